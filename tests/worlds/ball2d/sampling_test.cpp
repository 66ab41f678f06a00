// The 2D ball's chains: the paper's figure 2, and exactness against an estimate that shares no code with the
// world. Paper, sections 5.1.1 to 5.1.3. Seeds are fixed.
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "sampler/diagnostics.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

std::shared_ptr<const Scenario> ball(double redraw_share) {
  json document = json::parse(R"({"world":"ball2d","constraints":[{"kind":"rest_position","x":1}]})");
  document["model"] = {{"redraw_share", redraw_share}};
  return Scenario::read(document);
}

// --- Figure 2 ----------------------------------------------------------------------------------------

struct LongRun {
  double acceptance = 0;
  double within = 0;  ///< share of iterations within 0.1 D of the mark
};

/// The paper's proposals alone, after 20,000 iterations. A chain in 43 (235 of 10,000) is caught where the
/// first normals are so flat that the ball never rises (x = 0), for more than 100,000 iterations; the
/// stationary weight of that place is some e^-50, so such chains are left out and others run instead.
LongRun run_long(std::uint32_t chains, std::uint64_t iterations) {
  const auto scenario = ball(0);
  const auto performer = scenario->make_performer();
  double accepted = 0, within = 0;
  std::uint32_t arrived = 0, index = 0;
  for (; arrived < chains && index < 2 * chains; ++index) {
    Chain chain(scenario->target(Ratios::exact), {.seed = 161, .index = index});
    bool has_arrived = false;
    for (int i = 0; i < 20000 && (has_arrived || i < 2000); ++i) {
      chain.step(*performer);
      has_arrived |= std::abs(chain.stay().score.measures.back()) <= 0.1;
    }
    if (!has_arrived) continue;
    ++arrived;
    const std::uint64_t before = chain.counts().accepted;
    for (std::uint64_t i = 0; i < iterations; ++i) {
      chain.step(*performer);
      within += std::abs(chain.stay().score.measures.back()) <= 0.1;
    }
    accepted += static_cast<double>(chain.counts().accepted - before);
  }
  EXPECT_EQ(arrived, chains);
  std::printf("%u of %u chains never arrived\n", index - arrived, index);
  const double total = arrived * static_cast<double>(iterations);
  return {accepted / total, within / total};
}

/// The windows are those of the paper's figure as measured before (0.167 and 0.685). Over 191 other chains of
/// 150,000 iterations acceptance was 0.172 with a standard deviation of 0.016 between chains, the share 0.683
/// with 0.005: means of 60 such chains miss a window with probability 2e-4, by the acceptance.
TEST(Ball2dFigure2, TheStationaryChainAcceptsASixthAndStaysWithinATenthForTwoThirds) {
  const LongRun run = run_long(60, 150000);
  RecordProperty("acceptance", std::to_string(run.acceptance));
  RecordProperty("within", std::to_string(run.within));
  EXPECT_GT(run.acceptance, 0.15);
  EXPECT_LT(run.acceptance, 0.18);
  EXPECT_GT(run.within, 0.66);
  EXPECT_LT(run.within, 0.70);
}

/// With standard errors near 0.001 and 0.0004, by the same figures.
TEST(SlowBall2dFigure2, TheStationaryChainAcceptsASixthAndStaysWithinATenthForTwoThirds) {
  const LongRun run = run_long(16, 2000000);
  std::printf("acceptance %.4f, within 0.1 D %.4f\n", run.acceptance, run.within);
  EXPECT_NEAR(run.acceptance, 0.171, 0.006);
  EXPECT_NEAR(run.within, 0.683, 0.004);
}

