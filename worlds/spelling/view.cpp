// See view.h.
#include "worlds/spelling/view.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

#include "sampler/check.h"

namespace retake::spelling {
namespace {

using Eigen::Vector3d;

// Lengths in metres, all chosen.
constexpr double kWallThickness = 0.004;
constexpr double kNearWall = 0.013;  // high, cut down so that it hides no bin
constexpr double kBottom = -0.006;   // of the box, below its floors
constexpr double kTableThickness = 0.01;
constexpr double kTableMargin = 2;
constexpr double kPaint = 0.00005;  // by which marks lie above what they mark
constexpr double kOnWall = 0.0001;  // from a wall at most, where a hit is the wall's

// Glass of about one brightness on dark floors, a colour for each letter: read also where a marble is a few
// pixels.
constexpr std::array kGlass = {"#ffb52e", "#59b8ff", "#ff7d86", "#5fd88c", "#c79bff", "#ffe066"};

enum Still { kPartitions, kFloors, kFarWall, kNearWallBody, kLeftWall, kRightWall };

Body box_body(std::string name, std::string colour, Surface surface, const Vector3d& low,
              const Vector3d& high) {
  return {.name = std::move(name),
          .shape = retake::Box{(high - low) / 2},
          .colour = std::move(colour),
          .surface = surface,
          .pose = {.position = (low + high) / 2}};
}

/// The colours of what moved, by where it rests: one for each stretch of columns in which something rests,
/// from the left. Letters have a column free between them, so each has its own.
std::vector<const char*> colours_of_tracks(const Box& box, std::span<const Track> tracks) {
  const Rectangle interior = box.interior();
  const auto column_of = [&](const Track& track) {
    const double column = (track.rest.position.x() - interior.min_x) / kPitch;
    return static_cast<std::size_t>(std::clamp(column, 0.0, static_cast<double>(box.columns() - 1)));
  };
  std::vector<bool> filled(static_cast<std::size_t>(box.columns()));
  for (const Track& track : tracks)
    filled[column_of(track)] = true;
  std::vector<const char*> colours;
  std::size_t stretch = 0;
  for (std::size_t column = 0; column < filled.size(); ++column) {
    stretch += column > 0 && filled[column - 1] && !filled[column] ? 1 : 0;
    colours.push_back(kGlass[stretch % kGlass.size()]);
  }
  std::vector<const char*> of_tracks;
  for (const Track& track : tracks)
    of_tracks.push_back(colours[column_of(track)]);
  return of_tracks;
}

/// The triangles of a mesh that `is_chosen` takes, given the places of their corners, moved up by `raised`.
template <typename IsChosen>
Mesh part_of(const impulse::TriangleMesh& mesh, std::span<const Vector3d> places, double raised,
             IsChosen&& is_chosen) {
  Mesh part;
  std::map<std::uint32_t, std::uint32_t> numbers;  // of vertices, in the part
  for (const auto& triangle : mesh.triangles) {
    if (!is_chosen(places[triangle[0]], places[triangle[1]], places[triangle[2]])) continue;
    for (const std::uint32_t vertex : triangle) {
      const auto [number, is_new] = numbers.emplace(vertex, static_cast<std::uint32_t>(numbers.size()));
      if (is_new)
        for (const double value : {places[vertex].x(), places[vertex].y() + raised, places[vertex].z()})
          part.positions.push_back(value);
      part.indices.push_back(number->second);
    }
  }
  return part;
}

/// Whether a triangle is a bin's floor: only floors lie wholly below the rim.
bool is_floor(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return std::max({a.y(), b.y(), c.y()}) < kPartitionHeight / 2;
}

std::vector<Vector3d> places_of(const impulse::TriangleMesh& mesh, std::span<const Vector3d> offsets) {
  std::vector<Vector3d> places;
  for (std::size_t vertex = 0; vertex < mesh.vertices.size(); ++vertex)
    places.push_back(mesh.place(vertex, offsets));
  return places;
}

}  // namespace

std::string marble_name(std::size_t marble) {
  return "marble_" + std::to_string(marble + 1);
}

Roster roster(std::size_t marbles) {
  Roster roster{.movers = {},
                .still = {"partitions", "floors", "wall_far", "wall_near", "wall_left", "wall_right"}};
  for (std::size_t marble = 0; marble < marbles; ++marble)
    roster.movers.push_back({.name = marble_name(marble), .tells_rest = true});
  return roster;
}

void write_scene(const Box& box, std::span<const Vector3d> offsets, std::span<const std::size_t> marbles,
                 Animation& animation) {
  std::vector<Body>& bodies = animation.bodies;
  bodies.clear();
  const std::vector<const char*> colours = colours_of_tracks(box, animation.tracks);
  for (std::size_t track = 0; track < marbles.size(); ++track)
    bodies.push_back({.name = marble_name(marbles[track]),
                      .shape = Sphere{kMarbleRadius},
                      .colour = colours[track],
                      .surface = Surface::glass,
                      .track = track});

  // What can be hit, in the order of Still.
  const std::vector<Vector3d> places = places_of(box.mesh(), offsets);
  const auto stands = [](const auto&... corners) { return !is_floor(corners...); };
  bodies.push_back({.name = "partitions",
                    .shape = part_of(box.mesh(), places, 0, stands),
                    .colour = "#5d4630",
                    .surface = Surface::plastic});
  bodies.push_back({.name = "floors",
                    .shape = part_of(box.mesh(), places, 0, is_floor),
                    .colour = "#231c19",
                    .surface = Surface::felt});
  const auto [left, right, far, near] = box.interior();
  const double thick = kWallThickness;
  const char* wood = "#8f6238";
  bodies.push_back(box_body("wall_far", wood, Surface::wood, {left - thick, kBottom, far - thick},
                            {right + thick, kBoxDepth, far}));
  bodies.push_back(box_body("wall_near", wood, Surface::wood, {left - thick, kBottom, near},
                            {right + thick, kNearWall, near + thick}));
  bodies.push_back(
      box_body("wall_left", wood, Surface::wood, {left - thick, kBottom, far}, {left, kBoxDepth, near}));
  bodies.push_back(
      box_body("wall_right", wood, Surface::wood, {right, kBottom, far}, {right + thick, kBoxDepth, near}));

  // What only the eye needs.
  bodies.push_back(box_body("table", "#55656a", Surface::plaster,
                            {left - kTableMargin, kBottom - kTableThickness, far - kTableMargin},
                            {right + kTableMargin, kBottom, near + kTableMargin}));
}

std::size_t still_body(const Box& box, const Vector3d& place, std::size_t marbles) {
  const Rectangle interior = box.interior();
  if (place.x() < interior.min_x + kOnWall) return marbles + kLeftWall;
  if (place.x() > interior.max_x - kOnWall) return marbles + kRightWall;
  if (place.z() < interior.min_z + kOnWall) return marbles + kFarWall;
  if (place.z() > interior.max_z - kOnWall) return marbles + kNearWallBody;
  return marbles + (place.y() < kPaint ? kFloors : kPartitions);
}

Body designated_floors(const Box& box, const BinPattern& pattern) {
  const std::vector<Vector3d> unmoved(box.group_count(), Vector3d::Zero());
  const auto is_designated = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    if (!is_floor(a, b, c)) return false;
    const auto bin = box.bin_of((a + b + c) / 3);
    return bin && pattern.designated[*bin];
  };
  return {.name = "target",
          .shape = part_of(box.mesh(), places_of(box.mesh(), unmoved), kPaint, is_designated),
          .colour = "#7a5a44",
          .surface = Surface::marking};
}

Viewpoint box_viewpoint(const Animation& animation) {
  const auto table = std::find_if(animation.bodies.begin(), animation.bodies.end(),
                                  [](const Body& body) { return body.name == "table"; });
  CHECK(table != animation.bodies.end());
  Vector3d half = std::get<retake::Box>(table->shape).half_extents;
  const double rim = kWallThickness - kTableMargin;
  return {.center = {0, kBoxDepth / 2, 0},
          .half_extents = {half.x() + rim, kBoxDepth / 2, half.z() + rim},
          .azimuth = 0,
          .elevation = 1.2};
}

}  // namespace retake::spelling
