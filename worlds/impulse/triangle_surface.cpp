// See triangle_surface.h.
#include "worlds/impulse/triangle_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "sampler/check.h"
#include "worlds/impulse/sphere.h"

namespace retake::impulse {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostFound = 16;   // chosen: twice what is ever kept
constexpr double kSameNormal = 0.9999;   // cosine; contacts whose normals are closer are one
constexpr double kSamePlane = 1e-6;      // [m]; an edge as near to a touched face belongs to it
constexpr double kSmallestArea = 1e-12;  // [m2]
constexpr double kRounding = 1e-9;       // [m], far above what arithmetic loses

/// A point of a triangle, and whether it lies on none of its edges.
struct Closest {
  Vector3d point;
  bool inside;
};

/// The point of a triangle that is closest to p: Ericson, Real-Time Collision Detection, 5.1.5.
Closest closest_point(const Vector3d& a, const Vector3d& ab, const Vector3d& ac, const Vector3d& p) {
  const Vector3d ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, false};
  const Vector3d bp = ap - ab;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {a + ab, false};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {a + d1 / (d1 - d3) * ab, false};
  const Vector3d cp = ap - ac;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {a + ac, false};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + d2 / (d2 - d6) * ac, false};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {a + ab + w * (ac - ab), false};
  }
  const double scale = 1 / (va + vb + vc);
  return {a + vb * scale * ab + vc * scale * ac, true};
}

/// From where a triangle can be touched: by the box around it and by its plane.
struct Neighbourhood {
  Neighbourhood(const TriangleMesh& mesh, std::uint32_t triangle, double furthest, bool moves)
      : reach(furthest) {
    const auto& [first, second, third] = mesh.triangles[triangle];
    const Vector3d &a = mesh.vertices[first].place, &b = mesh.vertices[second].place,
                   &c = mesh.vertices[third].place;
    const Vector3d cross = (b - a).cross(c - a);
    CHECK(cross.norm() > 2 * kSmallestArea, triangle);
    low = a.cwiseMin(b).cwiseMin(c);
    high = a.cwiseMax(b).cwiseMax(c);
    normal = cross.normalized();
    distance = normal.dot(a);
    // What never moves is not touched from behind.
    behind = moves ? reach : kRounding;
    extent = normal.cwiseAbs().sum() * TriangleIndex::kCell / 2;
  }
  /// Whether a sphere whose centre is in the cell around a place can touch it.
  bool meets(const Vector3d& place) const {
    const Vector3d half = Vector3d::Constant(TriangleIndex::kCell / 2);
    const Vector3d gap = (low - place - half).cwiseMax(place - half - high).cwiseMax(Vector3d::Zero());
    const double height = normal.dot(place) - distance;
    return gap.squaredNorm() <= reach * reach && height <= reach + extent && height >= -behind - extent;
  }

  Vector3d low, high, normal;
  double distance, reach, behind, extent;  // [m]
};

/// A contact before those that are one are told apart.
struct Found {
  double distance;  ///< [m] of the centre
  Vector3d normal;
  Vector3d point;
  bool face;
};

/// The closest contacts, in order of distance; equal ones in the order in which they were found.
class FoundList {
 public:
  void add(const Found& found) {
    if (count_ == found_.size() && found.distance >= found_[count_ - 1].distance) return;
    if (count_ < found_.size()) ++count_;
    std::size_t at = count_ - 1;
    for (; at > 0 && found_[at - 1].distance > found.distance; --at)
      found_[at] = found_[at - 1];
    found_[at] = found;
  }
  std::span<const Found> list() const { return {found_.data(), count_}; }

 private:
  std::array<Found, kMostFound> found_;
  std::size_t count_ = 0;
};

/// Whether a contact says no more than one that is already kept.
bool repeats(const Found& found, const Found& kept) {
  if (found.normal.dot(kept.normal) > kSameNormal) return true;
  return kept.face && !found.face && std::abs(kept.normal.dot(found.point - kept.point)) < kSamePlane;
}

}  // namespace

Vector3d TriangleMesh::place(std::size_t vertex, std::span<const Vector3d> offsets) const {
  const Vertex& it = vertices[vertex];
  return it.group ? Vector3d(it.place + offsets[*it.group]) : it.place;
}

