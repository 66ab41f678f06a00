// See sphere.h.
#include "worlds/impulse/sphere.h"

#include <bit>
#include <cmath>
#include <numbers>

namespace retake::impulse {
bool same_bits(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::bit_cast<std::uint64_t>(a.x()) == std::bit_cast<std::uint64_t>(b.x()) &&
         std::bit_cast<std::uint64_t>(a.y()) == std::bit_cast<std::uint64_t>(b.y()) &&
         std::bit_cast<std::uint64_t>(a.z()) == std::bit_cast<std::uint64_t>(b.z());
}

double Settings::mass() const {
  return density * 4 / 3 * std::numbers::pi * radius * radius * radius;
}

std::int32_t Settings::rest_steps() const {
  return static_cast<std::int32_t>(std::lround(rest_time / time_step));
}

bool SphereState::same_bits(const SphereState& other) const {
  return impulse::same_bits(position, other.position) &&
         impulse::same_bits(linear_velocity, other.linear_velocity) &&
         impulse::same_bits(angular_velocity, other.angular_velocity) && quiet_steps == other.quiet_steps;
}

}  // namespace retake::impulse
