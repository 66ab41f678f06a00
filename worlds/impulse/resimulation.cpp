// See resimulation.h.
//
// A body that is on its script (cast.h) has the script's state. It is stepped all the same where its script
// may not hold. If the step gives the script's next state, contacts and impacts, it stays; else it leaves the
// script.
#include "worlds/impulse/resimulation.h"

#include <algorithm>
#include <utility>

#include "sampler/check.h"
#include "worlds/impulse/cast.h"
#include "worlds/impulse/column_grid.h"
#include "worlds/impulse/contact_step.h"

namespace retake::impulse {
namespace {

using Eigen::Vector3d;

/// Two bodies that overlap; `first` moves.
struct Pair {
  std::uint32_t first, second;
  bool second_rests;
  std::pair<std::uint32_t, std::uint32_t> key() const { return std::minmax(first, second); }
};

}  // namespace

class Resimulation::Simulation {
 public:
  Simulation(const Settings& settings, std::unique_ptr<Surface> surface)
      : settings_(settings),
        surface_(std::move(surface)),
        contacts_(settings),
        resting_(4 * settings.radius),
        followers_(4 * settings.radius) {
    CHECK(settings.time_step > 0 && settings.radius > 0 && settings.density > 0);
    CHECK(settings.rest_speed > settings.gravity * settings.time_step, settings.time_step);
    CHECK(surface_ != nullptr);
  }

  const Settings& settings() const { return settings_; }
  const Surface& surface() const { return *surface_; }

  ResimulationOutcome simulate(const Scene& scene, const Run* record, Run* run, const StopWhen& stop_when,
                               const Interruption* interruption) {
    CHECK(record == nullptr || (record->complete && record != run));
    prepare(scene, record);
    const bool stopped = !play(scene.latest_step, stop_when, interruption);
    const bool rests = !stopped && everything_rests();
    if (run != nullptr) write(scene, !stopped, rests, *run);
    cast_.release();
    return {stopped ? RunEnd::stopped : rests ? RunEnd::rests : RunEnd::unsettled, body_steps_};
  }

 private:
  void prepare(const Scene& scene, const Run* record) {
    surface_->set_offsets(scene.offsets);
    cast_.assemble(scene, record, *surface_);
    step_ = 0;
    body_steps_ = 0;
    moving_.clear();
    resting_changed_.clear();
    resting_.clear(cast_.size());
    births_.clear();
    for (std::uint32_t body = 0; body < cast_.size(); ++body)
      if (cast_[body].takes_part) births_.push_back(body);
    std::stable_sort(births_.begin(), births_.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return cast_[a].birth < cast_[b].birth; });
    born_ = 0;
  }

  // --- Time ------------------------------------------------------------------------------------------

  /// False if it was stopped.
  bool play(std::int64_t latest, const StopWhen& stop_when, const Interruption* interruption) {
    bool survey_is_due = true;
    while (step_ < latest && (born_ < births_.size() || !moving_.empty())) {
      if (interruption) interruption->check();
      survey_is_due |= give_birth();
      if (survey_is_due || step_ >= horizon_) survey();
      survey_is_due = false;
      if (attentive_.empty()) {
        step_ = std::min({horizon_, next_birth(), next_rest_, latest});
      } else {
        survey_is_due = step_once();
        ++step_;
      }
      if (any_rests_ || step_ == next_rest_) {
        survey_is_due = true;
        if (!lay_to_rest(stop_when)) return false;
      }
    }
    return true;
  }

  std::int64_t next_birth() const { return born_ < births_.size() ? cast_[births_[born_]].birth : kNever; }

  bool give_birth() {
    bool any = false;
    for (; next_birth() == step_; ++born_, any = true) {
      Actor& actor = cast_[births_[born_]];
      if (!actor.on_script) actor.writer.emplace(SphereState{.position = actor.place});
      moving_.push_back(births_[born_]);
    }
    return any;
  }

