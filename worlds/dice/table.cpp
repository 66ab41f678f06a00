// See table.h.
#include "worlds/dice/table.h"

#include <algorithm>
#include <cmath>

#include "sampler/check.h"

namespace retake::dice {
namespace {

/// The four cubic basis functions that are not zero in a cell, at a fraction of it.
std::array<double, 4> basis(double t) {
  const double s = 1 - t;
  constexpr double kSixth = 1.0 / 6;
  return {s * s * s * kSixth, (t * t * (3 * t - 6) + 4) * kSixth, (s * s * (3 * s - 6) + 4) * kSixth,
          t * t * t * kSixth};
}

/// Their derivatives.
std::array<double, 4> slopes(double t) {
  const double s = 1 - t;
  return {-0.5 * s * s, t * (1.5 * t - 2), -s * (1.5 * s - 2), 0.5 * t * t};
}

double dot(const double* row, const std::array<double, 4>& weights) {
  return (row[0] * weights[0] + row[1] * weights[1]) + (row[2] * weights[2] + row[3] * weights[3]);
}

double value(const std::array<double, 16>& points, const std::array<double, 4>& along_x,
             const std::array<double, 4>& along_z) {
  return (along_x[0] * dot(&points[0], along_z) + along_x[1] * dot(&points[4], along_z)) +
         (along_x[2] * dot(&points[8], along_z) + along_x[3] * dot(&points[12], along_z));
}

}  // namespace

double TableSettings::max_slope() const {
  return std::sqrt(2.0) * 2 * max_height() / spacing;
}

ControlPoint draw_control_point(const TableSettings& settings, RandomStream& random) {
  const double height = settings.height_deviation * random.gaussian();
  const double restitution = settings.restitution_mean + settings.restitution_deviation * random.gaussian();
  const double friction = settings.friction_mean + settings.friction_deviation * random.gaussian();
  return {.height = height, .restitution = restitution, .friction = friction};
}

ControlPoint physical(const TableSettings& settings, const ControlPoint& point) {
  return {.height = std::clamp(point.height, -settings.max_height(), settings.max_height()),
          .restitution = std::clamp(point.restitution, 0.0, 0.95),
          .friction = std::max(point.friction, 0.02)};
}

ControlPoint control_point_of_key(const TableSettings& settings, std::uint64_t key, GridPlace place) {
  const auto bits = [](std::int32_t index) { return std::uint64_t{static_cast<std::uint32_t>(index)}; };
  RandomStream random(
      {.seed = key, .purpose = Purpose::field, .iteration = bits(place.x) << 32 | bits(place.z)});
  return draw_control_point(settings, random);
}

ControlPoint control_point(const TableSettings& settings, const TableContent& content, GridPlace place) {
  const auto given =
      std::lower_bound(content.overrides.begin(), content.overrides.end(), place,
                       [](const Override& one, const GridPlace& wanted) { return one.place < wanted; });
  const bool is_given = given != content.overrides.end() && given->place == place;
  return is_given ? given->point : control_point_of_key(settings, content.key, place);
}

Table::Table(const TableSettings& settings)
    : settings_(settings),
      cells_per_metre_(1 / settings.spacing),
      cells_(static_cast<std::size_t>(kCells * kCells)),
      points_(static_cast<std::size_t>(kPoints * kPoints)) {
  CHECK(settings.spacing > 0, settings.spacing);
}

void Table::reset(const TableContent& content) {
  content_ = &content;
  ++epoch_;
  look_as(0, 0, nullptr);
}

void Table::restore(std::int32_t who, std::span<const FirstTouch> touches) {
  look_as(who, 0, nullptr);
  for (const FirstTouch& touch : touches)
    look_at(touch.place);
}

Table::Height Table::height(double x, double z) {
  const Coordinate at_x = coordinate(x), at_z = coordinate(z);
  const Cell& found = cell(at_x.index, at_z.index);
  const auto weights_x = basis(at_x.fraction), weights_z = basis(at_z.fraction);
  const auto slopes_x = slopes(at_x.fraction), slopes_z = slopes(at_z.fraction);
  std::array<double, 4> rows;
  double slope_z = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    rows[i] = dot(&found.heights[4 * i], weights_z);
    slope_z += weights_x[i] * dot(&found.heights[4 * i], slopes_z);
  }
  return {.value = dot(rows.data(), weights_x),
          .slope_x = dot(rows.data(), slopes_x) * cells_per_metre_,
          .slope_z = slope_z * cells_per_metre_};
}

Table::Material Table::material(double x, double z) {
  const Coordinate at_x = coordinate(x), at_z = coordinate(z);
  const Cell& found = cell(at_x.index, at_z.index);
  const auto weights_x = basis(at_x.fraction), weights_z = basis(at_z.fraction);
  return {.restitution = value(found.restitutions, weights_x, weights_z),
          .friction = value(found.frictions, weights_x, weights_z)};
}

void Table::open(Cell& cell, GridPlace place) {
  if (cell.epoch != epoch_ || cell.place != place) cell.seen_by = 0;
  cell.seen_by |= who_;
  cell.epoch = epoch_;
  cell.place = place;
  cell.highest = -settings_.max_height();
  for (std::int32_t i = 0; i < 4; ++i)
    for (std::int32_t j = 0; j < 4; ++j) {
      const ControlPoint& point = look_at({place.x - 1 + i, place.z - 1 + j});
      const auto at = static_cast<std::size_t>(4 * i + j);
      cell.heights[at] = point.height;
      cell.restitutions[at] = point.restitution;
      cell.frictions[at] = point.friction;
      cell.highest = std::max(cell.highest, point.height);
    }
}

const ControlPoint& Table::look_at(GridPlace place) {
  const auto slot = (place.x & (kPoints - 1)) * kPoints + (place.z & (kPoints - 1));
  KnownPoint& known = points_[static_cast<std::size_t>(slot)];
  if (known.epoch != epoch_ || known.place != place)
    known = {.epoch = epoch_,
             .place = place,
             .physical = dice::physical(settings_, control_point(settings_, *content_, place))};
  if ((known.seen_by & who_) == 0) {
    known.seen_by |= who_;
    if (log_) log_->push_back({place, step_});
  }
  return known.physical;
}

}  // namespace retake::dice