// --- TriangleIndex -----------------------------------------------------------------------------------------

TriangleIndex::TriangleIndex(TriangleMesh mesh, double radius) : mesh_(std::move(mesh)), radius_(radius) {
  for (const TriangleMesh::Vertex& vertex : mesh_.vertices)
    CHECK(!vertex.group || *vertex.group < mesh_.group_count, *vertex.group);
  for (const auto& corners : mesh_.triangles)
    for (const std::uint32_t corner : corners)
      CHECK(corner < mesh_.vertices.size(), corner);
  divide();
  fill_cells();
  list_groups();
}

/// Lays cells over everything from where a triangle can be touched.
void TriangleIndex::divide() {
  corner_ = Vector3d::Zero();
  cells_ = {0, 0, 0};
  if (mesh_.triangles.empty()) return;
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const TriangleMesh::Vertex& vertex : mesh_.vertices) {
    low = low.cwiseMin(vertex.place);
    high = high.cwiseMax(vertex.place);
  }
  corner_ = low - Vector3d::Constant(reach(true));
  const Vector3d extent = high - low + Vector3d::Constant(2 * reach(true));
  for (std::size_t axis = 0; axis < 3; ++axis)
    cells_[axis] = static_cast<std::uint32_t>(std::ceil(extent[static_cast<Eigen::Index>(axis)] / kCell));
}

double TriangleIndex::reach(bool moves) const {
  return radius_ + (moves ? std::sqrt(3.0) * kMaxOffset : 0) + kRounding;
}

std::uint32_t TriangleIndex::cell(const Vector3d& centre) const {
  std::array<std::uint32_t, 3> at;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double along = (centre[i] - corner_[i]) * (1 / kCell);
    if (!(along >= 0 && along < cells_[axis])) return outside();
    at[axis] = static_cast<std::uint32_t>(along);
  }
  return (at[1] * cells_[2] + at[2]) * cells_[0] + at[0];
}

void TriangleIndex::fill_cells() {
  std::vector<std::vector<std::uint32_t>> of_cell(outside() + 1);
  for (std::uint32_t triangle = 0; triangle < mesh_.triangles.size(); ++triangle) {
    const Neighbourhood near(mesh_, triangle, reach(moves(triangle)), moves(triangle));
    // The cells around the triangle's box.
    std::array<std::uint32_t, 3> from, to;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      const double first = (near.low[i] - near.reach - corner_[i]) / kCell - 1;
      const double last = (near.high[i] + near.reach - corner_[i]) / kCell + 1;
      from[axis] = static_cast<std::uint32_t>(std::max(0.0, first));
      to[axis] = std::min(cells_[axis] - 1, static_cast<std::uint32_t>(last));
    }
    for (std::uint32_t y = from[1]; y <= to[1]; ++y)
      for (std::uint32_t z = from[2]; z <= to[2]; ++z)
        for (std::uint32_t x = from[0]; x <= to[0]; ++x)
          if (near.meets(corner_ + kCell * Vector3d(x + 0.5, y + 0.5, z + 0.5)))
            of_cell[(y * cells_[2] + z) * cells_[0] + x].push_back(triangle);
  }
  triangles_ = Lists(of_cell);
}

bool TriangleIndex::moves(std::uint32_t triangle) const {
  const auto& corners = mesh_.triangles[triangle];
  return std::any_of(corners.begin(), corners.end(),
                     [&](std::uint32_t corner) { return mesh_.vertices[corner].group.has_value(); });
}

