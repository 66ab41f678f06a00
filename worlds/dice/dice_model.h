// DiceModel: what is uncertain when dice are thrown on a random table, and how candidates are proposed.
// Paper, section 5.4. It must not know wishes or how dice move.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "sampler/kernel.h"
#include "sampler/model.h"
#include "worlds/dice/placement.h"
#include "worlds/dice/table.h"
#include "worlds/dice/tumble.h"

namespace retake::dice {

/// Where the control grid lies in the world.
enum class GridPose {
  random,  ///< it has no privileged pose: offset within a cell, angle and handedness are uniform
  fixed,   ///< glued to the world: control point (0, 0) at the world's origin (the paper)
};

struct DiceSettings {
  std::size_t dice = 1;
  GridPose pose = GridPose::random;
  bool random_paint = true;  ///< else die's and paint's frames are one
  TableSettings table{};
  double start_spread = 0.003;   ///< [m] of x and z of the start, about the world's origin
  double drop_height = 0.12;     ///< [m] of the centre at the start
  double height_spread = 0.003;  ///< [m]
  double speed = 0.4;            ///< [m/s] along x
  double speed_spread = 0.03;    ///< [m/s] of each component of the velocity
  double spin_spread = 10;       ///< [rad/s] of each component of the angular velocity
  double interval = 0.25;        ///< [s] between the starts of successive dice
};

/// [s] from the first start, when a run ends.
inline double longest_run(const DiceSettings& settings) {
  constexpr double kLongestRoll = 4;  // [s] after the last start; chosen: dice take 0.65
  return static_cast<double>(settings.dice - 1) * settings.interval + kLongestRoll;
}

/// A rectangle of control points.
struct Patch {
  GridPlace first;
  std::int32_t along_x, along_z;

  std::size_t size() const { return static_cast<std::size_t>(along_x * along_z); }
  GridPlace place(std::size_t index) const;
};

/// What a State says, with physics in the grid's frame and the rest in the placement and the paint.
struct DiceThrow {
  TumbleScene scene;
  Placement placement;
  std::vector<std::size_t> paint;  ///< of each die, which of paints()
};

/// The Variables, in this order: the table's key; for a random pose a phase within a cell, a heading in the
/// grid, and whether the placement mirrors; of each die the start, the velocity, the angular velocity, four
/// numbers whose direction is its orientation, and its paint; then the overrides of the control points of a
/// patch, three each.
///
/// Start and velocity are in the world's frame. Angular velocity and orientation, whose priors have no
/// direction, are in the grid's. Phase and heading are those of the start and the flight if there is one die:
/// then the motion in the grid depends on them, the height, the horizontal and the vertical speed, spin,
/// orientation and the table alone, and States that differ only in the rest have the same motion, bit for
/// bit. Of several dice, they are those of the world's origin and its x axis, which is the same model, but
/// for launches that are rounded in the grid to 6e-11 m and m/s.
///
/// A square grid is the same after a quarter turn, so headings of a quarter of the circle are all there are.
/// Immutable. Thread safety: shared by all threads.
class DiceModel {
 public:
  /// Requires: at least one die; positive spreads; a start above the table.
  DiceModel(const DiceSettings& settings, const EngineSettings& engine, const DieShape& shape);

  const DiceSettings& settings() const { return settings_; }
  std::shared_ptr<const Model> model() const { return model_; }
  DiceThrow read(const State& state) const;
  /// The paper's proposals: one control point, one component of the initial conditions, everything; and
  /// placement and paint alone, which need no simulation.
  KernelTable kernels(Ratios ratios) const;

  /// Control points that can be changed one by one: where dice with such headings mostly roll.
  static constexpr Patch kPatch{.first = {-4, -14}, .along_x = 28, .along_z = 28};

  // Indices of Variables.
  std::size_t key() const { return 0; }
  std::size_t phase_x() const { return 1; }                             ///< phase_z follows; random pose only
  std::size_t heading() const { return 3; }                             ///< random pose only
  std::size_t mirrored() const { return 4; }                            ///< random pose only
  std::size_t start_x(std::size_t die) const { return first_of(die); }  ///< height and z follow
  std::size_t velocity_x(std::size_t die) const { return first_of(die) + 3; }
  std::size_t spin_x(std::size_t die) const { return first_of(die) + 6; }
  std::size_t orientation_x(std::size_t die) const { return first_of(die) + 9; }
  std::size_t paint(std::size_t die) const { return first_of(die) + 13; }  ///< random paint only
  std::size_t override_of(std::size_t patch_index) const {
    return first_of(settings_.dice) + 3 * patch_index;
  }

 private:
  std::size_t first_of(std::size_t die) const {
    return (settings_.pose == GridPose::random ? 5 : 1) + die * (settings_.random_paint ? 14 : 13);
  }
  std::vector<Variable> variables() const;
  Placement place_with_die(const State& state, DieState& launched) const;
  Placement place_with_world(const State& state, std::vector<Launch>& dice) const;
  Eigen::Vector2d heading_in_grid(const State& state) const;

  DiceSettings settings_;
  EngineSettings engine_;
  double lowest_start_;  ///< [m]
  std::shared_ptr<const Model> model_;
};

}  // namespace retake::dice
