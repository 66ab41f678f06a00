// Box: the partitioned box into which marbles fall - its measures, its triangles, its bins.
// Paper, appendix B.1 and figure 10. It must not know letters or how marbles move.
//
// As in figure 10, but for the box's own walls, which are planes: a bin has faces of partitions where it
// borders on other bins alone. Each bin has a floor of 8 triangles, each face, each top of a partition and
// each square between four bins 2.
//
// Frame: the box is centred on the origin; x goes along the columns, z along the rows towards the viewer, y
// up from the rim of the bins' floors. Bin (0, 0) lies at the far left of who reads from +z.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "worlds/impulse/triangle_surface.h"

namespace retake::spelling {

inline constexpr double kOpening = 0.020;    ///< [m], side of a bin (B.1)
inline constexpr double kPartition = 0.002;  ///< [m], thickness (B.1)
inline constexpr double kPitch = kOpening + kPartition;
inline constexpr double kPartitionHeight = 0.012;  ///< [m] above the floor's rim (B.1)
inline constexpr double kFloorDepth = 0.0015;      ///< [m] of a floor's centre below its rim; chosen
inline constexpr double kBoxDepth = 0.036;    ///< [m] of the box as it is shown (B.1); its walls have no end
inline constexpr double kDropHeight = 0.072;  ///< [m] of a marble's centre when it is dropped (B.1)
inline constexpr double kMarbleRadius = 0.008;  ///< [m], chosen
/// A marble at rest is in a bin if its centre is lower [m]; one that lies on another is at 18.7 mm.
inline constexpr double kInBin = 0.014;

/// Upright rectangle in the floor's plane [m].
struct Rectangle {
  double min_x, max_x, min_z, max_z;
  double area() const { return (max_x - min_x) * (max_z - min_z); }  ///< [m2]
  bool contains(double x, double z) const { return x >= min_x && x <= max_x && z >= min_z && z <= max_z; }
};

/// How many vertices of a crossing of partitions move independently: all corners of the openings around it
/// together, in two diagonal pairs, or each on its own.
enum class Tessellation { one = 1, two = 2, four = 4 };

/// Immutable. Thread safety: shared by all threads.
class Box {
 public:
  /// Requires: positive numbers.
  Box(int columns, int rows, Tessellation tessellation);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  std::size_t bin_count() const;
  /// Bins are numbered row by row from the far left.
  std::size_t bin(int column, int row) const;
  Rectangle opening(std::size_t bin) const;
  /// The bin in which a marble at rest lies, none if it lies on others or on a partition.
  std::optional<std::size_t> bin_of(const Eigen::Vector3d& centre) const;
  Rectangle interior() const;
  /// Where marbles may be dropped: the interior less a marble's radius on every side.
  Rectangle drop_area() const;

  /// (columns + 1) * (rows + 1) * (1 or 2), or 4 a bin. Those at the corners of the box that move no
  /// partition are counted.
  std::size_t group_count() const;
  const impulse::TriangleMesh& mesh() const;
  /// The box for one thread's simulations. What a marble can touch where is listed at the first call alone,
  /// as that takes a tenth of a second for the largest boxes (measured): who only reads a wish need not wait.
  std::unique_ptr<impulse::TriangleSurface> make_surface() const;

 private:
  int columns_, rows_;
  Tessellation tessellation_;
  struct Triangles;
  std::shared_ptr<Triangles> triangles_;  ///< shared by copies
};

}  // namespace retake::spelling
