// See die_kernels.h.
#include "worlds/dice/die_kernels.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "sampler/check.h"
#include "sampler/roulette.h"
#include "worlds/dice/throw.h"

namespace retake::dice {

const Tumble& tumble(const Simulated& simulated) {
  return static_cast<const Tumble&>(*simulated.run);
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kImpossible = -std::numeric_limits<double>::infinity();
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
constexpr double kLeastSurvival = 0.02;  // chosen: nothing weighs more than 50 times what it would

constexpr std::size_t kLaunchVariables = 13;

/// A step of pCN: of a Gaussian's deviations.
double walked(double value, double mean, double deviation, double size, RandomStream& random) {
  return mean + std::sqrt(1 - size * size) * (value - mean) + size * deviation * random.gaussian();
}

}  // namespace

// --- What changed --------------------------------------------------------------------------------------

void walk_launch(const DiceModel& model, std::size_t die, double size, State& state, RandomStream& random) {
  for (std::size_t i = 0; i < kLaunchVariables; ++i) {
    const std::size_t variable = model.start_x(die) + i;
    const Distribution& prior = model.model()->variables()[variable].prior;
    at(state, variable) = walked(at(state, variable), prior.mean(), prior.standard_deviation(), size, random);
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

namespace {

// --- The table -----------------------------------------------------------------------------------------

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
    walk_launch(*known_.model, die, 1, candidate, random);
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

/// A control point that a die touches moves by a step that leaves its prior as it is. It is still touched
/// then, if no other die brings it about that it is not.
class WalkPoint final : public ScoredKernel {
 public:
  explicit WalkPoint(const Known& known) : known_(known) {}

  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    constexpr double kDecades = 2;  // chosen
    const Tumble& run = tumble(current);
    const std::vector<FirstTouch>& touches = run.paths[random.index(known_.dice())]->touches;
    if (touches.empty()) return 0;
    const GridPlace place = touches[random.index(touches.size())].place;
    const auto index = index_in_patch(place);
    if (!index) return 0;
    const TableSettings& settings = known_.model->settings().table;
    const double size = std::pow(10, -kDecades * random.uniform());
    ControlPoint point = control_point(settings, run.scene.table, place);
    point.height = walked(point.height, 0, settings.height_deviation, size, random);
    point.restitution =
        walked(point.restitution, settings.restitution_mean, settings.restitution_deviation, size, random);
    point.friction =
        walked(point.friction, settings.friction_mean, settings.friction_deviation, size, random);
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

}  // namespace

// --- For the guide -------------------------------------------------------------------------------------

std::unique_ptr<Watch> watch_throw(const Known& known, std::size_t die, bool may_meet, const State& candidate,
                                   RandomStream& random) {
  SurvivalFunction survival = surely;
  if (known.wishes[die].place) survival = Promise(known, candidate, die);
  return std::make_unique<DieWatch>(die, may_meet, std::move(survival), random);
}

std::unique_ptr<Watch> watch_meetings(std::size_t die, RandomStream& random) {
  return std::make_unique<DieWatch>(die, false, surely, random);
}

ScoredKernelTable make_die_kernels(const Known& known) {
  // Chosen: most throws are given up early, so they cost little, and whole throws are what comes seldom.
  std::vector<Weighted<ScoredKernel>> rows = {{"alone", 0.2, std::make_shared<const OneAlone>(known, true)},
                                              {"later", 0.06, std::make_shared<const OneAlone>(known, false)},
                                              {"launch", 0.6, std::make_shared<const LaunchAgain>(known)},
                                              {"all_later", 0.02, std::make_shared<const TableLater>(known)},
                                              {"point", 0.06, std::make_shared<const WalkPoint>(known)}};
  if (known.model->settings().pose == GridPose::random)
    rows.push_back({"pose", 0.06, std::make_shared<const MovePose>(known)});
  return ScoredKernelTable(std::move(rows));
}

}  // namespace retake::dice
