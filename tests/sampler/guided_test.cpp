// Chains that a world guides: exact whatever the kernels look at, the same with early rejection on or off and
// after any interruption. Each statistical comparison errs with probability 1e-6 unless it says more.
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/walk_checks.h"

namespace retake::tests {
namespace {

using Height = TwoModes::Height;

ChainSettings guided_settings(std::uint64_t seed) {
  return {.seed = seed, .method = Method::conditional};
}

/// Draws x and y around one of the modes, or within the mode where it is. Which mode is likelier depends on
/// what the Score says, so the way back depends on the candidate's.
class JumpByScore final : public ScoredKernel {
 public:
  explicit JumpByScore(bool stays_in_mode) : stays_in_mode_(stays_in_mode) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const std::size_t mode = random.bernoulli(share(current.state, current.score)) ? 0 : 1;
    candidate[TwoModes::kX] = kLow[mode][0] + kWidth[0] * random.uniform();
    candidate[TwoModes::kY] = kLow[mode][1] + kWidth[1] * random.uniform();
    return std::log(1 / (kWidth[0] * kWidth[1])) - log_density(current.state, current.score, candidate);
  }
  double log_hastings(const Model&, const Simulated& current, const Simulated& candidate) const override {
    return log_density(candidate.state, candidate.score, current.state) -
           log_density(current.state, current.score, candidate.state);
  }

 private:
  static constexpr std::array<std::array<double, 2>, 2> kLow = {{{1.0, 0.0}, {-1.2, 0.5}}};
  static constexpr std::array<double, 2> kWidth = {0.8, 0.3};
  double share(const State& from, const Score& score) const {
    if (stays_in_mode_) return TwoModes::part(from) == 1 ? 1 : 0;
    return score.log_constraint < -0.4 ? 0.25 : 0.7;
  }
  double log_density(const State& from, const Score& score, const State& to) const {
    const auto is_in = [&](std::size_t mode) {
      return to[TwoModes::kX] >= kLow[mode][0] && to[TwoModes::kX] < kLow[mode][0] + kWidth[0] &&
             to[TwoModes::kY] >= kLow[mode][1] && to[TwoModes::kY] < kLow[mode][1] + kWidth[1];
    };
    const double first = share(from, score);
    const double sum = (is_in(0) ? first : 0) + (is_in(1) ? 1 - first : 0);
    return std::log(sum / (kWidth[0] * kWidth[1]));
  }
  bool stays_in_mode_;
};

/// Any kernel that does not look at scores.
class Unscored final : public ScoredKernel {
 public:
  explicit Unscored(std::shared_ptr<const Kernel> kernel) : kernel_(std::move(kernel)) {}
  double propose(const Model& model, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    return kernel_->propose(model, current.state, candidate, random);
  }
  double log_hastings(const Model& model, const Simulated& current,
                      const Simulated& candidate) const override {
    return is_redraw() ? model.log_prior(current.state) - model.log_prior(candidate.state) : 0;
  }

 private:
  bool is_redraw() const { return dynamic_cast<const Redraw*>(kernel_.get()) != nullptr; }
  std::shared_ptr<const Kernel> kernel_;
};

/// Which States give animations that nobody would take for one.
enum class Differ { all, modes, none };

class ToyGuide final : public Guide {
 public:
  ToyGuide(const Model& model, bool stays_in_mode, Differ differ) : differ_(differ) {
    const auto unscored = [](auto kernel) {
      return std::make_shared<const Unscored>(std::make_shared<const decltype(kernel)>(std::move(kernel)));
    };
    const Perturb slope({{.variables = {TwoModes::kSlope}, .size = 1.2}});
    kernels_ = ScoredKernelTable(
        {{"jump", 1, std::make_shared<const JumpByScore>(stays_in_mode)},
         {"slope", 1, unscored(slope)},
         {"switch", 1, unscored(Redraw(model, {TwoModes::kSwitch, TwoModes::kGoverned}, Ratios::exact))}});
    soft_kernels_ = ScoredKernelTable({{"redraw", 2, unscored(Redraw::all(model, Ratios::exact))},
                                       {"jump", 1, std::make_shared<const JumpByScore>(stays_in_mode)},
                                       {"slope", 1, unscored(slope)}});
  }
  void begin(const Model& model, State& state, RandomStream& random) const override {
    do
      model.draw(random, state);
    while (model.log_prior(state) == -kInfinity);
  }
  void extend(const Model& model, const Simulated&, std::uint64_t, State& candidate,
              RandomStream& random) const override {
    model.draw(random, candidate);
  }
  bool keeps(const Simulated&, const Simulated& candidate) const override {
    return candidate.score.satisfied;
  }
  const ScoredKernelTable& kernels() const override { return kernels_; }
  const ScoredKernelTable& soft_kernels() const override { return soft_kernels_; }
  std::uint64_t sweep() const override { return 3; }
  bool differ(const Model&, const Simulated& a, const Simulated& b) const override {
    ++looks;
    const bool are_others = TwoModes::part(a.state) != TwoModes::part(b.state);
    const bool differ = differ_ == Differ::all || (differ_ == Differ::modes && are_others);
    renewals += differ ? 1 : 0;
    return differ;
  }

