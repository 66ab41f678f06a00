// Standard gravity, for every world.
// doc/design.md, section 2.
#pragma once

namespace retake {

inline constexpr double kGravity = 9.81;  ///< [m/s^2], downwards (-y); standard gravity to three digits

}  // namespace retake
