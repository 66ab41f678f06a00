// Placement: where the control grid lies in the world, and how a die is painted. Physics runs in the grid's
// frame; this is applied to what it gives. Paper, section 5.4. It must not know how dice move.
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "worlds/animation.h"

namespace retake::dice {

/// A rigid map from the grid's frame to the world, or one that mirrors: then z changes its sign before the
/// rest is done. Dice are mirror symmetric, so a mirrored motion is a motion of the same die.
class Placement {
 public:
  /// The identity: the grid is glued to the world.
  Placement() = default;
  /// Leads `from` to `to`, which have the same height, and the direction (cos, 0, sin) of `heading_in_grid`
  /// to that of `heading`, which are unit vectors (x, z).
  Placement(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector2d& heading_in_grid,
            const Eigen::Vector2d& heading, bool mirrored);

  Eigen::Vector3d point(const Eigen::Vector3d& in_grid) const { return to_ + axes_ * (in_grid - from_); }
  Eigen::Vector3d direction(const Eigen::Vector3d& in_grid) const { return axes_ * in_grid; }
  /// How a box that is turned so in the grid's frame is turned in the world.
  Eigen::Quaterniond rotation(const Eigen::Quaterniond& in_grid) const;
  Eigen::Vector3d point_in_grid(const Eigen::Vector3d& point) const {
    return from_ + axes_.transpose() * (point - to_);
  }
  Eigen::Vector3d direction_in_grid(const Eigen::Vector3d& direction) const {
    return axes_.transpose() * direction;
  }
  bool mirrored() const { return mirrored_; }

 private:
  Eigen::Vector3d from_ = Eigen::Vector3d::Zero(), to_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();  ///< after mirroring
  bool mirrored_ = false;
};

/// The rotations of a cube. Painting a die by one of them turns what is painted within the die, and changes
/// nothing of how it moves: the painted die is turned by the die's rotation times that of the paint.
inline constexpr std::size_t kPaints = 24;
inline constexpr std::size_t kPlainPaint = 0;  ///< the identity
const std::array<Eigen::Quaterniond, kPaints>& paints();

/// The face with so many pips, from 1 to 6: its outward normal in the painted die's frame. Opposite faces add
/// up to seven, and 1, 2 and 3 go around their corner counter-clockwise.
Eigen::Vector3d face_normal(int pips);

/// A die that is painted by `painted` shows `up` on top: the paints by which it shows `wanted` instead. If it
/// is mirrored, the motion has been mirrored since.
std::array<std::size_t, 4> paints_that_show(int wanted, std::size_t painted, int up, bool is_mirrored);

/// The face that lies on top, from 1 to 6; 0 if none does, because the die leans by more than 26 degrees.
/// `rotation` is that of the painted die.
int top_face(const Eigen::Quaterniond& rotation);

}  // namespace retake::dice
