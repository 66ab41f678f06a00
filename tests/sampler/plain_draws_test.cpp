// Plain draws: how a conditional chain counts what chance finds, and does not learn what chance finds often.
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/walk_checks.h"

namespace retake::tests {
namespace {

/// x is uniform on [0, 1]; up to `share` of it satisfies, with p_c = exp(-steepness x).
struct Slope {
  double share = 0.3;
  double steepness = 0;

  std::shared_ptr<const Target> target() const {
    const auto model = std::make_shared<const Model>(
        std::vector<Variable>{{.name = "x", .unit = "", .prior = Distribution::uniform(0, 1)}});
    const auto redraw = std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact));
    auto target = std::make_shared<Target>(*target_of(model, {{"redraw", 1, redraw}}));
    if (steepness == 0) target->least_satisfied = 0;
    return target;
  }
  ToySimulator simulator() const {
    ToySimulator simulator([*this](const State& state) { return -steepness * state[0]; });
    simulator.satisfies = [*this](const State& state) { return state[0] < share; };
    return simulator;
  }
  /// Of x, given that it satisfies.
  double mean() const {
    if (steepness == 0) return 0.5 * share;
    const double end = std::exp(-steepness * share);
    return 1 / steepness - share * end / (1 - end);
  }
};

ChainSettings plainly(std::uint64_t seed, Method method = Method::conditional) {
  return {.seed = seed, .method = method};
}

/// Means of x by 24 seeds, of as many iterations each.
std::vector<double> means_of(const Slope& slope, std::uint64_t seed, int iterations) {
  std::vector<double> means;
  for (std::uint64_t i = 0; i < kSeeds; ++i) {
    Chain chain(slope.target(), plainly(seed + i));
    ToySimulator simulator = slope.simulator();
    StayGatherer gatherer;
    double sum = 0, all = 0;
    const auto add = [&](const Stay& stay) {
      sum += static_cast<double>(stay.weight) * stay.state[0];
      all += static_cast<double>(stay.weight);
    };
    for (int step = 0; step < iterations; ++step) {
      chain.step(simulator);
      gatherer.note(chain, add);
    }
    gatherer.finish(add);
    means.push_back(sum / all);
  }
  return means;
}

TEST(PlainDraws, WhatIsCommonIsNotLearned) {
  const Slope slope;
  Chain chain(slope.target(), plainly(349));
  ToySimulator simulator = slope.simulator();
  std::uint64_t hits = 0;
  for (int i = 1; i <= 1000; ++i) {
    hits += chain.step(simulator);
    ASSERT_EQ(chain.counts().samples, hits);
    if (hits > 0) {
      ASSERT_EQ(chain.stay().weight, 1u) << "as with rejection";
    }
    ASSERT_EQ(chain.counts().is_learning, i < 64) << i;
    ASSERT_FALSE(chain.lesson()) << "there is nothing to know";
  }
  EXPECT_EQ(chain.counts().kernels[1].proposed, 0u);
  EXPECT_EQ(chain.counts().odds.basis, OddsBasis::rejection);
  EXPECT_EQ(chain.counts().odds.draws, 1000u);
  EXPECT_EQ(chain.counts().odds.hits, hits);
}

TEST(PlainDraws, WhatIsFoundBeforeLearningCounts) {
  for (const double steepness : {0.0, 6.0}) {
    const Slope slope{.share = 0.4, .steepness = steepness};
    EXPECT_LT(std::abs(z_of_mean(means_of(slope, 350, 60), slope.mean())), kLargestT) << steepness;
    EXPECT_LT(std::abs(z_of_mean(means_of(slope, 350, 4000), slope.mean())), kLargestT) << steepness;
  }
  // Hardly any draw counts where p_c is small everywhere: it has to be learned.
  const Slope faint{.share = 1, .steepness = 40};
  Chain chain(faint.target(), plainly(351));
  ToySimulator simulator = faint.simulator();
  for (int i = 0; i < 3000; ++i)
    chain.step(simulator);
  EXPECT_EQ(chain.counts().odds.basis, OddsBasis::learned);
  EXPECT_LT(std::abs(z_of_mean(means_of(faint, 352, 4000), faint.mean())), kLargestT);
}

/// Of a share below the limit, a seed whose first draws say that it is common.
std::uint64_t misled_seed(const Slope& slope) {
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Chain chain(slope.target(), plainly(seed));
    ToySimulator simulator = slope.simulator();
    for (int i = 0; i < 64; ++i)
      chain.step(simulator);
    if (!chain.counts().is_learning) return seed;
  }
  throw std::runtime_error("no seed is misled");
}

TEST(PlainDraws, AFirstLookThatWasWrongIsMended) {
  const Slope slope{.share = 0.07};
  const std::uint64_t seed = misled_seed(slope);
  Chain chain(slope.target(), plainly(seed)), resumed(slope.target(), plainly(seed));
  ToySimulator simulator = slope.simulator(), fresh = slope.simulator();
  bool learned = false, sampled = false;
  for (int i = 0; i < 10'000; ++i) {
    chain.step(simulator);
    if (i % 7 == 0) resumed = Chain(slope.target(), plainly(seed), resumed.checkpoint());
    resumed.step(fresh);
    ASSERT_EQ(chain.checkpoint(), resumed.checkpoint()) << i;
    if (i > 64) learned |= chain.counts().is_learning;
    sampled |= learned && !chain.counts().is_learning;
  }
  EXPECT_TRUE(sampled);
  EXPECT_EQ(chain.lesson()->kind, LessonKind::proposal);
  const auto found = odds(chain.counts().odds);
  EXPECT_EQ(chain.counts().odds.basis, OddsBasis::learned);
  EXPECT_TRUE(found->low < 0.07 && 0.07 < found->high);
}

TEST(PlainDraws, EarlyRejectionChangesNothingOfPlainDraws) {
  for (const Slope& slope : {Slope{}, Slope{.share = 0.3, .steepness = 3}, Slope{.share = 0.07}}) {
    ChainSettings settings = plainly(353);
    Chain on(slope.target(), settings);
    settings.early_rejection = false;
    Chain off(slope.target(), settings);
    ToySimulator simulator_on = slope.simulator(), simulator_off = slope.simulator();
    for (int i = 0; i < 4000; ++i) {
      ASSERT_EQ(on.step(simulator_on), off.step(simulator_off)) << i;
      ASSERT_EQ(without_work(on.checkpoint()), without_work(off.checkpoint())) << i;
    }
  }
}

TEST(PlainDraws, MethodsOfOneSeedDoNotFindTheSame) {
  const Slope slope;
  std::vector<double> found;
  for (const Method method : {Method::rejection, Method::conditional, Method::metropolis}) {
    Chain chain(slope.target(), plainly(354, method));
    ToySimulator simulator = slope.simulator();
    for (int i = 0; i < 200; ++i)
      if (chain.step(simulator)) found.push_back(chain.stay().state[0]);
  }
  std::sort(found.begin(), found.end());
  EXPECT_GT(found.size(), 150u);
  EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
}

}  // namespace
}  // namespace retake::tests
