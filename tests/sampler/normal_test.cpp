// The normal quantile against values computed with 60 digits, and against the cumulative distribution
// function.
#include "sampler/normal.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

TEST(Normal, QuantileHasKnownValues) {
  const struct {
    double probability;
    double z;
  } known[] = {
      {1e-300, -37.047096299361199237}, {1e-20, -9.2623400897984075796}, {1e-9, -5.9978070150076868614},
      {1e-4, -3.7190164854556805523},   {0.01, -2.3263478740408410931},  {0.025, -1.9599639845400542118},
      {0.075, -1.4395314709384559349},  {0.1, -1.2815515655446004353},   {0.25, -0.6744897501960817432},
      {0.6, 0.25334710313579974132},    {0.975, 1.9599639845400538556}};
  for (const auto& [probability, z] : known) {
    EXPECT_NEAR(normal_quantile(probability) / z, 1.0, 1e-15) << probability;
  }
}

TEST(Normal, CumulativeDistributionHasKnownValues) {
  const struct {
    double z;
    double probability;
  } known[] = {{-37.0, 5.7255712225245768227e-300},
               {-10.0, 7.619853024160526066e-24},
               {-3.0, 0.0013498980316300945267},
               {-1.0, 0.15865525393145705141},
               {0.0, 0.5},
               {0.5, 0.69146246127401310364},
               {2.0, 0.9772498680518207928},
               {6.0, 0.99999999901341235496}};
  for (const auto& [z, probability] : known) {
    EXPECT_NEAR(normal_cdf(z) / probability, 1.0, 1e-16 * (10.0 + 4.0 * z * z)) << z;
  }
  EXPECT_EQ(normal_cdf(-kInfinity), 0.0);
  EXPECT_EQ(normal_cdf(kInfinity), 1.0);
}

// The cumulative distribution function magnifies a relative error of z by about z^2.
TEST(Normal, RoundTripReturnsTheProbability) {
  const auto expect_round_trip = [](double probability) {
    const double z = normal_quantile(probability);
    EXPECT_NEAR(normal_cdf(z) / probability, 1.0, 1e-15 * (2.0 + z * z)) << probability;
  };
  for (int i = 1; i < 10'000; ++i)
    expect_round_trip(i / 10'000.0);
  for (double probability = 0.5; probability > 1e-300; probability *= 0.7)
    expect_round_trip(probability);
}

TEST(Normal, QuantileIsOddAboutOneHalf) {
  for (int i = 0; i <= 512; ++i) {
    const double probability = i / 1024.0;
    EXPECT_EQ(normal_quantile(1.0 - probability), -normal_quantile(probability)) << probability;
  }
}

TEST(Normal, QuantileRisesAcrossTheSeamsOfItsBranches) {
  for (const double seam : {0.075, std::exp(-25.0)}) {
    double last = normal_quantile(seam * (1.0 - 1e-12));
    for (int i = -999; i <= 1000; ++i) {
      const double z = normal_quantile(seam * (1.0 + i * 1e-15));
      EXPECT_NEAR(z / last, 1.0, 1e-11);
      EXPECT_GE(z, last - 1e-14) << seam << " + " << i;
      last = z;
    }
  }
}

TEST(Normal, QuantileAtAndBeyondTheEnds) {
  EXPECT_EQ(normal_quantile(0.0), -kInfinity);
  EXPECT_EQ(normal_quantile(1.0), kInfinity);
  EXPECT_EQ(normal_quantile(0.5), 0.0);
  EXPECT_TRUE(std::isfinite(normal_quantile(std::numeric_limits<double>::denorm_min())));
  for (const double outside : {-0.1, 1.1, kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(normal_quantile(outside))) << outside;
  }
}

}  // namespace
}  // namespace retake::tests
