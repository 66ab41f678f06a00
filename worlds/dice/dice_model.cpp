// See dice_model.h.
#include "worlds/dice/dice_model.h"

#include <bit>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "sampler/check.h"
#include "worlds/dice/proposals.h"

namespace retake::dice {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d vector_at(const State& state, std::size_t first) {
  return state.segment<3>(static_cast<Eigen::Index>(first));
}

}  // namespace

GridPlace Patch::place(std::size_t index) const {
  const auto at = static_cast<std::int32_t>(index);
  return {first.x + at / along_z, first.z + at % along_z};
}

DiceModel::DiceModel(const DiceSettings& settings, const EngineSettings& engine, const DieShape& shape)
    : settings_(settings),
      engine_(engine),
      lowest_start_(shape.reach() + shape.rounding() + settings.table.max_height()) {
  CHECK(settings.dice > 0 && settings.speed > 0);
  // A die that starts in the table is impossible; so is one without an orientation or a direction.
  const auto possible = [dice_model = *this](const State& state) {
    for (std::size_t die = 0; die < dice_model.settings_.dice; ++die) {
      const auto orientation = state.segment<4>(static_cast<Eigen::Index>(dice_model.orientation_x(die)));
      if (at(state, dice_model.start_x(die) + 1) < dice_model.lowest_start_) return false;
      if (!(orientation.squaredNorm() > 0)) return false;
    }
    return std::hypot(at(state, dice_model.velocity_x(0)), at(state, dice_model.velocity_x(0) + 2)) > 0;
  };
  model_ = std::make_shared<const Model>(variables(), possible);
}

std::vector<Variable> DiceModel::variables() const {
  const DiceSettings& s = settings_;
  const auto uniform = [](double low, double high) { return Distribution::uniform(low, high); };
  const auto gaussian = [](double mean, double deviation) { return Distribution::gaussian(mean, deviation); };
  constexpr double kEighth = std::numbers::pi / 4;
  std::vector<Variable> all = {{"table", "", uniform(0, 1)}};
  if (s.pose == GridPose::random) {
    all.push_back({"grid_phase_x", "m", uniform(0, s.table.spacing)});
    all.push_back({"grid_phase_z", "m", uniform(0, s.table.spacing)});
    all.push_back({"grid_heading", "rad", uniform(-kEighth, kEighth)});
    all.push_back({"grid_mirrored", "", Distribution::on_off(0.5)});
  }
  for (std::size_t die = 0; die < s.dice; ++die) {
    const std::string name = "die_" + std::to_string(die + 1);
    all.push_back({name + "_x", "m", gaussian(0, s.start_spread)});
    all.push_back({name + "_height", "m", gaussian(s.drop_height, s.height_spread)});
    all.push_back({name + "_z", "m", gaussian(0, s.start_spread)});
    all.push_back({name + "_velocity_x", "m/s", gaussian(s.speed, s.speed_spread)});
    all.push_back({name + "_velocity_y", "m/s", gaussian(0, s.speed_spread)});
    all.push_back({name + "_velocity_z", "m/s", gaussian(0, s.speed_spread)});
    for (const char* axis : {"_spin_x", "_spin_y", "_spin_z"})
      all.push_back({name + axis, "rad/s", gaussian(0, s.spin_spread)});
    for (const char* axis : {"_orientation_x", "_orientation_y", "_orientation_z", "_orientation_w"})
      all.push_back({name + axis, "", gaussian(0, 1)});
    if (s.random_paint) all.push_back({name + "_paint", "", uniform(0, kPaints)});
  }
  for (std::size_t i = 0; i < kPatch.size(); ++i) {
    const auto [x, z] = kPatch.place(i);
    const std::string name = "point_" + std::to_string(x) + "_" + std::to_string(z);
    const auto add = [&](const char* what, const char* unit, double mean, double deviation) {
      all.push_back(
          {.name = name + what, .unit = unit, .prior = gaussian(mean, deviation), .is_override = true});
    };
    add("_height", "m", 0, s.table.height_deviation);
    add("_restitution", "", s.table.restitution_mean, s.table.restitution_deviation);
    add("_friction", "", s.table.friction_mean, s.table.friction_deviation);
  }
  return all;
}

