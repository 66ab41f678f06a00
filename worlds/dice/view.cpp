// See view.h.
#include "worlds/dice/view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>

namespace retake::dice {
namespace {

using Eigen::Vector3d;

// All chosen.
constexpr double kMargin = 0.035;    // [m] of the table around where the centres of dice go
constexpr int kFinesse = 3;          // parts of a cell's side
constexpr double kPipRadius = 0.25;  // of half the plane middle of the shortest side
constexpr double kPipDepth = 0.42;   // of the radius
constexpr double kBowlRing = 0.6;    // of the radius, where a bowl bends
constexpr int kPipCorners = 16;
constexpr int kRoundingParts = 3;  // of the eighth of a circle that each face has of an edge

constexpr std::array kColours = {"#f4efe4", "#b5202c", "#1f4f9c", "#6d4a9c", "#e0a21b", "#3a3a44"};
constexpr const char* kDarkPips = "#16181d";
constexpr const char* kLightPips = "#f7f4ec";
constexpr const char* kFelt = "#2f6b50";
constexpr const char* kRim = "#7a4526";

// The gaming table, the same for all throws that it holds, in metres: of 2,250 throws of one to six dice one
// in a thousand went beyond.
constexpr double kTrayMiddle = 0.17;  // along x, the way in which dice are thrown
constexpr double kTrayHalfLength = 0.29, kTrayHalfWidth = 0.30;
constexpr double kTrayGrows = 1.6;  // times as large, about its middle, until it holds a throw
constexpr double kRimWidth = 0.034, kRimHeight = 0.02;
constexpr double kUnderBumps = 0.0003;                // from the lowest of them down to the felt
constexpr double kTrayDepth = 0.02;                   // below the felt
constexpr double kDeskThickness = 0.02, kDesk = 1.5;  // to every side
// Most throws stay within, so that most tiles are seen from one place.
const Vector3d kSeenLow(-0.03, 0, -0.075), kSeenHigh(0.19, 0.1, 0.075);

void add_point(Mesh& mesh, const Vector3d& point) {
  mesh.positions.insert(mesh.positions.end(), point.data(), point.data() + 3);
}

/// The sides of the painted die, in its own frame.
Vector3d painted(const Vector3d& half_extents, std::size_t paint) {
  return (paints()[paint].conjugate() * half_extents).cwiseAbs();
}

/// Lines across a side: a plane middle in thirds, and more of them where it is rounded.
std::vector<double> lines(double half_extent, double rounding) {
  std::vector<double> all;
  const double core = half_extent - rounding;
  for (int i = kRoundingParts; i >= 0; --i)
    all.push_back(-core - rounding * std::tan(std::numbers::pi / 4 * i / kRoundingParts));
  for (const double third : {-1 / 3.0, 1 / 3.0})
    all.push_back(third * core);
  for (int i = 0; i <= kRoundingParts; ++i)
    all.push_back(core + rounding * std::tan(std::numbers::pi / 4 * i / kRoundingParts));
  return all;
}

/// Where the pips of a face are, in thirds of its plane middle from its centre: in order, the first of 2, 4
/// and 6 or, after the one in the centre, of 3 and 5.
constexpr std::array<std::array<int, 2>, 6> kPips = {{{-1, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, 0}, {1, 0}}};

std::array<int, 2> pip_place(int pip, int count) {
  const int of_pairs = pip - count % 2;
  if (of_pairs < 0) return {0, 0};
  return kPips[static_cast<std::size_t>(of_pairs)];
}

/// The places of a face's pips, as vectors of thirds of its sides.
std::vector<Vector3d> pip_places(int face) {
  const Vector3d normal = face_normal(face);
  const Vector3d across = normal.cwiseAbs()({2, 0, 1}), along = normal.cross(across);
  std::vector<Vector3d> places;
  for (int pip = 0; pip < face; ++pip) {
    const auto [right, up] = pip_place(pip, face);
    places.push_back(right * across + up * along);
  }
  return places;
}

/// The face whose normal is an axis, or its opposite.
int face_along(int axis, int side) {
  for (int face = 1; face < 6; ++face)
    if (face_normal(face)[axis] * side > 0.5) return face;
  return 6;
}

/// A die: its body, with a hole for each pip, and the bowls that fill the holes.
class DieMeshes {
 public:
  DieMeshes(const Vector3d& half_extents, double rounding)
      : half_extents_(half_extents),
        rounding_(rounding),
        core_(half_extents - Vector3d::Constant(rounding)),
        pip_radius_(kPipRadius * core_.minCoeff()) {
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1})
        add_face(axis, side);
  }
  Mesh body, pips;

