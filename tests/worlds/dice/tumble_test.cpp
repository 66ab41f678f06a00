// Runs of dice: resumed and full ones are the same bit for bit, so are lazy and given tables, and runs do not
// depend on what ran before.
#include <gtest/gtest.h>

#include "tests/worlds/dice/fixture.h"

namespace retake::tests {
namespace {

using dice::DiceSettings;
using dice::Tumble;
using dice::TumbleScene;

/// Whether two runs are the same in every bit.
void expect_same(const Tumble& a, const Tumble& b) {
  ASSERT_EQ(a.complete, b.complete);
  ASSERT_EQ(a.step_count, b.step_count);
  ASSERT_EQ(a.paths.size(), b.paths.size());
  for (std::size_t die = 0; die < a.paths.size(); ++die) {
    const dice::DiePath &path = *a.paths[die], &other = *b.paths[die];
    ASSERT_EQ(path.launch_step, other.launch_step);
    ASSERT_EQ(path.states.size(), other.states.size()) << die;
    for (std::size_t i = 0; i < path.states.size(); ++i)
      ASSERT_TRUE(path.states[i].same_bits(other.states[i])) << die << ' ' << i;
    ASSERT_EQ(path.touches.size(), other.touches.size()) << die;
    for (std::size_t i = 0; i < path.touches.size(); ++i) {
      ASSERT_EQ(path.touches[i].place, other.touches[i].place) << die << ' ' << i;
      ASSERT_EQ(path.touches[i].step, other.touches[i].step) << die << ' ' << i;
    }
  }
  ASSERT_EQ(a.hits.size(), b.hits.size());
  for (std::size_t i = 0; i < a.hits.size(); ++i) {
    ASSERT_EQ(a.hits[i].step, b.hits[i].step);
    ASSERT_EQ(a.hits[i].die, b.hits[i].die);
    ASSERT_EQ(a.hits[i].other, b.hits[i].other);
    ASSERT_EQ(a.hits[i].impulse, b.hits[i].impulse);
    ASSERT_EQ(a.hits[i].point, b.hits[i].point);
    ASSERT_EQ(a.hits[i].normal, b.hits[i].normal);
  }
  ASSERT_EQ(a.meetings.size(), b.meetings.size());
  for (std::size_t i = 0; i < a.meetings.size(); ++i) {
    ASSERT_EQ(a.meetings[i].step, b.meetings[i].step);
    ASSERT_EQ(a.meetings[i].first, b.meetings[i].first);
    ASSERT_EQ(a.meetings[i].second, b.meetings[i].second);
  }
}

/// A random change of one kind.
State changed(const DiceTable& table, const State& state, RandomStream& random) {
  const dice::DiceModel& model = table.model;
  State other = state;
  const auto at = [&](std::size_t variable) -> double& { return other[static_cast<Eigen::Index>(variable)]; };
  const std::size_t die = random.index(model.settings().dice);
  switch (random.index(6)) {
    case 0:  // of where the last dice start, which are there from their start on only
      at(model.start_x(model.settings().dice - 1) + 1) += 1e-4 * random.gaussian();
      break;
    case 1:
      at(model.spin_x(die) + random.index(3)) += 0.1 * random.gaussian();
      break;
    case 2:
      at(model.key()) = random.uniform();
      break;
    default:  // control points, one or a few
      for (std::uint64_t i = 0; i <= random.index(3); ++i) {
        const std::size_t first = model.override_of(random.index(dice::DiceModel::kPatch.size()));
        const dice::ControlPoint point = draw_control_point(model.settings().table, random);
        at(first) = point.height;
        at(first + 1) = point.restitution;
        at(first + 2) = point.friction;
      }
  }
  return other;
}

std::size_t shared_paths(const Tumble& a, const Tumble& b) {
  std::size_t shared = 0;
  for (std::size_t die = 0; die < a.paths.size(); ++die)
    shared += a.paths[die] == b.paths[die] ? 1 : 0;
  return shared;
}

/// Walks by random changes; every run is resumed from the one before and compared with a full one.
void expect_resumed_runs_are_full_ones(const DiceSettings& settings, std::uint64_t seed, int changes) {
  DiceTable resumed(settings), full(settings);
  RandomStream random = stream(seed);
  State state = resumed.draw(seed, 0);
  Tumble current, next, whole;
  resumed.tumbler.simulate(resumed.model.read(state).scene, nullptr, &current);
  std::int64_t stepped = 0, all = 0, unchanged = 0;
  bool alone = false;
  for (int i = 0; i < changes; ++i) {
    const State candidate = changed(resumed, state, random);
    const TumbleScene scene = resumed.model.read(candidate).scene;
    const Tumble* record = current.complete ? &current : nullptr;
    const dice::TumbleOutcome outcome = resumed.tumbler.simulate(scene, record, &next);
    const dice::TumbleOutcome complete = full.tumbler.simulate(scene, nullptr, &whole);
    ASSERT_EQ(outcome.end, complete.end);
    ASSERT_EQ(outcome.step_count, complete.step_count);
    ASSERT_NO_FATAL_FAILURE(expect_same(next, whole)) << "change " << i;
    for (std::size_t die = 0; die < settings.dice; ++die)
      ASSERT_TRUE(resumed.tumbler.states()[die].same_bits(full.tumbler.states()[die]));
    stepped += outcome.stepped;
    all += complete.stepped;
    unchanged += outcome.stepped == 0 ? 1 : 0;
    alone = alone || (record && outcome.stepped > 0 && shared_paths(next, *record) > 0);
    if (!random.bernoulli(0.5)) continue;
    state = candidate;
    std::swap(current, next);
  }
  EXPECT_LT(stepped, all * 9 / 10) << "resuming saves something";
  EXPECT_GT(unchanged, changes / 10) << "most control points are never touched";
  EXPECT_EQ(alone, settings.dice > 1) << "dice that nothing happens to are not simulated";
}

TEST(DiceTumble, ResumedRunsAreFullOnes) {
  expect_resumed_runs_are_full_ones({}, 321, 200);
  expect_resumed_runs_are_full_ones({.dice = 3, .pose = dice::GridPose::fixed, .interval = 0.1}, 322, 40);
}

TEST(SlowDiceTumble, ResumedRunsAreFullOnes) {
  expect_resumed_runs_are_full_ones({}, 323, 5000);
  expect_resumed_runs_are_full_ones({.dice = 4, .interval = 0.1}, 324, 1000);
}

TEST(DiceTumble, AStoppedRunIsNotLookedAtAsIfItWereComplete) {
  DiceTable table;
  Tumble run;
  const TumbleScene scene = table.draw_scene(325, 0);
  const dice::TumbleOutcome outcome = table.tumbler.simulate(
      scene, nullptr, &run, [](std::span<const dice::Hit> hits) { return hits.size() >= 2; });
  EXPECT_EQ(outcome.end, dice::TumbleEnd::stopped);
  EXPECT_FALSE(run.complete);
  EXPECT_GE(run.hits.size(), 2u);
  EXPECT_EQ(run.step_count, outcome.step_count);
}

TEST(DiceTumble, GivenControlPointsMoveDiceAsThoseOfTheKeyDo) {
  DiceTable table;
  for (std::uint64_t i = 0; i < 20; ++i) {
    TumbleScene lazy = table.draw_scene(326, i), given = lazy;
    Tumble a, b;
    table.tumbler.simulate(lazy, nullptr, &a);
    given.table.key = 0;
    for (std::int32_t x = -40; x < 60; ++x)
      for (std::int32_t z = -40; z < 40; ++z)
        given.table.overrides.push_back(
            {{x, z}, control_point_of_key(table.model.settings().table, lazy.table.key, {x, z})});
    table.tumbler.simulate(given, nullptr, &b);
    ASSERT_NO_FATAL_FAILURE(expect_same(a, b));
  }
}

TEST(DiceTumble, RunsDoNotDependOnWhatRanBefore) {
  DiceTable one({.dice = 2}), other({.dice = 2});
  Tumble a, b;
  for (std::uint64_t i = 0; i < 20; ++i) {
    one.tumbler.simulate(one.draw_scene(327, i), nullptr, &a);
    other.tumbler.simulate(other.draw_scene(328, i), nullptr, nullptr);
    other.tumbler.simulate(other.draw_scene(327, i), nullptr, &b);
    ASSERT_NO_FATAL_FAILURE(expect_same(a, b));
  }
}

TEST(DiceTumble, WhatWasNeverTouchedDoesNotMatter) {
  DiceTable table;
  for (std::uint64_t i = 0; i < 10; ++i) {
    TumbleScene scene = table.draw_scene(329, i);
    Tumble a, b;
    table.tumbler.simulate(scene, nullptr, &a);
    RandomStream random = stream(330, i);
    for (std::int32_t x = -20; x < 40; ++x)
      for (std::int32_t z = -25; z < 25; ++z) {
        const dice::GridPlace place{x, z};
        const std::vector<dice::FirstTouch>& touches = a.paths[0]->touches;
        const bool touched = std::any_of(touches.begin(), touches.end(),
                                         [&](const dice::FirstTouch& touch) { return touch.place == place; });
        if (!touched)
          scene.table.overrides.push_back({place, draw_control_point(table.model.settings().table, random)});
      }
    EXPECT_FALSE(first_difference(table.model.settings().table, scene, a, 0).has_value());
    table.tumbler.simulate(scene, nullptr, &b);
    ASSERT_NO_FATAL_FAILURE(expect_same(a, b));
  }
}

TEST(DiceTumble, NobodyMeetsADieThatIsYetToBeThrown) {
  DiceTable table({.dice = 2});
  for (std::uint64_t number = 0; number < 20; ++number) {
    TumbleScene alone = table.draw_scene(411, number), both = alone;
    alone.dice.resize(1);
    Tumble lonely, follows, from_scratch;
    ASSERT_EQ(table.tumbler.simulate(alone, nullptr, &lonely).end, dice::TumbleEnd::rests);
    // The second one is to be thrown where the first comes to rest, when it has long done so.
    both.dice[1].step = lonely.step_count + 100;
    both.dice[1].state.position = lonely.paths[0]->states.back().position;
    both.latest_step += both.dice[1].step;
    table.tumbler.simulate(both, nullptr, &from_scratch);
    TumbleScene before = both;
    before.dice[1].state.position.y() += 0.1;
    Tumble record;
    ASSERT_EQ(table.tumbler.simulate(before, nullptr, &record).end, dice::TumbleEnd::rests);
    table.tumbler.simulate(both, &record, &follows);
    for (const Tumble* run : {&from_scratch, &follows}) {
      for (std::int64_t step = 0; step < both.dice[1].step; ++step)
        ASSERT_TRUE(run->paths[0]->at(step).same_bits(lonely.paths[0]->at(step))) << number << ' ' << step;
      for (const dice::Meeting& meeting : run->meetings)
        ASSERT_GE(meeting.step, both.dice[1].step);
      ASSERT_FALSE(run->meetings.empty()) << "then it is there";
    }
  }
}

TEST(DiceTumble, DiceMeetAndWakeThoseThatRest) {
  DiceTable table({.dice = 4, .start_spread = 0.001, .interval = 0.8});
  int met = 0, woken = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    Tumble run;
    ASSERT_EQ(table.tumbler.simulate(table.draw_scene(331, i), nullptr, &run).end, dice::TumbleEnd::rests);
    met += std::any_of(run.hits.begin(), run.hits.end(),
                       [](const dice::Hit& hit) { return hit.other != dice::kTable; })
               ? 1
               : 0;
    for (std::size_t die = 0; die < 4; ++die) {
      bool rested = false;
      for (std::int64_t step = 0; step <= run.step_count; ++step) {
        const bool rests = run.paths[die]->at(step).quiet_steps >= dice::EngineSettings().rest_steps();
        woken += rested && !rests ? 1 : 0;
        rested = rests;
      }
      EXPECT_TRUE(rested);
    }
    // In the end no two dice are in each other: their centres are at least a side apart.
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = 0; b < a; ++b)
        EXPECT_GT((run.paths[a]->states.back().position - run.paths[b]->states.back().position).norm(),
                  0.95 * kDieSide);
  }
  EXPECT_GT(met, 5);
  EXPECT_GT(woken, 0);
}

}  // namespace
}  // namespace retake::tests
