// See box.h.
#include "worlds/spelling/box.h"

#include <array>
#include <cmath>
#include <mutex>
#include <utility>

#include "sampler/check.h"

namespace retake::spelling {
namespace {

using Eigen::Vector3d;
using impulse::TriangleMesh;

/// Builds the triangles of figure 10. Corners of an opening are named by their side: right is +x, near +z.
class Mesher {
 public:
  Mesher(const Box& box, Tessellation tessellation) : box_(box), tessellation_(tessellation) {}

  TriangleMesh mesh() {
    mesh_.group_count = box_.group_count();
    for (int row = 0; row < box_.rows(); ++row)
      for (int column = 0; column < box_.columns(); ++column) {
        add_floor(column, row);
        add_sides(column, row);
        add_rims(column, row);
      }
    add_walls();
    return std::move(mesh_);
  }

 private:
  using Index = std::uint32_t;

  Index vertex(const Vector3d& place, std::optional<Index> group = std::nullopt) {
    mesh_.vertices.push_back({place, group});
    return static_cast<Index>(mesh_.vertices.size()) - 1;
  }
  void triangle(Index a, Index b, Index c) { mesh_.triangles.push_back({a, b, c}); }
  /// Counter-clockwise seen from the free side.
  void quadrilateral(Index a, Index b, Index c, Index d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }

  Vector3d corner_place(int column, int row, bool right, bool near, double height) const {
    const Rectangle opening = box_.opening(box_.bin(column, row));
    return {right ? opening.max_x : opening.min_x, height, near ? opening.max_z : opening.min_z};
  }
  /// The group of an opening's corner on top of the partitions.
  Index group(int column, int row, bool right, bool near) const {
    const int side = (near ? 2 : 0) + (right ? 1 : 0);
    if (tessellation_ == Tessellation::four)
      return static_cast<Index>(4 * box_.bin(column, row)) + static_cast<Index>(side);
    const int crossing = (row + (near ? 1 : 0)) * (box_.columns() + 1) + column + (right ? 1 : 0);
    if (tessellation_ == Tessellation::one) return static_cast<Index>(crossing);
    return static_cast<Index>(2 * crossing + (right == near ? 0 : 1));
  }
  Index top(int column, int row, bool right, bool near) {
    return vertex(corner_place(column, row, right, near, kPartitionHeight), group(column, row, right, near));
  }
  Index foot(int column, int row, bool right, bool near) {
    return vertex(corner_place(column, row, right, near, 0));
  }

  /// Eight triangles around a centre that lies lower.
  void add_floor(int column, int row) {
    const Rectangle opening = box_.opening(box_.bin(column, row));
    const double x = (opening.min_x + opening.max_x) / 2, z = (opening.min_z + opening.max_z) / 2;
    const Index centre = vertex({x, -kFloorDepth, z});
    // Around the rim, counter-clockwise seen from above.
    const std::array<Index, 8> rim = {
        vertex({opening.min_x, 0, opening.min_z}), vertex({opening.min_x, 0, z}),
        vertex({opening.min_x, 0, opening.max_z}), vertex({x, 0, opening.max_z}),
        vertex({opening.max_x, 0, opening.max_z}), vertex({opening.max_x, 0, z}),
        vertex({opening.max_x, 0, opening.min_z}), vertex({x, 0, opening.min_z})};
    for (std::size_t i = 0; i < rim.size(); ++i)
      triangle(centre, rim[i], rim[(i + 1) % rim.size()]);
  }

  /// The partitions' faces around a bin. Where the box ends there is a wall instead.
  void add_sides(int column, int row) {
    const auto side = [&](bool right_a, bool near_a, bool right_b, bool near_b) {
      quadrilateral(foot(column, row, right_a, near_a), foot(column, row, right_b, near_b),
                    top(column, row, right_b, near_b), top(column, row, right_a, near_a));
    };
    if (column > 0) side(false, true, false, false);
    if (column + 1 < box_.columns()) side(true, false, true, true);
    if (row > 0) side(false, false, true, false);
    if (row + 1 < box_.rows()) side(true, true, false, true);
  }

