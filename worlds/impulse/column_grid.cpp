// See column_grid.h.
#include "worlds/impulse/column_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace retake::impulse {
namespace {

constexpr double kFarthest = 1e6;  // columns from the origin; what is beyond shares the last one

}  // namespace

ColumnGrid::ColumnGrid(double width) : per_metre_(1 / width) {
  clear(0);
}

void ColumnGrid::clear(std::size_t bodies) {
  heads_.assign(std::bit_ceil(4 * bodies + 16), -1);
  entries_.clear();
}

void ColumnGrid::insert(std::uint32_t body, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  for (std::int64_t z = column(low.z()); z <= column(high.z()); ++z)
    for (std::int64_t x = column(low.x()); x <= column(high.x()); ++x) {
      std::int32_t& head = heads_[bucket(x, z)];
      entries_.push_back({body, head});
      head = static_cast<std::int32_t>(entries_.size()) - 1;
    }
}

std::int64_t ColumnGrid::column(double along) const {
  const double at = std::max(-kFarthest, std::min(kFarthest, along * per_metre_));
  return static_cast<std::int64_t>(at + kFarthest);  // never negative, so this rounds down
}

std::size_t ColumnGrid::bucket(std::int64_t x, std::int64_t z) const {
  const auto hash = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u ^
                    static_cast<std::uint64_t>(z) * 0xC2B2AE3D27D4EB4Fu;
  return (hash >> 32) & (heads_.size() - 1);
}

}  // namespace retake::impulse
