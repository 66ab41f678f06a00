// TwoModes: a toy whose satisfied set has two parts far apart, with all that makes chains hard to get right;
// and what tests of chains judge it by: an oracle that shares no code with chains, and gathered stays.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "sampler/chain.h"
#include "sampler/spread.h"
#include "tests/sampler/toys.h"

namespace retake::tests {

/// About 2 in 100 draws of the prior satisfy it.
struct TwoModes {
  /// log_constraint on the satisfied set.
  enum class Height {
    level,    ///< 0: least_satisfied is 0
    stepped,  ///< 0 in one part, -1 in the other: least_satisfied is -1
    sloped,   ///< without a least
  };
  Height height = Height::level;
  /// Simulations fail, log_constraint is minus infinity in places, and the support is restricted.
  bool hazards = false;
  /// Both parts shrink about their middles by this factor, in x and in y.
  double narrowness = 1;
  /// Only the second part satisfies.
  bool is_single = false;
  std::shared_ptr<const Guide> guide{};
  std::shared_ptr<const PlacedRedraw> placed{};

  enum Variables : std::size_t { kX, kY, kSlope, kSwitch, kGoverned };

  /// Which part, of those that are not narrowed.
  static int part(const State& state) { return TwoModes{}.part_of(state); }
  int part_of(const State& state) const {
    const auto within = [&](double value, double low, double high) {
      return std::abs(value - 0.5 * (low + high)) < 0.5 * (high - low) / narrowness;
    };
    if (!is_single && within(state[kX], 1.2, 1.6) && within(state[kY], 0.1, 0.2)) return 1;
    if (within(state[kX], -1.0, -0.7) && within(state[kY], 0.6, 0.75)) return 2;
    return 0;
  }
  LogConstraint log_constraint() const {
    return [*this](const State& state) {
      const double x = state[kX], y = state[kY];
      if (hazards && y > 0.66 && y < 0.7) return kFails;
      if (hazards && y > 0.8) return -kInfinity;
      const int where = part_of(state);
      if (where == 0) {
        const double distance = std::min(is_single ? kInfinity : std::hypot(x - 1.4, 3 * (y - 0.15)),
                                         std::hypot(x + 0.85, 3 * (y - 0.675)));
        return -0.8 - 2 * narrowness * distance + 0.3 * std::sin(9 * x);
      }
      switch (height) {
        case Height::level:
          break;
        case Height::stepped:
          return where == 1 ? -1.0 : 0.0;
        case Height::sloped:
          return -0.5 * std::pow(state[kSlope], 2);
      }
      return 0.0;
    };
  }
  std::shared_ptr<const Target> target() const {
    std::function<bool(const State&)> in_support;
    if (hazards)
      in_support = [](const State& state) {
        return state[kX] > -1.5 && !(state[kX] > 1.4 && state[kSlope] < 0);
      };
    const auto model = std::make_shared<const Model>(
        std::vector<Variable>{
            {.name = "x", .unit = "", .prior = Distribution::gaussian(0, 1)},
            {.name = "y", .unit = "", .prior = Distribution::uniform(0, 1)},
            {.name = "slope", .unit = "", .prior = Distribution::gaussian(0.5, 1)},
            {.name = "switch", .unit = "", .prior = Distribution::on_off(0.4)},
            {.name = "governed", .unit = "", .prior = Distribution::uniform(-1, 1), .switch_index = 3}},
        std::move(in_support));
    auto target = std::make_shared<Target>(Target{
        model,
        KernelTable({{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact))}}),
        {"log_constraint"}});
    target->guide = guide;
    target->placed = placed;
    if (guide) target->scored_kernels = {guide, &guide->soft_kernels()};
    target->least_satisfied = height == Height::level ? 0 : height == Height::stepped ? -1 : -kInfinity;
    return target;
  }
  ToySimulator simulator() const {
    ToySimulator simulator(log_constraint());
    simulator.satisfies = [*this](const State& state) { return part_of(state) != 0; };
    simulator.features = [](const State& state) { return std::vector<double>{state[kX]}; };
    return simulator;
  }
  static Eigen::VectorXd functions(const State& state) {
    const bool on = state[kSwitch] == 1;
    Eigen::VectorXd values(9);
    values << (part(state) == 1), state[kX], state[kY], state[kSlope], state[kSlope] * state[kSlope], on,
        on ? state[kGoverned] : 0, on ? state[kGoverned] * state[kGoverned] : 0, state[kX] * state[kSlope];
    return values;
  }
};

inline std::vector<TwoModes> all_two_modes() {
  std::vector<TwoModes> toys;
  for (const bool hazards : {false, true})
    for (const auto height : {TwoModes::Height::level, TwoModes::Height::stepped, TwoModes::Height::sloped})
      toys.push_back({.height = height, .hazards = hazards});
  return toys;
}

/// As a test is called with it.
inline std::string name_of(const TwoModes& toy) {
  const std::string names[] = {"Level", "Stepped", "Sloped"};
  return names[static_cast<std::size_t>(toy.height)] + (toy.hazards ? "WithHazards" : "");
}