DiceThrow DiceModel::read(const State& state) const {
  DiceThrow thrown;
  // The table.
  TableContent& table = thrown.scene.table;
  table.key = std::bit_cast<std::uint64_t>(at(state, key()));
  for (std::size_t i = 0; i < kPatch.size(); ++i)
    if (const Vector3d values = vector_at(state, override_of(i)); !std::isnan(values[0]))
      table.overrides.push_back({kPatch.place(i), {values[0], values[1], values[2]}});

  // The dice.
  for (std::size_t die = 0; die < settings_.dice; ++die) {
    Launch launch;
    const double start = static_cast<double>(die) * settings_.interval;
    launch.step = static_cast<std::int64_t>(std::lround(start / engine_.time_step));
    launch.state.position = vector_at(state, start_x(die));
    launch.state.linear_velocity = vector_at(state, velocity_x(die));
    launch.state.angular_velocity = vector_at(state, spin_x(die));
    launch.state.rotation =
        Quaterniond(state.segment<4>(static_cast<Eigen::Index>(orientation_x(die)))).normalized();
    thrown.scene.dice.push_back(launch);
    const auto paint_of = [&] {
      return std::min(static_cast<std::size_t>(at(state, paint(die))), kPaints - 1);
    };
    thrown.paint.push_back(settings_.random_paint ? paint_of() : kPlainPaint);
  }
  thrown.scene.latest_step =
      static_cast<std::int64_t>(std::lround(longest_run(settings_) / engine_.time_step));

  // Where the grid lies.
  if (settings_.pose == GridPose::random && settings_.dice == 1)
    thrown.placement = place_with_die(state, thrown.scene.dice[0].state);
  else if (settings_.pose == GridPose::random)
    thrown.placement = place_with_world(state, thrown.scene.dice);
  return thrown;
}

/// Nothing of the motion comes from where the die starts in the world, or in which direction it flies there.
Placement DiceModel::place_with_die(const State& state, DieState& launched) const {
  const Vector3d start = launched.position, velocity = launched.linear_velocity;
  const double speed = std::sqrt(velocity.x() * velocity.x() + velocity.z() * velocity.z());
  const Vector2d in_grid = heading_in_grid(state);
  launched.position.x() = at(state, phase_x());
  launched.position.z() = at(state, phase_x() + 1);
  launched.linear_velocity.x() = speed * in_grid.x();
  launched.linear_velocity.z() = speed * in_grid.y();
  return Placement(launched.position, start, in_grid, Vector2d(velocity.x(), velocity.z()) / speed,
                   at(state, mirrored()) == 1);
}

/// What one die does says nothing of where the grid lies for the others. Launches are rounded in the grid, so
/// that dice and grid can be moved together and the motion stays as it is, bit for bit.
Placement DiceModel::place_with_world(const State& state, std::vector<Launch>& dice) const {
  constexpr double kFineness = 0x1p34;  // a multiple of 6e-11 [m] or [m/s]
  const auto rounded = [](const Vector3d& vector) -> Vector3d {
    return vector.unaryExpr([](double value) { return std::nearbyint(value * kFineness) / kFineness; });
  };
  const Vector3d origin(at(state, phase_x()), 0, at(state, phase_x() + 1));
  const Placement placement(origin, Vector3d::Zero(), heading_in_grid(state), Vector2d::UnitX(),
                            at(state, mirrored()) == 1);
  for (Launch& launch : dice) {
    launch.state.position = rounded(placement.point_in_grid(launch.state.position));
    launch.state.linear_velocity = rounded(placement.direction_in_grid(launch.state.linear_velocity));
  }
  return placement;
}

Vector2d DiceModel::heading_in_grid(const State& state) const {
  return {std::cos(at(state, heading())), std::sin(at(state, heading()))};
}

KernelTable DiceModel::kernels(Ratios ratios) const {
  std::vector<std::size_t> components, labels;
  for (std::size_t die = 0; die < settings_.dice; ++die) {
    for (std::size_t variable = start_x(die); variable < start_x(die) + 13; ++variable)
      components.push_back(variable);
    if (settings_.random_paint) labels.push_back(paint(die));
  }
  if (settings_.pose == GridPose::random) {
    for (const std::size_t variable : {phase_x(), phase_x() + 1, heading()})
      components.push_back(variable);
    labels.push_back(mirrored());
  }
  // Chosen: the paper leaves the relative probabilities to its user.
  std::vector<WeightedKernel> rows = {
      {"everything", 0.05, std::make_shared<const Redraw>(Redraw::all(*model_, ratios))},
      {"control_point", 0.5,
       std::make_shared<const RedrawControlPoint>(override_of(0), kPatch.size(), settings_.table)},
      {"component", 0.4, std::make_shared<const PerturbOne>(*model_, std::move(components))}};
  if (!labels.empty())
    rows.push_back({"labels", 0.05, std::make_shared<const Redraw>(*model_, std::move(labels), ratios)});
  return KernelTable(std::move(rows));
}

}  // namespace retake::dice
