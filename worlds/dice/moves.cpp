// See moves.h.
#include "worlds/dice/moves.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "sampler/check.h"
#include "sampler/roulette.h"
#include "worlds/dice/throw.h"

namespace retake::dice {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kImpossible = -std::numeric_limits<double>::infinity();
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
constexpr double kLeastSurvival = 0.02;  // chosen: nothing weighs more than 50 times what it would

double& at(State& state, std::size_t variable) {
  return state[static_cast<Eigen::Index>(variable)];
}
double at(const State& state, std::size_t variable) {
  return state[static_cast<Eigen::Index>(variable)];
}

/// What all moves know.
struct Known {
  std::shared_ptr<const DiceModel> model;
  EngineSettings engine;
  std::vector<EndWish> wishes;  ///< of each die
  EndMeasures measures;

  std::size_t dice() const { return wishes.size(); }
  std::int64_t steps(double seconds) const { return std::llround(seconds / engine.time_step); }
};

const Tumble& tumble(const Simulated& simulated) {
  return static_cast<const Tumble&>(*simulated.run);
}

// --- What changed --------------------------------------------------------------------------------------

constexpr std::size_t kLaunchVariables = 13;

void redraw_launch(const DiceModel& model, std::size_t die, State& state, RandomStream& random) {
  for (std::size_t i = 0; i < kLaunchVariables; ++i) {
    const std::size_t variable = model.start_x(die) + i;
    at(state, variable) = model.model()->variables()[variable].prior.draw(random);
  }
}

std::optional<std::size_t> die_thrown_anew(const DiceModel& model, const State& a, const State& b) {
  const auto launch = [&](const State& state, std::size_t die) {
    return state.segment<kLaunchVariables>(static_cast<Eigen::Index>(model.start_x(die)));
  };
  for (std::size_t die = 0; die < model.settings().dice; ++die)
    if (launch(a, die) != launch(b, die)) return die;
  return std::nullopt;
}

bool meets_since(const Tumble& run, std::size_t die, std::int64_t step) {
  const auto index = static_cast<std::int32_t>(die);
  return std::any_of(run.meetings.begin(), run.meetings.end(), [&](const Meeting& meeting) {
    return meeting.step >= step && (meeting.first == index || meeting.second == index);
  });
}

// --- The table -----------------------------------------------------------------------------------------

std::optional<std::size_t> index_in_patch(GridPlace place) {
  const Patch& patch = DiceModel::kPatch;
  const std::int32_t x = place.x - patch.first.x, z = place.z - patch.first.z;
  if (x < 0 || x >= patch.along_x || z < 0 || z >= patch.along_z) return std::nullopt;
  return static_cast<std::size_t>(x * patch.along_z + z);
}

void set_point(const DiceModel& model, std::size_t index_in_patch, const ControlPoint& point, State& state) {
  state.segment<3>(static_cast<Eigen::Index>(model.override_of(index_in_patch))) =
      Vector3d(point.height, point.restitution, point.friction);
}

/// Draws the table anew but for what each die has touched before a step of its own. False if some of that
/// lies beyond the patch, where nothing can be kept.
bool redraw_table(const DiceModel& model, const Tumble& run, const std::vector<std::int64_t>& kept_before,
                  State& state, RandomStream& random) {
  bool keeps_all = true;
  state
      .segment(static_cast<Eigen::Index>(model.override_of(0)),
               static_cast<Eigen::Index>(3 * DiceModel::kPatch.size()))
      .setConstant(kAbsent);
  for (std::size_t die = 0; die < run.paths.size(); ++die)
    for (const FirstTouch& touch : run.paths[die]->touches) {
      if (touch.step >= kept_before[die]) break;
      const auto index = index_in_patch(touch.place);
      keeps_all = keeps_all && index;
      if (index && std::isnan(at(state, model.override_of(*index))))
        set_point(model, *index, control_point(model.settings().table, run.scene.table, touch.place), state);
    }
  at(state, model.key()) = random.uniform();
  return keeps_all;
}

// --- Roulette ------------------------------------------------------------------------------------------

/// How likely throws go on that are looked at.
class Promise {
 public:
  /// Requires: a place that is wished.
  Promise(const Known& known, const State& state, std::size_t die)
      : looks_(look_times(known.model->settings())) {
    const DiceThrow thrown = known.model->read(state);
    const EndWish::Disc& place = *known.wishes[die].place;
    const DieState& start = thrown.scene.dice[die].state;
    DieState there;
    there.position = thrown.placement.point_in_grid({place.x, start.position.y(), place.z});
    const LookFeatures target = look_at(start, there, 0);
    target_ = Vector2d(target[0], target[1]);
  }
  double operator()(std::size_t look, std::span<const double> features) const {
    const double miss = (Vector2d(features[0], features[1]) - target_).norm() / looks_[look].spread;
    // Proportional to the root of a Gaussian chance, and sure within 1.4 deviations.
    return std::clamp(std::exp(0.5 - 0.25 * miss * miss), kLeastSurvival, 1.0);
  }

