// Die: a rounded box and how it moves. Paper, section 5.4. It must not know what it rolls on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace retake::dice {

/// A box whose edges are rounded, centred, its sides along the axes of its own frame. It is touched at its
/// features: spheres as large as the rounding in its corners, in the middles of its edges and of its faces.
class DieShape {
 public:
  static constexpr std::size_t kFeatures = 26;

  /// Sides along x, y and z [m], radius of the rounding [m], density [kg/m3]. Requires: positive; the
  /// rounding less than half of every side.
  DieShape(const Eigen::Vector3d& sides, double rounding, double density);

  const Eigen::Vector3d& half_extents() const { return half_extents_; }  ///< [m]
  double rounding() const { return rounding_; }                          ///< [m]
  double mass() const { return mass_; }                                  ///< [kg], as if it were not rounded
  /// Principal moments of inertia, divided by the mass [m2].
  const Eigen::Vector3d& inertia() const { return inertia_; }
  /// True if the principal moments are equal.
  bool is_cube() const { return is_cube_; }
  /// Centres of the features, in the die's frame [m].
  const std::array<Eigen::Vector3d, kFeatures>& features() const { return features_; }
  double reach() const { return reach_; }  ///< [m] from the centre to the farthest feature's centre
  double side() const { return 2 * half_extents_.mean(); }  ///< [m], of a cube as large

 private:
  Eigen::Vector3d half_extents_;
  double rounding_, mass_;
  Eigen::Vector3d inertia_;
  bool is_cube_;
  std::array<Eigen::Vector3d, kFeatures> features_;
  double reach_;
};

/// All that decides how a die goes on.
struct DieState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();            ///< [m] of the centre
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();     ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();    ///< [rad/s]
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< from the die's frame
  std::int32_t quiet_steps = 0;                                  ///< successive slow ones

  bool same_bits(const DieState& other) const;
};

/// Turns by a rotation vector of less than a radian: exact to its fourth power, by arithmetic alone.
Eigen::Quaterniond turned(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& angle);

/// The energy of motion and height [J], gravity [m/s2] along -y.
double energy(const DieShape& shape, const DieState& state, double gravity);

}  // namespace retake::dice
