// See release.h.
#include "worlds/bowling/release.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace retake::bowling {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLeastShare = 0.8;  // of the largest radius and density (A.1)
constexpr double kSlowest = 0.5;     // [m/s] down the lane, chosen: slower ones take a minute to arrive

// The Variables in the order of the State; the pins' offsets follow, x and z of each.
enum Index : std::size_t {
  kRadius,
  kDensity,
  kPlace,
  kHeight,
  kVelocityX,  // modern: the speed
  kVelocityZ,  // modern: the launch angle
  kSpin,       // modern: the rate of revolution
  kPaperCount,
  kRotation = kPaperCount,
  kTilt,
  kModernCount,
};

std::size_t ball_variables(ReleaseStyle style) {
  return style == ReleaseStyle::paper ? kPaperCount : kModernCount;
}

std::vector<Variable> variables_of(ReleaseStyle style, const std::vector<int>& rack) {
  // A.1, in its order.
  const double r = kBallLargestRadius, rho = kBallLargestDensity, w = kLaneHalfWidth;
  std::vector<Variable> variables = {
      {"ball_radius", "m", Distribution::uniform(kLeastShare * r, r)},
      {"ball_density", "kg/m^3", Distribution::uniform(kLeastShare * rho, rho)},
      {"ball_z", "m", Distribution::uniform(-w, w)},
      {"ball_height", "m", Distribution::gaussian(1.1 * r, 0.1 * r)},
  };
  if (style == ReleaseStyle::paper) {
    variables.push_back({"ball_velocity_x", "m/s", Distribution::gaussian(7.0, 1.0)});
    variables.push_back({"ball_velocity_z", "m/s", Distribution::gaussian(0.0, 0.1)});
    variables.push_back({"ball_spin", "rad/s", Distribution::gaussian(0.0, 0.2)});
  } else {
    // Thirty professional men: 8.32 m/s and 436 rpm, at most 20.9 mph and 570 rpm; the spreads put those
    // about 2.5 standard deviations out. Rotation of 45 degrees and a launch of 1.8 degrees to the right are
    // the best known release; the launch is spread so that every pin can be aimed at.
    variables.push_back({"ball_speed", "m/s", Distribution::gaussian(8.32, 0.4)});
    variables.push_back({"launch_angle", "rad", Distribution::gaussian(1.8 * kDegree, 2.0 * kDegree)});
    variables.push_back({"rev_rate", "rad/s", Distribution::gaussian(45.7, 5.6)});
    variables.push_back({"axis_rotation", "rad", Distribution::gaussian(45 * kDegree, 12 * kDegree)});
    variables.push_back({"axis_tilt", "rad", Distribution::gaussian(15 * kDegree, 5 * kDegree)});
  }
  for (const int pin : rack)
    for (const char* axis : {"_x", "_z"})
      variables.push_back(
          {"pin_" + std::to_string(pin) + axis, "m", Distribution::gaussian(0.0, kPinOffset)});
  return variables;
}

}  // namespace

ReleaseModel::ReleaseModel(ReleaseStyle style, const std::vector<int>& rack)
    : style_(style), pins_(rack.size()) {
  // A ball that starts inside the lane is impossible, and so is one that does not arrive.
  const auto possible = [](const State& state) {
    return at(state, kHeight) >= at(state, kRadius) && at(state, kVelocityX) > kSlowest;
  };
  model_ = std::make_shared<const Model>(variables_of(style, rack), possible);
}

