// See view.h.
#include "worlds/dice/view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>

namespace retake::dice {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// All chosen.
constexpr double kMargin = 0.025;       // [m] of the table around where the centres of dice go
constexpr int kFinesse = 3;             // parts of a cell's side
constexpr double kPrecision = 0x1p-16;  // [m] to which the table is rounded: 15 micrometres, which packs well
constexpr double kPipRadius = 0.095;    // of the side
constexpr double kPipSpacing = 0.25;    // of the side
constexpr double kPaint = 0.00003;      // [m] by which pips lie above their face
constexpr int kPipCorners = 16;
constexpr int kRoundingParts = 4;  // of the eighth of a circle that each face has of an edge

constexpr std::array kColours = {"#f4efe4", "#b5202c", "#1f4f9c", "#1f7a4d", "#e0a21b", "#3a3a44"};
constexpr const char* kDarkPips = "#16181d";
constexpr const char* kLightPips = "#f7f4ec";

void add_point(Mesh& mesh, const Vector3d& point) {
  mesh.positions.insert(mesh.positions.end(), point.data(), point.data() + 3);
}

/// The sides of the painted die, in its own frame.
Vector3d painted(const Vector3d& half_extents, std::size_t paint) {
  return (paints()[paint].conjugate() * half_extents).cwiseAbs();
}

/// Lines across a side: a plane middle, and more of them where it is rounded.
std::vector<double> lines(double half_extent, double rounding) {
  std::vector<double> all;
  const double core = half_extent - rounding;
  for (int i = kRoundingParts; i >= 0; --i)
    all.push_back(-core - rounding * std::tan(std::numbers::pi / 4 * i / kRoundingParts));
  for (int i = 0; i <= kRoundingParts; ++i)
    all.push_back(core + rounding * std::tan(std::numbers::pi / 4 * i / kRoundingParts));
  return all;
}

/// A rounded box whose faces share the vertices of their edges.
Mesh rounded_box(const Vector3d& half_extents, double rounding) {
  Mesh mesh;
  std::map<std::array<std::int64_t, 3>, std::uint32_t> known;  // by place, in nanometres
  const Vector3d core = half_extents - Vector3d::Constant(rounding);
  const auto vertex = [&](const Vector3d& on_box) {
    const Vector3d inner = on_box.cwiseMax(-core).cwiseMin(core);
    const Vector3d place = inner + rounding * (on_box - inner).normalized();
    std::array<std::int64_t, 3> key;
    for (std::size_t i = 0; i < 3; ++i)
      key[i] = std::llround(place[static_cast<Eigen::Index>(i)] * 1e9);
    const auto [found, is_new] = known.emplace(key, static_cast<std::uint32_t>(known.size()));
    if (is_new) add_point(mesh, place);
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const std::vector<double> along_u = lines(half_extents[u], rounding);
    const std::vector<double> along_v = lines(half_extents[v], rounding);
    for (const int side : {-1, 1})
      for (std::size_t i = 0; i + 1 < along_u.size(); ++i)
        for (std::size_t j = 0; j + 1 < along_v.size(); ++j) {
          const auto corner = [&](std::size_t di, std::size_t dj) {
            Vector3d on_box;
            on_box[axis] = side * half_extents[axis];
            on_box[u] = along_u[i + di];
            on_box[v] = along_v[j + dj];
            return vertex(on_box);
          };
          const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side > 0)
            mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
          else
            mesh.indices.insert(mesh.indices.end(), {a, c, b, a, d, c});
        }
  }
  return mesh;
}

/// Where the pips of a face are, in spacings from its middle: in order, the first of 2, 4 and 6 or, after the
/// one in the middle, of 3 and 5.
constexpr std::array<std::array<double, 2>, 6> kPips = {
    {{-1, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, 0}, {1, 0}}};

Vector2d pip_place(int pip, int count) {
  const int of_pairs = pip - count % 2;
  if (of_pairs < 0) return Vector2d::Zero();
  const auto& [across, along] = kPips[static_cast<std::size_t>(of_pairs)];
  return {across, along};
}

