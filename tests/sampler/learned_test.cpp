// LearnedRedraw: what it draws has the density that it says, its weights are bounded, and it learns what
// matters. Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include "sampler/learned.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/conditional.h"
#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

enum Variables : std::size_t { kStart, kSpeed, kAngle, kNuisance, kSwitch, kGoverned };

/// What matters is where a ball arrives: start + 0.5 angle speed, near a mark. Half of the prior is refused.
struct AimToy {
  Model model{{{.name = "start", .unit = "m", .prior = Distribution::uniform(-1, 1)},
               {.name = "speed", .unit = "m/s", .prior = Distribution::gaussian(2, 0.5)},
               {.name = "angle", .unit = "rad", .prior = Distribution::gaussian(0, 0.7)},
               {.name = "nuisance", .unit = "", .prior = Distribution::gaussian(3, 2)},
               {.name = "switch", .unit = "", .prior = Distribution::on_off(0.4)},
               {.name = "governed", .unit = "", .prior = Distribution::uniform(0, 2), .switch_index = 4}},
              [](const State& state) { return state[kSpeed] + 0.3 * state[kNuisance] > 2.4; }};
  static double shift(const State& state) { return 0.5 * state[kAngle] * state[kSpeed]; }
  static bool satisfied(const State& state) {
    return std::abs(state[kStart] + shift(state) - 0.6) < 0.03 && state[kAngle] > 0;
  }
  /// With start as it is, or as where it leads; the coordinate that is shifted comes last.
  Block block(bool shifted) const {
    if (!shifted) return Block(model, {});
    return Block(model, {{.variable = kAngle},
                         {.variable = kNuisance},
                         {.variable = kSpeed},
                         {.variable = kStart, .shift = shift}});
  }
  std::vector<WeighedState> hits(std::size_t count, std::uint64_t seed) const {
    std::vector<WeighedState> found;
    RandomStream random = stream(seed);
    State state;
    while (found.size() < count) {
      model.draw(random, state);
      if (model.log_prior(state) != -kInfinity && satisfied(state)) found.push_back({.state = state});
    }
    return found;
  }
};

/// Functions of a State whose prior means are compared with weighted means of draws.
std::vector<double> functions(const State& state) {
  const double governed = state[kSwitch] == 1 ? state[kGoverned] : -1;
  return {1,
          state[kStart],
          state[kSpeed],
          state[kAngle],
          state[kNuisance],
          state[kSwitch],
          governed,
          state[kStart] * state[kAngle],
          state[kAngle] * state[kAngle],
          std::abs(state[kStart] + AimToy::shift(state)),
          AimToy::satisfied(state) ? 10.0 : 0.0,
          AimToy::satisfied(state) ? 10 * state[kNuisance] : 0.0};
}

class LearnedRedrawTest : public ::testing::TestWithParam<bool> {
 protected:
  const AimToy toy;
  const Block block = toy.block(GetParam());
  LearnedRedraw learned(std::size_t count = 60) const {
    RandomStream random = stream(221, 0, Purpose::learning);
    return LearnedRedraw::learn(block, toy.hits(count, 222), {.most_kernels = 40, .plain_hits = 20}, random);
  }
  void expect_density_agrees_with_draws(const LearnedRedraw& redraw, std::uint64_t seed) const;
};

INSTANTIATE_TEST_SUITE_P(Blocks, LearnedRedrawTest, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "Shifted" : "Plain"; });

/// If the draws have density q, then E_q[w f, within the support] = E_p[f, within the support] for every f.
void LearnedRedrawTest::expect_density_agrees_with_draws(const LearnedRedraw& redraw,
                                                         std::uint64_t seed) const {
  constexpr int kDraws = 150'000;
  std::vector<std::vector<double>> weighted, plain;
  RandomStream by_q = stream(seed), by_p = stream(seed + 1);
  State state;
  for (int i = 0; i < kDraws; ++i) {
    redraw.draw(block, by_q, state);
    double weight = 0;
    if (toy.model.log_prior(state) != -kInfinity) {
      weight = std::exp(redraw.log_weight(block, state));
      ASSERT_LE(weight, (1 + 1e-12) / redraw.prior_share());
      ASSERT_GT(weight, 0);
    }
    const std::vector<double> by_q_values = weight > 0 ? functions(state) : std::vector<double>(12, 0.0);
    toy.model.draw(by_p, state);
    const bool valid = toy.model.log_prior(state) != -kInfinity;
    const std::vector<double> by_p_values = functions(state);
    weighted.resize(by_q_values.size());
    plain.resize(by_p_values.size());
    for (std::size_t f = 0; f < by_q_values.size(); ++f) {
      weighted[f].push_back(weight * by_q_values[f]);
      plain[f].push_back(valid ? by_p_values[f] : 0);
    }
  }
  for (std::size_t f = 0; f < weighted.size(); ++f)
    EXPECT_LT(std::abs(z_of_means(weighted[f], plain[f])), kLargestZ) << f;
}