/// Means of functions over p(A | satisfied), with standard errors, and P(satisfied).
struct Truth {
  Eigen::VectorXd mean, error;
  double probability = 0, probability_error = 0;
};

/// By weighing draws of the prior, without a chain.
inline Truth truth_of(const TwoModes& toy, int draws, std::uint64_t seed) {
  const auto target = toy.target();
  const LogConstraint log_constraint = toy.log_constraint();
  RandomStream random = stream(seed);
  State state;
  std::vector<Eigen::VectorXd> values;
  std::vector<double> weights;
  double valid = 0, weight = 0;
  for (int i = 0; i < draws; ++i) {
    target->model->draw(random, state);
    if (!target->model->in_support(state)) continue;
    ++valid;
    const double said = log_constraint(state);
    if (TwoModes::part(state) == 0 || std::isnan(said)) continue;
    values.push_back(TwoModes::functions(state));
    weights.push_back(std::exp(said));
    weight += weights.back();
  }
  Truth truth;
  truth.mean = Eigen::VectorXd::Zero(values[0].size());
  truth.error = truth.mean;
  for (std::size_t i = 0; i < values.size(); ++i)
    truth.mean += weights[i] / weight * values[i];
  for (std::size_t i = 0; i < values.size(); ++i)
    truth.error += (weights[i] / weight * (values[i] - truth.mean)).cwiseAbs2();
  truth.error = truth.error.cwiseSqrt();
  truth.probability = static_cast<double>(values.size()) / valid;
  truth.probability_error = std::sqrt(truth.probability * (1 - truth.probability) / valid);
  return truth;
}

/// The stays of all walkers of a chain, each with the weight that it has at its end.
class StayGatherer {
 public:
  /// Once after every step.
  template <typename AtEnd>
  void note(const Chain& chain, AtEnd&& at_end) {
    const std::size_t walker = chain.walker();
    if (walker >= last_.size()) last_.resize(walker + 1);
    const Stay& now = chain.stay(walker);
    Stay& before = last_[walker];
    if (now.iteration != before.iteration) end(before, at_end);
    if (now.iteration != before.iteration || now.weight != before.weight || now.is_sample != before.is_sample)
      before = now;
  }
  template <typename AtEnd>
  void finish(AtEnd&& at_end) {
    for (Stay& stay : last_)
      end(stay, at_end);
  }

 private:
  template <typename AtEnd>
  static void end(const Stay& stay, AtEnd&& at_end) {
    if (stay.iteration > 0 && stay.is_sample && stay.weight > 0) at_end(stay);
  }
  std::vector<Stay> last_;
};

/// How many draws of p(A | satisfied) the last step counted for.
class DrawWatcher {
 public:
  std::uint64_t note(const Chain& chain) {
    const std::size_t walker = chain.walker();
    if (walker >= last_.size()) last_.resize(walker + 1);
    const Stay& stay = chain.stay(walker);
    const Seen now{.iteration = stay.iteration, .weight = stay.is_sample ? stay.weight : 0};
    const Seen before = std::exchange(last_[walker], now);
    return now.iteration == before.iteration ? now.weight - before.weight : now.weight;
  }

 private:
  struct Seen {
    std::uint64_t iteration = 0, weight = 0;
  };
  std::vector<Seen> last_;
};

/// What one chain says.
struct Said {
  RunMoments moments{9};
  OddsTally odds;
};

inline Said run_of(Chain& chain, Simulator& simulator, int iterations) {
  Said said;
  StayGatherer gatherer;
  const auto add = [&](const Stay& stay) {
    said.moments.add(TwoModes::functions(stay.state), static_cast<double>(stay.weight));
  };
  for (int i = 0; i < iterations; ++i) {
    chain.step(simulator);
    gatherer.note(chain, add);
  }
  gatherer.finish(add);
  said.odds = chain.counts().odds;
  return said;
}

inline Said run_of(const TwoModes& toy, const ChainSettings& settings, int iterations) {
  Chain chain(toy.target(), settings);
  ToySimulator simulator = toy.simulator();
  return run_of(chain, simulator, iterations);
}

/// The largest |t| of the seeds' means against the truth, over all functions.
inline double largest_t(const std::vector<Said>& runs, const Truth& truth) {
  double largest = 0;
  for (Eigen::Index f = 0; f < truth.mean.size(); ++f) {
    std::vector<double> means;
    for (const Said& run : runs)
      means.push_back(run.moments.mean()[f]);
    const Moments of = moments(means);
    largest = std::max(largest,
                       std::abs(of.mean - truth.mean[f]) / std::hypot(of.standard_error(), truth.error[f]));
  }
  return largest;
}

/// How many of the runs' intervals hold the truth.
inline int covered(const std::vector<Said>& runs, OddsBasis basis, double probability) {
  int count = 0;
  for (const Said& run : runs) {
    const auto found = odds(run.odds);
    count += found && run.odds.basis == basis && found->low <= probability && probability <= found->high;
  }
  return count;
}

/// A learning that ends soon, for tests that take many seeds.
inline constexpr LearningLimits kShortLearning{
    .hits = 60, .plain_hits = 8, .draws = 20'000, .plain_draws = 0};

}  // namespace retake::tests
