// The dice's table: its spline against a brute-force tensor product and finite differences, its random field,
// and that it does not matter whether control points are made late or given.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "worlds/dice/table.h"

namespace retake::tests {
namespace {

using dice::ControlPoint;
using dice::Table;
using dice::TableContent;
using dice::TableSettings;

/// The cubic cardinal b-spline on [-2, 2], by the recursion of Cox and de Boor.
double cardinal(double x, int degree) {
  if (degree == 0) return x >= 0 && x < 1 ? 1 : 0;
  return (x * cardinal(x, degree - 1) + (degree + 1 - x) * cardinal(x - 1, degree - 1)) / degree;
}

/// The tensor product over every control point within ten cells.
ControlPoint brute_force(const TableSettings& settings, std::uint64_t key, double x, double z) {
  const auto centre_x = static_cast<std::int32_t>(std::lround(x / settings.spacing));
  const auto centre_z = static_cast<std::int32_t>(std::lround(z / settings.spacing));
  ControlPoint sum{0, 0, 0};
  for (std::int32_t i = centre_x - 10; i <= centre_x + 10; ++i)
    for (std::int32_t j = centre_z - 10; j <= centre_z + 10; ++j) {
      const double weight =
          cardinal(x / settings.spacing - i + 2, 3) * cardinal(z / settings.spacing - j + 2, 3);
      const ControlPoint point = physical(settings, control_point_of_key(settings, key, {i, j}));
      sum.height += weight * point.height;
      sum.restitution += weight * point.restitution;
      sum.friction += weight * point.friction;
    }
  return sum;
}

TEST(DiceTable, IsTheTensorProductOfItsControlPoints) {
  for (const double spacing : {0.01, 0.007}) {
    const TableSettings settings{.spacing = spacing};
    Table table(settings);
    const TableContent content{.key = 7, .overrides = {}};
    table.reset(content);
    RandomStream random = stream(301);
    for (int i = 0; i < 300; ++i) {
      const double x = 0.6 * random.uniform() - 0.3, z = 0.6 * random.uniform() - 0.3;
      const ControlPoint wanted = brute_force(settings, content.key, x, z);
      EXPECT_NEAR(table.height(x, z).value, wanted.height, 1e-15);
      EXPECT_NEAR(table.material(x, z).restitution, wanted.restitution, 1e-13);
      EXPECT_NEAR(table.material(x, z).friction, wanted.friction, 1e-13);
    }
  }
}

TEST(DiceTable, SlopesAreTheDerivatives) {
  Table table({});
  const TableContent content{.key = 8, .overrides = {}};
  table.reset(content);
  RandomStream random = stream(302);
  constexpr double kStep = 1e-6;  // [m]
  for (int i = 0; i < 1000; ++i) {
    const double x = 0.4 * random.uniform() - 0.2, z = 0.4 * random.uniform() - 0.2;
    const Table::Height at = table.height(x, z);
    const double along_x = table.height(x + kStep, z).value - table.height(x - kStep, z).value;
    const double along_z = table.height(x, z + kStep).value - table.height(x, z - kStep).value;
    EXPECT_NEAR(at.slope_x, along_x / (2 * kStep), 1e-6);
    EXPECT_NEAR(at.slope_z, along_z / (2 * kStep), 1e-6);
    EXPECT_LE(at.value, table.highest_near(x, z));
    EXPECT_LE(std::hypot(at.slope_x, at.slope_z), table.settings().max_slope());
  }
}

TEST(DiceTable, ControlPointsFollowTheirPrior) {
  const TableSettings settings;
  std::vector<double> height, restitution, friction;
  for (std::int32_t i = 0; i < 200; ++i)
    for (std::int32_t j = 0; j < 200; ++j) {
      const ControlPoint point = control_point_of_key(settings, 9, {i - 100, j - 100});
      height.push_back(point.height);
      restitution.push_back(point.restitution);
      friction.push_back(point.friction);
    }
  const auto expect_moments = [](const std::vector<double>& values, double mean, double deviation) {
    EXPECT_LT(std::abs(z_of_mean(values, mean)), kLargestZ);
    const double error = deviation / std::sqrt(2.0 * static_cast<double>(values.size()));
    EXPECT_NEAR(std::sqrt(moments(values).variance), deviation, kLargestZ * error);
  };
  expect_moments(height, 0, settings.height_deviation);
  expect_moments(restitution, settings.restitution_mean, settings.restitution_deviation);
  expect_moments(friction, settings.friction_mean, settings.friction_deviation);
}

TEST(DiceTable, GivenControlPointsAreTheSameAsThoseOfTheKey) {
  const TableSettings settings;
  TableContent lazy{.key = 10, .overrides = {}}, given{.key = 11, .overrides = {}};
  for (std::int32_t i = -12; i <= 12; ++i)
    for (std::int32_t j = -12; j <= 12; ++j)
      given.overrides.push_back({{i, j}, control_point_of_key(settings, lazy.key, {i, j})});
  Table one(settings), other(settings);
  one.reset(lazy);
  other.reset(given);
  RandomStream random = stream(303);
  for (int i = 0; i < 500; ++i) {
    const double x = 0.2 * random.uniform() - 0.1, z = 0.2 * random.uniform() - 0.1;
    const Table::Height a = one.height(x, z), b = other.height(x, z);
    EXPECT_EQ(a.value, b.value);
    EXPECT_EQ(a.slope_x, b.slope_x);
    EXPECT_EQ(a.slope_z, b.slope_z);
    EXPECT_EQ(one.material(x, z).friction, other.material(x, z).friction);
  }
}

TEST(DiceTable, ValuesDoNotDependOnWhatWasLookedAtBefore) {
  Table table({}), far({});
  const TableContent content{.key = 12, .overrides = {{{3, 4}, {0.001, 0.9, 0.1}}}};
  table.reset(content);
  far.reset(content);
  for (int i = 0; i < 400; ++i)  // overwrites whatever a cache can hold
    far.height(0.01 * i, -0.02 * i);
  for (int i = 0; i < 100; ++i) {
    const double x = 0.001 * i, z = 0.0007 * i;
    EXPECT_EQ(table.height(x, z).value, far.height(x, z).value);
    EXPECT_EQ(table.material(x, z).restitution, far.material(x, z).restitution);
  }
}

TEST(DiceTable, LogsWhenSomebodyLooksAtAControlPointForTheFirstTime) {
  Table table({});
  const TableContent content{.key = 13, .overrides = {}};
  table.reset(content);
  std::vector<dice::FirstTouch> log, of_another;
  table.look_as(0, 3, &log);
  table.height(0.025, 0.035);
  ASSERT_EQ(log.size(), 16u);
  table.look_as(0, 5, &log);
  table.height(0.026, 0.036);
  EXPECT_EQ(log.size(), 16u);
  table.height(0.035, 0.035);
  ASSERT_EQ(log.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(log[i].step, i < 16 ? 3 : 5);
    EXPECT_TRUE(log[i].place.x >= 1 && log[i].place.x <= 5 && log[i].place.z >= 2 && log[i].place.z <= 5);
  }

  table.look_as(1, 6, &of_another);
  table.height(0.035, 0.035);
  EXPECT_EQ(of_another.size(), 16u) << "another one has not looked at it before";
  EXPECT_EQ(log.size(), 20u);
  table.look_as(0, 7, &log);
  table.height(0.035, 0.035);
  EXPECT_EQ(log.size(), 20u);

  // Who takes over a log logs the rest only.
  Table again({});
  again.reset(content);
  again.restore(1, of_another);
  std::vector<dice::FirstTouch> rest;
  again.look_as(1, 8, &rest);
  again.height(0.035, 0.035);
  EXPECT_TRUE(rest.empty());
  again.height(0.045, 0.035);
  EXPECT_EQ(rest.size(), 4u);
}

TEST(DiceTable, ControlPointsAreGaussianAndTheSurfaceIsPhysical) {
  const dice::TableSettings settings;
  const auto flat = [](const ControlPoint& point) {
    TableContent content;
    for (std::int32_t x = 0; x < 5; ++x)
      for (std::int32_t z = 0; z < 5; ++z)
        content.overrides.push_back({{x, z}, point});
    return content;
  };
  Table table(settings);
  const TableContent far = flat({.height = 1, .restitution = 3, .friction = -2});
  table.reset(far);
  EXPECT_DOUBLE_EQ(table.height(0.02, 0.02).value, settings.max_height());
  EXPECT_DOUBLE_EQ(table.material(0.02, 0.02).restitution, 0.95);
  EXPECT_DOUBLE_EQ(table.material(0.02, 0.02).friction, 0.02);
  const TableContent low = flat({.height = -1, .restitution = -3, .friction = 0.4});
  table.reset(low);
  EXPECT_DOUBLE_EQ(table.height(0.02, 0.02).value, -settings.max_height());
  EXPECT_DOUBLE_EQ(table.material(0.02, 0.02).restitution, 0);
  EXPECT_DOUBLE_EQ(table.material(0.02, 0.02).friction, 0.4);
}

}  // namespace
}  // namespace retake::tests
