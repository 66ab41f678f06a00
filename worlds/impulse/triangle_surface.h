// TriangleSurface: planes, and triangles whose vertices belong to movable groups, for spheres of one radius.
// Paper, appendix B and figure 10. It must not know what the triangles form.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "worlds/impulse/surface.h"

namespace retake::impulse {

/// Everything on the side of the normal is free.
struct Plane {
  Eigen::Vector3d normal;  ///< unit vector
  double distance;         ///< [m] of the plane from the origin along the normal
};

/// What a TriangleSurface is made of; values, not yet checked.
struct TriangleMesh {
  struct Vertex {
    Eigen::Vector3d place;                 ///< [m]
    std::optional<std::uint32_t> group{};  ///< none: it never moves
  };
  std::vector<Vertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from the free side
  std::vector<Plane> planes;
  std::size_t group_count = 0;

  /// Where a vertex is. Requires: an offset for each group.
  Eigen::Vector3d place(std::size_t vertex, std::span<const Eigen::Vector3d> offsets) const;
};

/// What a sphere of one radius may touch from where: a uniform grid of cells, each with the triangles that
/// a sphere whose centre is in it can reach, whatever the offsets. Immutable. Thread safety: shared by all.
class TriangleIndex {
 public:
  static constexpr double kMaxOffset = 0.001;  ///< [m] a component; ten standard deviations of appendix B
  static constexpr double kCell =
      0.004;  ///< [m], measured: 5.5 mm cost a tenth more a step, and less is slow to fill

  /// Requires: indices of vertices and groups in range; no triangle without an area.
  TriangleIndex(TriangleMesh mesh, double radius);

  const TriangleMesh& mesh() const { return mesh_; }
  double radius() const { return radius_; }
  std::uint32_t cell(const Eigen::Vector3d& centre) const;
  std::span<const std::uint32_t> triangles(std::uint32_t cell) const { return list_of(triangles_, cell); }
  std::span<const std::uint32_t> groups(std::uint32_t cell) const { return list_of(groups_, cell); }
  std::span<const std::uint32_t> triangles_of_group(std::uint32_t group) const {
    return list_of(group_triangles_, group);
  }

 private:
  struct Lists {
    Lists() = default;
    explicit Lists(const std::vector<std::vector<std::uint32_t>>& lists);
    std::vector<std::uint32_t> begin;  ///< of each list, and the end of the last one
    std::vector<std::uint32_t> items;
  };
  static std::span<const std::uint32_t> list_of(const Lists& lists, std::uint32_t which) {
    return {lists.items.data() + lists.begin[which], lists.items.data() + lists.begin[which + 1]};
  }
  std::uint32_t outside() const { return cells_[0] * cells_[1] * cells_[2]; }
  /// How far a centre can be from a triangle as it was built and touch it [m].
  double reach(bool moves) const;
  bool moves(std::uint32_t triangle) const;
  void divide();
  void fill_cells();
  void list_groups();

  TriangleMesh mesh_;
  double radius_;
  Eigen::Vector3d corner_;              ///< [m], lowest, of the cells
  std::array<std::uint32_t, 3> cells_;  ///< along x, y, z; one more cell, the last, is everything else
  Lists triangles_, groups_, group_triangles_;
};

class TriangleSurface final : public Surface {
 public:
  explicit TriangleSurface(std::shared_ptr<const TriangleIndex> index);
  std::size_t group_count() const override { return offsets_.size(); }
  void set_offsets(std::span<const Eigen::Vector3d> offsets) override;
  double max_offset() const override { return TriangleIndex::kMaxOffset; }
  std::uint32_t region(const Eigen::Vector3d& centre) const override { return index_->cell(centre); }
  std::span<const std::uint32_t> groups(std::uint32_t region) const override {
    return index_->groups(region);
  }
  void find_contacts(std::uint32_t region, const Eigen::Vector3d& centre,
                     SurfaceContacts& contacts) const override;

 private:
  struct Corners {
    Eigen::Vector3d a, ab, ac;  ///< [m] a corner, and from it to the others
  };
  void place(std::uint32_t triangle);

  std::shared_ptr<const TriangleIndex> index_;
  std::vector<Eigen::Vector3d> offsets_;
  std::vector<Corners> corners_;  ///< of the triangles where they are now
  std::vector<Plane> planes_;     ///< of the triangles where they are now
  std::vector<std::uint32_t> moved_;
};

}  // namespace retake::impulse
