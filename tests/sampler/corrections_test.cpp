// The ratios that the paper gets wrong and what is right: doc/design.md, section 3, one group of tests a
// correction (the fourth, A.1's product, is in model_test.cpp). Seeds are fixed; each statistical comparison
// errs with probability 1e-6 unless it says otherwise. "Visibly wrong" means a p-value below 1e-12.
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

constexpr double kVisiblyWrong = 1e-12;

// --- 1. Switching balls (B.2) --------------------------------------------------------------------

/// A state of switch_model(4, width) with the first `on` balls on.
State balls_on(std::size_t on, double width) {
  State state(8);
  for (std::size_t ball = 0; ball < 4; ++ball) {
    at(state, 2 * ball) = ball < on ? 1 : 0;
    at(state, 2 * ball + 1) = ball < on ? 0.5 * width : kAbsent;
  }
  return state;
}

double count_on(const State& state) {
  return state[0] + state[2] + state[4] + state[6];
}

TEST(Correction1Toggle, LogHastingsIsTheExactFormula) {
  constexpr double kBalls = 4, kProbability = 0.3, kArea = 0.02;
  const auto model = switch_model(4, kArea);
  const Toggle toggle(*model, switches_of(*model), kProbability, Ratios::exact);
  std::array<std::array<int, 5>, 5> seen{};
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    const std::size_t on = seed % 5;
    const State current = balls_on(on, kArea);
    State candidate = current;
    RandomStream random = stream(31, seed);
    const double log_hastings = toggle.propose(*model, current, candidate, random);
    const double n = static_cast<double>(on), after = count_on(candidate);
    ++seen[on][static_cast<std::size_t>(after)];
    if (after < n) {
      const double j = n - after;
      ASSERT_NEAR(log_hastings, (kBalls - 2 * n + j) * std::log(1 - kProbability) - j * std::log(kArea),
                  1e-12);
    } else if (after > n) {
      const double j = after - n;
      ASSERT_NEAR(log_hastings, (2 * n - kBalls + j) * std::log(1 - kProbability) + j * std::log(kArea),
                  1e-12);
    }
    ASSERT_EQ(std::isfinite(model->log_prior(candidate)), true);
  }
  // Every change has been seen: the rarest, all four at once, has probability 0.004 and 800 tries.
  for (std::size_t from = 0; from < 5; ++from)
    for (std::size_t to = 0; to < 5; ++to)
      EXPECT_GT(seen[from][to], 0) << from << " to " << to;
}

TEST(Correction1Toggle, LogHastingsHasAValueWorkedOutByHand) {
  // Three of four balls on, one of them switched off; t = 1/4, a = 1/100. Forward 1/2 * 1/4 * (3/4)^2; back
  // 1/2 * (1/4 * 3/4) of the two that are then off, and density 100: a ratio of 100 / (3/4).
  const auto model = switch_model(4, 0.01);
  const Toggle toggle(*model, switches_of(*model), 0.25, Ratios::exact);
  const State current = balls_on(3, 0.01);
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    State candidate = current;
    RandomStream random = stream(32, seed);
    const double log_hastings = toggle.propose(*model, current, candidate, random);
    if (count_on(candidate) != 2) continue;
    EXPECT_NEAR(log_hastings, 4.892852258439873, 1e-12);
    return;
  }
  FAIL() << "no ball was switched off in 100 proposals";
}

/// p-values of "all 16 patterns are equally likely" and "the number on is Binomial(4, 1/2)" on a constant
/// target.
std::pair<double, double> patterns_of_chain(Ratios ratios, double width) {
  constexpr int kDraws = 8000, kThinning = 50;  // the pattern forgets itself in about 5 iterations
  const auto model = switch_model(4, width);
  const auto target = target_of(
      model, {{"toggle", 1, std::make_shared<const Toggle>(*model, switches_of(*model), 0.25, ratios)}});
  Chain chain(target, {.seed = 33});
  ToySimulator simulator(constant);
  std::vector<double> patterns(16, 0), counts(5, 0);
  for (int draw = 0; draw < kDraws; ++draw) {
    for (int i = 0; i < kThinning; ++i)
      chain.step(simulator);
    std::size_t pattern = 0;
    for (std::size_t ball = 0; ball < 4; ++ball)
      if (at(chain.stay().state, 2 * ball) == 1) pattern |= std::size_t{1} << ball;
    ++patterns[pattern];
    ++counts[static_cast<std::size_t>(count_on(chain.stay().state))];
  }
  std::vector<double> binomial;
  for (const double ways : {1, 4, 6, 4, 1})
    binomial.push_back(kDraws * ways / 16);
  return {chi_square_p(patterns, std::vector<double>(16, kDraws / 16.0)), chi_square_p(counts, binomial)};
}

