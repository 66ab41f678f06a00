// Diagnostics against R's `posterior` (data/make_diagnostics_reference.R), against chains whose answer is
// known, and at the edges of what they accept.
#include "sampler/diagnostics.h"

#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/normal.h"
#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct ReferenceCase {
  std::string name;
  MatrixXd draws;
  QuantityDiagnostics expected;
  double expected_ess_mean;
  double expected_tau;  ///< of the first chain, unsplit
};

/// The next token, which has to be `name`, and then a number as R writes it.
double read_number(std::istream& in, const std::string& name) {
  std::string found, number;
  if (!(in >> found >> number) || found != name)
    throw std::runtime_error("expected " + name + ", not " + found);
  return number == "NA" ? kNaN : std::stod(number);
}

std::vector<ReferenceCase> read_reference() {
  const std::string path = RETAKE_SOURCE_DIR "/tests/sampler/data/diagnostics_reference.txt";
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot read " + path);
  std::string word;
  std::getline(in, word);
  std::vector<ReferenceCase> cases;
  while (in >> word) {
    ReferenceCase reference;
    Index iterations = 0, chains = 0;
    in >> reference.name >> iterations >> chains;
    reference.expected.rhat = read_number(in, "rhat");
    reference.expected.ess_bulk = read_number(in, "ess_bulk");
    reference.expected.ess_tail = read_number(in, "ess_tail");
    reference.expected_ess_mean = read_number(in, "ess_mean");
    reference.expected.mean = read_number(in, "mean");
    reference.expected.sd = read_number(in, "sd");
    reference.expected_tau = read_number(in, "tau_of_first_chain");
    in >> word;
    reference.draws.resize(iterations, chains);
    for (Index i = 0; i < iterations; ++i) {
      for (Index chain = 0; chain < chains; ++chain) {
        in >> word;
        reference.draws(i, chain) = std::stod(word);
      }
    }
    cases.push_back(std::move(reference));
  }
  return cases;
}

/// Walks with a standard deviation of 1 whose every draw keeps `memory` of the one before.
MatrixXd walks(Index iterations, Index chains, double memory, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  MatrixXd draws(iterations, chains);
  for (Index chain = 0; chain < chains; ++chain) {
    double x = normal(random);
    for (Index i = 0; i < iterations; ++i) {
      draws(i, chain) = x;
      x = memory * x + std::sqrt(1 - memory * memory) * normal(random);
    }
  }
  return draws;
}

void expect_close(double actual, double expected, const char* what) {
  if (std::isnan(expected)) {
    EXPECT_TRUE(std::isnan(actual)) << what << " is " << actual;
  } else {
    EXPECT_NEAR(actual, expected, 1e-11 * std::abs(expected)) << what;
  }
}

/// Draws that are independent of each other and normal, the same on every platform.
MatrixXd normal_draws(Index iterations, Index chains, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  return MatrixXd::NullaryExpr(iterations, chains, [&] {
    return normal_quantile((static_cast<double>(bits() >> 12) + 0.5) * 0x1p-52);
  });
}

void expect_all_nan(const MatrixXd& draws) {
  const QuantityDiagnostics diagnostics = diagnose(chains_of(draws));
  EXPECT_TRUE(std::isnan(diagnostics.rhat));
  EXPECT_TRUE(std::isnan(diagnostics.ess_bulk));
  EXPECT_TRUE(std::isnan(diagnostics.ess_tail));
  EXPECT_TRUE(std::isnan(ess_mean(chains_of(draws))));
  EXPECT_TRUE(std::isnan(diagnostics.mean));
  EXPECT_TRUE(std::isnan(diagnostics.sd));
}

TEST(Diagnostics, AgreeWithPosterior) {
  const auto cases = read_reference();
  EXPECT_EQ(cases.size(), 41u);
  for (const auto& reference : cases) {
    SCOPED_TRACE(reference.name);
    const QuantityDiagnostics actual = diagnose(chains_of(reference.draws));
    expect_close(actual.rhat, reference.expected.rhat, "rhat");
    expect_close(actual.ess_bulk, reference.expected.ess_bulk, "ess_bulk");
    expect_close(actual.ess_tail, reference.expected.ess_tail, "ess_tail");
    expect_close(actual.mean, reference.expected.mean, "mean");
    expect_close(actual.sd, reference.expected.sd, "sd");
    expect_close(ess_mean(chains_of(reference.draws)), reference.expected_ess_mean, "ess_mean");
    expect_close(integrated_autocorrelation_time(reference.draws.col(0)), reference.expected_tau, "tau");
  }
}

