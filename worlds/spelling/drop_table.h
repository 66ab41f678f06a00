// DropTable: where a marble has to be dropped to fall into a bin, as far as one can know without knowing the
// others.
// doc/design.md, section 3, "Informed proposals". It must not know words.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "sampler/random.h"

namespace retake::spelling {

/// A square of cells around the centre of a bin; a cell counts the drops from there that ended in the bin.
inline constexpr int kTableSide = 48;         ///< cells
inline constexpr double kTableCell = 0.0022;  ///< [m], side of a cell: the square is 4.8 bins wide
using DropCounts = std::array<std::uint32_t, kTableSide * kTableSide>;

/// Counts drops into boxes of 11 x 11 bins, forty one by one into each, with default settings; each counts
/// eight times, as the bins look alike from every side. A drop is known by where it started from the centre
/// of the bin in which it ended. (Drops into empty boxes alone start too near their bins: those that have to
/// travel over filled bins are then proposed too rarely, and once there stay for long.) The build writes down
/// what this gives; see CMakeLists.txt.
DropCounts count_drops(int drops);
inline constexpr int kCountedDrops = 8000;

/// The density of drops, seen from the bin's centre, that end in the bin. Immutable.
class DropTable {
 public:
  explicit DropTable(const DropCounts& counts);
  /// Of kCountedDrops.
  static const DropTable& standard();
  /// [1/m2]; integrates to 1.
  double density(const Eigen::Vector2d& from_centre) const;
  Eigen::Vector2d draw(RandomStream& random) const;  ///< [m] from the bin's centre

 private:
  std::vector<double> densities_, cumulative_;  ///< of the cells
};

}  // namespace retake::spelling
