// The lane's lengths and the pin's body against what is published and measured. Paper, section 5.2.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "worlds/bowling/lane.h"

namespace retake::tests {
namespace {

using namespace bowling;

TEST(BowlingLane, PinsHaveTheBodyOfAUsbcPin) {
  const PinBody pin = pin_body();
  // USBC: the centre of gravity lies 5 5/8 to 5 15/16 inches above the base.
  EXPECT_GT(pin.centre_of_mass, 0.1429);
  EXPECT_LT(pin.centre_of_mass, 0.1508);
  EXPECT_NEAR(pin.transverse_inertia, 0.01311, 0.00001);
  EXPECT_NEAR(pin.axial_inertia, 0.00189, 0.00001);
}

/// Moments of the same outline by plain summation over thin discs.
TEST(BowlingLane, PinsHaveTheMomentsOfTheirOutline) {
  double mass = 0, first = 0, second = 0, axial = 0;
  constexpr int kDiscs = 200000;
  std::size_t ring = 0;
  for (int i = 0; i < kDiscs; ++i) {
    const double h = kPinHeight * (i + 0.5) / kDiscs;
    while (kPinProfile[ring + 1][0] < h)
      ++ring;
    const auto [h0, r0] = kPinProfile[ring];
    const auto [h1, r1] = kPinProfile[ring + 1];
    const double r = r0 + (r1 - r0) * (h - h0) / (h1 - h0), disc = r * r;
    mass += disc;
    first += disc * h;
    second += disc * (h * h + r * r / 4);
    axial += disc * r * r / 2;
  }
  const double centre = first / mass, scale = kPinMass / mass;
  const PinBody pin = pin_body();
  EXPECT_NEAR(pin.centre_of_mass, centre, 1e-8);
  EXPECT_NEAR(pin.axial_inertia, scale * axial, 1e-8);
  EXPECT_NEAR(pin.transverse_inertia, scale * second - kPinMass * centre * centre, 1e-8);
}

TEST(BowlingLane, AStandingPinTipsAtTenDegrees) {
  const double angle = std::atan2(kPinProfile[0][1], pin_body().centre_of_mass) * 180 / std::numbers::pi;
  EXPECT_NEAR(angle, 9.9, 0.05);
}

TEST(BowlingLane, TheProfileClosesAndIsAsHighAndWideAsTheRulesSay) {
  EXPECT_NEAR(kPinProfile.back()[0], kPinHeight, 1e-12);
  EXPECT_EQ(kPinProfile.back()[1], 0);
  double widest = 0;
  for (std::size_t i = 0; i < kRings; ++i) {
    widest = std::max(widest, kPinProfile[i][1]);
    if (i > 0) {
      EXPECT_GT(kPinProfile[i][0], kPinProfile[i - 1][0]);
    }
  }
  EXPECT_NEAR(2 * widest, 4.766 * kInch, 1e-9);
}

TEST(BowlingLane, SpotsFormTheTriangle) {
  EXPECT_EQ(pin_spot(1), Eigen::Vector3d::Zero());
  // Neighbours stand 12 inches apart, and nothing nearer.
  for (int a = 1; a <= kPinCount; ++a)
    for (int b = a + 1; b <= kPinCount; ++b)
      EXPECT_GT((pin_spot(a) - pin_spot(b)).norm(), kPinSpacing - 1e-8) << a << " and " << b;
  for (const auto& [a, b] : {std::pair{1, 2}, {1, 3}, {2, 3}, {2, 4}, {5, 8}, {6, 10}, {7, 8}, {9, 10}})
    EXPECT_NEAR((pin_spot(a) - pin_spot(b)).norm(), kPinSpacing, 1e-8) << a << " and " << b;
  // The corner pins stand 2.75 inches from the lane's edge, the 7 on the left (-z).
  EXPECT_NEAR(pin_spot(7).z(), -kLaneHalfWidth + 2.75 * kInch, 1e-9);
  EXPECT_NEAR(pin_spot(10).z(), kLaneHalfWidth - 2.75 * kInch, 1e-9);
  EXPECT_NEAR(pin_spot(7).x(), 31.177 * kInch, 1e-4);
  EXPECT_LT(pin_spot(10).x(), kDeckEnd);
  EXPECT_LT(pin_spot(2).z(), pin_spot(3).z());
  EXPECT_EQ(pin_spot(5).z(), 0);
}

}  // namespace
}  // namespace retake::tests