TEST(Diagnostics, DiagnoseGathersTheSingleFunctions) {
  const MatrixXd draws = normal_draws(50, 3, 1);
  const QuantityDiagnostics diagnostics = diagnose(chains_of(draws));
  EXPECT_EQ(diagnostics.rhat, rank_normalised_split_rhat(chains_of(draws)));
  EXPECT_EQ(diagnostics.ess_bulk, ess_bulk(chains_of(draws)));
  EXPECT_EQ(diagnostics.ess_tail, ess_tail(chains_of(draws)));
}

// Each estimate has a relative standard error below 6 %, so a bound of 30 % fails by chance once in 10^6
// seeds.
TEST(Diagnostics, LongAutoregressionHasItsIntegratedAutocorrelationTime) {
  for (const double coefficient : {0.0, 0.5, 0.9}) {
    MatrixXd draws = normal_draws(100'000, 2, 7);
    const double innovation = std::sqrt(1.0 - coefficient * coefficient);
    for (Index i = 1; i < draws.rows(); ++i) {
      draws.row(i) = coefficient * draws.row(i - 1) + innovation * draws.row(i);
    }
    const double tau = (1.0 + coefficient) / (1.0 - coefficient);
    EXPECT_NEAR(integrated_autocorrelation_time(draws.col(0)) / tau, 1.0, 0.3);
    EXPECT_NEAR(ess_mean(chains_of(draws)) * tau / static_cast<double>(draws.size()), 1.0, 0.3);
    EXPECT_NEAR(ess_bulk(chains_of(draws)) * tau / static_cast<double>(draws.size()), 1.0, 0.3);
    EXPECT_NEAR(rank_normalised_split_rhat(chains_of(draws)), 1.0, 0.01);
  }
}

TEST(Diagnostics, BulkAndTailDependOnRanksOnly) {
  const MatrixXd draws = normal_draws(200, 2, 3);
  const MatrixXd stretched = draws.array().cube().exp();
  EXPECT_EQ(ess_bulk(chains_of(stretched)), ess_bulk(chains_of(draws)));
  EXPECT_EQ(ess_tail(chains_of(stretched)), ess_tail(chains_of(draws)));
}

TEST(Diagnostics, RhatSeesAChainOfAnotherPlaceAndOneOfAnotherWidth) {
  const MatrixXd draws = normal_draws(400, 4, 5);
  EXPECT_LT(rank_normalised_split_rhat(chains_of(draws)), 1.01);
  MatrixXd moved = draws;
  moved.col(2).array() += 1.0;
  EXPECT_GT(rank_normalised_split_rhat(chains_of(moved)), 1.05);
  MatrixXd widened = draws;
  widened.col(2) *= 4.0;
  EXPECT_GT(rank_normalised_split_rhat(chains_of(widened)), 1.05);
}

TEST(Diagnostics, ChainsStuckApartNeverAgree) {
  MatrixXd draws(20, 3);
  draws.rowwise() = Eigen::RowVector3d(1.0, 2.0, 4.0);
  EXPECT_EQ(rank_normalised_split_rhat(chains_of(draws)), kInfinity);
  EXPECT_LT(ess_bulk(chains_of(draws)), 6.0);
}

TEST(Diagnostics, AnyDrawThatIsNotFiniteGivesNaN) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    MatrixXd draws = normal_draws(40, 2, 11);
    draws(17, 1) = bad;
    expect_all_nan(draws);
    EXPECT_TRUE(std::isnan(integrated_autocorrelation_time(draws.col(1))));
  }
}

TEST(Diagnostics, NoDrawsGiveNaN) {
  expect_all_nan(MatrixXd(0, 0));
  expect_all_nan(MatrixXd(0, 3));
  expect_all_nan(MatrixXd(5, 0));
  EXPECT_TRUE(std::isnan(integrated_autocorrelation_time(VectorXd(0))));
}