TEST_P(LearnedRedrawTest, DrawAndDensityAgree) {
  const LearnedRedraw redraw = learned();
  ASSERT_GT(redraw.kernels(), 1u);
  ASSERT_GT(redraw.widths().maxCoeff(), 0) << "something was learned";
  expect_density_agrees_with_draws(redraw, 223);
}

TEST_P(LearnedRedrawTest, ALocalMoveLeavesItAsItIs) {
  constexpr int kDraws = 10'000, kSteps = 3;
  const LearnedRedraw redraw = learned();
  const LearnedLocalMove move(block, redraw);
  std::vector<std::vector<double>> changes;
  RandomStream random = stream(226);
  State state, candidate;
  int moves = 0;
  for (int i = 0; i < kDraws; ++i) {
    do
      redraw.draw(block, random, state);
    while (toy.model.log_prior(state) == -kInfinity);
    const std::vector<double> before = functions(state);
    for (int step = 0; step < kSteps; ++step) {
      candidate = state;
      const double log_hastings = move.propose(toy.model, state, candidate, random);
      const double log_ratio = toy.model.log_prior(candidate) - toy.model.log_prior(state) + log_hastings;
      if (!(std::log(random.uniform()) < log_ratio)) continue;
      std::swap(state, candidate);
      ++moves;
    }
    const std::vector<double> after = functions(state);
    changes.resize(after.size());
    for (std::size_t f = 1; f < after.size(); ++f)  // the first is constant
      changes[f].push_back(after[f] - before[f]);
  }
  EXPECT_GT(moves, kDraws / 2);
  for (std::size_t f = 1; f < changes.size(); ++f)
    EXPECT_LT(std::abs(z_of_mean(changes[f], 0)), kLargestZ) << f;
}

TEST_P(LearnedRedrawTest, IsTheSameAfterWritingAndReading) {
  const LearnedRedraw redraw = learned();
  ByteWriter out;
  redraw.write(out);
  ByteReader in(out.bytes());
  const LearnedRedraw read = LearnedRedraw::read(in, block);
  EXPECT_TRUE(in.at_end());
  EXPECT_EQ(read.widths(), redraw.widths());
  EXPECT_EQ(read.kernels(), redraw.kernels());
  EXPECT_EQ(read.prior_share(), redraw.prior_share());
  EXPECT_EQ(read.mean_weight(), redraw.mean_weight());
  EXPECT_EQ(read.drawn_weight(), redraw.drawn_weight());
  RandomStream left = stream(225), right = stream(225);
  State a, b;
  for (int i = 0; i < 5000; ++i) {
    redraw.draw(block, left, a);
    read.draw(block, right, b);
    ASSERT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * toy.model.size()), 0) << i;
    if (toy.model.log_prior(a) == -kInfinity) continue;
    ASSERT_EQ(redraw.log_weight(block, a), read.log_weight(block, b)) << i;
  }
}

TEST_P(LearnedRedrawTest, DamagedBytesAreRefused) {
  ByteWriter out;
  learned().write(out);
  const std::string bytes = out.bytes();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ByteReader in(std::string_view(bytes).substr(0, length));
    ASSERT_THROW(LearnedRedraw::read(in, block), std::out_of_range) << length;
  }
  const Block other(toy.model, {{.variable = kAngle}});
  ByteReader in(bytes);
  EXPECT_THROW(LearnedRedraw::read(in, other), std::out_of_range);
}

