// See view.h.
#include "worlds/bowling/view.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "sampler/check.h"
#include "worlds/bowling/pins.h"

namespace retake::bowling {
namespace {

constexpr double kStripeLow = 0.252, kStripeHigh = 0.281;  // [m] above the base, around the neck
constexpr double kStripeThickness = 0.0004;                // [m]
constexpr double kBehind = 0.35;                           // [m] of the pit behind its cushion
constexpr double kFloor = 2.4;                             // [m] to either side, chosen: the floor around
constexpr double kApproach = 4.572;                        // [m], 15 feet before the foul line
constexpr double kWallHeight = 0.42;                       // [m], chosen: low enough to look over
constexpr double kCushionHeight = 0.56;                    // [m], chosen: a ground for white pins
constexpr double kPaint = 0.0006;                          // [m] by which markings lie above what they mark

enum Still { kLane, kGutterLeft, kGutterRight, kWallLeft, kWallRight, kPit, kCushionBody };

/// The outline of a pin between two heights above its base, around its centre of mass.
Revolution outline(double low, double high, double thickness) {
  const double centre = pin_body().centre_of_mass;
  Revolution shape;
  const auto add = [&](double height, double radius) {
    shape.profile.push_back({radius + thickness, height - centre});
  };
  for (std::size_t i = 0; i + 1 < kRings; ++i) {
    const auto [h0, r0] = kPinProfile[i];
    const auto [h1, r1] = kPinProfile[i + 1];
    const auto radius_at = [&](double h) { return r0 + (r1 - r0) * (h - h0) / (h1 - h0); };
    if (h0 < low && low < h1) add(low, radius_at(low));
    if (h0 >= low && h0 <= high) add(h0, r0);
    if (h0 < high && high < h1) add(high, radius_at(high));
  }
  return shape;
}

Revolution whole_pin() {
  const double centre = pin_body().centre_of_mass;
  Revolution shape;
  shape.profile.push_back({0, -centre});  // the base
  for (const auto& [height, radius] : kPinProfile)
    shape.profile.push_back({radius, height - centre});
  return shape;
}

Body box(std::string name, std::string colour, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return {.name = std::move(name),
          .shape = Box{(high - low) / 2},
          .colour = std::move(colour),
          .pose = {.position = (low + high) / 2}};
}

/// Flat markings: every outline is a convex polygon, drawn as a fan.
class Markings {
 public:
  /// Adds a polygon whose corners go around counter-clockwise, seen from the side that shows.
  void add(const std::vector<Eigen::Vector3d>& corners) {
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size() / 3);
    for (const Eigen::Vector3d& corner : corners)
      mesh_.positions.insert(mesh_.positions.end(), corner.data(), corner.data() + 3);
    for (std::uint32_t i = 1; i + 1 < corners.size(); ++i)
      mesh_.indices.insert(mesh_.indices.end(), {first, first + i, first + i + 1});
  }
  /// Adds a disc of `corners` corners around `centre`, facing along `normal`.
  void add_disc(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, double radius, int corners) {
    const Eigen::Vector3d across = normal.unitOrthogonal(), other = normal.cross(across);
    std::vector<Eigen::Vector3d> rim;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      rim.push_back(centre + radius * (std::cos(angle) * across + std::sin(angle) * other));
    }
    add(rim);
  }
  Mesh mesh() && { return std::move(mesh_); }

 private:
  Mesh mesh_;
};

/// The arrows to aim by, and the dots before them: USBC's places, every fifth board.
Mesh aiming_marks() {
  constexpr double kBoards = 39, kFoot = 0.3048;
  const double board = 2 * kLaneHalfWidth / kBoards;
  Markings marks;
  for (int arrow = -3; arrow <= 3; ++arrow) {
    const double z = 5 * board * arrow, tip = kFoulLine + (15.8 - 1.15 * std::abs(arrow)) * kFoot;
    const double half_width = 0.6 * board, tail = tip - 0.5 * kFoot;
    marks.add({{tip, kPaint, z}, {tail, kPaint, z - half_width}, {tail, kPaint, z + half_width}});
  }
  for (const int side : {-1, 1})
    for (int dot = 0; dot < 5; ++dot)
      marks.add_disc({kFoulLine + 7 * kFoot, kPaint, side * (5.0 + 3 * dot) * board},
                     Eigen::Vector3d::UnitY(), 0.3 * board, 8);
  return std::move(marks).mesh();
}