  /// Looks ahead, up to horizon_: who may have to be stepped (attentive_), and where those are who follow
  /// their scripts.
  void survey() {
    std::sort(moving_.begin(), moving_.end());
    next_rest_ = kNever;
    std::int64_t next_wake = kNever;
    for (const std::uint32_t body : moving_) {
      const Actor& actor = cast_[body];
      if (!actor.on_script) continue;
      if (actor.script->rests) next_rest_ = std::min(next_rest_, actor.script_end());
      next_wake = std::min(next_wake, actor.wake);
    }
    const bool all_follow = std::all_of(moving_.begin(), moving_.end(),
                                        [&](std::uint32_t body) { return !cast_[body].changed(); });
    // Nobody is looked at more closely before the next wake, where nothing changed is about.
    const bool quiet = all_follow && resting_changed_.empty();
    horizon_ = quiet && next_wake > step_ ? next_wake : step_ + Motion::kBlock;
    attentive_.clear();
    if (quiet && next_wake > step_) return;
    for (const std::uint32_t body : moving_) {
      Actor& actor = cast_[body];
      if (!actor.changed() && comes_near_changed(actor)) actor.near_until = horizon_;
      if (actor.changed() || actor.near_until > step_ || actor.wake < horizon_) attentive_.push_back(body);
    }
    if (!attentive_.empty()) place_followers();
  }

  /// Whether the script passes something changed that rests before horizon_.
  bool comes_near_changed(const Actor& actor) const {
    if (resting_changed_.empty()) return false;
    const Motion::Bounds bounds = bounds_ahead(actor);
    return std::any_of(resting_changed_.begin(), resting_changed_.end(), [&](std::uint32_t body) {
      const Vector3d& place = cast_[body].place;
      return (place.array() > bounds.low.array()).all() && (place.array() < bounds.high.array()).all();
    });
  }

  /// From where a body on its script touches others before horizon_.
  Motion::Bounds bounds_ahead(const Actor& actor) const {
    const auto& blocks = actor.script->blocks;
    const auto last = static_cast<std::int32_t>(blocks.size()) - 1;
    const auto block_at = [&](std::int64_t step) {
      return static_cast<std::size_t>(std::clamp(actor.since_birth(step) / Motion::kBlock, 0, last));
    };
    const Vector3d margin = Vector3d::Constant(2 * settings_.radius + kRounding);
    if (last < 0) return {actor.place - margin, actor.place + margin};
    Motion::Bounds bounds = blocks[block_at(step_)];
    for (std::size_t i = block_at(step_) + 1; i <= block_at(horizon_); ++i) {
      bounds.low = bounds.low.cwiseMin(blocks[i].low);
      bounds.high = bounds.high.cwiseMax(blocks[i].high);
    }
    return {bounds.low - margin, bounds.high + margin};
  }

  void place_followers() {
    followers_.clear(moving_.size());
    for (const std::uint32_t body : moving_) {
      if (cast_[body].changed()) continue;
      const Motion::Bounds bounds = bounds_ahead(cast_[body]);
      followers_.insert(body, bounds.low, bounds.high);
    }
  }

  // --- One step --------------------------------------------------------------------------------------

  /// True if somebody left or joined its script.
  bool step_once() {
    search();
    contacts_.clear();
    for (const std::uint32_t body : members_) {
      Actor& actor = cast_[body];
      if (actor.on_script && actor.partners.empty() && actor.wake > step_) continue;
      actor.outcome = contacts_.add(body, actor.fallen);
    }
    if (contacts_.outcomes().empty()) return false;
    for (const Pair& pair : pairs_) {
      if (pair.second_rests)
        contacts_.add_pair_with_resting(cast_[pair.first].outcome, pair.second, cast_[pair.second].place);
      else
        contacts_.add_pair(cast_[pair.first].outcome, cast_[pair.second].outcome);
    }
    contacts_.solve(*surface_);
    body_steps_ += static_cast<std::int64_t>(contacts_.outcomes().size());
    for (const ContactStep::Hit& hit : contacts_.hits()) {
      Actor& actor = cast_[hit.body];
      actor.impacts.push_back({actor.since_birth(step_), hit.other, hit.impulse, hit.point, hit.normal});
    }
    bool any = false;
    for (const ContactStep::Outcome& outcome : contacts_.outcomes())
      any |= take(outcome);
    return any;
  }