  /// The tops of the partitions to the right of a bin and nearer than it, and of their crossing.
  void add_rims(int column, int row) {
    const bool beside = column + 1 < box_.columns(), before = row + 1 < box_.rows();
    if (beside)
      quadrilateral(top(column, row, true, false), top(column, row, true, true),
                    top(column + 1, row, false, true), top(column + 1, row, false, false));
    if (before)
      quadrilateral(top(column, row, false, true), top(column, row + 1, false, false),
                    top(column, row + 1, true, false), top(column, row, true, true));
    if (beside && before)
      quadrilateral(top(column, row, true, true), top(column, row + 1, true, false),
                    top(column + 1, row + 1, false, false), top(column + 1, row, false, true));
  }

  void add_walls() {
    const Rectangle inside = box_.interior();
    mesh_.planes = {{Vector3d::UnitX(), inside.min_x},
                    {-Vector3d::UnitX(), -inside.max_x},
                    {Vector3d::UnitZ(), inside.min_z},
                    {-Vector3d::UnitZ(), -inside.max_z}};
  }

  const Box& box_;
  Tessellation tessellation_;
  TriangleMesh mesh_;
};

double extent(int count) {
  return count * kOpening + (count - 1) * kPartition;
}

}  // namespace

struct Box::Triangles {
  explicit Triangles(TriangleMesh made) : mesh(std::move(made)) {}
  const TriangleMesh mesh;
  std::once_flag is_indexed;
  std::shared_ptr<const impulse::TriangleIndex> index;
};

Box::Box(int columns, int rows, Tessellation tessellation)
    : columns_(columns), rows_(rows), tessellation_(tessellation) {
  CHECK(columns > 0 && rows > 0, columns, rows);
  triangles_ = std::make_shared<Triangles>(Mesher(*this, tessellation).mesh());
}

const TriangleMesh& Box::mesh() const {
  return triangles_->mesh;
}

std::size_t Box::bin_count() const {
  return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
}

std::size_t Box::bin(int column, int row) const {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
         static_cast<std::size_t>(column);
}

Rectangle Box::opening(std::size_t bin) const {
  const auto columns = static_cast<std::size_t>(columns_);
  const double min_x = interior().min_x + static_cast<double>(bin % columns) * kPitch,
               min_z = interior().min_z + static_cast<double>(bin / columns) * kPitch;
  return {min_x, min_x + kOpening, min_z, min_z + kOpening};
}

std::optional<std::size_t> Box::bin_of(const Eigen::Vector3d& centre) const {
  if (centre.y() >= kInBin || !interior().contains(centre.x(), centre.z())) return std::nullopt;
  const int column = static_cast<int>((centre.x() - interior().min_x) / kPitch),
            row = static_cast<int>((centre.z() - interior().min_z) / kPitch);
  const std::size_t number = bin(column, row);
  if (!opening(number).contains(centre.x(), centre.z())) return std::nullopt;
  return number;
}

Rectangle Box::interior() const {
  const double half_x = extent(columns_) / 2, half_z = extent(rows_) / 2;
  return {-half_x, half_x, -half_z, half_z};
}

Rectangle Box::drop_area() const {
  const Rectangle inside = interior();
  return {inside.min_x + kMarbleRadius, inside.max_x - kMarbleRadius, inside.min_z + kMarbleRadius,
          inside.max_z - kMarbleRadius};
}

std::size_t Box::group_count() const {
  if (tessellation_ == Tessellation::four) return 4 * bin_count();
  return static_cast<std::size_t>(columns_ + 1) * static_cast<std::size_t>(rows_ + 1) *
         (tessellation_ == Tessellation::two ? 2 : 1);
}

std::unique_ptr<impulse::TriangleSurface> Box::make_surface() const {
  std::call_once(triangles_->is_indexed, [this] {
    triangles_->index = std::make_shared<const impulse::TriangleIndex>(triangles_->mesh, kMarbleRadius);
  });
  return std::make_unique<impulse::TriangleSurface>(triangles_->index);
}

}  // namespace retake::spelling
