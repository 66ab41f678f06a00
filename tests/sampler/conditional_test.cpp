// Conditional chains: exact on toys, odds that cover, the same with early rejection on or off and after any
// interruption. Seeds are fixed; each statistical comparison errs with probability 1e-6 unless it says more.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/walk_checks.h"

namespace retake::tests {
namespace {

using Height = TwoModes::Height;

ChainSettings with_seed(std::uint64_t seed) {
  return {.seed = seed, .method = Method::conditional, .learning = kShortLearning};
}

/// Less than one draw of the prior in a million satisfies it: a ladder has to find the first hits.
TwoModes rare_toy() {
  return {.height = Height::sloped, .narrowness = 130, .is_single = true};
}

ChainSettings rare_settings(std::uint64_t seed) {
  return {.seed = seed,
          .method = Method::conditional,
          .learning = {.hits = 60, .plain_hits = 8, .draws = 45'000, .plain_draws = 0}};
}

class ConditionalTest : public ::testing::TestWithParam<TwoModes> {};
INSTANTIATE_TEST_SUITE_P(Toys, ConditionalTest, ::testing::ValuesIn(all_two_modes()),
                         [](const auto& tested) { return name_of(tested.param); });

TEST_P(ConditionalTest, IsExactAndItsOddsCover) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 301);
  const auto runs = runs_of(GetParam(), with_seed(302), 6000);
  EXPECT_LT(largest_t(runs, truth), kLargestT);
  // With a true coverage of 95 % fewer than 19 of 24 are seen with probability 1.3e-3.
  EXPECT_GE(covered(runs, OddsBasis::learned, truth.probability), 19);
  const auto by_rejection = runs_of(GetParam(), {.seed = 303, .method = Method::rejection}, 20'000);
  EXPECT_LT(largest_t(by_rejection, truth), kLargestT);
  EXPECT_GE(covered(by_rejection, OddsBasis::rejection, truth.probability), 19);
}

TEST_P(ConditionalTest, IsExactHoweverLittleItLearned) {
  // A redraw from a handful of hits is far from the target, and only the ratio of weights makes up for it.
  // One chain each, as the faults of many redraws would cancel; its batches stand for seeds.
  const Truth truth = truth_of(GetParam(), 1'000'000, 307);
  ChainSettings settings = with_seed(308);
  settings.learning = {.hits = 6, .plain_hits = 1, .draws = 20'000, .plain_draws = 0};
  Chain chain(GetParam().target(), settings);
  ToySimulator simulator = GetParam().simulator();
  while (chain.counts().iteration == 0 || chain.counts().is_learning)
    chain.step(simulator);
  std::vector<Said> batches;
  for (int batch = 0; batch < kSeeds; ++batch)
    batches.push_back(run_of(chain, simulator, 20'000));
  EXPECT_LT(largest_t(batches, truth), kLargestT);
}

TEST_P(ConditionalTest, EarlyRejectionChangesNothingButTheWork) {
  // Where p_c has no least value that satisfies there is no bound: what is hopeless is not simulated at all.
  const bool bounds = std::isfinite(GetParam().target()->least_satisfied);
  expect_early_rejection_changes_nothing(GetParam(), with_seed(304), 8000, bounds);
}

TEST_P(ConditionalTest, LearningWeighsNothing) {
  expect_learning_weighs_nothing(GetParam(), with_seed(305), 40'000);
}

TEST_P(ConditionalTest, LessonsTakeThePlaceOfLearning) {
  expect_lessons_take_the_place_of_learning(GetParam(), with_seed(340), LessonKind::proposal);
}

TEST_P(ConditionalTest, LearnsOnFromAnUnfinishedLesson) {
  Chain first(GetParam().target(), with_seed(345));
  ToySimulator simulator = GetParam().simulator();
  while (first.counts().samples < 30)
    first.step(simulator);
  ASSERT_EQ(first.lesson()->kind, LessonKind::unfinished);
  ChainSettings settings = with_seed(346);
  settings.lesson = first.lesson()->bytes;
  Chain second(GetParam().target(), settings);
  EXPECT_TRUE(second.counts().is_learning);
  EXPECT_EQ(second.counts().odds.draws, 0u) << "the draws of the other one are the other one's";
  while (second.counts().iteration == 0 || second.counts().is_learning)
    second.step(simulator);
  EXPECT_LE(second.counts().samples, kShortLearning.hits - 30 + 10) << "it needed the rest only";
  EXPECT_EQ(second.lesson()->kind, LessonKind::proposal);
  expect_resumes(GetParam(), settings, 4000, [](int i) { return i % 3 == 0; });
  const Truth truth = truth_of(GetParam(), 1'000'000, 347);
  EXPECT_LT(largest_t(runs_of(GetParam(), settings, 6000), truth), kLargestT);
}

TEST_P(ConditionalTest, IsExactFromALesson) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 341);
  const auto runs = taught_runs_of(GetParam(), with_seed(342), 6000);
  EXPECT_LT(largest_t(runs, truth), kLargestT);
  EXPECT_GE(covered(runs, OddsBasis::learned, truth.probability), 19);
  // From one lesson too, which serves any number of chains.
  ChainSettings settings = with_seed(343);
  settings.lesson = lesson_of(GetParam(), with_seed(344)).bytes;
  EXPECT_LT(largest_t(runs_of(GetParam(), settings, 6000), truth), kLargestT);
}

TEST_P(ConditionalTest, ResumedEqualsUninterrupted) {
  expect_resumes(GetParam(), with_seed(306), 8000, [](int) { return true; });
}

TEST(Conditional, TheLastDrawOfEachSeedIsADrawOfTheTarget) {
  for (const Height height : {Height::level, Height::stepped, Height::sloped})
    expect_last_draws_are_exact(height, with_seed(3100), 60, 60);
}

TEST(SlowConditional, IsExact) {
  for (const TwoModes& toy : all_two_modes()) {
    const Truth truth = truth_of(toy, 20'000'000, 311);
    const auto runs = runs_of(toy, with_seed(312), 60'000);
    EXPECT_LT(largest_t(runs, truth), kLargestT) << name_of(toy);
    EXPECT_GE(covered(runs, OddsBasis::learned, truth.probability), 19) << name_of(toy);
  }
}

TEST(SlowConditional, TheLastDrawOfEachSeedIsADrawOfTheTarget) {
  for (const Height height : {Height::level, Height::stepped, Height::sloped})
    expect_last_draws_are_exact(height, with_seed(313'000), 500, 200);
}

TEST(Conditional, GivesThePriorBackWhenEverythingSatisfies) {
  expect_the_prior_back({.seed = 321,
                         .method = Method::conditional,
                         .learning = {.hits = 20, .plain_hits = 3, .plain_draws = 0}},
                        kSeeds, 4000);
  expect_the_prior_back({.seed = 348, .method = Method::conditional}, kSeeds, 4000);
}

TEST(Conditional, ThrowsWhereThePriorIsNowhereInItsSupport) {
  expect_nowhere_throws(with_seed(322));
}

TEST(Conditional, LearningEndsByCountsOfDrawsToo) {
  // Hits that would never be enough: it ends after so many draws.
  const TwoModes toy;
  ChainSettings settings = with_seed(323);
  settings.learning = {.hits = 1'000'000, .plain_hits = 1e9, .draws = 1500, .plain_draws = 0};
  Chain chain(toy.target(), settings);
  ToySimulator simulator = toy.simulator();
  for (int i = 1; i < 1500; ++i) {
    chain.step(simulator);
    ASSERT_TRUE(chain.counts().is_learning) << i;
  }
  chain.step(simulator);
  EXPECT_FALSE(chain.counts().is_learning);
}

TEST(Conditional, WhereLocalMovesFailCountsNoLess) {
  // Half of what satisfies is fifty slits, which most local moves miss, half is wide. A State that a local
  // move does not leave has to count once more.
  const auto model = std::make_shared<const Model>(
      std::vector<Variable>{{.name = "x", .unit = "", .prior = Distribution::uniform(0, 1)}});
  const auto is_in_slit = [](double x) { return x < 0.5 && std::fmod(x, 0.01) < 0.005; };
  auto target = std::make_shared<Target>(
      *target_of(model, {{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact))}}));
  target->least_satisfied = 0;
  std::vector<double> shares;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Chain chain(target, {.seed = 330 + seed,
                         .method = Method::conditional,
                         .learning = {.hits = 20, .plain_hits = 5, .plain_draws = 0}});
    ToySimulator simulator(constant);
    simulator.satisfies = [&](const State& state) { return state[0] >= 0.75 || is_in_slit(state[0]); };
    StayGatherer gatherer;
    double in_slits = 0, all = 0;
    const auto add = [&](const Stay& stay) {
      all += static_cast<double>(stay.weight);
      in_slits += is_in_slit(stay.state[0]) ? static_cast<double>(stay.weight) : 0;
    };
    for (int i = 0; i < 30'000; ++i) {
      chain.step(simulator);
      gatherer.note(chain, add);
    }
    shares.push_back(in_slits / all);
  }
  EXPECT_LT(std::abs(z_of_mean(shares, 0.5)), kLargestT);
}

TEST(Conditional, ConstantsOfTheConstraintDoNotMatter) {
  // log_constraint is known up to a constant only: a thousand less, where exp() has nothing left, is the same
  // target.
  const TwoModes toy{.height = Height::sloped};
  const Truth truth = truth_of(toy, 1'000'000, 324);
  std::vector<Said> runs;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    ChainSettings settings = with_seed(325 + seed);
    Chain chain(toy.target(), settings);
    const LogConstraint plain = toy.log_constraint();
    ToySimulator simulator([&](const State& state) { return plain(state) - 1000; });
    simulator.satisfies = [](const State& state) { return TwoModes::part(state) != 0; };
    runs.push_back(run_of(chain, simulator, 6000));
  }
  EXPECT_LT(largest_t(runs, truth), kLargestT);
  EXPECT_GE(covered(runs, OddsBasis::learned, truth.probability), 19);
}

/// Past a thousand hits are thinned.
ChainSettings many_hits(std::uint64_t seed) {
  return {.seed = seed,
          .method = Method::conditional,
          .learning = {.hits = 1010, .plain_hits = 1, .plain_draws = 0}};
}

TEST(Conditional, ResumesWhereHitsAreThinned) {
  expect_resumes({.height = Height::sloped, .hazards = true}, many_hits(326), 6000,
                 [](int i) { return i % 101 == 0; });
}

TEST(SlowConditional, IsExactWhereHitsAreThinned) {
  const TwoModes toy{.height = Height::sloped, .hazards = true};
  const Truth truth = truth_of(toy, 20'000'000, 327);
  const auto runs = runs_of(toy, many_hits(328), 30'000);
  EXPECT_LT(largest_t(runs, truth), kLargestT);
  EXPECT_GE(covered(runs, OddsBasis::learned, truth.probability), 19);
}

// --- Where the prior finds nothing ----------------------------------------------------------------

TEST(Conditional, ALadderFindsWhatThePriorDoesNot) {
  const TwoModes toy = rare_toy();
  ChainSettings settings = rare_settings(331);
  Chain chain(toy.target(), settings);
  ToySimulator simulator = toy.simulator();
  ASSERT_EQ(chain.counts().kernels.at(3).name, "tempering");
  for (int i = 0; i < 30'000; ++i)
    ASSERT_FALSE(chain.step(simulator));
  EXPECT_EQ(chain.counts().kernels[3].proposed, 0u);
  int steps = 0;
  while (chain.counts().is_learning) {
    chain.step(simulator);
    ASSERT_LT(++steps, 400'000);
  }
  EXPECT_GT(chain.counts().kernels[3].proposed, 0u);
  EXPECT_GT(chain.counts().kernels[1].proposed, 0u);
}

TEST(SlowConditional, OddsOfARareWishCover) {
  const TwoModes toy = rare_toy();
  const double half_x = 0.15 / 130, half_y = 0.075 / 130;
  const double probability = (normal_cdf(-0.85 + half_x) - normal_cdf(-0.85 - half_x)) * 2 * half_y;
  ASSERT_LT(probability, 1e-6);
  int seen = 0;
  constexpr int kRareSeeds = 40;
  for (std::uint64_t seed = 0; seed < kRareSeeds; ++seed) {
    const Said said = run_of(toy, rare_settings(332 + seed), 120'000);
    const auto found = odds(said.odds);
    if (said.odds.basis != OddsBasis::learned || said.odds.hits < 20) continue;
    seen += found->low <= probability && probability <= found->high;
  }
  // With a true coverage of 95 % fewer than 33 of 40 are seen with probability 7e-4.
  EXPECT_GE(seen, 33);
}

TEST(Conditional, ResumesWithinTheLadderToo) {
  int tempered = 0;
  expect_resumes(rare_toy(), rare_settings(331), 120'000, [&](int i) {
    const bool interrupts = i < 29'990 ? i % 997 == 0 : i < 36'000 ? i % 3 == 0 : i % 401 == 0;
    tempered += interrupts && i > 30'000;
    return interrupts;
  });
  EXPECT_GT(tempered, 1000);
}

TEST(Conditional, EarlyRejectionChangesNothingWithinTheLadder) {
  expect_early_rejection_changes_nothing(rare_toy(), rare_settings(331), 120'000);
}

// --- Damage ---------------------------------------------------------------------------------------

TEST(Conditional, DamagedCheckpointsAreRefusedInEveryPhase) {
  ChainSettings settings = with_seed(341);
  settings.learning = {.hits = 12, .plain_hits = 1, .draws = 20'000, .plain_draws = 0};
  for (const bool rare : {false, true}) {
    settings.learning.draws = rare ? 45'000 : 20'000;
    const TwoModes toy = rare ? rare_toy() : TwoModes{.height = Height::sloped, .hazards = true};
    Chain chain(toy.target(), settings);
    ToySimulator simulator = toy.simulator();
    std::vector<std::string> checkpoints;
    if (!rare) checkpoints.push_back(chain.checkpoint());
    std::uint64_t tempered = 0;
    while (chain.counts().is_learning) {
      const std::string before = chain.checkpoint();
      chain.step(simulator);
      const std::uint64_t proposed = chain.counts().kernels[3].proposed;
      // Exploring, in the ladder, and the last of learning.
      if (chain.counts().iteration == 300 || (proposed > 500 && tempered == 0)) {
        tempered = proposed;
        checkpoints.push_back(before);
      }
      if (!chain.counts().is_learning) checkpoints.push_back(before);
      ASSERT_LT(chain.counts().iteration, 400'000u);
    }
    EXPECT_EQ(tempered > 0, rare);
    for (int i = 0; i < 100; ++i)
      chain.step(simulator);
    checkpoints.push_back(chain.checkpoint());
    for (const std::string& bytes : checkpoints)
      expect_survives_damage(toy, settings, bytes, 7);
  }
}

}  // namespace
}  // namespace retake::tests
