// Spread: the worth of a run whose worth is known - independent draws, autoregression, a run stuck in a mode.
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include "sampler/spread.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"

namespace retake::tests {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kQuantities = 400;

/// Runs of stationary autoregression x' = rho x + sqrt(1 - rho^2) noise, each quantity on its own.
std::vector<RunMoments> autoregressive_runs(int count, int draws, double rho, std::uint64_t seed) {
  std::vector<RunMoments> runs;
  for (int r = 0; r < count; ++r) {
    RandomStream random = stream(seed, static_cast<std::uint64_t>(r));
    RunMoments run(kQuantities);
    VectorXd x(kQuantities);
    for (double& value : x)
      value = random.gaussian();
    for (int i = 0; i < draws; ++i) {
      run.add(x, 1);
      for (double& value : x)
        value = rho * value + std::sqrt(1 - rho * rho) * random.gaussian();
    }
    runs.push_back(run);
  }
  return runs;
}

/// How many standard errors the mean of 1 / ESS, which is said to be unbiased, lies above the truth.
double z_of_inverse(const VectorXd& effective, double truth) {
  std::vector<double> inverses;
  for (const double value : effective)
    inverses.push_back(1 / value);
  return z_of_mean(inverses, 1 / truth);
}

TEST(Spread, OfIndependentDrawsIsTheirNumber) {
  const VectorXd effective = ess_by_spread(autoregressive_runs(8, 400, 0, 211));
  EXPECT_LT(std::abs(z_of_inverse(effective, 400)), kLargestZ);
  EXPECT_NEAR(harmonic_mean(effective), 400, 400 * 0.14);  // 5 sqrt(2 / (7 quantities))
}

TEST(Spread, OfAutoregressionIsItsEffectiveNumber) {
  const double rho = 0.8;
  const int draws = 500;
  // Variance of a mean of n, over the variance of one: (1 + 2 sum (1 - k / n) rho^k) / n.
  double tau = 1;
  for (int k = 1; k < draws; ++k)
    tau += 2 * (1 - static_cast<double>(k) / draws) * std::pow(rho, k);
  const VectorXd effective = ess_by_spread(autoregressive_runs(8, draws, rho, 212));
  EXPECT_LT(std::abs(z_of_inverse(effective, draws / tau)), kLargestZ);
  EXPECT_NEAR(harmonic_mean(effective), draws / tau, draws / tau * 0.14);
}

TEST(Spread, OfRunsStuckInTheirModesIsNearOne) {
  // Each run stays in one of two modes far apart, however many draws it takes there.
  std::vector<RunMoments> runs;
  for (int r = 0; r < 16; ++r) {
    RandomStream random = stream(213, static_cast<std::uint64_t>(r));
    RunMoments run(kQuantities);
    VectorXd mode(kQuantities);
    for (double& value : mode)
      value = random.bernoulli(0.5) ? 10 : -10;
    for (int i = 0; i < 200; ++i) {
      VectorXd x = mode;
      for (double& value : x)
        value += random.gaussian();
      run.add(x, 1);
    }
    runs.push_back(run);
  }
  const double effective = harmonic_mean(ess_by_spread(runs));
  EXPECT_GT(effective, 0.8);
  EXPECT_LT(effective, 1.2);
}

TEST(Spread, WeightedMomentsAreThoseOfRepeatedDraws) {
  RunMoments weighted(3), repeated(3);
  RandomStream random = stream(214);
  for (int i = 0; i < 1000; ++i) {
    VectorXd x(3);
    x << random.gaussian(), 1e6 + random.uniform(), 5;
    const std::uint64_t weight = 1 + random.index(7);
    weighted.add(x, static_cast<double>(weight));
    for (std::uint64_t k = 0; k < weight; ++k)
      repeated.add(x, 1);
  }
  EXPECT_EQ(weighted.weight(), repeated.weight());
  for (Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(weighted.mean()[i], repeated.mean()[i], 1e-13 * (1 + std::abs(repeated.mean()[i])));
    EXPECT_NEAR(weighted.variance()[i], repeated.variance()[i], 1e-7 * (repeated.variance()[i] + 1e-9));
  }
}

TEST(Spread, OfAConstantIsNotANumber) {
  std::vector<RunMoments> runs(4, RunMoments(2));
  RandomStream random = stream(215);
  for (RunMoments& run : runs)
    for (int i = 0; i < 50; ++i) {
      VectorXd x(2);
      x << 0.1 + 0.2, random.gaussian();
      run.add(x, 1 + random.uniform());
    }
  const VectorXd effective = ess_by_spread(runs);
  EXPECT_TRUE(std::isnan(effective[0]));
  EXPECT_FALSE(std::isnan(effective[1]));
  EXPECT_DOUBLE_EQ(harmonic_mean(effective), effective[1]) << "constants are left out";
}

TEST(Spread, TheHarmonicMeanOfNothingIsNotANumber) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(harmonic_mean(VectorXd(0))));
  EXPECT_TRUE(std::isnan(harmonic_mean(VectorXd::Constant(3, none))));
  VectorXd some(3);
  some << 2, none, 6;
  EXPECT_DOUBLE_EQ(harmonic_mean(some), 3);
}

}  // namespace
}  // namespace retake::tests
