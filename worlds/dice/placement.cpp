// See placement.h.
#include "worlds/dice/placement.h"

#include <algorithm>

#include "sampler/check.h"

namespace retake::dice {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Seen from below, where x turns towards z.
Matrix3d turn_of(double cosine, double sine) {
  Matrix3d turn;
  turn << cosine, 0, -sine, 0, 1, 0, sine, 0, cosine;
  return turn;
}

std::array<Quaterniond, kPaints> make_paints() {
  std::array<Quaterniond, kPaints> all;
  std::size_t count = 0;
  std::array<int, 3> axes = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d turn = Matrix3d::Zero();
      for (int row = 0; row < 3; ++row)
        turn(row, axes[static_cast<std::size_t>(row)]) = (signs >> row & 1) != 0 ? -1 : 1;
      if (turn.determinant() > 0) all[count++] = Quaterniond(turn).normalized();
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  CHECK(count == kPaints, count);
  return all;
}

}  // namespace

Placement::Placement(const Vector3d& from, const Vector3d& to, const Vector2d& heading_in_grid,
                     const Vector2d& heading, bool mirrored)
    : from_(from), to_(to), mirrored_(mirrored) {
  // The heading turned back to x, mirrored or not, then to where it goes.
  const double side = mirrored ? -heading_in_grid.y() : heading_in_grid.y();
  const Matrix3d turn = turn_of(heading.x(), heading.y()) * turn_of(heading_in_grid.x(), side).transpose();
  turn_ = Quaterniond(turn).normalized();
  axes_ = mirrored ? Matrix3d(turn * Vector3d(1, 1, -1).asDiagonal()) : turn;
}

Quaterniond Placement::rotation(const Quaterniond& in_grid) const {
  if (!mirrored_) return (turn_ * in_grid).normalized();
  // Mirrored in the grid and in the die, which is as it was before.
  const Quaterniond mirror(in_grid.w(), -in_grid.x(), -in_grid.y(), in_grid.z());
  return (turn_ * mirror).normalized();
}

const std::array<Quaterniond, kPaints>& paints() {
  static const std::array<Quaterniond, kPaints> all = make_paints();
  return all;
}

Vector3d face_normal(int pips) {
  CHECK(pips >= 1 && pips <= 6, pips);
  return pips <= 3 ? Vector3d(Vector3d::Unit(pips - 1)) : Vector3d(-Vector3d::Unit(6 - pips));
}

std::array<std::size_t, 4> paints_that_show(int wanted, std::size_t painted, int up, bool is_mirrored) {
  Vector3d side = paints()[painted] * face_normal(up);
  // A mirrored motion is that of a mirrored die, whose paint is not mirrored.
  if (is_mirrored) side.z() = -side.z();
  std::array<std::size_t, 4> fitting{};
  std::size_t count = 0;
  for (std::size_t paint = 0; paint < kPaints; ++paint)
    if ((paints()[paint] * face_normal(wanted)).dot(side) > 0.5) fitting.at(count++) = paint;
  CHECK(count == fitting.size(), count);
  return fitting;
}

int top_face(const Quaterniond& rotation) {
  constexpr double kLeast = 0.9;  // cosine, chosen: between flat on the bumps, and on an edge
  const Vector3d up = rotation.conjugate() * Vector3d::UnitY();
  for (int pips = 1; pips <= 6; ++pips)
    if (up.dot(face_normal(pips)) > kLeast) return pips;
  return 0;
}

}  // namespace retake::dice