Mesh pips(const Vector3d& half_extents) {
  Mesh mesh;
  const double side = 2 * half_extents.minCoeff();
  for (int face = 1; face <= 6; ++face) {
    const Vector3d normal = face_normal(face);
    const Vector3d across = face_normal(face % 3 + 1), along = normal.cross(across);
    const Vector3d middle = normal * (std::abs(normal.dot(half_extents)) + kPaint);
    for (int pip = 0; pip < face; ++pip) {
      const Vector2d place = pip_place(pip, face);
      const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
      const Vector3d centre = middle + kPipSpacing * side * (place.x() * across + place.y() * along);
      for (int i = 0; i < kPipCorners; ++i) {
        const double angle = 2 * std::numbers::pi * i / kPipCorners;
        add_point(mesh, centre + kPipRadius * side * (std::cos(angle) * across + std::sin(angle) * along));
      }
      for (std::uint32_t i = 1; i + 1 < kPipCorners; ++i)
        mesh.indices.insert(mesh.indices.end(), {first, first + i, first + i + 1});
    }
  }
  return mesh;
}

/// The surface where dice went and around, with vertices on a grid that is finer than that of the control
/// points, in the world's frame.
Mesh table_mesh(const std::vector<DieState>& states, const Placement& placement, Table& table) {
  Vector3d low = states.front().position, high = low;
  for (const DieState& state : states) {
    low = low.cwiseMin(state.position);
    high = high.cwiseMax(state.position);
  }
  const double width = table.settings().spacing / kFinesse;
  const auto first = [&](double least) { return std::llround((least - kMargin) / width); };
  const auto last = [&](double most) { return std::llround((most + kMargin) / width); };
  const std::int64_t x0 = first(low.x()), x1 = last(high.x()), z0 = first(low.z()), z1 = last(high.z());

  Mesh mesh;
  for (std::int64_t i = x0; i <= x1; ++i)
    for (std::int64_t j = z0; j <= z1; ++j) {
      const double x = static_cast<double>(i) * width, z = static_cast<double>(j) * width;
      for (const double value : placement.point({x, table.height(x, z).value, z}))
        mesh.positions.push_back(std::round(value / kPrecision) * kPrecision);
    }
  const auto columns = static_cast<std::uint32_t>(z1 - z0 + 1),
             rows = static_cast<std::uint32_t>(x1 - x0 + 1);
  for (std::uint32_t i = 0; i + 1 < rows; ++i)
    for (std::uint32_t j = 0; j + 1 < columns; ++j) {
      const std::uint32_t a = i * columns + j, b = a + columns, c = b + 1, d = a + 1;
      // From x to z is clockwise, seen from above, unless it is mirrored.
      if (placement.mirrored())
        mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
      else
        mesh.indices.insert(mesh.indices.end(), {a, c, b, a, d, c});
    }
  return mesh;
}

}  // namespace

std::string die_name(std::size_t die) {
  return "die_" + std::to_string(die + 1);
}

terms::Roster roster(std::size_t dice) {
  std::vector<terms::Face> faces;
  for (int pips = 1; pips <= 6; ++pips)
    faces.push_back({.number = pips, .normal = face_normal(pips)});
  terms::Roster roster;
  roster.still.emplace_back("table");
  for (std::size_t die = 0; die < dice; ++die) {
    terms::Roster::Mover& mover = roster.movers.emplace_back();
    mover.name = die_name(die);
    mover.faces = faces;
    mover.tells_rest = true;
  }
  return roster;
}

void write_scene(const DieShape& shape, const DiceThrow& thrown, const std::vector<DieState>& states,
                 Table& table, Animation& animation) {
  std::vector<Body>& bodies = animation.bodies;
  bodies.clear();
  const std::size_t dice = thrown.scene.dice.size();
  for (std::size_t die = 0; die < dice; ++die)
    bodies.push_back(
        {.name = die_name(die),
         .shape = rounded_box(painted(shape.half_extents(), thrown.paint[die]), shape.rounding()),
         .colour = kColours[die % kColours.size()],
         .track = die});
  bodies.push_back(
      {.name = "table", .shape = table_mesh(states, thrown.placement, table), .colour = "#3f6b52"});
  for (std::size_t die = 0; die < dice; ++die)
    bodies.push_back({.name = "pips_" + std::to_string(die + 1),
                      .shape = pips(painted(shape.half_extents(), thrown.paint[die])),
                      .colour = die % kColours.size() == 0 ? kDarkPips : kLightPips,
                      .track = die});
}

Viewpoint throw_viewpoint(const Animation& animation) {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Track& track : animation.tracks) {
    low = low.cwiseMin(track.positions.rowwise().minCoeff());
    high = high.cwiseMax(track.positions.rowwise().maxCoeff());
  }
  const Vector3d around = Vector3d::Constant(0.015);
  return {.center = (low + high) / 2,
          .half_extents = (high - low) / 2 + around,
          .azimuth = 0.3,
          .elevation = 0.55};
}

}  // namespace retake::dice
