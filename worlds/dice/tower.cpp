// See tower.h.
#include "worlds/dice/tower.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace retake::dice {
namespace {

using Eigen::Vector3d;

// All chosen. In radii of a sphere around a die:
constexpr double kDepth = 0.8;    // that a die which is let go is behind the mouth, so that walls hide it
constexpr double kRoom = 0.2;     // around dice
constexpr double kLoft = 1.5;     // above dice
constexpr double kLargest = 6;    // that a tower may be wide or deep
constexpr double kBoards = 0.25;  // thickness of the walls
constexpr double kFoot = -0.01;   // [m], below the table's bumps
constexpr const char* kWood = "#6f4a2c";

/// Appends a box to a mesh.
void add_box(const Vector3d& low, const Vector3d& high, Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
  for (int corner = 0; corner < 8; ++corner)
    for (int axis = 0; axis < 3; ++axis)
      mesh.positions.push_back((corner >> axis & 1 ? high : low)[axis]);
  // Corners by their bits x, y, z; two triangles a side, counter-clockwise from outside.
  for (const std::uint32_t corner : {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                     2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6})
    mesh.indices.push_back(first + corner);
}

}  // namespace

std::optional<Body> tower_around(const Animation& thrown, const DieShape& shape) {
  // The mouth is before all dice that are let go.
  const double radius = shape.reach() + shape.rounding();
  double mouth = -std::numeric_limits<double>::infinity();
  for (const Track& track : thrown.tracks)
    mouth = std::max(mouth, track.start.position.x() + (1 + kDepth) * radius);

  // Whatever is or ever comes behind it has room.
  double back = mouth, half_width = 0, roof = 0;
  for (const Track& track : thrown.tracks)
    for (Eigen::Index frame = 0; frame < track.positions.cols(); ++frame) {
      const Vector3d place = track.positions.col(frame);
      if (place.x() - radius > mouth) continue;
      back = std::min(back, place.x() - (1 + kRoom) * radius);
      half_width = std::max(half_width, std::abs(place.z()) + (1 + kRoom) * radius);
      roof = std::max(roof, place.y() + (1 + kLoft) * radius);
    }
  if (std::max(mouth - back, 2 * half_width) > kLargest * radius) return std::nullopt;

  const double thick = kBoards * radius, outer = half_width + thick;
  Mesh mesh;
  add_box({back - thick, kFoot, -outer}, {back, roof, outer}, mesh);
  for (const double side : {-outer, half_width})
    add_box({back, kFoot, side}, {mouth, roof, side + thick}, mesh);
  add_box({back - thick, roof, -outer}, {mouth, roof + thick, outer}, mesh);
  return Body{.name = kTower, .shape = std::move(mesh), .colour = kWood, .surface = Surface::wood};
}

}  // namespace retake::dice
