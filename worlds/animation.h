// Animation: what a simulation produced - bodies with shapes, poses at a fixed rate, contact events.
// doc/design.md, sections 1 and 4. It must not know which world it shows, nor JSON.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sampler/model.h"

namespace retake {

struct Sphere {
  double radius;  ///< [m]
};
struct Box {
  Eigen::Vector3d half_extents;  ///< [m]
};
struct Cylinder {  ///< along y, centred
  double radius;   ///< [m]
  double height;   ///< [m]
};
struct Revolution {                            ///< around y
  std::vector<std::array<double, 2>> profile;  ///< [m] (radius, y) from one end to the other
};
struct Mesh {
  std::vector<double> positions;       ///< [m] x, y, z of every vertex
  std::vector<std::uint32_t> indices;  ///< three a triangle, counter-clockwise seen from outside
};
/// What a surface is like from place to place, such as its friction: a value for each of its points.
struct Attribute {
  std::string name;
  std::vector<double> values;
};
/// A surface over a level grid: point (row, column) is at x = row spacing, z = column spacing.
struct HeightField {
  std::size_t rows = 0, columns = 0;  ///< points along x and along z
  double spacing = 0;                 ///< [m]
  std::vector<double> heights;        ///< [m] y, row by row
  std::vector<Attribute> attributes;

  std::size_t point_count() const { return rows * columns; }
};
using Shape = std::variant<Sphere, Box, Cylinder, Revolution, Mesh, HeightField>;

/// Two triangles for each square of the grid; vertices in the order of the heights.
Mesh mesh_of(const HeightField& field);

struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

/// What a body's surface is like, apart from its colour: how it is drawn, never how it moves. Records hold
/// the numbers, so what is new comes last.
enum class Surface : std::uint8_t {
  plain,      ///< nothing is known of it
  wood,       ///< one piece, with its grain
  boards,     ///< wood, laid in boards along x
  varnished,  ///< such boards under varnish: mirrors what is above it
  felt,       ///< dull and soft, of a gaming table
  cloth,      ///< heavy and dull, of a curtain
  plastic,    ///< shines a little
  polished,   ///< lacquer or resin: shines much
  glass,      ///< coloured through and clear
  metal,      ///< brushed
  rubber,     ///< dull and smooth
  stone,      ///< ground, hardly shines
  plaster,    ///< dull and even
  marking,    ///< paint or print that lies on another body, without a thickness of its own
  lamp,       ///< gives light, of its colour
  shade,  ///< a box without a surface: the farther along x something lies in it, the less light reaches it
};
inline constexpr std::size_t kSurfaces = 16;

/// As keyframe documents name it.
std::string_view to_string(Surface surface);

struct Body {
  std::string name;
  Shape shape;
  std::string colour;  ///< "#rrggbb"
  Surface surface = Surface::plain;
  std::optional<std::size_t> track{};  ///< which of Animation::tracks it follows; none: it stands still
  Pose pose{};                         ///< of a body that stands still
};

/// x, y, z, w of a rotation, of the two signs that it can have the one that is nearer to another rotation.
inline Eigen::Vector4d nearer(const Eigen::Vector4d& rotation, const Eigen::Vector4d& other) {
  return rotation.dot(other) < 0 ? Eigen::Vector4d(-rotation) : rotation;
}

/// x, y, z, w of a rotation a column.
using Rotations = Eigen::Matrix<double, 4, Eigen::Dynamic>;

/// Gives each rotation the sign that is nearer to the one before.
void put_in_one_hemisphere(Rotations& rotations);

/// The poses of one moving body, a frame each 1/rate seconds from time 0. Before `from` nobody sees or meets
/// it, and its frames are its start.
struct Track {
  std::string name{};            ///< of the body
  Pose start{};                  ///< in which it appears
  double from = 0;               ///< [s] before this the body is not there; its motion is known when it is
  Pose rest{};                   ///< in which the animation ends; without frames unknown of what has fallen
  std::optional<double> fell{};  ///< [s] when it fell over, or off what carried it, for good
  std::optional<double> settled{};  ///< [s] when it came to rest, in `rest`, for good; none: not known
  Eigen::Matrix<double, 3, Eigen::Dynamic> positions;  ///< [m]
  Rotations rotations;                                 ///< successive ones in one hemisphere
};

struct ContactEvent {
  double time = 0;                                     ///< [s]
  std::array<std::size_t, 2> bodies{};                 ///< which of Animation::bodies
  double impulse = 0;                                  ///< [N s]
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] of the point of contact
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< unit vector that pushes the first body
};

/// Reused by simulators: a simulation that is only scored writes the rests but neither frames nor bodies, and
/// may leave out the events. While it is under way an Animation holds what is known so far: the tracks with
/// their starts; rests and falls as they happen, in order of time; and with frames, which then are those so
/// far, every event up to the last of them.
struct Animation {
  double rate = 60;          ///< [frames/s]
  std::size_t frames = 0;    ///< at least 1 once recorded
  std::vector<Body> bodies;  ///< first those of the tracks, in their order and with their names
  std::vector<Track> tracks;
  std::vector<ContactEvent> events;  ///< in order of time

  double duration() const { return frames == 0 ? 0 : static_cast<double>(frames - 1) / rate; }
};

/// [m] of the highest height field without a track over a place; 0, the floor, where there is none. Requires:
/// height fields are level.
double ground_height(const Animation& animation, double x, double z);

/// 128 bits of the State and of every pose and event, as 32 hexadecimal digits: equal digests mean the same
/// motion.
std::string digest(const State& state, const Animation& animation);

}  // namespace retake