TEST(Correction1Toggle, EveryPatternOfFourBallsIsEquallyLikelyOnAConstantTarget) {
  for (const double width : {1.0, 0.05, 40.0}) {
    const auto [patterns, counts] = patterns_of_chain(Ratios::exact, width);
    EXPECT_GT(patterns, kErrorRate) << width;
    EXPECT_GT(counts, kErrorRate) << width;
  }
}

TEST(Correction1Toggle, ThePrintedRatioLacksTheBinomialFactorAndIsUpsideDown) {
  // Width 1 shows the missing factor alone, since a = 1; the other width shows the ratio upside down.
  for (const double width : {1.0, 0.05}) {
    const auto [patterns, counts] = patterns_of_chain(Ratios::paper, width);
    EXPECT_LT(patterns, kVisiblyWrong) << width;
    EXPECT_LT(counts, kVisiblyWrong) << width;
  }
}

// --- 2. Sampling new values for all variables ------------------------------------------------------

TEST(Correction2Redraw, LogHastingsCancelsThePrior) {
  const auto model = rich_model();
  const std::vector<std::size_t> block{0, 1, 2, 5, 8};
  const Redraw all = Redraw::all(*model, Ratios::exact), some(*model, block, Ratios::exact);
  RandomStream random = stream(34);
  State current, candidate;
  for (int i = 0; i < 2000; ++i) {
    model->draw(random, current);
    for (const Kernel* kernel : {static_cast<const Kernel*>(&all), static_cast<const Kernel*>(&some)}) {
      candidate = current;
      const double log_hastings = kernel->propose(*model, current, candidate, random);
      ASSERT_NEAR(log_hastings, model->log_prior(current) - model->log_prior(candidate), 1e-12);
    }
  }
}

/// What a chain that redraws a wide Gaussian demands of candidates, less what p_c alone would demand.
std::vector<double> excess_of_demands(Ratios ratios) {
  const auto model = gaussian_model(3);
  const auto target =
      target_of(model, {{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, ratios))}});
  constexpr std::uint64_t kSeed = 35;
  Chain chain(target, {.seed = kSeed, .early_rejection = true});
  ToySimulator simulator([](const State& state) { return -0.1 * state.squaredNorm(); });
  std::vector<double> excess;
  simulator.observe = [&](const State&, const SimulationRequest& request) {
    if (request.needed == -kInfinity) return;  // the initial State
    const double log_u = std::log(stream(kSeed, chain.counts().iteration, Purpose::acceptance).uniform());
    excess.push_back(request.needed - (chain.stay().score.log_constraint + log_u));
  };
  for (int i = 0; i < 5000; ++i)
    chain.step(simulator);
  return excess;
}

TEST(Correction2Redraw, AcceptanceDependsOnTheConstraintAlone) {
  const std::vector<double> excess = excess_of_demands(Ratios::exact);
  ASSERT_GT(excess.size(), 1000u);
  for (const double value : excess)
    ASSERT_NEAR(value, 0, 1e-10);
}

TEST(Correction2Redraw, ThePaperMultipliesByThePriorAgain) {
  const std::vector<double> excess = excess_of_demands(Ratios::paper);
  double largest = 0;
  for (const double value : excess)
    largest = std::max(largest, std::abs(value));
  EXPECT_GT(largest, 1);
}

// --- 3. Fresh offsets --------------------------------------------------------------------------------

