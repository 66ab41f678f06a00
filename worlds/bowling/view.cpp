// See view.h.
#include "worlds/bowling/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "sampler/check.h"

namespace retake::bowling {
namespace {

constexpr double kStripeLow = 0.252, kStripeHigh = 0.281;  // [m] above the base, around the neck
constexpr double kStripeThickness = 0.0004;                // [m]
constexpr double kBehind = 0.35;                           // [m] of the pit behind its cushion
constexpr double kHall = 2.42;                             // [m] to either side, chosen: with the next lanes
constexpr double kApproach = 4.572;                        // [m], 15 feet before the foul line
// The hall around, chosen.
constexpr double kCapping = 0.14;       // [m] wide, between two lanes
constexpr double kMasking = 0.6;        // [m] above the lane, where the panel over the pit begins
constexpr double kMaskingFront = 0.93;  // [m], behind the deck's last row
constexpr double kMaskingTop = 2.3;     // [m]
constexpr double kLampHeight = 0.022;   // [m] of the strip of light under the panel
constexpr double kShadeBegins = 0.9;    // [m], just behind the deck
constexpr double kPaint = 0.0006;       // [m] by which markings lie above what they mark

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

Body box(std::string name, std::string colour, retake::Surface surface, const Eigen::Vector3d& low,
         const Eigen::Vector3d& high) {
  return {.name = std::move(name),
          .shape = Box{(high - low) / 2},
          .colour = std::move(colour),
          .surface = surface,
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

Roster roster(const std::vector<int>& rack) {
  Roster roster{
      .movers = {{.name = kBallName}},
      .still = {"lane", "gutter_left", "gutter_right", "wall_left", "wall_right", "pit", "cushion"}};
  for (const int pin : rack)
    roster.movers.push_back({.name = pin_name(pin), .tells_fall = true});
  return roster;
}

void write_scene(const std::vector<int>& rack, double ball_radius, Animation& animation) {
  using retake::Surface;
  std::vector<Body>& bodies = animation.bodies;
  bodies.clear();
  bodies.push_back({.name = kBallName,
                    .shape = Sphere{ball_radius},
                    .colour = "#1d3f7a",
                    .surface = Surface::polished,
                    .track = 0});
  for (std::size_t i = 0; i < rack.size(); ++i)
    bodies.push_back({.name = pin_name(rack[i]),
                      .shape = whole_pin(),
                      .colour = "#f6f1e7",
                      .surface = Surface::polished,
                      .track = kFirstPinTrack + i});

  // What stands still, in the order of Still.
  const double w = kLaneHalfWidth, back = kCushion + kBehind, thick = 0.02;
  const double under = -kGutterDepth - thick;
  const char *gutter = "#2b2f37", *side = "#3d4a5e";
  bodies.push_back(box("lane", "#d8a868", Surface::varnished, {kFoulLine, under, -w}, {kDeckEnd, 0, w}));
  bodies.push_back(box("gutter_left", gutter, Surface::plastic, {kFoulLine, under, -kWall},
                       {kDeckEnd, -kGutterDepth, -w}));
  bodies.push_back(
      box("gutter_right", gutter, Surface::plastic, {kFoulLine, under, w}, {kDeckEnd, -kGutterDepth, kWall}));
  bodies.push_back(
      box("wall_left", side, Surface::plaster, {0, -0.2, -kWall - kCapping}, {back, kMasking, -kWall}));
  bodies.push_back(
      box("wall_right", side, Surface::plaster, {0, -0.2, kWall}, {back, kMasking, kWall + kCapping}));
  bodies.push_back(
      box("pit", "#121419", Surface::cloth, {kDeckEnd, kPitFloor - thick, -kWall}, {back, kPitFloor, kWall}));
  bodies.push_back(box("cushion", "#17191e", Surface::cloth, {kCushion, kPitFloor, -kWall},
                       {kCushion + thick, kMasking, kWall}));

  for (std::size_t i = 0; i < rack.size(); ++i)
    bodies.push_back({.name = "stripe_" + std::to_string(rack[i]),
                      .shape = outline(kStripeLow, kStripeHigh, kStripeThickness),
                      .colour = "#b3202a",
                      .surface = Surface::polished,
                      .track = kFirstPinTrack + i});

  // What only the eye needs: first of the lane, then of the hall. No light falls into the pit, so that a pin
  // that comes to stand in it is not taken for one that still stands.
  bodies.push_back(
      {.name = "markings", .shape = aiming_marks(), .colour = "#5b3413", .surface = Surface::marking});
  bodies.push_back({.name = "finger_holes",
                    .shape = finger_holes(ball_radius),
                    .colour = "#0a0d14",
                    .surface = Surface::marking,
                    .track = 0});
  bodies.push_back(
      box("foul_line", "#15171b", Surface::marking, {kFoulLine - 0.025, -0.01, -w}, {kFoulLine, kPaint, w}));
  bodies.push_back(box("approach", "#c4935a", Surface::boards, {kFoulLine - kApproach, under, -kHall},
                       {kFoulLine, 0, kHall}));
  bodies.push_back(box("pit_shade", "#050608", Surface::shade, {kDeckEnd, kPitFloor, -kWall},
                       {kCushion, kMasking, kWall}));
  bodies.push_back(box("masking", "#27364d", Surface::plaster, {kMaskingFront, kMasking, -kHall},
                       {back, kMaskingTop, kHall}));
  bodies.push_back(box("lamp", "#ffe9c4", Surface::lamp, {kMaskingFront - thick, kMasking, -kWall},
                       {kMaskingFront, kMasking + kLampHeight, kWall}));
  bodies.push_back(box("hall_floor", gutter, Surface::plastic, {kFoulLine, under - thick, -kHall},
                       {back, -kGutterDepth - 0.001, kHall}));
  for (const int right : {-1, 1}) {
    const auto beside = [&](const char* name, const char* colour, Surface surface, double from, double to,
                            double x, double end, double low, double high) {
      const double inner = right * from, outer = right * to;
      bodies.push_back(box(std::string(name) + (right < 0 ? "_left" : "_right"), colour, surface,
                           {x, low, std::min(inner, outer)}, {end, high, std::max(inner, outer)}));
    };
    const double next = kWall + kCapping + (kWall - w);  // where the next lane begins
    beside("capping", "#3a4250", Surface::plastic, kWall, kWall + kCapping, kFoulLine, 0, under, 0.012);
    beside("next_lane", "#d0a064", Surface::boards, next, next + 2 * w, kFoulLine, kDeckEnd, under, 0);
    beside("next_pit", "#0b0c0f", Surface::cloth, kWall + kCapping, kHall, kDeckEnd, back, under, kMasking);
  }
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
