// Re-simulation: after whatever change, bit for bit what a run from scratch gives. doc/design.md, section 3.
// Seeds are fixed.
#include <cstdio>
#include <thread>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/impulse/fixture.h"

namespace retake::tests {
namespace {

using namespace impulse;
using impulse::Scene;

struct Rest {
  std::size_t body;
  std::int64_t step;
  Eigen::Vector3d position;
  bool operator==(const Rest&) const = default;
};

/// A simulation, with the calls of StopWhen that came with it.
struct Played {
  impulse::Run run;
  std::vector<Rest> rests;
  ResimulationOutcome outcome;
};
Played play(Resimulation& resimulation, const Scene& scene, const impulse::Run* record) {
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
  expect_changes_equal_runs_from_scratch(hi(), 100, 501);
}
TEST(ImpulseResimulation, ChangesOfAcmEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(acm(), 40, 502);
}
TEST(ImpulseResimulation, ChangesOfALongWordEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(long_word(), 6, 503);
}
TEST(ImpulseResimulation, ChangesOfCrowdedDropsEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(crowded(), 60, 504);
}
/// Boxes, marbles and intervals of every kind; what is simulated from scratch equals the naive simulation
/// too.
void expect_random_boxes_agree(int boxes, int changes, std::uint64_t seed) {
  RandomStream random = stream(seed);
  for (int i = 0; i < boxes; ++i) {
    const auto tessellation = static_cast<spelling::Tessellation>(1 << random.index(3));
    const int columns = 1 + static_cast<int>(random.index(12)), rows = 1 + static_cast<int>(random.index(6));
    const Marbles marbles{spelling::Box(columns, rows, tessellation), 1 + random.index(25),
                          1 + static_cast<std::int64_t>(random.index(200)), "random box"};
    Resimulation local({}, marbles.box.make_surface());
    const auto surface = marbles.box.make_surface();
    Scene scene = draw_scene(marbles, random);
    Played current = play(local, scene, nullptr);
    const auto where = [&](const std::string& what) {
      return "box " + std::to_string(i) + ", " + std::to_string(columns) + " x " + std::to_string(rows) +
             ", " + std::to_string(marbles.count) + " marbles, each " + std::to_string(marbles.interval) +
             " steps: " + what;
    };
    ASSERT_EQ(difference(current.run, simulate_naively({}, *surface, scene)), "") << where("from scratch");
    for (int k = 0; k < changes; ++k) {
      const std::string what = change(marbles, scene, random);
      Played changed = play(local, scene, &current.run);
      ASSERT_EQ(difference(changed.run, simulate_naively({}, *surface, scene)), "") << where(what);
      current = std::move(changed);
    }
  }
}
TEST(ImpulseResimulation, ChangesInRandomBoxesEqualTheNaiveSimulation) {
  expect_random_boxes_agree(15, 3, 505);
}
TEST(SlowImpulseResimulation, ChangesInRandomBoxesEqualTheNaiveSimulation) {
  expect_random_boxes_agree(600, 5, 515);
}

TEST(ImpulseResimulation, AChangeThatChangesNothingSharesEveryMotion) {
  const Marbles marbles = hi();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(506);
  const Scene scene = draw_scene(marbles, random);
  impulse::Run first, second;
  resimulation.simulate(scene, nullptr, &first);
  const auto outcome = resimulation.simulate(scene, &first, &second);
  EXPECT_EQ(outcome.body_steps, 0);
  EXPECT_EQ(first.motions, second.motions);
}

/// What a change costs does not grow with the number of marbles.
TEST(ImpulseResimulation, ARedrawnDropStepsFewOfManyMarbles) {
  const Marbles marbles = long_word();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(523);
  Scene scene = draw_scene(marbles, random);
  impulse::Run current, changed;
  const auto full = resimulation.simulate(scene, nullptr, &current);
  constexpr int kMoves = 40;
  std::int64_t steps = 0;
  for (int i = 0; i < kMoves; ++i) {
    const std::size_t body = random.index(marbles.count);
    scene.bodies[body] = draw_drop(marbles, body, random);
    steps += resimulation.simulate(scene, &current, &changed).body_steps;
    std::swap(current, changed);
  }
  EXPECT_LT(steps / kMoves, 3 * full.body_steps / static_cast<std::int64_t>(marbles.count));
}

TEST(ImpulseResimulation, AnUndoneChangeGivesTheFirstRunBack) {
  const Marbles marbles = acm();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(507);
  Scene scene = draw_scene(marbles, random);
  impulse::Run first;
  resimulation.simulate(scene, nullptr, &first);
  for (int i = 0; i < 30; ++i) {
    Scene changed = scene;
    const std::string what = change(marbles, changed, random);
    impulse::Run there, back;
    resimulation.simulate(changed, &first, &there);
    resimulation.simulate(scene, &there, &back);
    ASSERT_EQ(difference(first, back), "") << what;
  }
}

TEST(ImpulseResimulation, SwappedDropsThatMeetNobodyAreNotStepped) {
  const Marbles marbles = acm();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(508);
  Scene scene = draw_scene(marbles, random);
  // Far apart from each other and from everybody else.
  scene.bodies.assign(marbles.count, std::nullopt);
  scene.bodies[3] = Drop{450, {-0.1, spelling::kDropHeight, 0}};
  scene.bodies[20] = Drop{3000, {0.1, spelling::kDropHeight, 0}};
  impulse::Run first, second;
  resimulation.simulate(scene, nullptr, &first);
  std::swap(scene.bodies[3]->place, scene.bodies[20]->place);
  const auto outcome = resimulation.simulate(scene, &first, &second);
  EXPECT_EQ(outcome.body_steps, 0);
  EXPECT_EQ(second.motions[3], first.motions[20]);
  EXPECT_EQ(second.motions[20], first.motions[3]);
}

/// A passer-by that meets another body of the same motion goes the same way, and knows whom it met.
TEST(ImpulseResimulation, SwappedDropsOfOneTimeAreToldApartByThoseThatMeetThem) {
  const Marbles marbles = hi();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(522);
  Scene scene = draw_scene(marbles, random);
  scene.bodies.assign(4, std::nullopt);
  scene.bodies[0] = Drop{0, {-0.05, spelling::kDropHeight, 0.001}};
  scene.bodies[1] = Drop{0, {0.05, spelling::kDropHeight, 0.001}};
  scene.bodies[3] = Drop{20, {-0.045, spelling::kDropHeight, 0.003}};  // follows body 0 down
  impulse::Run first, second, scratch;
  resimulation.simulate(scene, nullptr, &first);
  ASSERT_FALSE(first.motions[3]->meetings.empty());
  std::swap(scene.bodies[0]->place, scene.bodies[1]->place);
  resimulation.simulate(scene, &first, &second);
  resimulation.simulate(scene, nullptr, &scratch);
  EXPECT_EQ(difference(second, scratch), "");
  EXPECT_EQ(second.motions[3]->meetings.front().other, 1);
  EXPECT_TRUE(second.motions[3]->states.back().same_bits(first.motions[3]->states.back()));
}

TEST(ImpulseResimulation, NobodyMeetsASphereThatIsYetToBeBorn) {
  const Marbles marbles = hi();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(523);
  Scene alone = draw_scene(marbles, random);
  for (int i = 0; i < 20; ++i) {
    alone.bodies.assign(2, std::nullopt);
    alone.bodies[0] = draw_drop(marbles, 0, random);
    impulse::Run lonely, from_scratch, follows;
    resimulation.simulate(alone, nullptr, &lonely);
    const Motion& motion = *lonely.motions[0];
    // In the way of the first one, and to be born there when that has long come to rest.
    Scene both = alone;
    const auto middle = motion.states.begin() + motion.step_count() / 2;
    both.bodies[1] = Drop{motion.step_count() + 50, middle->position};
    resimulation.simulate(both, nullptr, &from_scratch);
    resimulation.simulate(both, &lonely, &follows);
    EXPECT_TRUE(same_bits(*from_scratch.motions[0], motion)) << i;
    EXPECT_TRUE(same_bits(*follows.motions[0], motion)) << i;
    EXPECT_EQ(difference(follows, from_scratch), "") << i;
  }
}

TEST(ImpulseResimulation, ARunThatIsStoppedEndsWhereItIsTold) {
  const Marbles marbles = hi();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(509);
  Scene scene = draw_scene(marbles, random);
  impulse::Run first, second;
  resimulation.simulate(scene, nullptr, &first);
  scene.bodies[0] = draw_drop(marbles, 0, random);
  const Played whole = play(resimulation, scene, &first);
  ASSERT_GE(whole.rests.size(), 4u);
  std::vector<Rest> seen;
  const auto outcome = resimulation.simulate(scene, &first, &second, [&](const Rested& rested) {
    seen.push_back({rested.body, rested.step, rested.position});
    return seen.size() == 3;
  });
  EXPECT_EQ(outcome.end, RunEnd::stopped);
  EXPECT_FALSE(second.complete);
  EXPECT_EQ(seen, std::vector<Rest>(whole.rests.begin(), whole.rests.begin() + 3));
  EXPECT_LT(outcome.body_steps, whole.outcome.body_steps);
}

TEST(ImpulseResimulation, WhatDoesNotRestIsUnsettledAndMayBeContinued) {
  const Marbles marbles = hi();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(510);
  Scene scene = draw_scene(marbles, random);
  scene.latest_step = 1600;
  impulse::Run cut, whole;
  EXPECT_EQ(resimulation.simulate(scene, nullptr, &cut).end, RunEnd::unsettled);
  EXPECT_TRUE(cut.complete);
  EXPECT_FALSE(cut.rests);
  scene.latest_step = marbles.latest_step();
  const auto outcome = resimulation.simulate(scene, &cut, &whole);
  EXPECT_EQ(outcome.end, RunEnd::rests);
  impulse::Run scratch;
  const auto from_scratch = resimulation.simulate(scene, nullptr, &scratch);
  EXPECT_EQ(difference(whole, scratch), "");
  EXPECT_LT(outcome.body_steps, from_scratch.body_steps / 2);
  // And back: what ends earlier is a part of the record.
  scene.latest_step = 1600;
  EXPECT_EQ(resimulation.simulate(scene, &whole, &scratch).body_steps, 0);
  EXPECT_EQ(difference(scratch, cut), "");
}

// --- Determinism -------------------------------------------------------------------------------------------

/// Several threads simulate the same drops, each with a simulation of its own, all with the same records.
TEST(ThreadsImpulseResimulation, ThreadsAndReusedSimulationsAgree) {
  const Marbles marbles = hi();
  RandomStream random = stream(521);
  std::vector<Scene> scenes = {draw_scene(marbles, random)};
  for (int i = 0; i < 8; ++i) {
    scenes.push_back(scenes.back());
    change(marbles, scenes.back(), random);
  }
  std::vector<impulse::Run> fresh(scenes.size());
  for (std::size_t i = 0; i < scenes.size(); ++i)
    Resimulation({}, marbles.box.make_surface()).simulate(scenes[i], nullptr, &fresh[i]);
  std::vector<std::string> differences(4);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < differences.size(); ++t)
      threads.emplace_back([&, t] {
        Resimulation reused({}, marbles.box.make_surface());
        for (std::size_t i = 0; i < 4 * scenes.size(); ++i) {
          const std::size_t which = (5 * i + t) % scenes.size(), from = (3 * i + 2 * t) % scenes.size();
          impulse::Run run;
          reused.simulate(scenes[which], i % 3 == 0 ? nullptr : &fresh[from], &run);
          differences[t] += difference(run, fresh[which]);
        }
      });
  }
  EXPECT_EQ(differences, std::vector<std::string>(differences.size()));
}

TEST(SlowImpulseResimulation, ChangesEqualRunsFromScratch) {
  expect_changes_equal_runs_from_scratch(hi(), 4000, 511);
  expect_changes_equal_runs_from_scratch(acm(), 2500, 512);
  expect_changes_equal_runs_from_scratch(long_word(), 500, 513);
  expect_changes_equal_runs_from_scratch(crowded(), 3000, 514);
}

}  // namespace
}  // namespace retake::tests
