// Re-simulation: after whatever change, bit for bit what a run from scratch gives. DESIGN section 3. Seeds
// are fixed.
#include <cstdio>
#include <thread>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/impulse_fixture.h"

namespace retake::tests {
namespace {

using namespace impulse;
using impulse::Run;  // not the sampler's
using impulse::Scene;

struct Rest {
  std::size_t body;
  std::int64_t step;
  Eigen::Vector3d position;
  bool operator==(const Rest&) const = default;
};

/// A simulation, with the calls of StopWhen that came with it.
struct Played {
  Run run;
  std::vector<Rest> rests;
  ResimulationOutcome outcome;
};
Played play(Resimulation& resimulation, const Scene& scene, const Run* record) {
  Played played;
  played.outcome = resimulation.simulate(scene, record, &played.run, [&](const Rested& rested) {
    played.rests.push_back({rested.body, rested.step, rested.position});
    return false;
  });
  return played;
}

/// A walk of random changes, each compared with a run from scratch.
void expect_changes_equal_runs_from_scratch(const Marbles& marbles, int changes, std::uint64_t seed) {
  Resimulation local({}, marbles.box.make_surface()), full({}, marbles.box.make_surface());
  RandomStream random = stream(seed);
  Scene scene = draw_scene(marbles, random);
  Played current = play(local, scene, nullptr);
  std::int64_t local_steps = 0, full_steps = 0;
  for (int i = 0; i < changes; ++i) {
    const std::string what = change(marbles, scene, random);
    Played changed = play(local, scene, &current.run);
    const Played scratch = play(full, scene, nullptr);
    local_steps += changed.outcome.body_steps;
    full_steps += scratch.outcome.body_steps;
    ASSERT_EQ(difference(changed.run, scratch.run), "") << marbles.name << ", change " << i << ": " << what;
    ASSERT_EQ(changed.outcome.end, scratch.outcome.end) << marbles.name << ", change " << i << ": " << what;
    ASSERT_EQ(changed.rests, scratch.rests) << marbles.name << ", change " << i << ": " << what;
    current = std::move(changed);
  }
  EXPECT_LT(local_steps, full_steps);
  std::printf("%s: %d changes, %.0f steps of a body each instead of %.0f\n", marbles.name.c_str(), changes,
              static_cast<double>(local_steps) / changes, static_cast<double>(full_steps) / changes);
}

TEST(ImpulseResimulation, ChangesOfHiEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(hi(), 150, 501);
}
TEST(ImpulseResimulation, ChangesOfAcmEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(acm(), 60, 502);
}
TEST(ImpulseResimulation, ChangesOfALongWordEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(long_word(), 10, 503);
}
TEST(ImpulseResimulation, ChangesOfCrowdedDropsEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(crowded(), 100, 504);
}
TEST(SlowImpulseResimulation, ChangesEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(hi(), 4000, 511);
  expect_changes_equal_runs_from_scratch(acm(), 2500, 512);
  expect_changes_equal_runs_from_scratch(long_word(), 500, 513);
  expect_changes_equal_runs_from_scratch(crowded(), 3000, 514);
}

}  // namespace
}  // namespace retake::tests