 private:
  /// Faces share the vertices of their edges.
  std::uint32_t vertex(const Vector3d& on_box) {
    const Vector3d inner = on_box.cwiseMax(-core_).cwiseMin(core_);
    const Vector3d place = inner + rounding_ * (on_box - inner).normalized();
    std::array<std::int64_t, 3> key;
    for (std::size_t i = 0; i < 3; ++i)
      key[i] = std::llround(place[static_cast<Eigen::Index>(i)] * 1e9);
    const auto [found, is_new] = known_.emplace(key, static_cast<std::uint32_t>(known_.size()));
    if (is_new) add_point(body, place);
    return found->second;
  }

  /// A grid of rectangles: rounded edges, and the plane middle in thirds.
  void add_face(int axis, int side) {
    const Frame frame{.axis = axis, .u = (axis + 1) % 3, .v = (axis + 2) % 3, .side = side};
    const std::vector<double> along_u = lines(half_extents_[frame.u], rounding_);
    const std::vector<double> along_v = lines(half_extents_[frame.v], rounding_);
    std::vector<std::array<int, 2>> pip_cells;
    for (const Vector3d& place : pip_places(face_along(axis, side)))
      pip_cells.push_back({static_cast<int>(std::lround(place[frame.u])) + kRoundingParts + 1,
                           static_cast<int>(std::lround(place[frame.v])) + kRoundingParts + 1});
    for (int i = 0; i + 1 < std::ssize(along_u); ++i)
      for (int j = 0; j + 1 < std::ssize(along_v); ++j) {
        const auto corner = [&](int di, int dj) {
          return point(frame, along_u[static_cast<std::size_t>(i + di)],
                       along_v[static_cast<std::size_t>(j + dj)]);
        };
        const std::array<Vector3d, 4> corners = {corner(1, 1), corner(0, 1), corner(0, 0), corner(1, 0)};
        if (std::find(pip_cells.begin(), pip_cells.end(), std::array{i, j}) != pip_cells.end()) {
          add_pip(frame, corners);
        } else {
          const std::uint32_t a = vertex(corners[0]), b = vertex(corners[1]), c = vertex(corners[2]),
                              d = vertex(corners[3]);
          add_triangle(body, frame, a, b, c);
          add_triangle(body, frame, a, c, d);
        }
      }
  }

  /// Of a face: its axes, u to v counter-clockwise seen along the first one, and which way it looks.
  struct Frame {
    int axis, u, v, side;
  };
  Vector3d point(const Frame& frame, double u, double v) const {
    Vector3d on_box;
    on_box[frame.axis] = frame.side * half_extents_[frame.axis];
    on_box[frame.u] = u;
    on_box[frame.v] = v;
    return on_box;
  }
  static void add_triangle(Mesh& mesh, const Frame& frame, std::uint32_t a, std::uint32_t b,
                           std::uint32_t c) {
    if (frame.side < 0) std::swap(b, c);
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  }