/// Two fingers and a thumb, as discs a little above the ball's surface. Chosen.
Mesh finger_holes(double ball_radius) {
  Markings holes;
  const auto hole = [&](double x, double y, double z, double radius) {
    const Eigen::Vector3d normal = Eigen::Vector3d(x, y, z).normalized();
    holes.add_disc(1.004 * ball_radius * normal, normal, radius, 14);
  };
  hole(-0.75, 0.60, -0.17, 0.0125);
  hole(-0.75, 0.60, 0.17, 0.0125);
  hole(-0.98, -0.10, 0, 0.0145);
  return std::move(holes).mesh();
}

}  // namespace

std::string pin_name(int pin) {
  return "pin_" + std::to_string(pin);
}

terms::Roster roster(const std::vector<int>& rack) {
  terms::Roster roster{
      .movers = {{.name = kBallName}},
      .still = {"lane", "gutter_left", "gutter_right", "wall_left", "wall_right", "pit", "cushion"}};
  for (const int pin : rack)
    roster.movers.push_back({.name = pin_name(pin), .tells_fall = true});
  return roster;
}

void write_scene(const std::vector<int>& rack, double ball_radius, Animation& animation) {
  std::vector<Body>& bodies = animation.bodies;
  bodies.clear();
  bodies.push_back({.name = kBallName, .shape = Sphere{ball_radius}, .colour = "#1d3f7a", .track = 0});
  for (std::size_t i = 0; i < rack.size(); ++i)
    bodies.push_back(
        {.name = pin_name(rack[i]), .shape = whole_pin(), .colour = "#f6f1e7", .track = kFirstPinTrack + i});

  // What stands still, in the order of Still.
  const double w = kLaneHalfWidth, back = kCushion + kBehind, thick = 0.02;
  const double under = -kGutterDepth - thick;
  bodies.push_back(box("lane", "#d8a868", {kFoulLine, under, -w}, {kDeckEnd, 0, w}));
  bodies.push_back(box("gutter_left", "#33373f", {kFoulLine, under, -kWall}, {kDeckEnd, -kGutterDepth, -w}));
  bodies.push_back(box("gutter_right", "#33373f", {kFoulLine, under, w}, {kDeckEnd, -kGutterDepth, kWall}));
  bodies.push_back(box("wall_left", "#2b3442", {0, -0.2, -kWall - thick}, {back, kWallHeight, -kWall}));
  bodies.push_back(box("wall_right", "#2b3442", {0, -0.2, kWall}, {back, kWallHeight, kWall + thick}));
  bodies.push_back(box("pit", "#1c1f26", {kDeckEnd, kPitFloor - thick, -kWall}, {back, kPitFloor, kWall}));
  bodies.push_back(
      box("cushion", "#1d4347", {kCushion, kPitFloor, -kWall}, {kCushion + thick, kCushionHeight, kWall}));

  for (std::size_t i = 0; i < rack.size(); ++i)
    bodies.push_back({.name = "stripe_" + std::to_string(rack[i]),
                      .shape = outline(kStripeLow, kStripeHigh, kStripeThickness),
                      .colour = "#b3202a",
                      .track = kFirstPinTrack + i});

  // What only the eye needs.
  bodies.push_back(box("floor_left", "#3d4553", {kFoulLine, under, -kFloor}, {back, 0.01, -kWall}));
  bodies.push_back(box("floor_right", "#3d4553", {kFoulLine, under, kWall}, {back, 0.01, kFloor}));
  bodies.push_back(
      box("approach", "#c4935a", {kFoulLine - kApproach, under, -kFloor}, {kFoulLine, 0, kFloor}));
  bodies.push_back(box("foul_line", "#15171b", {kFoulLine - 0.025, -0.01, -w}, {kFoulLine, kPaint, w}));
  bodies.push_back({.name = "markings", .shape = aiming_marks(), .colour = "#5b3413"});
  bodies.push_back(
      {.name = "finger_holes", .shape = finger_holes(ball_radius), .colour = "#0a0d14", .track = 0});
}

std::size_t still_body(Surface surface, double z, std::size_t pins) {
  const std::size_t first = 1 + pins;
  const bool left = z < 0;
  switch (surface) {
    case Surface::lane:
      return first + kLane;
    case Surface::gutter:
      return first + (left ? kGutterLeft : kGutterRight);
    case Surface::wall:
      return first + (left ? kWallLeft : kWallRight);
    case Surface::pit:
      return first + kPit;
    case Surface::cushion:
      return first + kCushionBody;
    case Surface::pin:
      break;
  }
  CHECK(false, static_cast<int>(surface));
  return first;
}

Viewpoint deck_viewpoint() {
  return {.center = {0.55, 0.13, 0}, .half_extents = {0.7, 0.2, 0.68}, .azimuth = -1.42, .elevation = 0.3};
}

}  // namespace retake::bowling
