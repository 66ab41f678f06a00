// Tempered chains: exact on toys, odds that cover, a ladder that is tuned, the same with early rejection on
// or off and after any interruption. Seeds are fixed; each statistical comparison errs with probability 1e-6
// unless it says more.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/walk_checks.h"

namespace retake::tests {
namespace {

using Height = TwoModes::Height;

ChainSettings tempering_settings(std::uint64_t seed) {
  return {.seed = seed, .method = Method::tempering};
}

class TemperingTest : public ::testing::TestWithParam<TwoModes> {};
INSTANTIATE_TEST_SUITE_P(Toys, TemperingTest, ::testing::ValuesIn(all_two_modes()),
                         [](const auto& tested) { return name_of(tested.param); });

TEST_P(TemperingTest, IsExactAndItsOddsCover) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 401);
  const auto runs = runs_of(GetParam(), tempering_settings(402), 40'000);
  EXPECT_LT(largest_t(runs, truth), kLargestT);
  // With a true coverage of 95 % fewer than 19 of 24 are seen with probability 1.3e-3.
  EXPECT_GE(covered(runs, OddsBasis::ladder, truth.probability), 19);
}

TEST_P(TemperingTest, EarlyRejectionChangesNothingButTheWork) {
  expect_early_rejection_changes_nothing(GetParam(), tempering_settings(404), 20'000);
}

TEST_P(TemperingTest, LearningWeighsNothing) {
  expect_learning_weighs_nothing(GetParam(), tempering_settings(405), 40'000);
}

TEST_P(TemperingTest, LessonsTakeThePlaceOfLearning) {
  expect_lessons_take_the_place_of_learning(GetParam(), tempering_settings(440), LessonKind::place);
}

TEST_P(TemperingTest, IsExactFromALesson) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 441);
  const auto runs = taught_runs_of(GetParam(), tempering_settings(442), 40'000);
  EXPECT_LT(largest_t(runs, truth), kLargestT);
  EXPECT_GE(covered(runs, OddsBasis::ladder, truth.probability), 19);
}

TEST_P(TemperingTest, ResumedEqualsUninterrupted) {
  expect_resumes(GetParam(), tempering_settings(406), 8000, [](int i) { return i < 4000 || i % 7 == 0; });
}

TEST_P(TemperingTest, KeepsSamplesOfEveryReplicaWhereTheSatisfiedSetIsLevelElseOfTheLast) {
  Chain chain(GetParam().target(), tempering_settings(407));
  ToySimulator simulator = GetParam().simulator();
  std::vector<std::uint64_t> draws;  // a rung
  DrawWatcher watcher;
  std::size_t turn = 0;  // the ladder begins with a step of the lowest rung
  for (int i = 0; i < 60'000; ++i) {
    const bool was_there = !chain.counts().rungs.empty();
    chain.step(simulator);
    const bool drew = watcher.note(chain);
    // The counters of rungs come with the ladder's first step.
    const std::size_t rungs = chain.counts().rungs.size();
    if (rungs == 0) continue;
    turn = was_there ? (turn + 1) % rungs : 0;
    draws.resize(rungs);
    draws[turn] += drew;
    if (!drew) continue;
    ASSERT_NE(TwoModes::part(chain.stay().state), 0);
    ASSERT_TRUE(chain.stay().score.satisfied);
    ASSERT_FALSE(chain.counts().is_learning);
  }
  ASSERT_GE(draws.size(), 3u);
  EXPECT_GT(draws.back(), 500u);
  draws.pop_back();
  for (const std::uint64_t count : draws) {
    if (GetParam().height == Height::level)
      EXPECT_GT(count, 20u);
    else
      EXPECT_EQ(count, 0u);
  }
}

TEST(Tempering, TheLastDrawOfEachSeedIsADrawOfTheTarget) {
  for (const Height height : {Height::level, Height::stepped, Height::sloped})
    expect_last_draws_are_exact(height, tempering_settings(4100), 200, 600);
}

TEST(SlowTempering, IsExact) {
  for (const TwoModes& toy : all_two_modes()) {
    const Truth truth = truth_of(toy, 20'000'000, 411);
    const auto runs = runs_of(toy, tempering_settings(412), 500'000);
    EXPECT_LT(largest_t(runs, truth), kLargestT) << name_of(toy);
    EXPECT_GE(covered(runs, OddsBasis::ladder, truth.probability), 19) << name_of(toy);
  }
}

TEST(SlowTempering, TheLastDrawOfEachSeedIsADrawOfTheTarget) {
  for (const Height height : {Height::level, Height::stepped, Height::sloped})
    expect_last_draws_are_exact(height, tempering_settings(413'000), 1500, 1500);
}

TEST(Tempering, GivesThePriorBackWhenEverythingSatisfies) {
  expect_the_prior_back(tempering_settings(421), kSeeds, 6000);
}

TEST(Tempering, ThrowsWhereThePriorIsNowhereInItsSupport) {
  expect_nowhere_throws(tempering_settings(422));
}

TEST(Tempering, ConstantsOfTheConstraintDoNotMatter) {
  // Only odds may be lost, where exp(-log_constraint) is no number any more.
  const TwoModes toy{.height = Height::sloped};
  const Truth truth = truth_of(toy, 1'000'000, 424);
  for (const double less : {50.0, 1000.0}) {
    std::vector<Said> runs;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      Chain chain(toy.target(), tempering_settings(425 + seed));
      const LogConstraint plain = toy.log_constraint();
      ToySimulator simulator([&](const State& state) { return plain(state) - less; });
      simulator.satisfies = [](const State& state) { return TwoModes::part(state) != 0; };
      runs.push_back(run_of(chain, simulator, 60'000));
    }
    EXPECT_LT(largest_t(runs, truth), kLargestT) << less;
    int wrong = 0;
    for (const Said& run : runs) {
      const auto found = odds(run.odds);
      wrong += found && !(found->low <= truth.probability && truth.probability <= found->high);
    }
    EXPECT_LE(wrong, 5) << less;
  }
}

// --- The ladder -----------------------------------------------------------------------------------

TEST(Tempering, TheTunedLadderRejectsAlikeAndCountsItsSwaps) {
  for (const TwoModes& toy : all_two_modes()) {
    Chain chain(toy.target(), tempering_settings(431));
    ToySimulator simulator = toy.simulator();
    while (chain.counts().is_learning)
      chain.step(simulator);
    const std::vector<RungCounter> before = chain.counts().rungs;
    for (std::size_t i = 0; i < 4000 * before.size(); ++i)
      chain.step(simulator);
    const std::vector<RungCounter>& rungs = chain.counts().rungs;
    ASSERT_EQ(rungs.size(), before.size());
    EXPECT_EQ(rungs.front().beta, 0);
    EXPECT_EQ(rungs.back().beta, 1);
    EXPECT_EQ(rungs.back().proposed, 0u);
    double least = 1, most = 0;
    for (std::size_t r = 0; r + 1 < rungs.size(); ++r) {
      EXPECT_LT(rungs[r].beta, rungs[r + 1].beta);
      EXPECT_EQ(rungs[r].beta, before[r].beta) << "frozen";
      // 4000 rounds propose every swap in every other round.
      EXPECT_EQ(rungs[r].proposed - before[r].proposed, 2000u);
      const double rejected = 1 - static_cast<double>(rungs[r].accepted - before[r].accepted) / 2000;
      least = std::min(least, rejected);
      most = std::max(most, rejected);
    }
    EXPECT_LT(most - least, 0.2) << name_of(toy);
    EXPECT_LT(most, 0.7) << name_of(toy);
  }
}

TEST(Tempering, ALadderReachesAWishThatThePriorDoesNotFind) {
  // Less than one draw in a million satisfies it.
  const TwoModes toy{.height = Height::sloped, .narrowness = 130, .is_single = true};
  const double half_x = 0.15 / 130, half_y = 0.075 / 130;
  const double probability = (normal_cdf(-0.85 + half_x) - normal_cdf(-0.85 - half_x)) * 2 * half_y;
  ASSERT_LT(probability, 1e-6);
  const auto runs = runs_of(toy, tempering_settings(432), 300'000, 8);
  // The slope is N(0.25, 1/2): of functions() the fourth.
  std::vector<double> slopes;
  for (const Said& run : runs)
    slopes.push_back(run.moments.mean()[3]);
  // Student's t with 7 degrees of freedom exceeds 5.4 with probability 1e-3.
  EXPECT_LT(std::abs(z_of_mean(slopes, 0.25)), 5.4);
  // With a true coverage of 95 % fewer than 5 of 8 are seen with probability 4e-4.
  EXPECT_GE(covered(runs, OddsBasis::ladder, probability), 5);
}

// --- Damage ---------------------------------------------------------------------------------------

TEST(Tempering, DamagedCheckpointsAreRefusedInEveryStage) {
  const TwoModes toy{.height = Height::sloped, .hazards = true};
  Chain chain(toy.target(), tempering_settings(441));
  ToySimulator simulator = toy.simulator();
  std::vector<std::string> checkpoints{chain.checkpoint()};
  while (chain.counts().iteration < 20'000) {
    chain.step(simulator);
    // The pilot, the ladder's first round, tuning, sampling.
    const std::uint64_t iteration = chain.counts().iteration;
    if (iteration == 20 || iteration == 55 || iteration == 700) checkpoints.push_back(chain.checkpoint());
  }
  EXPECT_FALSE(chain.counts().is_learning);
  checkpoints.push_back(chain.checkpoint());
  for (const std::string& bytes : checkpoints)
    expect_survives_damage(toy, tempering_settings(441), bytes, 3);
}

}  // namespace
}  // namespace retake::tests