TEST_P(LearnedRedrawTest, FindsANarrowRegionMoreOften) {
  const auto rate = [&](const LearnedRedraw& redraw, double& sum) {
    RandomStream random = stream(226);
    State state;
    int hits = 0;
    sum = 0;
    for (int i = 0; i < 100'000; ++i) {
      redraw.draw(block, random, state);
      if (toy.model.log_prior(state) == -kInfinity || !AimToy::satisfied(state)) continue;
      ++hits;
      sum += std::exp(redraw.log_weight(block, state));
    }
    return hits;
  };
  double by_prior = 0, by_learned = 0;
  const int hits_of_prior = rate(LearnedRedraw(), by_prior);
  const int hits_of_learned = rate(learned(200), by_learned);
  EXPECT_EQ(by_prior, hits_of_prior) << "a draw from the prior weighs 1";
  EXPECT_GT(hits_of_prior, 300);
  EXPECT_GT(hits_of_learned, (GetParam() ? 4 : 2) * hits_of_prior);
  // And the odds stay: 5 standard errors of the prior's count.
  EXPECT_NEAR(by_learned, by_prior, 6 * std::sqrt(by_prior));
}

TEST_P(LearnedRedrawTest, TakesThePriorForWhatDoesNotMatter) {
  // The shifted start is settled before the others: its width is narrow. What is left out of the shifted
  // block has no width at all.
  const Eigen::VectorXd widths = learned(300).widths();
  for (std::size_t j = 0; j < block.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    if (block.coordinates()[j].shift) {
      EXPECT_LT(widths[row], 0.1);
    }
    // Independent of what satisfies, though it goes with speed for the support's sake.
    if (block.coordinates()[j].variable == kNuisance) {
      EXPECT_EQ(widths[row], 0);
    }
  }
}

TEST(LearnedRedraw, TheFitDoesWithoutAnyVariableThatDoesNotMatter) {
  // One narrow Variable of four.
  const auto model = gaussian_model(4);
  const Block block(*model, {});
  std::vector<WeighedState> hits;
  RandomStream random = stream(227), learning = stream(227, 0, Purpose::learning);
  while (hits.size() < 300) {
    State state;
    model->draw(random, state);
    state[1] = 1.5 + 0.01 * state[1];
    hits.push_back({.state = state});
  }
  const LearnedRedraw redraw = LearnedRedraw::learn(block, hits, {.sweeps = 2, .plain_hits = 300}, learning);
  EXPECT_EQ(redraw.widths()[0], 0);
  EXPECT_GT(redraw.widths()[1], 0);
  EXPECT_LT(redraw.widths()[1], 0.02);
  EXPECT_EQ(redraw.widths()[2], 0);
  EXPECT_EQ(redraw.widths()[3], 0);
  EXPECT_LT(redraw.mean_weight(), 0.1);
  EXPECT_LE(redraw.kernels(), 230u);
}

TEST(LearnedRedraw, KeepsMoreOfThePriorTheFewerItsHitsWere) {
  const AimToy toy;
  const Block block = toy.block(true);
  const auto share = [&](double plain_hits) {
    RandomStream learning = stream(228, 0, Purpose::learning);
    return LearnedRedraw::learn(block, toy.hits(100, 229), {.plain_hits = plain_hits}, learning)
        .prior_share();
  };
  EXPECT_GT(share(1), share(1000));
  EXPECT_GE(share(1), 0.5);
  EXPECT_LE(share(1000), 0.3);
}

TEST(LearnedRedraw, OfHitsThatAgreeToTheLastBitStillWeighs) {
  const AimToy toy;
  const Block block = toy.block(false);
  const std::vector<WeighedState> hits(10, toy.hits(1, 230)[0]);
  RandomStream learning = stream(231), random = stream(232);
  const LearnedRedraw redraw = LearnedRedraw::learn(block, hits, {}, learning);
  State state;
  double sum = 0;
  for (int i = 0; i < 20000; ++i) {
    redraw.draw(block, random, state);
    if (toy.model.log_prior(state) == -kInfinity) continue;
    const double weight = std::exp(redraw.log_weight(block, state));
    ASSERT_LE(weight, (1 + 1e-12) / redraw.prior_share());
    sum += weight;
  }
  // P(speed + 0.3 nuisance > 2.4) of a Gaussian of mean 2.9 and variance 0.61.
  EXPECT_NEAR(sum / 20000, normal_cdf(0.5 / std::sqrt(0.61)), 0.03);
}

