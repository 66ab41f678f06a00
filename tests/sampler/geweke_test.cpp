// Geweke's joint test of every kernel (Getting it right, JASA 99 (2004) 799-804), and simulation-based
// calibration of whole chains. The model's Variables are theta; the data y are Gaussian around a function of
// theta, and the constraint is y's likelihood. Seeds are fixed; each comparison errs with probability 1e-6.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/toys.h"
#include "tests/sampler/two_modes.h"

namespace retake::tests {
namespace {

constexpr double kNoise = 0.8;  // of y

double signal(const State& theta) {
  // Not a plain sum, so that no two Variables stand in for one another.
  double sum = 0, weight = 1;
  for (const double value : theta)
    sum += (weight = -0.9 * weight) * (std::isnan(value) ? 0.3 : value);
  return sum;
}

double draw_data(const State& theta, RandomStream& random) {
  return signal(theta) + kNoise * random.gaussian();
}

LogConstraint likelihood(double y) {
  return [y](const State& theta) { return -0.5 * std::pow((y - signal(theta)) / kNoise, 2); };
}

/// Functions of theta and y whose distributions are compared.
std::vector<double> functions(const State& theta, double y) {
  std::vector<double> values{y, y * y, theta[0], theta[0] * theta[3], theta[3], theta[0] * y};
  for (const double value : theta) {
    const double filled = std::isnan(value) ? 0 : value;
    values.push_back(filled);
    values.push_back(filled * filled);
    values.push_back(filled * y);
  }
  return values;
}

/// Largest |z| between the two simulators' means, over all functions. Every replica of the
/// successive-conditional simulator begins at a draw of the joint distribution, so that replicas are
/// independent and nothing has to mix.
double largest_z(const Kernel& kernel, const Model& model, std::uint64_t seed) {
  constexpr int kReplicas = 40000, kAlternations = 8;
  std::vector<std::vector<double>> marginal, successive;
  const auto add = [](std::vector<std::vector<double>>& to, const std::vector<double>& values) {
    to.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      to[i].push_back(values[i]);
  };
  State theta;
  for (int replica = 0; replica < kReplicas; ++replica) {
    RandomStream apart = stream(seed, static_cast<std::uint64_t>(replica), Purpose::initial);
    model.draw(apart, theta);
    add(marginal, functions(theta, draw_data(theta, apart)));

    RandomStream random = stream(seed, static_cast<std::uint64_t>(replica), Purpose::proposal);
    model.draw(random, theta);
    double y = 0;
    for (int i = 0; i < kAlternations; ++i) {
      y = draw_data(theta, random);
      metropolis_step(model, kernel, likelihood(y), theta, random);
    }
    add(successive, functions(theta, y));
  }
  double largest = 0;
  for (std::size_t i = 0; i < marginal.size(); ++i)
    largest = std::max(largest, std::abs(z_of_means(marginal[i], successive[i])));
  return largest;
}

TEST(Geweke, TheTwoSimulatorsAgreeForEveryKernel) {
  // 33 functions of 7 kernels: the whole test errs with probability 2.3e-4.
  const auto model = rich_model();
  std::uint64_t seed = 70;
  for (const WeightedKernel& row : rich_kernels(*model, Ratios::exact))
    EXPECT_LT(largest_z(*row.kernel, *model, ++seed), kLargestZ) << row.name;
}

TEST(Geweke, TheTwoSimulatorsAgreeForLocalMoves) {
  const auto model = rich_model();
  EXPECT_LT(largest_z(LocalMove(*model, {5, 6}), *model, 78), kLargestZ);
}

TEST(Geweke, ThePapersRatiosDisagree) {
  const auto model = rich_model();
  for (const WeightedKernel& row : rich_kernels(*model, Ratios::paper)) {
    if (row.name.starts_with("perturb")) continue;  // symmetric, whatever the ratios
    EXPECT_GT(largest_z(*row.kernel, *model, 80), 10) << row.name;
  }
}

/// Ranks of the true value of theta's functions among those of a chain's thinned draws (Talts et al. 2018).
/// A draw is one of p(A | satisfied), as walkers' weights count them.
void expect_calibrated(Method method, std::uint32_t replicas, std::uint64_t counted_a_draw) {
  constexpr std::size_t kDraws = 19;
  const auto model = rich_model();
  const auto target = target_of(model, rich_kernels(*model, Ratios::exact));
  std::vector<std::vector<double>> ranks(4, std::vector<double>(kDraws + 1, 0));
  const auto quantities = [](const State& theta) {
    return std::array<double, 4>{signal(theta), theta[5], theta[6], theta[8]};
  };
  for (std::uint32_t replica = 0; replica < replicas; ++replica) {
    RandomStream random = stream(90, replica);
    State theta;
    model->draw(random, theta);
    ToySimulator simulator(likelihood(draw_data(theta, random)));
    Chain chain(target, {.seed = 91,
                         .index = replica,
                         .method = method,
                         .learning = {.hits = 20, .plain_hits = 3, .plain_draws = 0}});
    DrawWatcher watcher;
    const auto truth = quantities(theta);
    std::array<std::size_t, 4> below{};
    for (std::uint64_t i = 0; i < 200; ++i) {
      chain.step(simulator);
      watcher.note(chain);
    }
    std::uint64_t counted = 0;
    for (std::size_t draw = 0; draw < kDraws; ++draw) {
      for (; counted < counted_a_draw; counted += watcher.note(chain))
        chain.step(simulator);
      counted -= counted_a_draw;
      const auto values = quantities(chain.stay().state);
      for (std::size_t q = 0; q < values.size(); ++q)
        below[q] += values[q] < truth[q];
    }
    for (std::size_t q = 0; q < below.size(); ++q)
      ++ranks[q][below[q]];
  }
  const std::vector<double> flat(kDraws + 1, static_cast<double>(replicas) / (kDraws + 1));
  for (std::size_t q = 0; q < ranks.size(); ++q)
    EXPECT_GT(chi_square_p(ranks[q], flat), kErrorRate) << q;
}

TEST(Calibration, RanksAreUniformUnderMetropolis) {
  expect_calibrated(Method::metropolis, 600, 60);
}
TEST(Calibration, RanksAreUniformUnderRejection) {
  expect_calibrated(Method::rejection, 600, 1);
}
TEST(Calibration, RanksAreUniformUnderConditional) {
  expect_calibrated(Method::conditional, 600, 30);
}
TEST(Calibration, RanksAreUniformUnderTempering) {
  expect_calibrated(Method::tempering, 600, 40);
}
TEST(SlowCalibration, RanksAreUniformUnderConditional) {
  expect_calibrated(Method::conditional, 6000, 50);
}
TEST(SlowCalibration, RanksAreUniformUnderTempering) {
  expect_calibrated(Method::tempering, 10000, 60);
}
TEST(SlowCalibration, RanksAreUniformUnderMetropolis) {
  expect_calibrated(Method::metropolis, 20000, 100);
}
TEST(SlowCalibration, RanksAreUniformUnderRejection) {
  expect_calibrated(Method::rejection, 20000, 1);
}

}  // namespace
}  // namespace retake::tests
