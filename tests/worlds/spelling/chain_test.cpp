// Chains of the world `spelling` walk p(A): with lambda = 1 the model comes back, simulated and all; with
// another lambda what prior draws foretell; and the published ratios do what figures 6 and 7 show.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

/// Three bins by two, of which three are designated.
std::shared_ptr<const Scenario> small_box(double log_lambda) {
  return Scenario::read(
      {{"world", "spelling"},
       {"model", {{"columns", 3}, {"rows", 2}, {"interval", 0.05}}},
       {"constraints", {{{"kind", "bins"}, {"rows", {"#.#", ".#."}}, {"log_lambda", log_lambda}}}}});
}

double active_balls(const State& state) {
  double count = 0;
  for (int ball = 0; ball < 3; ++ball)
    count += state[3 * ball] == 1 ? 1 : 0;
  return count;
}

/// The sum of the squares of all offsets, in standard deviations; they follow the three Variables a ball.
double squared_offsets(const State& state, int balls) {
  return state.tail(state.size() - 3 * balls).squaredNorm() / (0.0001 * 0.0001);
}

/// Means of batches: of a chain that is long against its correlation they are nearly independent.
std::vector<double> batch_means(const std::vector<double>& values, std::size_t batches) {
  std::vector<double> means(batches, 0);
  const std::size_t length = values.size() / batches;
  for (std::size_t i = 0; i < batches * length; ++i)
    means[i / length] += values[i] / static_cast<double>(length);
  return means;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values)
    sum += value;
  return sum / static_cast<double>(values.size());
}

/// How many standard errors the mean of a chain is away from what it should be.
double z_of_chain(const std::vector<double>& values, double expected) {
  const std::vector<double> means = batch_means(values, 40);
  const double mean = mean_of(means);
  double variance = 0;
  for (const double each : means)
    variance += (each - mean) * (each - mean) / 39;
  return (mean - expected) / std::sqrt(variance / 40);
}

constexpr double kLargestZ = 5;  // exceeded once in 10^5 by batch means of 39 degrees of freedom

TEST(SpellingChain, WithLambdaOneTheNumberOfBallsIsBinomialAndOffsetsAreGaussian) {
  const auto scenario = small_box(0);
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 21});
  constexpr int kSteps = 12000;
  std::vector<std::vector<double>> counts(4), offset(2), drop(1);
  const auto last = scenario->model().size() - 1;
  for (int i = 0; i < kSteps; ++i) {
    chain.step(*performer);
    const State& state = chain.stay().state;
    for (std::size_t k = 0; k < 4; ++k)
      counts[k].push_back(active_balls(state) == static_cast<double>(k) ? 1 : 0);
    offset[0].push_back(squared_offsets(state, 3) / static_cast<double>(last + 1 - 9));
    offset[1].push_back(state[static_cast<Eigen::Index>(last)] / 0.0001);
    if (state[0] == 1) drop[0].push_back(state[1]);
  }
  // A pour that never comes to rest has no place in p(A); they are few enough not to be seen in what follows.
  EXPECT_LT(chain.counts().failed_simulations, kSteps / 1000u);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(std::abs(z_of_chain(counts[k], k == 0 || k == 3 ? 0.125 : 0.375)), kLargestZ) << k;
  EXPECT_LT(std::abs(z_of_chain(offset[0], 1)), kLargestZ);
  EXPECT_LT(std::abs(z_of_chain(offset[1], 0)), kLargestZ);
  EXPECT_LT(std::abs(z_of_chain(drop[0], 0)), kLargestZ);
}