TEST(LearnedRedraw, ThePriorWeighsOne) {
  const AimToy toy;
  const LearnedRedraw prior;
  EXPECT_TRUE(prior.is_prior());
  EXPECT_EQ(prior.kernels(), 0u);
  EXPECT_EQ(prior.prior_share(), 1);
  RandomStream left = stream(233), right = stream(233);
  State a, b;
  for (int i = 0; i < 1000; ++i) {
    prior.draw(toy.block(true), left, a);
    toy.model.draw(right, b);
    ASSERT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * toy.model.size()), 0);
    ASSERT_EQ(prior.log_weight(toy.block(true), a), 0);
  }
}

// --- thin -----------------------------------------------------------------------------------------

std::vector<WeighedState> weighed(std::size_t count, RandomStream& random) {
  std::vector<WeighedState> states;
  for (std::size_t i = 0; i < count; ++i)
    states.push_back({.state = State::Constant(1, random.gaussian()),
                      .weight = std::exp(1.5 * random.gaussian()) + (i % 50 == 0 ? 30 : 0)});
  return states;
}

TEST(Thin, KeepsSumsInTheMeanAndTheSize) {
  RandomStream random = stream(234);
  const std::vector<WeighedState> all = weighed(1000, random);
  const auto sums = [](const std::vector<WeighedState>& states) {
    std::array<double, 3> of{};
    for (const WeighedState& state : states) {
      of[0] += state.weight;
      of[1] += state.weight * state.state[0];
      of[2] += state.weight * state.state[0] * state.state[0];
    }
    return of;
  };
  const auto truth = sums(all);
  double least = kInfinity;
  for (const WeighedState& state : all)
    least = std::min(least, state.weight);
  std::array<std::vector<double>, 3> thinned_sums;
  std::vector<double> sizes;
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    RandomStream draws = stream(235, seed);
    const auto thinned = thin(all, 200, draws);
    sizes.push_back(static_cast<double>(thinned.size()));
    // All that were raised to a common weight weigh the same, and nothing weighs less.
    double lowest = kInfinity;
    for (const WeighedState& state : thinned)
      lowest = std::min(lowest, state.weight);
    ASSERT_GT(lowest, least);
    const auto of = sums(thinned);
    for (std::size_t f = 0; f < of.size(); ++f)
      thinned_sums[f].push_back(of[f]);
  }
  for (std::size_t f = 0; f < truth.size(); ++f)
    EXPECT_LT(std::abs(z_of_mean(thinned_sums[f], truth[f])), kLargestZ) << f;
  EXPECT_LT(std::abs(z_of_mean(sizes, 200)), kLargestZ);
}

TEST(Thin, LeavesFewAsTheyAre) {
  RandomStream random = stream(236);
  const auto all = weighed(50, random);
  const auto kept = thin(all, 50, random);
  ASSERT_EQ(kept.size(), 50u);
  for (std::size_t i = 0; i < kept.size(); ++i)
    EXPECT_EQ(kept[i].weight, all[i].weight);
}

TEST(Thin, OfEqualWeightsKeepsEachAlike) {
  std::vector<WeighedState> all;
  for (int i = 0; i < 30; ++i)
    all.push_back({.state = State::Constant(1, i)});
  std::vector<double> kept(30, 0);
  double total = 0;
  for (std::uint64_t seed = 0; seed < 9000; ++seed) {
    RandomStream draws = stream(237, seed);
    for (const WeighedState& state : thin(all, 10, draws)) {
      EXPECT_NEAR(state.weight, 3, 1e-9);
      ++kept[static_cast<std::size_t>(state.state[0])];
      ++total;
    }
  }
  // Counts of independent Bernoulli trials: a third of them, each with variance 2/9 of the trials.
  double statistic = 0;
  for (const double count : kept)
    statistic += (count - 3000) * (count - 3000) / (9000 * 2.0 / 9);
  EXPECT_GT(chi_square_p(statistic, 30), kErrorRate);
  EXPECT_LT(std::abs(z_of_share(total, 30 * 9000.0, 1 / 3.0)), kLargestZ);
}

}  // namespace
}  // namespace retake::tests