TEST(Diagnostics, ShortChainsGiveNaN) {
  for (Index iterations = 1; iterations < 4; ++iterations) {
    EXPECT_TRUE(std::isnan(rank_normalised_split_rhat(chains_of(normal_draws(iterations, 4, 13)))));
  }
  EXPECT_FALSE(std::isnan(rank_normalised_split_rhat(chains_of(normal_draws(4, 4, 13)))));
  for (Index iterations = 1; iterations < 6; ++iterations) {
    EXPECT_TRUE(std::isnan(ess_bulk(chains_of(normal_draws(iterations, 4, 13)))));
  }
  EXPECT_FALSE(std::isnan(ess_bulk(chains_of(normal_draws(6, 4, 13)))));
}

// --- Chains that differ in length -----------------------------------------------------------------

/// A walk of each length about its place, with a standard deviation of 1.
ChainDraws ragged(const std::vector<std::pair<Index, double>>& lengths_and_places, double memory,
                  std::uint64_t seed) {
  ChainDraws chains;
  for (const auto& [length, place] : lengths_and_places)
    chains.push_back(walks(length, 1, memory, seed++).col(0).array() + place);
  return chains;
}

TEST(RaggedDiagnostics, ALongChainDoesNotHideShortOnesThatDisagree) {
  const std::vector<std::pair<Index, double>> apart = {{30, -9}, {30, -6}, {30, -3},
                                                       {30, 3},  {30, 6},  {30, 9}};
  auto with_long = apart;
  with_long.push_back({3000, 0});
  EXPECT_GT(diagnose(ragged(apart, 0, 1)).rhat, 2);
  const ChainDraws draws = ragged(with_long, 0, 1);
  EXPECT_GT(diagnose(draws).rhat, 1.1);
  EXPECT_LT(ess_across(draws), 30);
  EXPECT_LT(diagnose(draws).ess_bulk, 300);
  // Whichever comes first.
  const ChainDraws turned(draws.rbegin(), draws.rend());
  EXPECT_NEAR(diagnose(turned).rhat, diagnose(draws).rhat, 1e-9);
  EXPECT_NEAR(ess_across(turned), ess_across(draws), 1e-6);
}

TEST(RaggedDiagnostics, ChainsThatAgreeAreWorthWhatTheyHaveSeen) {
  // n draws that keep m of the one before are worth n (1 - m) / (1 + m), however they are cut into chains.
  for (const double memory : {0.0, 0.6}) {
    double bulk = 0, mean = 0, across = 0, rhat = 0;
    constexpr int kSeeds = 40;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const ChainDraws draws = ragged(
          {{4000, 0}, {1000, 0}, {1000, 0}, {300, 0}, {300, 0}, {100, 0}, {100, 0}}, memory, 100 * seed + 7);
      const QuantityDiagnostics found = diagnose(draws);
      bulk += std::log(found.ess_bulk);
      mean += std::log(ess_mean(draws));
      across += 1 / ess_across(draws);
      rhat = std::max(rhat, found.rhat);
    }
    const double expected = 6800 * (1 - memory) / (1 + memory);
    EXPECT_NEAR(std::exp(bulk / kSeeds), expected, 0.15 * expected) << memory;
    EXPECT_NEAR(std::exp(mean / kSeeds), expected, 0.15 * expected) << memory;
    // The mean of 40 chi-squares of 6 degrees is known to 9 %.
    EXPECT_NEAR(kSeeds / across, expected, 0.45 * expected) << memory;
    EXPECT_LT(rhat, memory == 0 ? 1.02 : 1.05) << memory;
  }
}

TEST(RaggedDiagnostics, WhatOnlyTheLongChainRemembersCounts) {
  // One long walk and a hundred of ten draws, none of which reaches as far as the walk remembers. The mean of
  // all has the variance 2.98e-3 * 4, from the autocovariances 0.95^lag: worth 84 draws.
  constexpr int kSeeds = 40;
  double log_sum = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    std::vector<std::pair<Index, double>> lengths(101, {10, 0});
    lengths[50].first = 1000;
    log_sum += std::log(ess_mean(ragged(lengths, 0.95, 1000 * seed)));
  }
  EXPECT_GT(std::exp(log_sum / kSeeds), 84 / 2.2);
  EXPECT_LT(std::exp(log_sum / kSeeds), 84 * 1.3);
}

