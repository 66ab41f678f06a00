// The lane: regulation lengths, the pins' spots and their profile, in the project's frame.
// Paper, section 5.2 and appendix A.1. It must not know Bullet.
//
// x runs down the lane, y up, z to the bowler's right; the origin is the head pin's spot on the lane.
#pragma once

#include <array>

#include <Eigen/Core>

namespace retake::bowling {

inline constexpr double kLaneHalfWidth = 0.52705;  ///< [m], 41.5 inches
inline constexpr double kFoulLine = -18.288;       ///< [m], 60 feet before the head pin
inline constexpr double kDeckEnd = 0.868;          ///< [m], the tail of the pin deck
inline constexpr double kGutterDepth = 0.0889;     ///< [m], 3.5 inches
inline constexpr double kWall = 0.762;      ///< [m], |z| of the gutters' outer sides and of the side walls
inline constexpr double kPitFloor = -0.10;  ///< [m], chosen: the carpet behind the deck
inline constexpr double kCushion = 1.6;     ///< [m], chosen: where the pit ends

inline constexpr double kBallLargestRadius = 0.1085;  ///< [m], 8.5 inches across (A.1)
inline constexpr double kBallLargestDensity = 1440;   ///< [kg/m^3] (A.1)

inline constexpr int kPinCount = 10;
inline constexpr double kPinSpacing = 0.3048;  ///< [m], 12 inches between spots
inline constexpr double kPinMass = 1.55;       ///< [kg], 3 lb 6 oz to 3 lb 10 oz
inline constexpr double kPinHeight = 0.381;    ///< [m], 15 inches

/// Where a pin, 1 to 10, is to stand [m].
inline Eigen::Vector3d pin_spot(int pin) {
  const int row = pin == 1 ? 0 : pin <= 3 ? 1 : pin <= 6 ? 2 : 3;
  const int first = 1 + row * (row + 1) / 2;
  constexpr double kRow = 0.26396454;  // kPinSpacing times the height of an equilateral triangle of side 1
  return {row * kRow, 0, kPinSpacing * ((pin - first) - 0.5 * row)};
}

/// The outline of a pin: height above the base and radius [m] of rings from the base up; straight in between.
/// The base is flat and the crown closes at radius 0. USBC's heights and diameters, and a round head.
inline constexpr std::size_t kRings = 19;
inline constexpr double kInch = 0.0254;
inline constexpr std::array<std::array<double, 2>, kRings> kPinProfile = {{
    {0 * kInch, 1.0155 * kInch},
    {0.75 * kInch, 1.414 * kInch},
    {2.25 * kInch, 1.953 * kInch},
    {3.375 * kInch, 2.255 * kInch},
    {4.5 * kInch, 2.383 * kInch},
    {5.875 * kInch, 2.2815 * kInch},
    {7.25 * kInch, 1.8515 * kInch},
    {8.625 * kInch, 1.236 * kInch},
    {9.375 * kInch, 0.9825 * kInch},
    {10 * kInch, 0.8985 * kInch},
    {10.875 * kInch, 0.935 * kInch},
    {11.75 * kInch, 1.047 * kInch},
    {12.625 * kInch, 1.203 * kInch},
    {13.5 * kInch, 1.2735 * kInch},
    {13.95 * kInch, 1.2535 * kInch},
    {14.35 * kInch, 1.1095 * kInch},
    {14.65 * kInch, 0.877 * kInch},
    {14.88 * kInch, 0.541 * kInch},
    {15 * kInch, 0},
}};

/// What uniform density makes of the profile.
struct PinBody {
  double centre_of_mass;      ///< [m] above the base
  double axial_inertia;       ///< [kg m^2] about the pin's axis
  double transverse_inertia;  ///< [kg m^2] about an axis through the centre of mass, across the pin
};
PinBody pin_body();

}  // namespace retake::bowling