 private:
  std::array<Look, kLooks> looks_;
  Vector2d target_;  ///< [m] from the start, along and across the heading in the grid
};

/// Looks at one die.
class DieWatch final : public Roulette {
 public:
  DieWatch(std::size_t die, bool may_meet, SurvivalFunction survival, RandomStream& random)
      : Roulette(std::move(survival), random), die_(die), may_meet_(may_meet) {}
  std::size_t body() const override { return die_; }
  bool may_meet() const override { return may_meet_; }

 private:
  std::size_t die_;
  bool may_meet_;
};

/// Nothing is given up by chance.
double surely(std::size_t, std::span<const double>) {
  return 1;
}

double survival_of(const Known& known, const State& state, const Tumble& run, std::size_t die) {
  if (!known.wishes[die].place) return 1;
  const Promise promise(known, state, die);
  const auto looks = look_times(known.model->settings());
  const DiePath& path = *run.paths[die];
  double least = 1;
  for (std::size_t look = 0; look < looks.size(); ++look) {
    const DieState& then = path.at(path.launch_step + known.steps(looks[look].seconds));
    if (then.quiet_steps >= known.engine.rest_steps()) continue;
    least = std::min(least, promise(look, look_at(run.scene.dice[die].state, then, looks[look].rolls_on)));
  }
  return least;
}

/// Who looks at a die that is thrown anew.
std::unique_ptr<Watch> watch_throw(const Known& known, std::size_t die, bool may_meet, const State& candidate,
                                   RandomStream& random) {
  SurvivalFunction survival = surely;
  if (known.wishes[die].place) survival = Promise(known, candidate, die);
  return std::make_unique<DieWatch>(die, may_meet, std::move(survival), random);
}

// --- Kernels -------------------------------------------------------------------------------------------

/// Of kernels that throw a die anew.
class Throwing : public ScoredKernel {
 public:
  Throwing(const Known& known, bool may_meet) : known_(known), may_meet_(may_meet) {}

  std::unique_ptr<Watch> watch(const State& current, const State& candidate,
                               RandomStream& random) const override {
    const auto die = die_thrown_anew(*known_.model, current, candidate);
    return die ? watch_throw(known_, *die, may_meet_, candidate, random) : nullptr;
  }
  double log_hastings(const Model&, const Simulated& current, const Simulated& candidate) const override {
    const auto die = die_thrown_anew(*known_.model, current.state, candidate.state);
    if (!die) return 0;
    return log_prior_ratio(current.state, candidate.state) +
           std::log(survival_of(known_, current.state, tumble(current), *die) /
                    survival_of(known_, candidate.state, tumble(candidate), *die));
  }

 protected:
  /// Throws a die anew. Returns the most that log_hastings() can be.
  double throw_die(std::size_t die, const Simulated& current, State& candidate, RandomStream& random) const {
    redraw_launch(*known_.model, die, candidate, random);
    return log_prior_ratio(current.state, candidate) +
           std::log(survival_of(known_, current.state, tumble(current), die) / kLeastSurvival);
  }
  /// Of draws of the prior, the way back to the way there.
  double log_prior_ratio(const State& current, const State& candidate) const {
    const Model& model = *known_.model->model();
    const double there = model.log_prior(candidate);
    return there == kImpossible ? 0 : model.log_prior(current) - there;
  }
  const Known& known_;

 private:
  bool may_meet_;
};

class LaunchAgain final : public Throwing {
 public:
  explicit LaunchAgain(const Known& known) : Throwing(known, true) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const std::size_t die = random.index(known_.dice());
    return throw_die(die, current, candidate, random);
  }
};

