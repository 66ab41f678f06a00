// OpenScenario: a scenario with its scene, terms and roster laid open, so that tests can look behind Scores.
// For any world: what it needs to know it reads from the world's own tables.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/worlds/fixture.h"
#include "worlds/roster.h"

namespace retake::tests {

/// The registered worlds and the minimal one.
const std::vector<const World*>& all_worlds();

struct OpenScenario {
  std::shared_ptr<const Scenario> scenario;
  std::shared_ptr<const Scene> scene;
  Terms terms;
  Roster roster;

  const World& world() const { return scenario->world(); }
  const Model& model() const { return scenario->model(); }
  bool reads_frames() const;
};

/// Requires: a document without faults.
OpenScenario open_scenario(const World& world, const json& document);
std::vector<OpenScenario> open_examples(const World& world);
/// The model of an example without any wish.
OpenScenario open_without_wishes(const World& world, const json& example);
/// The example of the fewest movers, but more than one where there is such an example, without any wish.
OpenScenario open_smallest(const World& world);

/// Draws from the prior, within its support.
std::vector<State> draw_states(const Model& model, std::uint64_t seed, int count);

/// What one call of Physics::simulate told.
struct Told {
  SimulationEnd end = SimulationEnd::failed;
  Animation animation;
  std::vector<double> measures;

  bool is_complete() const { return end == SimulationEnd::complete; }
};

inline constexpr double kNotWritten = -7.25e77;  ///< what stood in measures before, unlike any

/// Simulates into the memory of `told`.
void simulate(Physics& physics, const State& state, const Recording& recording, Told& told,
              double written_before = kNotWritten);
/// By new Physics into new memory.
Told simulate_anew(const Scene& scene, const State& state, const Recording& recording,
                   double written_before = kNotWritten);

/// Every bit that a complete simulation tells of a State, besides the looks of the bodies.
std::string bits_of(const Told& told);

/// An animation as it was at a time [s], with so many frames, as far as its simulator told.
Animation so_far(const Animation& whole, std::size_t frames, double time);

/// The sum of the terms' log densities.
double log_density_of(const Terms& terms, const Animation& animation);

}  // namespace retake::tests
