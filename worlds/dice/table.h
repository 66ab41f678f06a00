// Table: an endless bumpy surface - a uniform bicubic b-spline over a square grid of control points, each
// with a random height, restitution and friction. Paper, section 5.4. It must not know dice or time.
//
// Everything here is in the grid's frame: control point (i, j) stands at x = i spacing, z = j spacing.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sampler/random.h"

namespace retake::dice {

/// The random field. The paper fixes none of its numbers; all are chosen, and measured to give lively rolls.
struct TableSettings {
  double spacing = 0.01;             ///< [m] between neighbouring control points
  double height_deviation = 0.0008;  ///< [m] of the Gaussian height of a control point
  double restitution_mean = 0.5;     ///< of the Gaussian restitution
  double restitution_deviation = 0.1;
  double friction_mean = 0.35;  ///< of the Gaussian coefficient of friction
  double friction_deviation = 0.1;

  /// [m]; heights beyond it, 4.3 deviations, are clamped, and the surface never leaves it: splines lie in the
  /// hull of their control points.
  double max_height() const { return 4.3 * height_deviation; }
  /// Of the surface in any direction: its derivatives are means of differences of neighbours.
  double max_slope() const;
};

/// Gaussian numbers; the surface is made of what physical() makes of them.
struct ControlPoint {
  double height;  ///< [m]
  double restitution;
  double friction;

  friend bool operator==(const ControlPoint&, const ControlPoint&) = default;
};

/// Indices of a control point.
struct GridPlace {
  std::int32_t x = 0, z = 0;

  friend auto operator<=>(const GridPlace&, const GridPlace&) = default;
};

/// Clamped: heights to max_height(), restitution to [0, 0.95], friction to at least 0.02.
ControlPoint physical(const TableSettings& settings, const ControlPoint& point);
/// A draw from the prior of a control point.
ControlPoint draw_control_point(const TableSettings& settings, RandomStream& random);
/// What a key says of a control point: a draw from the prior that is a pure function of key and place.
ControlPoint control_point_of_key(const TableSettings& settings, std::uint64_t key, GridPlace place);

/// A control point that is given instead of what the key says.
struct Override {
  GridPlace place;
  ControlPoint point;

  friend bool operator==(const Override&, const Override&) = default;
};

/// A whole table.
struct TableContent {
  std::uint64_t key = 0;
  std::vector<Override> overrides;  ///< ascending by place
};

/// A control point as this table has it, from the key unless it is overridden.
ControlPoint control_point(const TableSettings& settings, const TableContent& content, GridPlace place);

/// When somebody looked at a control point for the first time.
struct FirstTouch {
  GridPlace place;
  std::int64_t step;
};

/// A table whose control points are made when they are first looked at. What each of those who look sees for
/// the first time is logged: what it did before does not depend on it. Thread safety: one thread at a time.
class Table {
 public:
  struct Height {
    double value;             ///< [m]
    double slope_x, slope_z;  ///< derivatives
  };
  struct Material {
    double restitution, friction;
  };

  explicit Table(const TableSettings& settings);

  const TableSettings& settings() const { return settings_; }
  /// Forgets everything. Requires: `content` lives until the next call.
  void reset(const TableContent& content);
  /// What is looked at from now on is looked at by this one, in this step, and logged if it is the first
  /// time. A log that is null is not written. Requires: who < 32; steps of one do not descend.
  void look_as(std::int32_t who, std::int64_t step, std::vector<FirstTouch>* log) {
    who_ = std::uint32_t{1} << who;
    step_ = step;
    log_ = log;
  }
  /// Takes over what one has looked at, without logging it.
  void restore(std::int32_t who, std::span<const FirstTouch> touches);

  Height height(double x, double z);
  Material material(double x, double z);
  /// [m], which the surface does not exceed in the cell of a place.
  double highest_near(double x, double z) { return cell(coordinate(x).index, coordinate(z).index).highest; }

 private:
  static constexpr std::int32_t kCells = 64;    // kept in each direction
  static constexpr std::int32_t kPoints = 128;  // kept in each direction
  /// The control points of one cell, x by x.
  struct Cell {
    std::uint64_t epoch = 0;
    std::uint32_t seen_by = 0;  ///< a bit each
    GridPlace place;
    double highest = 0;  ///< [m]
    std::array<double, 16> heights, restitutions, frictions;
  };
  struct KnownPoint {
    std::uint64_t epoch = 0;
    std::uint32_t seen_by = 0;  ///< a bit each; of what lies 128 cells away it is forgotten
    GridPlace place;
    ControlPoint physical;
  };
  struct Coordinate {
    std::int32_t index;  ///< of the cell
    double fraction;     ///< within it, [0, 1)
  };

  Coordinate coordinate(double length) const {
    const double scaled = length * cells_per_metre_;
    auto index = static_cast<std::int32_t>(scaled);
    if (scaled < index) --index;
    return {index, scaled - index};
  }
  const Cell& cell(std::int32_t x, std::int32_t z) {
    Cell& found = cells_[static_cast<std::size_t>((x & (kCells - 1)) * kCells + (z & (kCells - 1)))];
    if (found.epoch != epoch_ || found.place != GridPlace{x, z} || (found.seen_by & who_) == 0) [[unlikely]]
      open(found, {x, z});
    return found;
  }
  void open(Cell& cell, GridPlace place);
  const ControlPoint& look_at(GridPlace place);

  TableSettings settings_;
  double cells_per_metre_;
  const TableContent* content_ = nullptr;
  std::uint64_t epoch_ = 0;  ///< what was cached before this one is of another table
  std::uint32_t who_ = 1;
  std::int64_t step_ = 0;
  std::vector<FirstTouch>* log_ = nullptr;
  std::vector<Cell> cells_;
  std::vector<KnownPoint> points_;
};

}  // namespace retake::dice