/// One die and what it alone touches from some time on, perhaps from its launch on.
class OneAlone final : public Throwing {
 public:
  OneAlone(const Known& known, bool throws) : Throwing(known, false), throws_(throws) {}

  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    constexpr double kLatest = 0.9;  // [s] from the launch; chosen: later than most come to rest
    const Tumble& run = tumble(current);
    const std::size_t die = random.index(known_.dice());
    const double time = throws_ ? 0 : kLatest * random.uniform();
    const std::int64_t from = run.paths[die]->launch_step + known_.steps(time);
    if (meets_since(run, die, from)) return 0;
    std::vector<std::int64_t> kept_before(known_.dice(), kNever);
    kept_before[die] = from;
    if (!redraw_table(*known_.model, run, kept_before, candidate, random)) {
      candidate = current.state;  // as a way back would be left
      return 0;
    }
    if (!throws_) return 0;
    return throw_die(die, current, candidate, random);
  }

  double log_hastings(const Model& model, const Simulated& current,
                      const Simulated& candidate) const override {
    const Tumble &before = tumble(current), &after = tumble(candidate);
    for (std::size_t die = 0; die < known_.dice(); ++die) {
      // What happened until something is another was looked at when it was proposed.
      const auto from = first_difference(known_.model->settings().table, after.scene, before, die);
      if (from && meets_since(after, die, *from)) return kImpossible;
    }
    return Throwing::log_hastings(model, current, candidate);
  }

 private:
  bool throws_;
};

class TableLater final : public ScoredKernel {
 public:
  explicit TableLater(const Known& known) : known_(known) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const Tumble& run = tumble(current);
    const double last = known_.model->settings().interval * static_cast<double>(known_.dice() - 1) + 0.9;
    const std::vector<std::int64_t> kept_before(known_.dice(), known_.steps(last * random.uniform()));
    if (!redraw_table(*known_.model, run, kept_before, candidate, random)) candidate = current.state;
    return 0;
  }

 private:
  const Known& known_;
};

/// A control point that a die touches moves by a step that leaves its prior as it is (Neal 1998; "pCN"). It
/// is still touched then, if no other die brings it about that it is not.
class WalkPoint final : public ScoredKernel {
 public:
  explicit WalkPoint(const Known& known) : known_(known) {}

  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    return propose(random.index(known_.dice()), 2, current, candidate, random);
  }
  /// Steps are as small as 10^-decades of the prior's deviation.
  double propose(std::size_t die, double decades, const Simulated& current, State& candidate,
                 RandomStream& random) const {
    const Tumble& run = tumble(current);
    const std::vector<FirstTouch>& touches = run.paths[die]->touches;
    if (touches.empty()) return 0;
    const GridPlace place = touches[random.index(touches.size())].place;
    const auto index = index_in_patch(place);
    if (!index) return 0;
    const TableSettings& settings = known_.model->settings().table;
    const double size = std::pow(10, -decades * random.uniform());
    const double kept = std::sqrt(1 - size * size);
    const auto moved = [&](double value, double mean, double deviation) {
      return mean + kept * (value - mean) + size * deviation * random.gaussian();
    };
    ControlPoint point = control_point(settings, run.scene.table, place);
    point.height = moved(point.height, 0, settings.height_deviation);
    point.restitution = moved(point.restitution, settings.restitution_mean, settings.restitution_deviation);
    point.friction = moved(point.friction, settings.friction_mean, settings.friction_deviation);
    set_point(*known_.model, *index, point, candidate);
    return -std::log(probability(run, place));
  }

  double log_hastings(const Model&, const Simulated& current, const Simulated& candidate) const override {
    const GridPlace place = moved_point(current.state, candidate.state);
    return std::log(probability(tumble(candidate), place)) - std::log(probability(tumble(current), place));
  }

 private:
  /// That it is this one which is moved.
  double probability(const Tumble& run, GridPlace place) const {
    double sum = 0;
    for (const auto& path : run.paths) {
      const auto is_here = [place](const FirstTouch& touch) { return touch.place == place; };
      const auto times = std::count_if(path->touches.begin(), path->touches.end(), is_here);
      if (times > 0) sum += static_cast<double>(times) / static_cast<double>(path->touches.size());
    }
    return sum / static_cast<double>(known_.dice());
  }
  GridPlace moved_point(const State& a, const State& b) const {
    for (std::size_t i = 0; i < DiceModel::kPatch.size(); ++i) {
      const std::size_t first = known_.model->override_of(i);
      const bool both_absent = std::isnan(at(a, first)) && std::isnan(at(b, first));
      if (!both_absent && at(a, first) != at(b, first)) return DiceModel::kPatch.place(i);
    }
    CHECK(false);
    return {};
  }
  const Known& known_;
};

