// Toy targets whose answers are known, for the tests of kernels and chains.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"

namespace retake::tests {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kFails = kAbsent;  ///< a toy's log_constraint where its simulation fails

using LogConstraint = std::function<double(const State&)>;

/// Scores by a function, whose value is also its one measure. Stops early wherever it is allowed to, and then
/// leaves a Score that would be tempting to read.
class ToySimulator final : public Simulator {
 public:
  explicit ToySimulator(LogConstraint log_constraint) : log_constraint_(std::move(log_constraint)) {}

  SimulationOutcome simulate(const State& candidate, const SimulationRequest& request,
                             Score& score) override {
    ++simulations;
    if (observe) observe(candidate, request);
    // One checkpoint, halfway.
    if (request.watch && features && !request.watch->goes_on(0, 1, features(candidate)))
      return {.end = SimulationEnd::stopped, .simulated_seconds = 1};
    const double value = log_constraint_(candidate);
    score = {.log_constraint = 0, .satisfied = true, .measures = {12345}};
    if (std::isnan(value)) return {.end = SimulationEnd::failed, .simulated_seconds = 1};
    if (value <= request.needed) return {.end = SimulationEnd::stopped, .simulated_seconds = 1};
    score = {.log_constraint = value,
             .satisfied = satisfies ? satisfies(candidate) : value > satisfied_above,
             .measures = {value}};
    return {.end = SimulationEnd::complete, .simulated_seconds = 2};
  }

  std::function<void(const State&, const SimulationRequest&)> observe;
  std::function<std::vector<double>(const State&)>
      features;  ///< that a watch is shown; null: it is not asked
  double satisfied_above = -kInfinity;
  std::function<bool(const State&)> satisfies;  ///< null: what exceeds satisfied_above
  std::uint64_t simulations = 0;

 private:
  LogConstraint log_constraint_;
};

inline double constant(const State&) {
  return 0;
}

inline std::shared_ptr<const Target> target_of(std::shared_ptr<const Model> model,
                                               std::vector<WeightedKernel> rows) {
  return std::make_shared<const Target>(
      Target{std::move(model), KernelTable(std::move(rows)), {"log_constraint"}});
}

/// `count` switches, on with probability one half, each followed by a Variable uniform on [0, width] that it
/// governs.
inline std::shared_ptr<const Model> switch_model(std::size_t count, double width) {
  std::vector<Variable> variables;
  for (std::size_t i = 0; i < count; ++i) {
    variables.push_back({.name = "on_" + std::to_string(i), .unit = "", .prior = Distribution::on_off(0.5)});
    variables.push_back({.name = "place_" + std::to_string(i),
                         .unit = "m",
                         .prior = Distribution::uniform(0, width),
                         .switch_index = 2 * i});
  }
  return std::make_shared<const Model>(std::move(variables));
}

inline std::vector<std::size_t> switches_of(const Model& model) {
  std::vector<std::size_t> switches;
  for (std::size_t i = 0; i < model.size(); ++i)
    if (model.variables()[i].prior.kind() == Distribution::Kind::on_off) switches.push_back(i);
  return switches;
}

inline std::shared_ptr<const Model> gaussian_model(std::size_t count, double standard_deviation = 1) {
  std::vector<Variable> variables;
  for (std::size_t i = 0; i < count; ++i)
    variables.push_back({.name = "x_" + std::to_string(i),
                         .unit = "",
                         .prior = Distribution::gaussian(0, standard_deviation)});
  return std::make_shared<const Model>(std::move(variables));
}

/// A model with every kind of Variable, present and governed.
inline std::shared_ptr<const Model> rich_model() {
  return std::make_shared<const Model>(std::vector<Variable>{
      {.name = "a_on", .unit = "", .prior = Distribution::on_off(0.3)},
      {.name = "a_place", .unit = "m", .prior = Distribution::uniform(0, 2), .switch_index = 0},
      {.name = "a_size", .unit = "m", .prior = Distribution::gaussian(1, 0.5), .switch_index = 0},
      {.name = "b_on", .unit = "", .prior = Distribution::on_off(0.6)},
      {.name = "b_place", .unit = "m", .prior = Distribution::uniform(-1, 1), .switch_index = 3},
      {.name = "angle", .unit = "rad", .prior = Distribution::uniform(0, 1)},
      {.name = "offset_x", .unit = "m", .prior = Distribution::gaussian(0, 0.5)},
      {.name = "offset_y", .unit = "m", .prior = Distribution::gaussian(0, 0.5)},
      {.name = "offset_z", .unit = "m", .prior = Distribution::gaussian(0.2, 1)}});
}

/// Every kernel, alone and on each kind of Variable of rich_model().
inline std::vector<WeightedKernel> rich_kernels(const Model& model, Ratios ratios) {
  using Shape = Perturb::Shape;
  const auto perturb = [](std::vector<Perturb::Group> groups) {
    return std::make_shared<const Perturb>(std::move(groups));
  };
  return {
      {"redraw_all", 1, std::make_shared<const Redraw>(Redraw::all(model, ratios))},
      {"redraw_block", 1,
       std::make_shared<const Redraw>(model, std::vector<std::size_t>{0, 1, 2, 5, 8}, ratios)},
      {"redraw_governed", 1,
       std::make_shared<const Redraw>(model, std::vector<std::size_t>{2, 4, 6}, ratios)},
      {"perturb_uniform", 1,
       perturb({{{1, 4, 5, 6}, Shape::uniform, 0.8, 1}, {{2}, Shape::uniform, 0.5, 0.4}})},
      {"perturb_gaussian", 1,
       perturb({{{2, 8}, Shape::gaussian, 0.7, 0.5}, {{1, 5}, Shape::gaussian, 0.4, 0.5}})},
      {"perturb_radial", 1, perturb({{{6, 7, 8}, Shape::radial, 0.9, 1}, {{4, 5}, Shape::radial, 0.6, 0.7}})},
      {"toggle", 1, std::make_shared<const Toggle>(model, switches_of(model), 0.25, ratios)}};
}

/// A sum over what is present, so that every Variable matters.
inline double sum_of_present(const State& state) {
  double sum = 0;
  for (const double value : state)
    if (!std::isnan(value)) sum += value;
  return sum;
}

/// One Metropolis-Hastings step written independently of Chain: line 7 of the paper's algorithm.
/// True if it moved.
inline bool metropolis_step(const Model& model, const Kernel& kernel, const LogConstraint& log_constraint,
                            State& state, RandomStream& random) {
  State candidate = state;
  const double log_hastings = kernel.propose(model, state, candidate, random);
  const double log_ratio = model.log_prior(candidate) + log_constraint(candidate) - model.log_prior(state) -
                           log_constraint(state) + log_hastings;
  if (!(std::log(random.uniform()) < log_ratio)) return false;
  state = std::move(candidate);
  return true;
}

}  // namespace retake::tests