  /// Finds everybody who may have to be stepped (members_), and the pairs among them and with those at rest.
  void search() {
    members_.clear();
    pairs_.clear();
    for (const std::uint32_t body : attentive_) {
      Actor& actor = cast_[body];
      if (!actor.changed() && actor.near_until <= step_ && actor.wake > step_) continue;
      actor.searched = step_;
      join(body);
    }
    sweep();
    // Those who are found look around in turn.
    for (std::size_t i = 0; i < members_.size(); ++i)
      look_around(members_[i]);
    std::sort(pairs_.begin(), pairs_.end(), [](const Pair& a, const Pair& b) { return a.key() < b.key(); });
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end(),
                             [](const Pair& a, const Pair& b) { return a.key() == b.key(); }),
                 pairs_.end());
    for (const Pair& pair : pairs_) {
      cast_[pair.first].partners.push_back(static_cast<std::int32_t>(pair.second));
      if (!pair.second_rests) cast_[pair.second].partners.push_back(static_cast<std::int32_t>(pair.first));
    }
    std::sort(members_.begin(), members_.end());
  }

  void join(std::uint32_t body) {
    Actor& actor = cast_[body];
    actor.joined = step_;
    actor.fallen = fall(settings_, actor.state(step_));
    actor.partners.clear();
    actor.impacts.clear();
    members_.push_back(body);
  }

  /// Pairs among those that search, by their order along x.
  void sweep() {
    if (members_.size() < 2) return;
    order_.clear();
    for (const std::uint32_t body : members_)
      order_.push_back({cast_[body].fallen.position.x(), body});
    std::sort(order_.begin(), order_.end());
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const double reach = order_[i].first + 2 * settings_.radius + kRounding;
      for (std::size_t j = i + 1; j < order_.size() && order_[j].first < reach; ++j) {
        const auto [low, high] = std::minmax(order_[i].second, order_[j].second);
        if (overlap(settings_, cast_[low].fallen.position, cast_[high].fallen.position))
          pairs_.push_back({low, high, false});
      }
    }
  }

  /// Pairs with those at rest, and with those that follow their scripts, which join.
  void look_around(std::uint32_t body) {
    const Vector3d place = cast_[body].fallen.position;
    resting_.for_each(place, [&](std::uint32_t other) {
      if (overlap(settings_, place, cast_[other].place)) pairs_.push_back({body, other, true});
    });
    followers_.for_each(place, [&](std::uint32_t other) {
      Actor& actor = cast_[other];
      if (other == body || actor.searched == step_) return;
      if (actor.joined != step_) {
        if (!overlap(settings_, place, fallen_position(settings_, actor.state(step_)))) return;
        join(other);
      } else if (!overlap(settings_, place, actor.fallen.position)) {
        return;
      }
      pairs_.push_back({std::min(body, other), std::max(body, other), false});
    });
  }

  /// Writes down what a step made of a body. True if it left or joined its script.
  bool take(const ContactStep::Outcome& outcome) {
    Actor& actor = cast_[outcome.body];
    const std::int32_t k = actor.since_birth(step_);
    const MotionWriter::Step step{.state = outcome.state,
                                  .region = outcome.region,
                                  .partners = actor.partners,
                                  .impacts = actor.impacts,
                                  .rests = outcome.rests};
    const bool leaves = actor.on_script && !has_step(*actor.script, k, step);
    if (actor.on_script && !leaves) {
      if (step_ + 1 >= actor.wake_end) cast_.find_wake(actor, step_ + 1);
      return false;
    }
    if (leaves) leave_script(outcome.body, k);
    actor.writer->append(step);
    any_rests_ |= outcome.rests;
    const bool joins = actor.script && reaches_script(actor, k + 1, outcome);
    if (joins) {
      actor.on_script = true;
      cast_.find_wake(actor, step_ + 1);
    }
    return leaves || joins;
  }

  void leave_script(std::uint32_t body, std::int32_t k) {
    Actor& actor = cast_[body];
    const bool was_changed = actor.changed();
    if (!actor.writer) actor.writer.emplace();
    actor.writer->copy(*actor.script, k);
    actor.on_script = false;
    if (!was_changed) cast_.warn_of(body, step_ + 1);
  }

  /// Whether the state in which a step leaves a body is what its script has then.
  static bool reaches_script(const Actor& actor, std::int32_t k, const ContactStep::Outcome& outcome) {
    const Motion& script = *actor.script;
    return k < script.step_count() && !outcome.rests &&
           script.states[static_cast<std::size_t>(k)].same_bits(outcome.state);
  }

  /// Those that have come to rest do not move again. False if that ends the simulation.
  bool lay_to_rest(const StopWhen& stop_when) {
    any_rests_ = false;
    bool goes_on = true;
    const auto rests_now = [&](std::uint32_t body) {
      const Actor& actor = cast_[body];
      return actor.on_script ? actor.script->rests && actor.script_end() == step_ : actor.writer->rests();
    };
    for (const std::uint32_t body : moving_) {
      if (!rests_now(body)) continue;
      Actor& actor = cast_[body];
      actor.rests = true;
      actor.place = actor.state(step_).position;
      const Vector3d reach = Vector3d::Constant(2 * settings_.radius + kRounding);
      resting_.insert(body, actor.place - reach, actor.place + reach);
      if (actor.changed()) resting_changed_.push_back(body);
      goes_on = goes_on && !(stop_when && stop_when({body, step_, actor.place}));
    }
    std::erase_if(moving_, [&](std::uint32_t body) { return cast_[body].rests; });
    return goes_on;
  }

  // --- What came of it -------------------------------------------------------------------------------

  bool everything_rests() const {
    return std::all_of(births_.begin(), births_.end(), [&](std::uint32_t body) { return cast_[body].rests; });
  }

  void write(const Scene& scene, bool complete, bool rests, Run& run) {
    run.scene = scene;
    run.complete = complete;
    run.rests = rests;
    run.motions.assign(scene.bodies.size(), nullptr);
    if (!complete) return;
    for (std::size_t body = 0; body < scene.bodies.size(); ++body)
      if (cast_[body].takes_part) run.motions[body] = motion_of(cast_[body], scene.latest_step);
  }

  std::shared_ptr<const Motion> motion_of(Actor& actor, std::int64_t latest) {
    const auto most = static_cast<std::int32_t>(std::max<std::int64_t>(latest - actor.birth, 0));
    if (actor.on_script) {
      const std::int32_t end = std::min(actor.script->step_count(), most);
      if (!actor.writer && end == actor.script->step_count()) return actor.script;
      if (!actor.writer) actor.writer.emplace();
      actor.writer->copy(*actor.script, end);
    } else if (!actor.writer) {  // never born
      actor.writer.emplace(SphereState{.position = actor.place});
    }
    return actor.writer->finish(settings_);
  }

  static constexpr double kRounding = 1e-9;  // [m], far above what arithmetic loses

  Settings settings_;
  std::unique_ptr<Surface> surface_;
  ContactStep contacts_;

  Cast cast_;
  std::vector<std::uint32_t> births_;  ///< in order of time
  std::size_t born_ = 0;               ///< how many of births_

  std::int64_t step_ = 0;  ///< how many steps are done
  std::int64_t horizon_ = 0, next_rest_ = kNever;
  bool any_rests_ = false;                ///< somebody who was stepped
  std::vector<std::uint32_t> moving_;     ///< ascending after a survey
  std::vector<std::uint32_t> attentive_;  ///< of them, those that may have to be stepped before horizon_
  ColumnGrid resting_;                    ///< those at rest
  std::vector<std::uint32_t> resting_changed_;  ///< of them, those of which the record is not right
  ColumnGrid followers_;                        ///< those of moving_ that are not changed

  std::vector<std::uint32_t> members_;
  std::vector<std::pair<double, std::uint32_t>> order_;
  std::vector<Pair> pairs_;
  std::int64_t body_steps_ = 0;
};

Resimulation::Resimulation(const Settings& settings, std::unique_ptr<Surface> surface)
    : simulation_(std::make_unique<Simulation>(settings, std::move(surface))) {}
Resimulation::~Resimulation() = default;

const Settings& Resimulation::settings() const {
  return simulation_->settings();
}
const Surface& Resimulation::surface() const {
  return simulation_->surface();
}

ResimulationOutcome Resimulation::simulate(const Scene& scene, const Run* record, Run* run,
                                           const StopWhen& stop_when, const Interruption* interruption) {
  return simulation_->simulate(scene, record, run, stop_when, interruption);
}

}  // namespace retake::impulse