  /// A rectangle with a round hole, and the bowl in it. Corners are counter-clockwise from that of most u, v.
  void add_pip(const Frame& frame, const std::array<Vector3d, 4>& corners) {
    const Vector3d centre = (corners[0] + corners[2]) / 2;
    const auto on_circle = [&](int corner, double radius, double depth) {
      const double angle = 2 * std::numbers::pi * corner / kPipCorners;
      Vector3d place = centre;
      place[frame.u] += radius * std::cos(angle);
      place[frame.v] += radius * std::sin(angle);
      place[frame.axis] -= frame.side * depth;
      return place;
    };
    std::vector<std::uint32_t> rim;
    for (int corner = 0; corner < kPipCorners; ++corner)
      rim.push_back(vertex(on_circle(corner, pip_radius_, 0)));
    constexpr std::size_t kQuarter = kPipCorners / 4;
    for (std::size_t quarter = 0; quarter < 4; ++quarter) {
      const std::uint32_t here = vertex(corners[quarter]), next = vertex(corners[(quarter + 1) % 4]);
      for (std::size_t k = quarter * kQuarter; k < (quarter + 1) * kQuarter; ++k)
        add_triangle(body, frame, rim[k], here, rim[(k + 1) % kPipCorners]);
      add_triangle(body, frame, here, next, rim[(quarter + 1) * kQuarter % kPipCorners]);
    }

    const auto first = static_cast<std::uint32_t>(pips.positions.size() / 3);
    for (int corner = 0; corner < kPipCorners; ++corner)
      add_point(pips, on_circle(corner, pip_radius_, 0));
    for (int corner = 0; corner < kPipCorners; ++corner)
      add_point(pips, on_circle(corner, kBowlRing * pip_radius_,
                                kPipDepth * (1 - kBowlRing * kBowlRing) * pip_radius_));
    add_point(pips, on_circle(0, 0, kPipDepth * pip_radius_));
    for (std::uint32_t k = 0; k < kPipCorners; ++k) {
      const std::uint32_t outer = first + k, outer_next = first + (k + 1) % kPipCorners;
      const std::uint32_t inner = outer + kPipCorners, inner_next = outer_next + kPipCorners;
      add_triangle(pips, frame, outer, outer_next, inner_next);
      add_triangle(pips, frame, outer, inner_next, inner);
      add_triangle(pips, frame, inner, inner_next, first + 2 * kPipCorners);
    }
  }

  Vector3d half_extents_;
  double rounding_;
  Vector3d core_;
  double pip_radius_;
  std::map<std::array<std::int64_t, 3>, std::uint32_t> known_;  ///< vertices by place, in nanometres
};

/// The surface where dice went and around, with points on a grid that is finer than that of the control
/// points, and where the grid's pose puts it.
Body table_of(const std::vector<DieState>& states, const Placement& placement, Table& table) {
  Vector3d low = states.front().position, high = low;
  for (const DieState& state : states) {
    low = low.cwiseMin(state.position);
    high = high.cwiseMax(state.position);
  }
  const double width = table.settings().spacing / kFinesse;
  const auto first = [&](double least) { return std::llround((least - kMargin) / width); };
  const auto last = [&](double most) { return std::llround((most + kMargin) / width); };
  const std::int64_t x0 = first(low.x()), x1 = last(high.x()), z0 = first(low.z()), z1 = last(high.z());

  HeightField field{
      .rows = static_cast<std::size_t>(x1 - x0 + 1),
      .columns = static_cast<std::size_t>(z1 - z0 + 1),
      .spacing = width,
      .heights = {},
      .attributes = {{.name = "restitution", .values = {}}, {.name = "friction", .values = {}}}};
  // Mirrored, the columns go against the grid's z.
  const std::int64_t z_begin = placement.mirrored() ? z1 : z0, z_step = placement.mirrored() ? -1 : 1;
  for (std::int64_t i = x0; i <= x1; ++i)
    for (std::int64_t column = 0; column <= z1 - z0; ++column) {
      const double x = static_cast<double>(i) * width,
                   z = static_cast<double>(z_begin + z_step * column) * width;
      const Table::Material material = table.material(x, z);
      field.heights.push_back(table.height(x, z).value);
      field.attributes[0].values.push_back(material.restitution);
      field.attributes[1].values.push_back(material.friction);
    }
  const Vector3d corner(static_cast<double>(x0) * width, 0, static_cast<double>(z_begin) * width);
  return {.name = "table",
          .shape = std::move(field),
          .colour = kFelt,
          .surface = Surface::felt,
          .pose = {.position = placement.point(corner),
                   .rotation = placement.rotation(Eigen::Quaterniond::Identity()).normalized()}};
}

Body box_body(std::string name, const char* colour, Surface surface, const Vector3d& low,
              const Vector3d& high) {
  return {.name = std::move(name),
          .shape = Box{(high - low) / 2},
          .colour = colour,
          .surface = surface,
          .pose = {.position = (low + high) / 2}};
}

