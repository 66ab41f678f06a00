// Draw and density are one object: every distribution draws what its log density says.
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include "sampler/distribution.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

struct NamedDistribution {
  std::string name;
  Distribution distribution;
};

class DistributionTest : public ::testing::TestWithParam<NamedDistribution> {
 protected:
  /// Where all but 1e-8 of a continuous distribution lies.
  std::pair<double, double> range() const {
    const Distribution& of = GetParam().distribution;
    if (of.kind() == Distribution::Kind::uniform) return {of.low(), of.high()};
    return {of.mean() - 6 * of.standard_deviation(), of.mean() + 6 * of.standard_deviation()};
  }
  static double density(double value) { return std::exp(GetParam().distribution.log_density(value)); }
  static bool is_continuous() { return GetParam().distribution.kind() != Distribution::Kind::on_off; }
};

INSTANTIATE_TEST_SUITE_P(
    All, DistributionTest,
    ::testing::Values(NamedDistribution{"uniform", Distribution::uniform(-2, 5)},
                      NamedDistribution{"narrow_uniform", Distribution::uniform(0.2376, 0.2377)},
                      NamedDistribution{"gaussian", Distribution::gaussian(0, 1)},
                      NamedDistribution{"far_gaussian", Distribution::gaussian(-40, 0.0001)},
                      NamedDistribution{"on_off", Distribution::on_off(0.5)},
                      NamedDistribution{"rarely_on", Distribution::on_off(0.02)}),
    [](const auto& tested) { return tested.param.name; });

TEST_P(DistributionTest, IsNormalised) {
  if (!is_continuous()) {
    EXPECT_NEAR(density(0) + density(1), 1, 1e-15);
    return;
  }
  const auto [from, to] = range();
  EXPECT_NEAR(integrate(density, from, to), 1, 1e-8);
}

TEST_P(DistributionTest, MeanAndStandardDeviationAreThoseOfTheDensity) {
  const Distribution& of = GetParam().distribution;
  double mean = density(1), square = density(1);
  if (is_continuous()) {
    const auto [from, to] = range();
    mean = integrate([](double value) { return value * density(value); }, from, to);
    square =
        integrate([&](double value) { return (value - mean) * (value - mean) * density(value); }, from, to);
  } else {
    square -= mean * mean;
  }
  EXPECT_NEAR(of.mean(), mean, 1e-7 * (std::abs(mean) + of.standard_deviation()));
  EXPECT_NEAR(of.standard_deviation(), std::sqrt(square), 1e-6 * of.standard_deviation());
}

TEST_P(DistributionTest, DrawsWhatTheDensitySays) {
  constexpr int kDraws = 100000;
  const Distribution& of = GetParam().distribution;
  RandomStream random = stream(11);
  if (!is_continuous()) {
    std::vector<double> counts(2, 0);
    for (int i = 0; i < kDraws; ++i) {
      const double draw = of.draw(random);
      ASSERT_TRUE(draw == 0 || draw == 1);
      ++counts[draw == 1 ? 1 : 0];
    }
    EXPECT_GT(chi_square_p(counts, {kDraws * density(0), kDraws * density(1)}), kErrorRate);
    return;
  }
  // Forty bins over 3 standard deviations each side (or the support), and one for what lies outside.
  constexpr std::size_t kBins = 40;
  const bool bounded = of.kind() == Distribution::Kind::uniform;
  const double from = bounded ? of.low() : of.mean() - 3 * of.standard_deviation();
  const double to = bounded ? of.high() : of.mean() + 3 * of.standard_deviation();
  const double width = (to - from) / kBins;
  std::vector<double> counts(kBins + 1, 0), expected;
  for (int i = 0; i < kDraws; ++i) {
    const double draw = of.draw(random);
    ASSERT_TRUE(std::isfinite(of.log_density(draw))) << draw;
    const double bin = std::floor((draw - from) / width);
    ++counts[bin >= 0 && bin < kBins ? static_cast<std::size_t>(bin) : kBins];
  }
  double inside = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const double low = from + static_cast<double>(bin) * width;
    expected.push_back(kDraws * integrate(density, low + 1e-9 * width, low + width * (1 - 1e-9), 20));
    inside += expected.back();
  }
  if (bounded) {
    EXPECT_EQ(counts.back(), 0);
    counts.pop_back();
  } else {
    expected.push_back(kDraws - inside);
  }
  EXPECT_GT(chi_square_p(counts, expected), kErrorRate);
}