/// Turns and shifts the grid and all that is thrown on it, symmetrically: the motion stays as it is, and ends
/// elsewhere.
class MovePose final : public ScoredKernel {
 public:
  explicit MovePose(const Known& known) : known_(known) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    // Chosen: the spread of a start, and of the direction of a throw.
    const DiceSettings& settings = known_.model->settings();
    const double scale = std::pow(10, -2 * random.uniform());
    const double angle = scale * settings.speed_spread / settings.speed * random.gaussian();
    const Vector2d shift = scale * settings.start_spread * Vector2d(random.gaussian(), random.gaussian());
    const Vector2d pivot(settings.speed * 0.3, 0);  // about where dice come to rest; chosen
    const double cosine = std::cos(angle), sine = std::sin(angle);
    const auto turned = [&](double x, double z) {
      return Vector2d(cosine * x - sine * z, sine * x + cosine * z);
    };

    // The world's origin and its x axis, seen from the grid.
    const Placement placement = known_.model->read(current.state).placement;
    const Vector2d from_pivot = -shift - pivot;
    const Vector2d origin = pivot + Vector2d(cosine * from_pivot.x() + sine * from_pivot.y(),
                                             -sine * from_pivot.x() + cosine * from_pivot.y());
    const Vector3d phase = placement.point_in_grid({origin.x(), 0, origin.y()});
    const Vector3d axis = placement.direction_in_grid({cosine, 0, -sine});
    const DiceModel& model = *known_.model;
    at(candidate, model.phase_x()) = phase.x();
    at(candidate, model.phase_x() + 1) = phase.z();
    at(candidate, model.heading()) = std::atan2(axis.z(), axis.x());

    for (std::size_t die = 0; die < known_.dice(); ++die) {
      const std::size_t start = model.start_x(die), velocity = model.velocity_x(die);
      const Vector2d place =
          pivot + shift + turned(at(candidate, start) - pivot.x(), at(candidate, start + 2));
      const Vector2d flight = turned(at(candidate, velocity), at(candidate, velocity + 2));
      at(candidate, start) = place.x();
      at(candidate, start + 2) = place.y();
      at(candidate, velocity) = flight.x();
      at(candidate, velocity + 2) = flight.y();
    }
    return 0;
  }

 private:
  const Known& known_;
};

// --- The guide -----------------------------------------------------------------------------------------

class DiceGuide final : public Guide {
 public:
  explicit DiceGuide(Known known) : known_(std::move(known)), walk_point_(known_) {
    // Chosen.
    std::vector<Weighted<ScoredKernel>> rows = {
        {"alone", 0.2, std::make_shared<const OneAlone>(known_, true)},
        {"later", 0.2, std::make_shared<const OneAlone>(known_, false)},
        {"launch", 0.2, std::make_shared<const LaunchAgain>(known_)},
        {"all_later", 0.05, std::make_shared<const TableLater>(known_)},
        {"point", 0.25, std::make_shared<const WalkPoint>(known_)}};
    if (known_.model->settings().pose == GridPose::random)
      rows.push_back({"pose", 0.1, std::make_shared<const MovePose>(known_)});
    kernels_ = ScoredKernelTable(std::move(rows));
    order_ = order_of_places();
  }
  DiceGuide(const DiceGuide&) = delete;
  DiceGuide& operator=(const DiceGuide&) = delete;

  /// Dice that are to be brought to their places one by one are out of the way until then, behind the start.
  void begin(const Model& model, State& state, RandomStream& random) const override {
    do
      model.draw(random, state);
    while (!model.in_support(state));
    for (std::size_t die = 0; die < known_.dice(); ++die)
      put_behind(die, state);
  }