void TriangleIndex::list_groups() {
  std::vector<std::vector<std::uint32_t>> triangles_of(mesh_.group_count), of_cell(outside() + 1);
  for (std::uint32_t triangle = 0; triangle < mesh_.triangles.size(); ++triangle)
    for (const std::uint32_t corner : mesh_.triangles[triangle])
      if (const auto& group = mesh_.vertices[corner].group) triangles_of[*group].push_back(triangle);
  for (auto& list : triangles_of)
    list.erase(std::unique(list.begin(), list.end()), list.end());
  for (std::uint32_t cell = 0; cell < of_cell.size(); ++cell) {
    auto& list = of_cell[cell];
    for (const std::uint32_t triangle : triangles(cell))
      for (const std::uint32_t corner : mesh_.triangles[triangle])
        if (const auto& group = mesh_.vertices[corner].group) list.push_back(*group);
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  group_triangles_ = Lists(triangles_of);
  groups_ = Lists(of_cell);
}

TriangleIndex::Lists::Lists(const std::vector<std::vector<std::uint32_t>>& lists) {
  begin.push_back(0);
  for (const auto& list : lists) {
    items.insert(items.end(), list.begin(), list.end());
    begin.push_back(static_cast<std::uint32_t>(items.size()));
  }
}

// --- TriangleSurface ---------------------------------------------------------------------------------------

TriangleSurface::TriangleSurface(std::shared_ptr<const TriangleIndex> index)
    : index_(std::move(index)),
      offsets_(index_->mesh().group_count, Vector3d::Zero()),
      corners_(index_->mesh().triangles.size()),
      planes_(corners_.size()) {
  for (std::uint32_t triangle = 0; triangle < corners_.size(); ++triangle)
    place(triangle);
}

void TriangleSurface::set_offsets(std::span<const Vector3d> offsets) {
  CHECK(offsets.size() == offsets_.size(), offsets.size(), offsets_.size());
  moved_.clear();
  for (std::uint32_t group = 0; group < offsets_.size(); ++group) {
    const Vector3d& offset = offsets[group];
    if (same_bits(offset, offsets_[group])) continue;
    CHECK(offset.cwiseAbs().maxCoeff() <= max_offset(), group, offset.transpose());
    offsets_[group] = offset;
    moved_.push_back(group);
  }
  for (const std::uint32_t group : moved_)
    for (const std::uint32_t triangle : index_->triangles_of_group(group))
      place(triangle);
}

void TriangleSurface::place(std::uint32_t triangle) {
  const TriangleMesh& mesh = index_->mesh();
  const auto& [a, b, c] = mesh.triangles[triangle];
  Corners& corners = corners_[triangle];
  corners.a = mesh.place(a, offsets_);
  corners.ab = mesh.place(b, offsets_) - corners.a;
  corners.ac = mesh.place(c, offsets_) - corners.a;
  const Vector3d cross = corners.ab.cross(corners.ac);
  const double length = cross.norm();
  Plane& plane = planes_[triangle];
  plane.normal = length > 0 ? Vector3d(cross / length) : Vector3d(Vector3d::UnitY());
  plane.distance = plane.normal.dot(corners.a);
}

void TriangleSurface::find_contacts(std::uint32_t region, const Vector3d& centre,
                                    SurfaceContacts& contacts) const {
  const double radius = index_->radius();
  contacts.clear();
  FoundList found;
  for (const Plane& plane : index_->mesh().planes) {
    const double distance = plane.normal.dot(centre) - plane.distance;
    if (distance < radius)
      found.add({distance, plane.normal, Vector3d(centre - distance * plane.normal), true});
  }
  for (const std::uint32_t triangle : index_->triangles(region)) {
    const Plane& plane = planes_[triangle];
    const double height = plane.normal.dot(centre) - plane.distance;
    if (!(height >= 0 && height < radius)) continue;
    const Corners& corners = corners_[triangle];
    const Closest closest = closest_point(corners.a, corners.ab, corners.ac, centre);
    if (closest.inside) {
      found.add({height, plane.normal, closest.point, true});
      continue;
    }
    const Vector3d away = centre - closest.point;
    const double squared = away.squaredNorm();
    if (squared >= radius * radius || squared == 0) continue;
    const double distance = std::sqrt(squared);
    found.add({distance, Vector3d(away / distance), closest.point, false});
  }

  std::array<const Found*, SurfaceContacts::kMost> kept;
  std::size_t count = 0;
  for (const Found& it : found.list()) {
    if (std::any_of(kept.begin(), kept.begin() + count,
                    [&](const Found* other) { return repeats(it, *other); }))
      continue;
    contacts.add({it.normal, radius - it.distance});
    kept[count++] = &it;
    if (contacts.full()) break;
  }
}

}  // namespace retake::impulse