/// "Within twenty iterations the chain moved toward a good location", as quantiles over starts. 200,000 other
/// chains gave 40.9 % and 85.5 %; with 100,000 the standard errors are 0.0016 and 0.0011, and 85 % is 4.5 of
/// them away.
TEST(Ball2dFigure2, ChainsFromRandomStartsArriveWithinTensOfIterations) {
  constexpr std::uint32_t kChains = 100000;
  const auto scenario = ball(0);
  const auto performer = scenario->make_performer();
  double by_20 = 0, by_50 = 0;
  for (std::uint32_t index = 0; index < kChains; ++index) {
    Chain chain(scenario->target(Ratios::exact), {.seed = 162 + index, .index = 0});
    int arrived = 51;
    for (int i = 1; i <= 50 && arrived > 50; ++i) {
      chain.step(*performer);
      if (std::abs(chain.stay().score.measures.back()) <= 0.1) arrived = i;
    }
    by_20 += arrived <= 20;
    by_50 += arrived <= 50;
  }
  RecordProperty("by_20", std::to_string(by_20 / kChains));
  RecordProperty("by_50", std::to_string(by_50 / kChains));
  EXPECT_GE(by_20 / kChains, 0.35);
  EXPECT_GE(by_50 / kChains, 0.85);
  EXPECT_NEAR(by_20 / kChains, 0.409, 0.009);
  EXPECT_NEAR(by_50 / kChains, 0.855, 0.007);
}

// --- Exactness -----------------------------------------------------------------------------------------

constexpr std::size_t kQuantities = 6;  // five tilts and x
using Quantities = std::array<double, kQuantities>;

/// Where the ball rests, written from section 5.1 and not from the world: velocities in units in which the
/// drop's speed is 1 and gravity 1, so that a hop lasts 2 vy; a fall of 4 D makes lengths come out in units
/// of 8 D.
double rest_of(const std::array<double, 5>& tilts) {
  const double e = std::sqrt(0.5);
  double x = 0, vx = 0, vy = -1;
  for (const double tilt : tilts) {
    const double nx = std::sin(tilt), ny = std::cos(tilt), along = vx * nx + vy * ny;
    if (along < 0) {
      vx -= (1 + e) * along * nx;
      vy -= (1 + e) * along * ny;
    }
    if (vy <= 0) continue;  // again at the same place
    x += 2 * vx * vy;
    vy = -vy;
  }
  return 8 * x;
}

/// Weighted prior draws: the mean of each quantity under p_w p_c, its spread, and the standard errors of the
/// mean and of the mean square distance from it.
struct Reference {
  Quantities mean{}, variance{}, mean_error{}, variance_error{};
  double acceptance = 0, acceptance_error = 0;  ///< of rejection: E p_c
};

Reference weigh_prior_draws(int count) {
  std::mt19937_64 generator(163);
  std::normal_distribution<double> normal(0, 10 * M_PI / 180);
  std::vector<std::pair<double, Quantities>> draws;
  double sum = 0, sum_of_squares = 0;
  Reference of;
  for (int i = 0; i < count; ++i) {
    std::array<double, 5> tilts{};
    for (double& tilt : tilts)
      tilt = normal(generator);
    const double x = rest_of(tilts), weight = std::exp(-0.5 * std::pow((x - 1) / 0.1, 2));
    sum += weight;
    sum_of_squares += weight * weight;
    if (weight < 1e-12) continue;
    draws.push_back({weight, {tilts[0], tilts[1], tilts[2], tilts[3], tilts[4], x}});
    for (std::size_t q = 0; q < kQuantities; ++q)
      of.mean[q] += weight * draws.back().second[q];
  }
  of.acceptance = sum / count;
  of.acceptance_error = std::sqrt((sum_of_squares / count - of.acceptance * of.acceptance) / count);
  for (std::size_t q = 0; q < kQuantities; ++q) {
    of.mean[q] /= sum;
    for (const auto& [weight, values] : draws)
      of.variance[q] += weight * std::pow(values[q] - of.mean[q], 2) / sum;
    for (const auto& [weight, values] : draws) {
      const double distance = values[q] - of.mean[q];
      of.mean_error[q] += std::pow(weight * distance / sum, 2);
      of.variance_error[q] += std::pow(weight * (distance * distance - of.variance[q]) / sum, 2);
    }
    of.mean_error[q] = std::sqrt(of.mean_error[q]);
    of.variance_error[q] = std::sqrt(of.variance_error[q]);
  }
  return of;
}