/// The mean of k / N under p(A), foretold from draws of the prior weighted with p_c, with its error.
struct Foretold {
  double filled, error;
};
Foretold foretell(const Scenario& scenario, int draws) {
  const auto performer = scenario.make_performer();
  RandomStream random({.seed = 22});
  std::vector<double> weights, filled;
  Score score;
  score.measures.resize(scenario.measures().size());
  for (int i = 0; i < draws; ++i) {
    if (performer->simulate(draw_state(scenario.model(), random), {}, score).end != SimulationEnd::complete)
      continue;
    weights.push_back(std::exp(score.log_constraint));
    filled.push_back(score.measures[scenario.measures().size() - 2]);
  }
  const double all = mean_of(weights) * static_cast<double>(weights.size());
  double mean = 0, variance = 0;
  for (std::size_t i = 0; i < weights.size(); ++i)
    mean += weights[i] * filled[i] / all;
  for (std::size_t i = 0; i < weights.size(); ++i)
    variance += std::pow(weights[i] * (filled[i] - mean) / all, 2);
  return {mean, std::sqrt(variance)};
}

void expect_as_foretold(double log_lambda, int draws, int steps) {
  const auto scenario = small_box(log_lambda);
  const Foretold foretold = foretell(*scenario, draws);
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 23});
  std::vector<double> filled;
  for (int i = 0; i < steps; ++i) {
    chain.step(*performer);
    filled.push_back(chain.stay().score.measures[scenario->measures().size() - 2]);
  }
  const double z = z_of_chain(filled, foretold.filled);
  const double own_error = (mean_of(filled) - foretold.filled) / z;
  const double both = (mean_of(filled) - foretold.filled) / std::hypot(own_error, foretold.error);
  std::printf("lambda e^%g: k foretold %.4f +- %.4f, walked %.4f +- %.4f\n", log_lambda, foretold.filled,
              foretold.error, mean_of(filled), std::abs(own_error));
  EXPECT_LT(std::abs(both), kLargestZ);
}

TEST(SpellingChain, WalksThePriorWeightedWithLambdaToTheBinsThatAreFilled) {
  expect_as_foretold(1, 3000, 6000);
}

TEST(SlowSpellingChain, WalksThePriorWeightedWithLambdaToTheBinsThatAreFilled) {
  expect_as_foretold(1, 60000, 200000);
  expect_as_foretold(2, 60000, 200000);
}

TEST(SlowSpellingChain, PublishedRatiosShowTheChangeAllEffectAndExactOnesDoNot) {
  const auto scenario = Scenario::read({{"world", "spelling"},
                                        {"model", {{"columns", 7}, {"rows", 5}}},
                                        {"constraints", {{{"kind", "spell"}, {"text", "HI"}}}}});
  const auto performer = scenario->make_performer();
  for (const Ratios ratios : {Ratios::paper, Ratios::exact}) {
    int arrivals = 0, drops = 0;
    for (const std::uint64_t seed : {31, 32, 33}) {
      Chain chain(scenario->target(ratios), {.seed = seed});
      chain.step(*performer);
      double most = 0;
      for (int i = 1; i < 20000; ++i) {
        const double filled_before = 10 + chain.stay().score.log_constraint / 5;
        const double offsets_before = squared_offsets(chain.stay().state, 10);
        const std::uint64_t all_before = chain.counts().kernels[0].accepted;
        chain.step(*performer);
        const double filled = 10 + chain.stay().score.log_constraint / 5;
        arrivals += filled == 10 && most < 10 ? 1 : 0;
        most = std::max(most, filled);
        // An accepted change of all that loses three bins or more, for which the offsets' density pays.
        if (chain.counts().kernels[0].accepted > all_before && filled <= filled_before - 3) {
          ++drops;
          EXPECT_LT(squared_offsets(chain.stay().state, 10), offsets_before - 10);
          most = 0;
        }
      }
    }
    std::printf("%s: %d arrivals at ten bins, %d drops by a change of all, in three chains\n",
                std::string(to_string(ratios)).c_str(), arrivals, drops);
    EXPECT_GE(arrivals, 3);
    if (ratios == Ratios::paper) {
      EXPECT_GE(drops, 3);
    } else {
      EXPECT_EQ(drops, 0);
    }
  }
}

}  // namespace
}  // namespace retake::tests