  void extend(const Model& model, const Simulated& kept, std::uint64_t vain_tries, State& candidate,
              RandomStream& random) const override {
    if (!kept.run || !tumble(kept).complete) return begin(model, candidate, random);
    const std::size_t die = first_off(kept).value_or(random.index(known_.dice()));
    // Chosen: how far a die may be [m] if a few touches are to bring it there, or a little of one touch.
    constexpr double kNear = 0.01, kVeryNear = 0.003;
    constexpr std::uint64_t kPatience = 150, kThrows = 1000;
    const double missed = off(kept, die);
    const std::uint64_t patience = missed > kNear ? kThrows : kPatience;
    if (vain_tries > 0 && vain_tries % patience == 0) return give_up(die, missed > kNear, candidate, random);
    const double throwing = missed > kNear ? 0.95 : 0.05, walking = missed > kVeryNear ? 0.15 : 0.5;
    const double u = random.uniform();
    if (u < throwing)
      redraw_launch(*known_.model, die, candidate, random);
    else if (u < throwing + (1 - throwing) * walking)
      walk_point_.propose(die, 4, kept, candidate, random);
    else
      redraw_end(kept, die, candidate, random);
  }

  /// Of the dice in their order the first that is not as far from its wish as before decides; small steps
  /// would lead nowhere.
  bool keeps(const Simulated& kept, const Simulated& candidate) const override {
    constexpr double kProgress = 0.85;  // chosen
    if (!tumble(kept).complete || is_given_up(kept.state, candidate.state)) return true;
    for (const std::size_t die : order_) {
      const double before = off(kept, die), after = off(candidate, die);
      if (before != after) return after <= kProgress * before;
    }
    return !first_off(kept) && candidate.score.log_constraint > kept.score.log_constraint;
  }

  /// A die that is to be brought to its place is of no use if it meets another one.
  std::unique_ptr<Watch> watch(const Simulated& kept, const State& candidate,
                               RandomStream& random) const override {
    if (!kept.run || !tumble(kept).complete || is_given_up(kept.state, candidate)) return nullptr;
    const std::optional<std::size_t> die = first_off(kept);
    if (!die) return nullptr;
    if (die_thrown_anew(*known_.model, kept.state, candidate))
      return watch_throw(known_, *die, false, candidate, random);
    return std::make_unique<DieWatch>(*die, false, surely, random);
  }

  const ScoredKernelTable& kernels() const override { return kernels_; }
  const ScoredKernelTable& soft_kernels() const override { return soft_kernels_; }
  std::uint64_t sweep() const override { return 20 * known_.dice(); }  // chosen

  bool reads_runs() const override { return true; }
  bool places() const override {
    return known_.model->settings().random_paint &&
           std::any_of(known_.wishes.begin(), known_.wishes.end(),
                       [](const EndWish& wish) { return wish.face; });
  }
  bool place(const Simulated& drawn, State& candidate, RandomStream& random) const override {
    for (std::size_t die = 0; die < known_.dice(); ++die)
      if (miss(drawn, die, 1 + 1e-9) > 0) return false;
    for (std::size_t die = 0; die < known_.dice(); ++die) {
      double& paint = at(candidate, known_.model->paint(die));
      const auto& face = known_.wishes[die].face;
      if (!face) {
        paint = static_cast<double>(kPaints) * random.uniform();
        continue;
      }
      const auto painted = std::min(static_cast<std::size_t>(paint), kPaints - 1);
      const double up = drawn.score.measures[known_.measures.top_face + die];
      const auto fitting = paints_that_show(*face, painted, static_cast<int>(up), false);
      paint = static_cast<double>(fitting[random.index(fitting.size())]) + random.uniform();
    }
    return true;
  }