  mutable std::uint64_t looks = 0, renewals = 0;

 private:
  Differ differ_;
  ScoredKernelTable kernels_, soft_kernels_;
};

TwoModes guided(TwoModes toy, bool stays_in_mode = false, Differ differ = Differ::all) {
  toy.guide = std::make_shared<const ToyGuide>(*toy.target()->model, stays_in_mode, differ);
  return toy;
}

class GuidedTest : public ::testing::TestWithParam<TwoModes> {};
INSTANTIATE_TEST_SUITE_P(Toys, GuidedTest, ::testing::ValuesIn(all_two_modes()),
                         [](const auto& tested) { return name_of(tested.param); });

TEST_P(GuidedTest, IsExact) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 401);
  EXPECT_LT(largest_t(runs_of(guided(GetParam()), guided_settings(402), 30'000), truth), kLargestT);
}

TEST_P(GuidedTest, SoftStretchesReachWhatItsKernelsDoNot) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 403);
  EXPECT_LT(largest_t(runs_of(guided(GetParam(), true), guided_settings(404), 60'000), truth), kLargestT);
}

TEST_P(GuidedTest, EarlyRejectionChangesNothingButTheWork) {
  const TwoModes toy = guided(GetParam());
  expect_early_rejection_changes_nothing(toy, guided_settings(405), 6000);
}

TEST_P(GuidedTest, LearningWeighsNothing) {
  expect_learning_weighs_nothing(guided(GetParam()), guided_settings(406), 40'000, 4);
}

TEST_P(GuidedTest, LessonsTakeThePlaceOfLearning) {
  expect_lessons_take_the_place_of_learning(guided(GetParam()), guided_settings(440), LessonKind::place);
}

TEST_P(GuidedTest, IsExactFromALesson) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 441);
  EXPECT_LT(largest_t(taught_runs_of(guided(GetParam()), guided_settings(442), 30'000), truth), kLargestT);
}

TEST(Guided, GoesOnWhereAnotherOneNotedItsLastSample) {
  const TwoModes toy = guided({});
  Chain first(toy.target(), guided_settings(443));
  ToySimulator simulator = toy.simulator();
  while (first.counts().iteration < 1000 || first.counts().is_learning)
    first.step(simulator);
  ChainSettings settings = guided_settings(444);
  settings.lesson = first.lesson()->bytes;
  std::vector<State> simulated;
  simulator.observe = [&](const State& state, const SimulationRequest&) { simulated.push_back(state); };
  Chain second(toy.target(), settings);
  second.step(simulator);
  ASSERT_FALSE(simulated.empty());
  EXPECT_EQ(simulated.front(), first.stay().state);
}

TEST(Guided, LearnsAnewWhereThePlaceOfItsLessonDoesNotSatisfy) {
  const TwoModes toy = guided({});
  ChainSettings settings = guided_settings(445);
  settings.lesson = lesson_of(toy, guided_settings(446)).bytes;
  Chain chain(toy.target(), settings);
  ToySimulator simulator = toy.simulator();
  simulator.satisfies = [&](const State& state) {
    return TwoModes::part(state) != 0 && simulator.simulations > 1;
  };
  chain.step(simulator);
  EXPECT_TRUE(chain.counts().is_learning);
  while (chain.counts().is_learning)
    chain.step(simulator);
  EXPECT_TRUE(chain.lesson());
}

TEST_P(GuidedTest, ResumedEqualsUninterrupted) {
  expect_resumes(guided(GetParam()), guided_settings(407), 4000, [](int) { return true; });
}

// --- Metropolis mixes the soft kernels with the world's table ----------------------------------------

ChainSettings mixed(std::uint64_t seed) {
  return {.seed = seed, .method = Method::metropolis};
}

TEST_P(GuidedTest, MetropolisIsExactWithKernelsThatLookAtScores) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 410);
  EXPECT_LT(largest_t(runs_of(guided(GetParam()), mixed(411), 30'000), truth), kLargestT);
}

TEST_P(GuidedTest, MetropolisIsTheSameWithoutEarlyRejectionAndAfterInterruptions) {
  const TwoModes toy = guided(GetParam());
  expect_early_rejection_changes_nothing(toy, mixed(412), 3000);
  expect_resumes(toy, mixed(413), 1000, [](int) { return true; });
}

TEST(Guided, MetropolisTakesATenthOfItsIterationsFromTheTable) {
  const TwoModes toy = guided({});
  Chain chain(toy.target(), mixed(414));
  ToySimulator simulator = toy.simulator();
  constexpr int kSteps = 10'000;
  for (int i = 0; i < kSteps; ++i)
    chain.step(simulator);
  const std::vector<std::string> names = {"redraw", "soft_redraw", "soft_jump", "soft_slope"};
  const double shares[] = {0.1, 0.45, 0.225, 0.225};
  ASSERT_EQ(chain.counts().kernels.size(), names.size());
  for (std::size_t kernel = 0; kernel < 4; ++kernel) {
    EXPECT_EQ(chain.counts().kernels[kernel].name, names[kernel]);
    EXPECT_NEAR(static_cast<double>(chain.counts().kernels[kernel].proposed) / kSteps, shares[kernel], 0.03);
  }
}

// --- Checkpoints --------------------------------------------------------------------------------------

TEST(Guided, DamagedCheckpointsAreRefused) {
  const TwoModes toy = guided({.height = Height::sloped});
  for (const int iterations : {0, 1, 200, 1500}) {
    Chain chain(toy.target(), guided_settings(408));
    ToySimulator simulator = toy.simulator();
    for (int i = 0; i < iterations; ++i)
      chain.step(simulator);
    expect_survives_damage(toy, guided_settings(408), chain.checkpoint(), 1);
  }
}

// --- How long it burns in, and how far apart samples are -----------------------------------------------

/// Runs until a chain has burned in, and on to its second sample that counts. Returns what lies between the
/// two, in iterations.
std::uint64_t interval_of(Chain& chain, ToySimulator& simulator) {
  while (chain.counts().iteration == 0 || chain.counts().is_learning)
    chain.step(simulator);
  const std::uint64_t first = chain.counts().iteration;
  while (!chain.step(simulator)) {
  }
  return chain.counts().iteration - first;
}

TEST(Guided, BurnsInUntilTheAnimationHasChangedOftenEnough) {
  const TwoModes toy = guided({}, false, Differ::modes);
  const auto& guide = dynamic_cast<const ToyGuide&>(*toy.guide);
  Chain chain(toy.target(), guided_settings(447));
  ToySimulator simulator = toy.simulator();
  const std::uint64_t interval = interval_of(chain, simulator);
  EXPECT_GE(guide.renewals, 12u);
  ASSERT_LT(guide.renewals, guide.looks);
  // A look comes after five sweeps of satisfied States: every one is, but in soft stretches.
  const std::uint64_t looks = (4 * (guide.looks - guide.renewals) + guide.renewals) / guide.renewals;
  EXPECT_GT(looks, 1u);
  EXPECT_GE(interval, looks * 5 * 3);
}

TEST(Guided, IsNotWaitedForWithoutEndWhereNothingChanges) {
  const TwoModes toy = guided({}, false, Differ::none);
  Chain chain(toy.target(), guided_settings(448));
  ToySimulator simulator = toy.simulator();
  while (chain.counts().iteration == 0 || chain.counts().is_learning)
    chain.step(simulator);
  EXPECT_GE(chain.counts().iteration, 1000u * 3);
  EXPECT_LT(chain.counts().iteration, 1000u * 3 + 500);  // it had to find a first one
  EXPECT_EQ(chain.counts().samples, 2u) << "the first one, and the first that counts";
  EXPECT_GE(interval_of(chain, simulator), 40u * 5 * 3);
}

TEST(Guided, ALessonTellsHowFarApartSamplesHaveToBe) {
  const TwoModes toy = guided({}, false, Differ::none);
  ChainSettings settings = guided_settings(449);
  settings.lesson = lesson_of(toy, guided_settings(450)).bytes;
  Chain chain(toy.target(), settings);
  ToySimulator simulator = toy.simulator();
  while (!chain.step(simulator)) {
  }
  EXPECT_GE(chain.counts().iteration, 40u * 5 * 3);
}

TEST_P(GuidedTest, IsExactAndResumesWhereAnimationsChangeSeldom) {
  const Truth truth = truth_of(GetParam(), 1'000'000, 451);
  const TwoModes toy = guided(GetParam(), false, Differ::modes);
  EXPECT_LT(largest_t(runs_of(toy, guided_settings(452), 60'000), truth), kLargestT);
  expect_early_rejection_changes_nothing(toy, guided_settings(453), 6000);
  expect_resumes(toy, guided_settings(454), 3000, [](int) { return true; });
}

TEST(Guided, WhatItMetLastIsNotShownBeforeItIsNoted) {
  // Samples come at fixed intervals; between them the walk moves on unseen.
  const TwoModes toy = guided({});
  Chain chain(toy.target(), guided_settings(409));
  ToySimulator simulator = toy.simulator();
  while (chain.counts().iteration == 0 || chain.counts().is_learning)
    chain.step(simulator);
  std::uint64_t last = 0, told = 0;
  for (int i = 0; i < 3000; ++i) {
    const bool is_new = chain.step(simulator);
    const Stay& stay = chain.stay();
    EXPECT_TRUE(stay.is_sample);
    if (!is_new) continue;
    EXPECT_EQ(stay.iteration, chain.counts().iteration);
    if (told > 0) {
      EXPECT_GE(stay.iteration - last, 15u);
    }
    last = stay.iteration;
    ++told;
  }
  EXPECT_GT(told, 20u);
}

}  // namespace
}  // namespace retake::tests