/// A tray of felt with a rim of wood, on a desk, for who watches: dice know an endless table. It holds the
/// dice of `went`, which are as large as `reach` [m] from their middles.
void add_tray(const std::vector<Vector3d>& went, double reach, const HeightField& bumps,
              std::vector<Body>& bodies) {
  double scale = 1;
  for (const Vector3d& place : went)
    while (std::abs(place.x() - kTrayMiddle) + reach > scale * kTrayHalfLength ||
           std::abs(place.z()) + reach > scale * kTrayHalfWidth)
      scale *= kTrayGrows;
  const double left = kTrayMiddle - scale * kTrayHalfLength, right = kTrayMiddle + scale * kTrayHalfLength;
  const double near = scale * kTrayHalfWidth, far = -near;
  const double lowest = *std::min_element(bumps.heights.begin(), bumps.heights.end());
  const double felt = std::min(lowest, 0.0) - kUnderBumps, bottom = std::min(felt, 0.0) - kTrayDepth;
  bodies.push_back(box_body("felt", kFelt, Surface::felt, {left, bottom, far}, {right, felt, near}));
  const double w = kRimWidth;
  const auto add_rim = [&](const char* name, double x0, double x1, double z0, double z1) {
    bodies.push_back(box_body(name, kRim, Surface::wood, {x0, bottom, z0}, {x1, kRimHeight, z1}));
  };
  add_rim("rim_far", left - w, right + w, far - w, far);
  add_rim("rim_near", left - w, right + w, near, near + w);
  add_rim("rim_left", left - w, left, far, near);
  add_rim("rim_right", right, right + w, far, near);
  bodies.push_back(box_body("desk", "#77706a", Surface::plaster,
                            {left - kDesk, bottom - kDeskThickness, far - kDesk},
                            {right + kDesk, bottom, near + kDesk}));
}

}  // namespace

std::string die_name(std::size_t die) {
  return "die_" + std::to_string(die + 1);
}

Roster roster(std::size_t dice) {
  std::vector<Face> faces;
  for (int pips = 1; pips <= 6; ++pips)
    faces.push_back({.number = pips, .normal = face_normal(pips)});
  Roster roster;
  roster.still.emplace_back("table");
  for (std::size_t die = 0; die < dice; ++die) {
    Roster::Mover& mover = roster.movers.emplace_back();
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
  std::vector<Body> pips;
  for (std::size_t die = 0; die < dice; ++die) {
    DieMeshes meshes(painted(shape.half_extents(), thrown.paint[die]), shape.rounding());
    bodies.push_back({.name = die_name(die),
                      .shape = std::move(meshes.body),
                      .colour = kColours[die % kColours.size()],
                      .surface = Surface::plastic,
                      .track = die});
    pips.push_back({.name = "pips_" + std::to_string(die + 1),
                    .shape = std::move(meshes.pips),
                    .colour = die % kColours.size() == 0 ? kDarkPips : kLightPips,
                    .surface = Surface::plastic,
                    .track = die});
  }
  bodies.push_back(table_of(states, thrown.placement, table));
  std::move(pips.begin(), pips.end(), std::back_inserter(bodies));
  std::vector<Vector3d> went;
  for (const DieState& state : states)
    went.push_back(thrown.placement.point(state.position));
  add_tray(went, shape.half_extents().norm(), std::get<HeightField>(bodies[table_body(dice)].shape), bodies);
}

Viewpoint throw_viewpoint(const Animation& animation) {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Track& track : animation.tracks) {
    low = low.cwiseMin(track.positions.rowwise().minCoeff());
    high = high.cwiseMax(track.positions.rowwise().maxCoeff());
  }
  const Vector3d around(0.022, 0.015, 0.022);
  low = low.cwiseMin(kSeenLow);
  high = high.cwiseMax(kSeenHigh);
  return {.center = (low + high) / 2,
          .half_extents = (high - low) / 2 + around,
          .azimuth = 0.3,
          .elevation = 0.55};
}

}  // namespace retake::dice
