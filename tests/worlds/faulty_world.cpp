// See faulty_world.h. Each class wraps one of the minimal world's and spoils what it says.
#include "tests/worlds/faulty_world.h"

#include <algorithm>
#include <utility>

#include "tests/worlds/minimal_world.h"

namespace retake::tests {
namespace {

constexpr double kLittle = 1e-9;  // [m], [s]

class FaultyPhysics final : public Physics {
 public:
  FaultyPhysics(std::unique_ptr<Physics> sound, Planted planted)
      : sound_(std::move(sound)), planted_(planted) {}

  SimulationOutcome simulate(const State& state, const Recording& recording, Animation& animation,
                             std::span<double> measures) override {
    std::vector<double> aside(measures.size());
    SimulationOutcome outcome =
        sound_->simulate(state, recording, animation,
                         planted_ == Planted::measure_not_written ? std::span<double>(aside) : measures);
    Track& track = animation.tracks[0];
    const auto rest_further = [&] { track.rest.position.x() += kLittle; };
    switch (planted_) {
      case Planted::rest_not_set:
        track.settled.reset();
        break;
      case Planted::rest_set_without_pose:
        track.settled = *track.settled / 2;
        break;
      case Planted::rest_differs_scored:
        if (!recording.frames) rest_further();
        break;
      case Planted::event_differs_scored:
        if (!recording.frames)
          for (ContactEvent& event : animation.events)
            event.impulse += kLittle;
        break;
      case Planted::leaks_after_stop:
        if (was_stopped_) rest_further();
        break;
      case Planted::leaks_frames:
        if (had_frames_ && !recording.frames) rest_further();
        break;
      case Planted::stops_too_early:
        if (recording.needed > -1) outcome.end = SimulationEnd::stopped;
        break;
      default:
        break;
    }
    was_stopped_ = outcome.end == SimulationEnd::stopped;
    had_frames_ = recording.frames;
    return outcome;
  }

 private:
  std::unique_ptr<Physics> sound_;
  Planted planted_;
  bool was_stopped_ = false, had_frames_ = false;
};

/// Gives both Variables the same place in their priors, and claims a draw of each.
class JointProposal final : public Kernel {
 public:
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override {
    const double z = random.gaussian();
    for (Eigen::Index i = 0; i < candidate.size(); ++i) {
      const Distribution& prior = model.variables()[static_cast<std::size_t>(i)].prior;
      candidate[i] = prior.mean() + z * prior.standard_deviation();
    }
    return model.log_prior(current) - model.log_prior(candidate);
  }
};

/// Moves everything a little towards the mean, with noise, and claims to be symmetric.
class DriftingProposal final : public Kernel {
 public:
  double propose(const Model& model, const State&, State& candidate, RandomStream& random) const override {
    for (Eigen::Index i = 0; i < candidate.size(); ++i) {
      const Distribution& prior = model.variables()[static_cast<std::size_t>(i)].prior;
      candidate[i] +=
          0.3 * (prior.mean() - candidate[i]) + 0.5 * prior.standard_deviation() * random.gaussian();
    }
    return 0;
  }
};

class FaultyScene final : public Scene {
 public:
  FaultyScene(std::shared_ptr<const Scene> sound, Planted planted)
      : sound_(std::move(sound)), planted_(planted) {}
  std::shared_ptr<const Model> model() const override { return sound_->model(); }
  KernelTable kernels(Ratios ratios) const override {
    std::vector<WeightedKernel> rows = sound_->kernels(ratios).rows();
    if (planted_ == Planted::joint_proposal)
      rows.push_back({"joint", 0.2, std::make_shared<const JointProposal>()});
    if (planted_ == Planted::wrong_ratio)
      rows.push_back({"drifting", 0.5, std::make_shared<const DriftingProposal>()});
    return KernelTable(std::move(rows));
  }
  std::vector<Measure> measures() const override { return sound_->measures(); }
  std::unique_ptr<Physics> make_physics() const override {
    return std::make_unique<FaultyPhysics>(sound_->make_physics(), planted_);
  }

 private:
  std::shared_ptr<const Scene> sound_;
  Planted planted_;
};

class FaultyTerm final : public Term {
 public:
  FaultyTerm(std::unique_ptr<const Term> sound, Planted planted)
      : sound_(std::move(sound)), planted_(planted) {}
  std::vector<Measure> measures() const override { return sound_->measures(); }
  bool reads_frames() const override { return sound_->reads_frames(); }
  TermScore score(const Animation& animation, std::span<double> values) const override {
    TermScore score = sound_->score(animation, values);
    if (planted_ == Planted::density_above_zero && score.satisfied) score.log_density += 0.1;
    return score;
  }
  double least_when_satisfied() const override { return sound_->least_when_satisfied(); }
  double upper_bound(const Animation& so_far) const override {
    const double bound = sound_->upper_bound(so_far);
    if (planted_ == Planted::bound_too_tight) return bound - 0.1;
    if (planted_ == Planted::bound_too_tight_midway && !so_far.tracks[0].settled) return bound - 0.1;
    return bound;
  }

 private:
  std::unique_ptr<const Term> sound_;
  Planted planted_;
};

class FaultyWorld final : public World {
 public:
  explicit FaultyWorld(Planted planted) : planted_(planted) {
    for (const TermKind& sound : minimal_world().term_kinds()) {
      TermKind& kind = kinds_.emplace_back(sound);
      kind.make = [make = sound.make, planted](auto&&... rest) {
        return std::make_unique<const FaultyTerm>(make(rest...), planted);
      };
    }
  }
  std::string_view name() const override { return minimal_world().name(); }
  int version() const override { return minimal_world().version(); }
  std::string_view summary() const override { return minimal_world().summary(); }
  Method default_method() const override { return minimal_world().default_method(); }
  Savings savings() const override { return minimal_world().savings(); }
  const ParameterTable& model_parameters() const override { return minimal_world().model_parameters(); }
  const std::vector<TermKind>& term_kinds() const override { return kinds_; }
  Roster roster(const Parameters& model) const override {
    Roster roster = minimal_world().roster(model);
    if (planted_ == Planted::still_bodies_swapped) std::reverse(roster.still.begin(), roster.still.end());
    return roster;
  }
  std::vector<nlohmann::json> examples() const override { return minimal_world().examples(); }
  std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                          std::vector<Fault>& faults) const override {
    return std::make_shared<const FaultyScene>(minimal_world().make_scene(model, faults), planted_);
  }

 private:
  Planted planted_;
  std::vector<TermKind> kinds_;
};

}  // namespace

std::unique_ptr<const World> make_faulty_world(Planted planted) {
  return std::make_unique<const FaultyWorld>(planted);
}

}  // namespace retake::tests
