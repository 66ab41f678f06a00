// See view.h.
#include "worlds/bowling/view.h"

#include <string>
#include <utility>

#include "sampler/check.h"
#include "worlds/bowling/pins.h"

namespace retake::bowling {
namespace {

constexpr double kStripeLow = 0.252, kStripeHigh = 0.281;  // [m] above the base, around the neck
constexpr double kStripeThickness = 0.0004;                // [m]
constexpr double kBehind = 0.35;                           // [m] of the pit behind its cushion

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

}  // namespace

void write_scene(const std::vector<int>& rack, double ball_radius, Animation& animation) {
  std::vector<Body>& bodies = animation.bodies;
  bodies.clear();
  bodies.push_back({.name = "ball", .shape = Sphere{ball_radius}, .colour = "#20304c", .track = 0});
  for (std::size_t i = 0; i < rack.size(); ++i)
    bodies.push_back({.name = "pin_" + std::to_string(rack[i]),
                      .shape = whole_pin(),
                      .colour = "#f6f1e7",
                      .track = kFirstPinTrack + i});

  // What stands still, in the order of Still.
  const double w = kLaneHalfWidth, back = kCushion + kBehind, thick = 0.02;
  bodies.push_back(box("lane", "#c69c6d", {kFoulLine, -0.08, -w}, {kDeckEnd, 0, w}));
  bodies.push_back(box("gutter_left", "#4a4d55", {kFoulLine, -kGutterDepth - thick, -kWall},
                       {kDeckEnd, -kGutterDepth, -w}));
  bodies.push_back(box("gutter_right", "#4a4d55", {kFoulLine, -kGutterDepth - thick, w},
                       {kDeckEnd, -kGutterDepth, kWall}));
  bodies.push_back(box("wall_left", "#2e3138", {0, -0.2, -kWall - thick}, {back, 0.55, -kWall}));
  bodies.push_back(box("wall_right", "#2e3138", {0, -0.2, kWall}, {back, 0.55, kWall + thick}));
  bodies.push_back(box("pit", "#1c1d21", {kDeckEnd, kPitFloor - thick, -kWall}, {back, kPitFloor, kWall}));
  bodies.push_back(box("cushion", "#25272d", {kCushion, kPitFloor, -kWall}, {kCushion + thick, 0.55, kWall}));

  for (std::size_t i = 0; i < rack.size(); ++i)
    bodies.push_back({.name = "stripe_" + std::to_string(rack[i]),
                      .shape = outline(kStripeLow, kStripeHigh, kStripeThickness),
                      .colour = "#b3202a",
                      .track = kFirstPinTrack + i});
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
  return {.center = {0.25, 0.12, 0}, .half_extents = {0.85, 0.3, 0.62}, .azimuth = -1.35, .elevation = 0.42};
}

}  // namespace retake::bowling