KernelTable ReleaseModel::kernels(Ratios ratios) const {
  const double r = kBallLargestRadius, rho = kBallLargestDensity, w = 2 * kLaneHalfWidth;
  using Shape = Perturb::Shape;
  const auto gaussian = [](std::size_t variable, double size) {
    return Perturb::Group{.variables = {variable}, .shape = Shape::gaussian, .size = size};
  };
  const auto perturb = [](std::vector<Perturb::Group> groups) {
    return std::make_shared<const Perturb>(std::move(groups));
  };
  // A.2, in its order: u below 0.05, 0.125, 0.2, 0.4, 0.6, 0.8, and otherwise.
  std::vector<WeightedKernel> rows = {
      {"redraw", 0.05, std::make_shared<const Redraw>(Redraw::all(*model_, ratios))},
      {"radius", 0.075, perturb({gaussian(kRadius, 0.04 * r)})},
      {"density", 0.075, perturb({gaussian(kDensity, 0.04 * rho)})},
      {"position", 0.2, perturb({gaussian(kPlace, 0.2 * w), gaussian(kHeight, 0.05 * r)})},
  };
  if (style_ == ReleaseStyle::paper) {
    rows.push_back({"velocity", 0.2, perturb({gaussian(kVelocityX, 0.5), gaussian(kVelocityZ, 0.05)})});
    rows.push_back({"spin", 0.2, perturb({gaussian(kSpin, 0.1)})});
  } else {
    // Half a standard deviation, as the paper's.
    rows.push_back(
        {"velocity", 0.2, perturb({gaussian(kVelocityX, 0.2), gaussian(kVelocityZ, 1.0 * kDegree)})});
    rows.push_back(
        {"spin", 0.2,
         perturb({gaussian(kSpin, 2.8), gaussian(kRotation, 6 * kDegree), gaussian(kTilt, 2.5 * kDegree)})});
  }
  std::vector<Perturb::Group> pins;
  const std::size_t first = ball_variables(style_);
  for (std::size_t i = 0; i < pins_; ++i)
    pins.push_back({.variables = {first + 2 * i, first + 2 * i + 1},
                    .shape = Shape::radial,
                    .size = 0.5 * kPinOffset,
                    .probability = 0.5});
  rows.push_back({"pins", 0.2, perturb(std::move(pins))});
  return KernelTable(std::move(rows));
}

std::vector<Coordinate> ReleaseModel::learned(const LaneFriction& friction, double x) const {
  std::vector<Coordinate> coordinates;
  for (std::size_t i = 0; i < ball_variables(style_); ++i)
    if (i != kPlace) coordinates.push_back({.variable = i});
  // The lane is the same everywhere across, so a ball ends as far to the side as it starts to the side.
  const auto drift = [model = *this, friction, x](const State& state) {
    if (!model.model_->in_support(state)) return 0.0;
    State centred = state;
    centred[static_cast<Eigen::Index>(kPlace)] = 0;
    const Release release = model.read_ball(centred);
    const Roll roll(release.ball, release.motion, friction);
    const double end = std::min(roll.time_at(x), roll.gutter_time());
    const Motion motion = roll.at(end);
    // In the gutter already: as it would have gone on.
    return motion.position.z() +
           motion.linear_velocity.z() / motion.linear_velocity.x() * (x - motion.position.x());
  };
  coordinates.push_back({.variable = kPlace, .shift = drift});
  return coordinates;
}

Release ReleaseModel::read(const State& state) const {
  Release release = read_ball(state);
  const std::size_t first = ball_variables(style_);
  for (std::size_t i = 0; i < pins_; ++i)
    release.offsets.emplace_back(at(state, first + 2 * i), 0, at(state, first + 2 * i + 1));
  return release;
}

Release ReleaseModel::read_ball(const State& state) const {
  Release release;
  const double r = at(state, kRadius);
  release.ball = {.radius = r, .mass = at(state, kDensity) * 4 / 3 * std::numbers::pi * r * r * r};
  release.motion.position = {kFoulLine, at(state, kHeight), at(state, kPlace)};
  if (style_ == ReleaseStyle::paper) {
    release.motion.linear_velocity = {at(state, kVelocityX), 0, at(state, kVelocityZ)};
    release.motion.angular_velocity = {0, at(state, kSpin), 0};
  } else {
    const double speed = at(state, kVelocityX), launch = at(state, kVelocityZ);
    const double turns = at(state, kSpin), tilt = at(state, kTilt);
    release.motion.linear_velocity = {speed * std::cos(launch), 0, speed * std::sin(launch)};
    // A forward roll turns about -z. Rotating its axis makes a right-hander's ball hook to the left (-z), and
    // tilting it lifts the axis from the horizon. Rotation counts from the direction of travel.
    const double across = turns * std::cos(tilt), turned = at(state, kRotation) - launch;
    release.motion.angular_velocity = {-across * std::sin(turned), turns * std::sin(tilt),
                                       -across * std::cos(turned)};
  }
  return release;
}

}  // namespace retake::bowling