TEST(Distribution, DensitiesHaveKnownValues) {
  EXPECT_NEAR(Distribution::uniform(-2, 5).log_density(0), -std::log(7), 1e-15);
  EXPECT_NEAR(Distribution::gaussian(1, 2).log_density(4), -2.7370857137646180, 1e-14);
  EXPECT_NEAR(Distribution::on_off(0.02).log_density(1), std::log(0.02), 1e-15);
  EXPECT_NEAR(Distribution::on_off(0.02).log_density(0), std::log(0.98), 1e-15);
}

TEST(Distribution, OutsideTheSupportIsImpossible) {
  for (const double value : {-0.0001, 1.0001, 1e300, -kInfinity, kInfinity, std::nan("")}) {
    EXPECT_EQ(Distribution::uniform(0, 1).log_density(value), -kInfinity) << value;
    EXPECT_EQ(Distribution::on_off(0.5).log_density(value), -kInfinity) << value;
  }
  EXPECT_EQ(Distribution::on_off(0.5).log_density(0.5), -kInfinity);
  EXPECT_EQ(Distribution::gaussian(0, 1).log_density(kInfinity), -kInfinity);
  for (const double value : {0.0, 1.0})
    EXPECT_EQ(Distribution::uniform(0, 1).log_density(value), 0);
}

TEST(Distribution, WrapKeepsWhatIsInRangeAndBringsTheRestInAtTheOtherEnd) {
  const Distribution of = Distribution::uniform(-2, 5);
  for (const double value : {-2.0, -1.9, 0.0, 4.999, 5.0})
    EXPECT_EQ(of.wrap(value), value);
  EXPECT_NEAR(of.wrap(5.5), -1.5, 1e-12);
  EXPECT_NEAR(of.wrap(-2.25), 4.75, 1e-12);
  EXPECT_NEAR(of.wrap(0.5 + 7 * 3), 0.5, 1e-12);
  EXPECT_NEAR(of.wrap(0.5 - 7 * 30), 0.5, 1e-12);
}

TEST(Distribution, WrapNeverLeavesTheSupport) {
  const Distribution of = Distribution::uniform(0.1, 0.3);
  RandomStream random = stream(12);
  for (int i = 0; i < 100000; ++i) {
    const double wrapped = of.wrap(0.2 + std::exp(20 * random.uniform() - 15) * random.gaussian());
    ASSERT_TRUE(std::isfinite(of.log_density(wrapped))) << wrapped;
  }
  for (double value = 0.1; value > 0.0999999999; value = std::nextafter(value, 0) - 1e-14)
    ASSERT_TRUE(std::isfinite(of.log_density(of.wrap(value)))) << value;
}

TEST(Distribution, WrapLeavesGaussiansAndSwitchesAlone) {
  EXPECT_EQ(Distribution::gaussian(0, 1).wrap(1e9), 1e9);
  EXPECT_EQ(Distribution::on_off(0.5).wrap(1.7), 1.7);
}

TEST(DistributionDeathTest, RefusesImpossibleParameters) {
  EXPECT_DEATH(Distribution::uniform(1, 1), "CHECK");
  EXPECT_DEATH(Distribution::uniform(0, std::nan("")), "CHECK");
  EXPECT_DEATH(Distribution::gaussian(0, 0), "CHECK");
  EXPECT_DEATH(Distribution::on_off(1), "CHECK");
}

}  // namespace
}  // namespace retake::tests