/// Draws of chains, one matrix [draw, chain] a quantity, against the reference: 12 comparisons at 1e-6 each.
void expect_agreement(const std::vector<Eigen::MatrixXd>& draws, const Reference& reference) {
  for (std::size_t q = 0; q < kQuantities; ++q) {
    const auto compare = [&](const Eigen::MatrixXd& values, double expected, double expected_error,
                             double tolerance) {
      const double sd = diagnose(chains_of(values)).sd, error = sd / std::sqrt(ess_mean(chains_of(values)));
      const double both = std::hypot(error, expected_error);
      EXPECT_LT(both, tolerance) << "too few draws to tell, quantity " << q;
      EXPECT_LT(std::abs(values.mean() - expected) / both, kLargestZ)
          << "quantity " << q << ": " << values.mean() << " not " << expected << ", error " << both;
    };
    const double spread = std::sqrt(reference.variance[q]);
    compare(draws[q], reference.mean[q], reference.mean_error[q], 0.05 * spread);
    compare((draws[q].array() - reference.mean[q]).square().matrix(), reference.variance[q],
            reference.variance_error[q], 0.08 * reference.variance[q]);
  }
}

/// Mean and spread of every tilt and of x are those of p_w p_c: of all states, not only of the satisfied
/// ones.
void expect_exact(Method method, double redraw_share, Eigen::Index chains, Eigen::Index draws, int thinning,
                  int prior_draws) {
  const Reference reference = weigh_prior_draws(prior_draws);
  const auto scenario = ball(redraw_share);
  const auto performer = scenario->make_performer();
  std::vector<Eigen::MatrixXd> values(kQuantities, Eigen::MatrixXd(draws, chains));
  double iterations = 0, accepted = 0;
  for (Eigen::Index index = 0; index < chains; ++index) {
    Chain chain(scenario->target(Ratios::exact),
                {.seed = 164, .index = static_cast<std::uint32_t>(index), .method = method});
    const bool walks = method == Method::metropolis;
    for (int i = 0; walks && i < 5000; ++i)
      chain.step(*performer);
    for (Eigen::Index draw = 0; draw < draws; ++draw) {
      for (int i = 0; walks && i < thinning; ++i)
        chain.step(*performer);
      while (!walks && !chain.step(*performer))
        continue;
      for (std::size_t q = 0; q < kQuantities; ++q)
        values[q](draw, index) =
            q < 5 ? chain.stay().state[static_cast<Eigen::Index>(q)] : chain.stay().score.measures[0];
    }
    iterations += static_cast<double>(chain.counts().iteration);
    accepted += static_cast<double>(chain.counts().accepted);
  }
  expect_agreement(values, reference);
  if (method == Method::rejection) {
    const double share = accepted / iterations;
    EXPECT_LT(std::abs(share - reference.acceptance) /
                  std::hypot(std::sqrt(share * (1 - share) / iterations), reference.acceptance_error),
              kLargestZ);
  }
}

TEST(Ball2dExactness, MetropolisAgreesWithWeightedPriorDraws) {
  expect_exact(Method::metropolis, 0.3, 4, 10000, 15, 1000000);
}
TEST(Ball2dExactness, RejectionAgreesWithWeightedPriorDraws) {
  expect_exact(Method::rejection, 0.3, 4, 5000, 1, 1000000);
}
TEST(SlowBall2dExactness, MetropolisAgreesWithWeightedPriorDrawsAtTheDefaultShare) {
  expect_exact(Method::metropolis, 0.05, 8, 40000, 50, 20000000);
}
TEST(SlowBall2dExactness, RejectionAgreesWithWeightedPriorDraws) {
  expect_exact(Method::rejection, 0.05, 8, 40000, 1, 20000000);
}

}  // namespace
}  // namespace retake::tests