TEST(Correction3FreshOffsets, HaveTheDensityThatThePriorSays) {
  // E log p of a 3-D Gaussian vertex is -3/2 below its peak.
  constexpr double kSize = 0.1;
  const auto vertex = gaussian_model(3, kSize);
  const double peak = -3 * std::log(kSize) - 1.5 * std::log(2 * M_PI);
  const Redraw redraw = Redraw::all(*vertex, Ratios::exact);
  RandomStream random = stream(36);
  std::vector<double> fresh, by_direction;
  State current = State::Zero(3), candidate = current;
  for (int i = 0; i < 20000; ++i) {
    redraw.propose(*vertex, current, candidate, random);
    fresh.push_back(vertex->log_prior(candidate) - peak);
    // As appendix B.1 words it: a random direction, by a Gaussian distance.
    for (double& value : candidate)
      value = random.gaussian();
    candidate *= kSize * random.gaussian() / candidate.norm();
    by_direction.push_back(vertex->log_prior(candidate) - peak);
  }
  EXPECT_LT(std::abs(z_of_mean(fresh, -1.5)), kLargestZ);
  EXPECT_LT(std::abs(z_of_mean(by_direction, -0.5)), kLargestZ) << "one nat a vertex above";
  EXPECT_GT(std::abs(z_of_mean(by_direction, -1.5)), 50);
}

TEST(Correction3FreshOffsets, TheRadialStepLeavesAThreeDimensionalGaussianInvariant) {
  // 4,000 chains that begin at a draw of the target and walk 25 steps: independent draws, without burn-in.
  const auto vertex = gaussian_model(3);
  const auto target =
      target_of(vertex, {{"radial", 1,
                          std::make_shared<const Perturb>(std::vector<Perturb::Group>{
                              {.variables = {0, 1, 2}, .shape = Perturb::Shape::radial, .size = 1.5}})}});
  ToySimulator simulator(constant);
  std::vector<double> radii, first, product;
  double moved = 0;
  for (std::uint32_t index = 0; index < 4000; ++index) {
    Chain chain(target, {.seed = 37, .index = index});
    for (int i = 0; i < 25; ++i)
      moved += chain.step(simulator);
    const State& state = chain.stay().state;
    radii.push_back(state.norm());
    first.push_back(state[0]);
    product.push_back(state[0] * state[1]);
  }
  EXPECT_GT(moved, 4000 * 25 * 0.3);
  const auto maxwell = [](double r) {
    return 2 * normal_cdf(r) - 1 - std::sqrt(2 / M_PI) * r * std::exp(-0.5 * r * r);
  };
  EXPECT_GT(kolmogorov_smirnov_p(radii, maxwell), kErrorRate);
  EXPECT_GT(kolmogorov_smirnov_p(first, normal_cdf), kErrorRate);
  EXPECT_LT(std::abs(z_of_mean(product, 0)), kLargestZ);
}

// --- 5. Outside the support ----------------------------------------------------------------------------

TEST(Correction5Support, CandidatesOutsideAreRejectedAndNeverSimulated) {
  // A disc: neither prior alone can refuse its outside.
  const auto disc = std::make_shared<const Model>(
      std::vector<Variable>{{.name = "x", .unit = "m", .prior = Distribution::uniform(-1, 1)},
                            {.name = "y", .unit = "m", .prior = Distribution::uniform(-1, 1)}},
      [](const State& state) { return state.squaredNorm() <= 1; });
  const auto step = std::make_shared<const Perturb>(
      std::vector<Perturb::Group>{{.variables = {0, 1}, .shape = Perturb::Shape::gaussian, .size = 0.7}});
  const auto target =
      target_of(disc, {{"perturb", 1, step},
                       {"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*disc, Ratios::exact))}});
  for (const Method method : {Method::metropolis, Method::rejection}) {
    for (const bool early_rejection : {true, false}) {
      Chain chain(target, {.seed = 38, .method = method, .early_rejection = early_rejection});
      ToySimulator simulator(constant);
      simulator.observe = [](const State& state, const SimulationRequest&) {
        ASSERT_LE(state.squaredNorm(), 1);
      };
      std::vector<double> squared_radii;
      constexpr std::uint64_t kIterations = 60000;
      for (std::uint64_t i = 1; i <= kIterations; ++i) {
        const bool moved = chain.step(simulator);
        ASSERT_LE(chain.stay().state.squaredNorm(), 1);
        if (method == Method::rejection ? moved : i % 15 == 0)
          squared_radii.push_back(chain.stay().state.squaredNorm());
      }
      // All that lies inside is accepted, since both densities are constant there.
      const std::uint64_t initial = method == Method::metropolis ? 1 : 0;
      EXPECT_EQ(chain.counts().simulations, chain.counts().accepted + initial);
      EXPECT_LT(chain.counts().accepted, 0.85 * kIterations);
      EXPECT_GT(kolmogorov_smirnov_p(squared_radii, [](double r2) { return r2; }), kErrorRate);
    }
  }
}

}  // namespace
}  // namespace retake::tests
