// Odds: the interval is that of a count or a share where weights are equal, covers where they are not, and
// tallies add up.
// Seeds are fixed; error rates are stated with each comparison.
#include "sampler/odds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"

namespace retake::tests {
namespace {

OddsTally tally_of(std::uint64_t draws, std::uint64_t hits, double weight = 1) {
  OddsTally tally{.basis = OddsBasis::rejection, .draws = draws};
  for (std::uint64_t i = 0; i < hits; ++i)
    tally.add_hit(weight);
  return tally;
}

TEST(Odds, AreNoneWithoutDraws) {
  EXPECT_FALSE(odds({}));
}

TEST(Odds, WithEqualWeightsTheIntervalIsThatOfAPoissonCount) {
  // Garwood 1936: halves of chi-square quantiles with 2 k and 2 k + 2 degrees of freedom.
  struct Case {
    std::uint64_t hits;
    double low, high;
  };
  for (const Case& garwood : {Case{0, 0, 3.688879}, Case{1, 0.025318, 5.571643}, Case{2, 0.242209, 7.224688},
                              Case{5, 1.623486, 11.668332}, Case{10, 4.795389, 18.390356},
                              Case{20, 12.216519, 30.888379}, Case{100, 81.363991, 121.626794}})
    for (const double weight : {1.0, 0.25}) {
      const std::uint64_t draws = 100'000;
      const auto found = odds(tally_of(draws, garwood.hits, weight));
      ASSERT_TRUE(found);
      const double n = static_cast<double>(draws);
      // Without a hit nothing is known of weights: what may have been missed weighs 1.
      const double unit = garwood.hits > 0 ? weight / n : 1 / n;
      EXPECT_DOUBLE_EQ(found->probability, weight * static_cast<double>(garwood.hits) / n);
      EXPECT_NEAR(found->low / unit, garwood.low, 1e-5) << garwood.hits;
      EXPECT_NEAR(found->high / unit, garwood.high, 1e-5) << garwood.hits;
    }
}

TEST(Odds, OfALargeShareAreThoseOfABinomialCount) {
  // Clopper and Pearson 1934: quantiles of the beta distribution, as R's binom.test gives them.
  struct Case {
    std::uint64_t hits, draws;
    double low, high;
  };
  for (const Case& share :
       {Case{1, 1, 0.025, 1}, Case{10, 10, 0.6915029, 1}, Case{9, 10, 0.5549839, 0.9974714},
        Case{5, 10, 0.1870860, 0.8129140}, Case{1, 10, 0.0025286, 0.4450161}, Case{100, 100, 0.9637833, 1},
        Case{2, 100, 0.0024312, 0.0703839}})
    for (const double weight : {1.0, 0.25}) {
      const auto found = odds(tally_of(share.draws, share.hits, weight));
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->low, weight * share.low, 1e-6) << share.hits << " of " << share.draws;
      EXPECT_NEAR(found->high, weight * share.high, 1e-6) << share.hits << " of " << share.draws;
    }
}

TEST(Odds, OfVeryManyHitsHaveTheNormalInterval) {
  // Where the count is large the interval is k +- 1.96 sqrt(k (1 - p)), but for a skewness of about one hit.
  for (const std::uint64_t hits : {10'000ull, 1'000'000ull, 100'000'000ull, 10'000'000'000ull}) {
    const double k = static_cast<double>(hits), spread = 1.959964 * std::sqrt(0.9 * k);
    const OddsTally tally{.basis = OddsBasis::rejection,
                          .draws = 10 * hits,
                          .hits = hits,
                          .sum = k,
                          .squares = k,
                          .largest = 1};
    const auto found = odds(tally);
    ASSERT_TRUE(found);
    EXPECT_NEAR(10 * k * found->low, k - spread, 2 + 1e-5 * spread) << hits;
    EXPECT_NEAR(10 * k * found->high, k + spread, 2 + 1e-5 * spread) << hits;
  }
}

TEST(Odds, NeverExceedOneNorDisorder) {
  for (const std::uint64_t hits : {0ull, 1ull, 9ull, 10ull})
    for (const double weight : {0.01, 1.0, 2.0}) {
      const auto found = odds(tally_of(10, hits, weight));
      ASSERT_TRUE(found);
      EXPECT_GE(found->low, 0);
      EXPECT_LE(found->low, found->probability);
      EXPECT_LE(found->probability, found->high);
      EXPECT_LE(found->high, 1);
    }
}

/// Hits of several weights, each with its probability a draw.
struct Mixture {
  struct Part {
    double probability, weight;
  };
  std::vector<Part> parts;
  double mean() const {
    double sum = 0;
    for (const Part& part : parts)
      sum += part.probability * part.weight;
    return sum;
  }
  void add_draws(std::uint64_t draws, RandomStream& random, OddsTally& tally) const {
    tally.draws += draws;
    for (std::uint64_t i = 0; i < draws; ++i) {
      double u = random.uniform();
      for (const Part& part : parts)
        if ((u -= part.probability) < 0) {
          tally.add_hit(part.weight);
          break;
        }
    }
  }
};

double coverage(const Mixture& mixture, std::uint64_t draws, int tallies) {
  int covered = 0;
  for (int i = 0; i < tallies; ++i) {
    RandomStream random = stream(201, static_cast<std::uint64_t>(i));
    OddsTally tally;
    mixture.add_draws(draws, random, tally);
    const auto found = odds(tally);
    covered += found->low <= mixture.mean() && mixture.mean() <= found->high;
  }
  return static_cast<double>(covered) / tallies;
}

TEST(Odds, OfMixedWeightsCoverTheTruth) {
  // 4000 tallies: with a true coverage of 95 % fewer than 93 % are seen with probability 3e-9.
  const int tallies = 4000;
  // Learned redraws: most hits light, and where no kernel is the weight is 1 / e.
  const Mixture learned{{{0.1, 0.05}, {0.03, 0.2}, {0.01, 2}}};
  const Mixture equal{{{0.02, 1}}};
  for (const std::uint64_t draws : {300u, 1000u}) {
    EXPECT_GE(coverage(learned, draws, tallies), 0.93) << draws;
    EXPECT_GE(coverage(equal, draws, tallies), 0.93) << draws;
  }
  // And the interval is not so wide that it says nothing.
  EXPECT_LE(coverage(learned, 1000, tallies), 0.995);
}

TEST(Odds, OfSharesCoverTheTruth) {
  // 2000 tallies: with a true coverage of 95 % fewer than 92.5 % are seen with probability 1e-6.
  for (const double probability : {0.05, 0.5, 0.97, 0.999})
    for (const std::uint64_t draws : {10u, 50u, 200u})
      EXPECT_GE(coverage({{{probability, 1}}}, draws, 2000), 0.925) << probability << " in " << draws;
}

TEST(Odds, OfSeveralBasesCoverTheTruth) {
  // Plain draws and learned ones of the same truth, few and many of either.
  const Mixture plain{{{0.031, 1}}}, learned{{{0.1, 0.05}, {0.03, 0.2}, {0.01, 2}}};
  ASSERT_NEAR(plain.mean(), learned.mean(), 1e-12);
  constexpr int kTallies = 2000;
  for (const auto& [of_prior, of_learned] : std::vector<std::pair<std::uint64_t, std::uint64_t>>{
           {125, 500}, {2000, 100}, {2000, 500}, {10'000, 10'000}}) {
    int covered = 0;
    for (int i = 0; i < kTallies; ++i) {
      RandomStream random = stream(203, static_cast<std::uint64_t>(i));
      OddsTally first{.basis = OddsBasis::rejection}, second{.basis = OddsBasis::learned};
      plain.add_draws(of_prior, random, first);
      learned.add_draws(of_learned, random, second);
      OddsPool pool;
      pool.add(second);
      pool.add(first);
      const auto found = odds(pool.tally());
      covered += found->low <= plain.mean() && plain.mean() <= found->high;
    }
    EXPECT_GE(covered, 0.925 * kTallies) << of_prior << ", " << of_learned;
  }
}

TEST(Odds, WhatIsPooledIsWhatThereIs) {
  const OddsTally ladder{OddsBasis::ladder, 100, 90, 50, 50, 1};
  OddsPool pool;
  EXPECT_EQ(pool.tally().basis, OddsBasis::none);
  pool.add({});
  pool.add(ladder);
  EXPECT_EQ(pool.tally().basis, OddsBasis::ladder);
  pool.add(tally_of(1000, 30));
  EXPECT_EQ(pool.tally().basis, OddsBasis::rejection);
  EXPECT_EQ(pool.tally().draws, 1000u) << "a ladder's odds are rough";
  // Learned draws that have just begun do not take the place of what is known.
  pool.add({OddsBasis::learned, 5, 0, 0, 0, 0});
  EXPECT_EQ(pool.tally().draws, 1000u);
  EXPECT_EQ(pool.tally().hits, 30u);
  pool.add({OddsBasis::learned, 195, 90, 9, 0.9, 0.1});
  EXPECT_EQ(pool.tally().basis, OddsBasis::learned);
  EXPECT_EQ(pool.tally().draws, 200u);
  EXPECT_EQ(pool.tally().hits, 90u);
  // Nor does a chain that learned throw away many plain draws.
  pool.add(tally_of(9000, 270));
  EXPECT_EQ(pool.tally().basis, OddsBasis::rejection);
  EXPECT_EQ(pool.tally().hits, 300u);
}

TEST(Odds, AddingTalliesIsPoolingTheirDraws) {
  const Mixture mixture{{{0.1, 0.125}, {0.05, 0.5}, {0.01, 2}}};  // sums of these are exact
  RandomStream random = stream(202), again = stream(202);
  OddsTally pooled, sum;
  for (const std::uint64_t draws : {1u, 500u, 2000u}) {
    OddsTally part;
    mixture.add_draws(draws, random, part);
    mixture.add_draws(draws, again, pooled);
    sum.add(part);
  }
  EXPECT_GT(pooled.hits, 300u);
  EXPECT_EQ(sum.draws, pooled.draws);
  EXPECT_EQ(sum.hits, pooled.hits);
  EXPECT_EQ(sum.sum, pooled.sum);
  EXPECT_EQ(sum.squares, pooled.squares);
  EXPECT_EQ(sum.largest, pooled.largest);
}

TEST(Odds, NamesOfABasisAreReadBack) {
  for (const OddsBasis basis : {OddsBasis::none, OddsBasis::ladder, OddsBasis::rejection, OddsBasis::learned})
    EXPECT_EQ(odds_basis_from(to_string(basis)), basis);
  EXPECT_EQ(odds_basis_from("a guess"), OddsBasis::none);
}

}  // namespace
}  // namespace retake::tests