 private:
  /// The farthest first, then those among others: what lies there already is in the way.
  std::vector<std::size_t> order_of_places() const {
    Vector2d centre = Vector2d::Zero();
    int places = 0;
    for (const EndWish& wish : known_.wishes)
      if (wish.place) {
        centre += Vector2d(wish.place->x, wish.place->z);
        ++places;
      }
    const auto urgency = [&](std::size_t die) {
      constexpr double kAmongOthers = 0.5;  // chosen: half as important as the distance
      const auto& place = known_.wishes[die].place;
      if (!place) return -1.0;
      const Vector2d at(place->x, place->z);
      return at.norm() - kAmongOthers * (at - centre / places).norm();
    };
    std::vector<std::size_t> order(known_.dice());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return urgency(a) > urgency(b); });
    return order;
  }
  /// [m] beyond so much of what is tolerated; a die that shows no face, or a wrong one that cannot be painted
  /// over, is a die's width farther.
  double miss(const Simulated& simulated, std::size_t die, double share = 0.999) const {
    constexpr double kFar = 1, kWidth = 0.02;  // [m]
    const std::vector<double>& measures = simulated.score.measures;
    const double x = measures[known_.measures.rest_x + die], z = measures[known_.measures.rest_z + die];
    if (std::isnan(x)) return kFar;
    const EndWish& wish = known_.wishes[die];
    double miss = 0;
    if (wish.place)
      miss = std::max(std::hypot(x - wish.place->x, z - wish.place->z) - share * wish.place->radius, 0.0);
    const double up = measures[known_.measures.top_face + die];
    const bool is_wrong = std::isnan(up) || (!known_.model->settings().random_paint && up != wish.face);
    return wish.face && is_wrong ? miss + kWidth : miss;
  }
  /// While dice are brought to their places they shall not meet: then each can be moved by itself.
  double off(const Simulated& simulated, std::size_t die) const {
    constexpr double kMet = 0.02;  // [m]
    const double missed = miss(simulated, die);
    return meets_since(tumble(simulated), die, 0) ? missed + kMet : missed;
  }
  std::optional<std::size_t> first_off(const Simulated& simulated) const {
    const auto found =
        std::find_if(order_.begin(), order_.end(), [&](std::size_t die) { return off(simulated, die) > 0; });
    return found == order_.end() ? std::nullopt : std::optional(*found);
  }

  /// What a die alone touches for the first time after some time becomes another table.
  void redraw_end(const Simulated& kept, std::size_t die, State& candidate, RandomStream& random) const {
    const Tumble& run = tumble(kept);
    const std::vector<FirstTouch>& touches = run.paths[die]->touches;
    if (touches.empty()) return;
    const std::int64_t first = touches.front().step, length = touches.back().step - first + 1;
    const std::int64_t from =
        first + static_cast<std::int64_t>(random.index(static_cast<std::uint64_t>(length)));
    for (const FirstTouch& touch : touches) {
      const auto index = index_in_patch(touch.place);
      if (touch.step < from || !index || others_touch(run, die, touch.place)) continue;
      set_point(*known_.model, *index, draw_control_point(known_.model->settings().table, random), candidate);
    }
  }
  static bool others_touch(const Tumble& run, std::size_t die, GridPlace place) {
    for (std::size_t other = 0; other < run.paths.size(); ++other) {
      const std::vector<FirstTouch>& touches = run.paths[other]->touches;
      if (other != die && std::any_of(touches.begin(), touches.end(),
                                      [place](const FirstTouch& touch) { return touch.place == place; }))
        return true;
    }
    return false;
  }

  /// Takes a die that nothing helps away, and another one if they may be in its way.
  void give_up(std::size_t die, bool takes_another, State& candidate, RandomStream& random) const {
    put_behind(die, candidate);
    if (takes_another) put_behind(random.index(known_.dice()), candidate);
  }
  void put_behind(std::size_t die, State& state) const {
    const DiceModel& model = *known_.model;
    at(state, model.velocity_x(die)) = -model.settings().speed;
  }
  bool is_given_up(const State& before, const State& after) const {
    for (std::size_t die = 0; die < known_.dice(); ++die) {
      const std::size_t speed = known_.model->velocity_x(die);
      if (at(before, speed) != at(after, speed) && at(after, speed) == -known_.model->settings().speed)
        return true;
    }
    return false;
  }

  Known known_;
  WalkPoint walk_point_;
  ScoredKernelTable kernels_, soft_kernels_;
  std::vector<std::size_t> order_;  ///< in which dice are brought to their places
};

}  // namespace

std::shared_ptr<const Guide> make_dice_guide(std::shared_ptr<const DiceModel> model,
                                             const EngineSettings& engine, std::vector<EndWish> wishes,
                                             const EndMeasures& measures) {
  return std::make_shared<const DiceGuide>(
      Known{.model = std::move(model), .engine = engine, .wishes = std::move(wishes), .measures = measures});
}

}  // namespace retake::dice
