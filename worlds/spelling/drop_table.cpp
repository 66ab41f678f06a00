// See drop_table.h.
#include "worlds/spelling/drop_table.h"

#include <algorithm>
#include <cmath>

namespace retake::spelling {
namespace {

constexpr DropCounts kCounts = {
#include "drop_counts.inc"
};

constexpr double kUncounted = 0.02;  // what a cell has besides its count; chosen: no cell is ruled out

}  // namespace

DropTable::DropTable(const DropCounts& counts) {
  double sum = 0;
  for (const std::uint32_t count : counts)
    cumulative_.push_back(sum += count + kUncounted);
  for (const std::uint32_t count : counts)
    densities_.push_back((count + kUncounted) / sum / (kTableCell * kTableCell));
}

const DropTable& DropTable::standard() {
  static const DropTable table(kCounts);
  return table;
}

double DropTable::density(const Eigen::Vector2d& from_centre) const {
  const Eigen::Array2d cell = (from_centre.array() / kTableCell).floor() + kTableSide / 2;
  if ((cell < 0).any() || (cell >= kTableSide).any()) return 0;
  return densities_[static_cast<std::size_t>(cell.y()) * kTableSide + static_cast<std::size_t>(cell.x())];
}

Eigen::Vector2d DropTable::draw(RandomStream& random) const {
  const double mark = random.uniform() * cumulative_.back();
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), mark);
  const auto cell = std::min<std::ptrdiff_t>(found - cumulative_.begin(), kTableSide * kTableSide - 1);
  const auto column = static_cast<double>(cell % kTableSide), row = static_cast<double>(cell / kTableSide);
  const double x = column - kTableSide / 2 + random.uniform(), y = row - kTableSide / 2 + random.uniform();
  return kTableCell * Eigen::Vector2d(x, y);
}

}  // namespace retake::spelling
