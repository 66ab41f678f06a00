// RandomStream: a pure function of its address, by an independent Philox4x64-10; and random enough in the
// order in which chains use it. All statistical tests fix their seeds; each comparison errs with probability
// 1e-6.
#include "sampler/random.h"

#include <array>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"

namespace retake::tests {
namespace {

__extension__ using Wide = unsigned __int128;
using Block = std::array<std::uint64_t, 4>;

/// Philox4x64-10 as Salmon et al. 2011, section 3.3 and table 2, describe it.
Block philox(Block counter, std::array<std::uint64_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const Wide first = Wide{0xD2E7470EE14C6C93} * counter[0], second = Wide{0xCA5A826395121157} * counter[2];
    counter = {
        static_cast<std::uint64_t>(second >> 64) ^ counter[1] ^ key[0], static_cast<std::uint64_t>(second),
        static_cast<std::uint64_t>(first >> 64) ^ counter[3] ^ key[1], static_cast<std::uint64_t>(first)};
    key[0] += 0x9E3779B97F4A7C15;
    key[1] += 0xBB67AE8584CAA73B;
  }
  return counter;
}

/// A few addresses that differ from a first one in one field each.
std::vector<RandomAddress> neighbours() {
  const RandomAddress first{
      .seed = 7, .chain = 3, .replica = 2, .purpose = Purpose::proposal, .iteration = 1000};
  std::vector<RandomAddress> addresses(11, first);
  addresses[1].seed = 8;
  addresses[2].chain = 4;
  addresses[3].replica = 3;
  addresses[4].purpose = Purpose::acceptance;
  addresses[5].purpose = Purpose::initial;
  addresses[6].iteration = 1001;
  addresses[7].seed += std::uint64_t{1} << 63;
  addresses[8].chain += 1u << 31;
  addresses[9].iteration += std::uint64_t{1} << 40;
  addresses[10].method = 1;
  return addresses;
}

TEST(Random, HasThePublishedKnownAnswer) {
  // Random123 1.x, kat_vectors: philox4x64 10, counter and key 0.
  RandomStream random({});
  EXPECT_EQ(random.bits(), 0x16554d9eca36314cU);
  EXPECT_EQ(random.bits(), 0xdb20fe9d672d0fdcU);
  EXPECT_EQ(random.bits(), 0xd7e772cee186176bU);
  EXPECT_EQ(random.bits(), 0x7e68b68aec7ba23bU);
}

TEST(Random, DrawsAreTheDocumentedFunctionOfTheirAddress) {
  for (const RandomAddress& address : neighbours()) {
    RandomStream random(address);
    const std::array<std::uint64_t, 2> key{
        address.seed, (std::uint64_t{address.chain} << 32) | (std::uint64_t{address.replica} << 16) |
                          (std::uint64_t{address.method} << 8) | static_cast<std::uint64_t>(address.purpose)};
    for (std::uint64_t draw = 0; draw < 1000; ++draw)
      ASSERT_EQ(random.bits(), philox({address.iteration, draw / 4, 0, 0}, key)[draw % 4]) << draw;
  }
}

TEST(Random, EveryFieldOfTheAddressGivesAnotherStream) {
  // 11 streams of 1,000 draws of 64 bits: a chance collision has probability 3e-12.
  std::set<std::uint64_t> seen;
  for (const RandomAddress& address : neighbours()) {
    RandomStream random(address);
    for (int draw = 0; draw < 1000; ++draw)
      EXPECT_TRUE(seen.insert(random.bits()).second) << draw;
  }
}

TEST(Random, UniformIsTheMidpointOfItsCellSoThatItReachesNeitherEnd) {
  // A midpoint that a double cannot hold would be rounded, the highest to exactly 1, whose quantile is
  // infinite.
  RandomStream random = stream(1);
  for (int draw = 0; draw < 10000; ++draw) {
    const double u = random.uniform();
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
    ASSERT_EQ(std::fmod(u * 0x1p53, 2), 1) << "draw " << draw << " was rounded";
  }
}

TEST(Random, UniformFollowsItsDistribution) {
  RandomStream random = stream(2);
  std::vector<double> draws(200000), squares;
  for (double& draw : draws)
    squares.push_back(std::pow((draw = random.uniform()) - 0.5, 2));
  EXPECT_LT(std::abs(z_of_mean(draws, 0.5)), kLargestZ);
  EXPECT_LT(std::abs(z_of_mean(squares, 1.0 / 12)), kLargestZ);
  EXPECT_GT(kolmogorov_smirnov_p(draws, [](double u) { return u; }), kErrorRate);
}

TEST(Random, GaussianFollowsItsDistribution) {
  RandomStream random = stream(3);
  std::vector<double> draws(200000), squares, fourths;
  double beyond_three = 0;
  for (double& draw : draws) {
    draw = random.gaussian();
    squares.push_back(draw * draw);
    fourths.push_back(draw * draw * draw * draw);
    beyond_three += std::abs(draw) > 3;
  }
  EXPECT_LT(std::abs(z_of_mean(draws, 0)), kLargestZ);
  EXPECT_LT(std::abs(z_of_mean(squares, 1)), kLargestZ);
  EXPECT_LT(std::abs(z_of_mean(fourths, 3)), kLargestZ);
  EXPECT_LT(std::abs(z_of_share(beyond_three, 200000, 2 * normal_cdf(-3))), kLargestZ);
  EXPECT_GT(kolmogorov_smirnov_p(draws, normal_cdf), kErrorRate);
}

TEST(Random, DrawsOfSuccessiveIterationsAndPurposesAreIndependent) {
  // As chains use them: the first draws of each iteration, for two purposes.
  constexpr std::uint64_t kIterations = 100000;
  std::vector<double> first, by_next, by_acceptance, by_second, by_chain;
  double before = 0.5;
  for (std::uint64_t iteration = 1; iteration <= kIterations; ++iteration) {
    RandomStream proposal = stream(4, iteration, Purpose::proposal);
    const double u = proposal.uniform(), second = proposal.uniform();
    const double acceptance = stream(4, iteration, Purpose::acceptance).uniform();
    const double other =
        RandomStream(
            {.seed = 4, .chain = 1, .replica = 0, .purpose = Purpose::proposal, .iteration = iteration})
            .uniform();
    first.push_back(u);
    by_next.push_back((u - 0.5) * (before - 0.5));
    by_acceptance.push_back((u - 0.5) * (acceptance - 0.5));
    by_second.push_back((u - 0.5) * (second - 0.5));
    by_chain.push_back((u - 0.5) * (other - 0.5));
    before = u;
  }
  EXPECT_GT(kolmogorov_smirnov_p(first, [](double u) { return u; }), kErrorRate);
  for (const auto* products : {&by_next, &by_acceptance, &by_second, &by_chain})
    EXPECT_LT(std::abs(z_of_mean(*products, 0)), kLargestZ);
}

TEST(Random, IndexIsUniform) {
  for (const std::uint64_t count : {2u, 3u, 7u, 30u, 1000u}) {
    RandomStream random = stream(5, count);
    std::vector<double> counts(count, 0);
    for (int draw = 0; draw < 100000; ++draw) {
      const std::uint64_t index = random.index(count);
      ASSERT_LT(index, count);
      ++counts[index];
    }
    const std::vector<double> expected(count, 1e5 / static_cast<double>(count));
    EXPECT_GT(chi_square_p(counts, expected), kErrorRate) << count;
  }
}

TEST(Random, IndexOfOneIsZeroAndTheLargestCountFits) {
  RandomStream random = stream(6);
  std::uint64_t highest = 0;
  for (int draw = 0; draw < 1000; ++draw) {
    EXPECT_EQ(random.index(1), 0u);
    highest = std::max(highest, random.index(std::uint64_t{1} << 32));
  }
  // The highest of 1,000 lies below 0.98 of the range with probability 2e-9.
  EXPECT_LT(highest, std::uint64_t{1} << 32);
  EXPECT_GT(highest, 0.98 * 0x1p32);
}

TEST(Random, BernoulliHasItsProbability) {
  for (const double probability : {0.02, 0.25, 0.5, 0.999}) {
    RandomStream random = stream(7);
    double hits = 0;
    for (int draw = 0; draw < 100000; ++draw)
      hits += random.bernoulli(probability);
    EXPECT_LT(std::abs(z_of_share(hits, 1e5, probability)), kLargestZ) << probability;
  }
}

}  // namespace
}  // namespace retake::tests
