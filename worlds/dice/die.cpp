// See die.h.
#include "worlds/dice/die.h"

#include <cstring>

#include "sampler/check.h"

namespace retake::dice {

using Eigen::Quaterniond;
using Eigen::Vector3d;

DieShape::DieShape(const Vector3d& sides, double rounding, double density)
    : half_extents_(sides / 2), rounding_(rounding), mass_(density * sides.prod()) {
  CHECK(density > 0 && rounding > 0 && 2 * rounding < sides.minCoeff(), density, rounding, sides.transpose());
  const Vector3d squares = sides.cwiseAbs2();
  inertia_ = (Vector3d::Constant(squares.sum()) - squares) / 12;
  is_cube_ = sides.x() == sides.y() && sides.y() == sides.z();
  const Vector3d core = half_extents_ - Vector3d::Constant(rounding);
  std::size_t feature = 0;
  for (const int x : {-1, 0, 1})
    for (const int y : {-1, 0, 1})
      for (const int z : {-1, 0, 1})
        if (x != 0 || y != 0 || z != 0) features_[feature++] = Vector3d(x, y, z).cwiseProduct(core);
  reach_ = core.norm();
}

bool DieState::same_bits(const DieState& other) const {
  const auto same = [](const auto& a, const auto& b) {
    return std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
  };
  return same(position, other.position) && same(linear_velocity, other.linear_velocity) &&
         same(angular_velocity, other.angular_velocity) && same(rotation.coeffs(), other.rotation.coeffs()) &&
         quiet_steps == other.quiet_steps;
}

Quaterniond turned(const Quaterniond& rotation, const Vector3d& angle) {
  // tan(a / 2) = a / 2 (1 + a^2 / 12) up to the fifth power.
  const Vector3d half = (0.5 * (1 + angle.squaredNorm() * (1.0 / 12))) * angle;
  return (Quaterniond(1, half.x(), half.y(), half.z()) * rotation).normalized();
}

double energy(const DieShape& shape, const DieState& state, double gravity) {
  const Vector3d turning = state.rotation.conjugate() * state.angular_velocity;
  const double moving = state.linear_velocity.squaredNorm() + shape.inertia().dot(turning.cwiseAbs2());
  return shape.mass() * (0.5 * moving + gravity * state.position.y());
}

}  // namespace retake::dice