TEST(RaggedDiagnostics, OneDrawMoreIsOneDrawMore) {
  ChainDraws draws = ragged({{400, 0}, {400, 0}, {400, 0}}, 0.3, 3);
  const QuantityDiagnostics equal = diagnose(draws);
  draws[1] = draws[1].head(398).eval();
  const QuantityDiagnostics cut = diagnose(draws);
  EXPECT_NEAR(cut.rhat, equal.rhat, 2e-3);
  EXPECT_NEAR(cut.ess_bulk, equal.ess_bulk, 0.03 * equal.ess_bulk);
  EXPECT_NEAR(cut.ess_tail, equal.ess_tail, 0.1 * equal.ess_tail);
}

TEST(RaggedDiagnostics, OfEqualChainsTheSpreadIsThatOfTheirMeans) {
  const MatrixXd draws = walks(200, 5, 0.5, 4);
  const VectorXd means = draws.colwise().mean().transpose();
  const double of_means = (means.array() - means.mean()).square().sum() / 4;
  const double of_all = (draws.array() - draws.mean()).square().sum() / (1000 - 1.0);
  EXPECT_NEAR(ess_across(chains_of(draws)), 5 * of_all / of_means, 1e-9 * of_all / of_means);
  EXPECT_TRUE(std::isnan(ess_across(chains_of(draws.leftCols(1)))));
  EXPECT_TRUE(std::isnan(ess_across(chains_of(MatrixXd::Constant(10, 3, 2)))));
}

TEST(RaggedDiagnostics, AChainThatNeverMovesIsWorthLittleBesideOneThatDoes) {
  ChainDraws draws = ragged({{500, 0}}, 0, 5);
  draws.push_back(VectorXd::Constant(200, 3));
  EXPECT_GT(diagnose(draws).rhat, 1.2);
  EXPECT_LT(diagnose(draws).ess_bulk, 30);
}

TEST(RaggedDiagnostics, AChainThatIsTooShortGivesNaN) {
  ChainDraws draws = ragged({{100, 0}, {3, 0}}, 0, 6);
  EXPECT_TRUE(std::isnan(rank_normalised_split_rhat(draws)));
  draws.push_back(VectorXd(0));
  EXPECT_TRUE(std::isnan(ess_bulk(draws)));
}

TEST(RoughEss, TellsSlowQuantitiesFromQuickOnes) {
  // Over many walks its mean is near the true figure, n (1 - memory) / (1 + memory).
  for (const double memory : {0.0, 0.5, 0.9}) {
    double sum = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed)
      sum += std::log(ess_rough(chains_of(walks(900, 4, memory, seed))));
    const double expected = 3600 * (1 - memory) / (1 + memory);
    EXPECT_GT(std::exp(sum / 100), 0.4 * expected) << memory;
    EXPECT_LT(std::exp(sum / 100), 1.4 * expected) << memory;
  }
}

TEST(RoughEss, ChainsThatDisagreeAndChainsThatDriftAreWorthLittle) {
  MatrixXd apart = walks(400, 3, 0, 1);
  apart.rowwise() += Eigen::RowVector3d(0, 20, 40);
  EXPECT_LT(ess_rough(chains_of(apart)), 10);
  MatrixXd drifting = walks(400, 2, 0, 2);
  drifting.colwise() += VectorXd::LinSpaced(400, 0, 30);
  EXPECT_LT(ess_rough(chains_of(drifting)), 10);
}

TEST(RoughEss, HasNoFigureWhereThereIsNone) {
  EXPECT_TRUE(std::isnan(ess_rough(chains_of(MatrixXd::Constant(50, 2, 3)))));
  EXPECT_TRUE(std::isnan(ess_rough(chains_of(walks(3, 2, 0, 1)))));
  MatrixXd holed = walks(50, 2, 0, 1);
  holed(7, 1) = kNaN;
  EXPECT_TRUE(std::isnan(ess_rough(chains_of(holed))));
}

}  // namespace
}  // namespace retake::tests
