// The partitioned box: its measures, what its vertex groups move, and what a marble touches in it.
// Paper, appendix B.1 and figure 10.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/impulse/fixture.h"

namespace retake::tests {
namespace {

using impulse::SurfaceContacts;
using impulse::TriangleMesh;
using Eigen::Vector3d;
using spelling::Box;
using spelling::Tessellation;

constexpr std::array kTessellations = {Tessellation::one, Tessellation::two, Tessellation::four};

TEST(SpellingBox, HasTheMeasuresOfTheAppendix) {
  const Box box(7, 5, Tessellation::two);
  const auto inside = box.interior(), drops = box.drop_area();
  EXPECT_NEAR(inside.max_x - inside.min_x, 0.152, 1e-12);
  EXPECT_NEAR(inside.max_z - inside.min_z, 0.108, 1e-12);
  EXPECT_NEAR(drops.area(), 0.136 * 0.092, 1e-12);
  EXPECT_NEAR(Box(15, 7, Tessellation::one).drop_area().area(), 0.312 * 0.136, 1e-12);
  const auto first = box.opening(0), last = box.opening(box.bin_count() - 1);
  EXPECT_NEAR(first.min_x, inside.min_x, 1e-12);
  EXPECT_NEAR(first.max_z, inside.min_z + 0.020, 1e-12);
  EXPECT_NEAR(last.max_x, inside.max_x, 1e-12);
  EXPECT_NEAR(last.max_z, inside.max_z, 1e-12);
}

TEST(SpellingBox, NumbersOfVertexGroupsAreThoseOfTheTessellation) {
  for (const auto& [columns, rows, one, two, four] :
       {std::array{7, 5, 48, 96, 140}, {15, 7, 128, 256, 420}, {1, 1, 4, 8, 4}}) {
    EXPECT_EQ(Box(columns, rows, Tessellation::one).group_count(), static_cast<std::size_t>(one));
    EXPECT_EQ(Box(columns, rows, Tessellation::two).group_count(), static_cast<std::size_t>(two));
    EXPECT_EQ(Box(columns, rows, Tessellation::four).group_count(), static_cast<std::size_t>(four));
  }
}

TEST(SpellingBox, AMarbleAtRestIsInTheBinThatItLiesIn) {
  const Box box(3, 2, Tessellation::two);
  for (std::size_t bin = 0; bin < box.bin_count(); ++bin) {
    const auto opening = box.opening(bin);
    const double x = (opening.min_x + opening.max_x) / 2, z = (opening.min_z + opening.max_z) / 2;
    EXPECT_EQ(box.bin_of({x, 0.007, z}), bin);
    EXPECT_EQ(box.bin_of({x, 0.0187, z}), std::nullopt);
    EXPECT_EQ(box.bin_of({opening.max_x + 0.001, 0.007, z}), std::nullopt);
  }
  EXPECT_EQ(box.bin(2, 1), 5u);
  EXPECT_EQ(box.bin_of({1, 0.007, 0}), std::nullopt);
}

Vector3d normal_of(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vector3d origin = mesh.vertices[a].place;
  return (mesh.vertices[b].place - origin).cross(mesh.vertices[c].place - origin);
}

/// Floors and tops face up and the faces of partitions away from them; together they cover the box.
TEST(SpellingBox, TrianglesCoverTheBoxAndFaceOutwards) {
  for (const Tessellation tessellation : kTessellations) {
    const Box box(4, 3, tessellation);
    const TriangleMesh& mesh = box.mesh();
    double covered = 0, faces = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const Vector3d normal = normal_of(mesh, i);
      covered += normal.y() / 2;
      if (std::abs(normal.y()) > 1e-12) {
        EXPECT_GT(normal.y(), 0);
        continue;
      }
      // Its free side is the opening in front of it.
      faces += normal.norm() / 2;
      Vector3d middle = Vector3d::Zero();
      for (const std::uint32_t corner : mesh.triangles[i])
        middle += mesh.vertices[corner].place / 3;
      const Vector3d before = middle + 0.001 * normal.normalized(),
                     behind = middle - 0.001 * normal.normalized();
      EXPECT_TRUE(box.bin_of({before.x(), 0, before.z()}).has_value());
      EXPECT_FALSE(box.bin_of({behind.x(), 0, behind.z()}).has_value());
    }
    EXPECT_NEAR(covered, box.interior().area(), 1e-12);
    EXPECT_NEAR(faces, 2 * (3 * 3 + 4 * 2) * 0.020 * 0.012, 1e-12);
  }
}

/// A group moves tops of partitions alone: all corners at a crossing, two opposite ones, or one.
TEST(SpellingBox, AGroupMovesTheCornersOfOneCrossing) {
  for (const Tessellation tessellation : kTessellations) {
    const Box box(5, 4, tessellation);
    std::map<std::uint32_t, std::set<std::array<double, 2>>> corners;
    for (const TriangleMesh::Vertex& vertex : box.mesh().vertices) {
      EXPECT_EQ(vertex.group.has_value(), vertex.place.y() == spelling::kPartitionHeight);
      if (vertex.group) corners[*vertex.group].insert({vertex.place.x(), vertex.place.z()});
    }
    std::size_t most = 0;
    for (const auto& [group, places] : corners) {
      most = std::max(most, places.size());
      for (const auto& a : places)
        for (const auto& b : places) {
          EXPECT_LT(std::abs(a[0] - b[0]), 0.0021);
          EXPECT_LT(std::abs(a[1] - b[1]), 0.0021);
          // Of a pair, the corners are opposite.
          if (tessellation == Tessellation::two && a != b) {
            EXPECT_TRUE(a[0] != b[0] && a[1] != b[1]);
          }
        }
    }
    EXPECT_EQ(most, 4u / static_cast<std::size_t>(tessellation));
    // The box's corners have no partitions.
    EXPECT_GE(corners.size() + 8, box.group_count());
  }
}

// --- What a marble touches ---------------------------------------------------------------------------------

/// The distance of a point from a triangle, by its plane and its edges.
double distance_to_triangle(const std::array<Vector3d, 3>& corners, const Vector3d& p) {
  const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  bool inside = true;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d &a = corners[i], edge = corners[(i + 1) % 3] - a;
    inside = inside && normal.dot(edge.cross(p - a)) >= 0;
    const double along = std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - along * edge).norm());
  }
  return inside ? std::abs(normal.dot(p - corners[0])) : least;
}

/// The deepest contact is as deep as the nearest triangle or wall says, whatever the offsets; and every
/// triangle that is touched belongs to groups that the region names.
TEST(SpellingBox, ContactsAreThoseOfEveryTriangle) {
  RandomStream random = stream(561);
  for (const Tessellation tessellation : kTessellations) {
    const Box box(4, 3, tessellation);
    const TriangleMesh& mesh = box.mesh();
    const auto surface = box.make_surface();
    const auto inside = box.interior();
    int touching = 0;
    for (int i = 0; i < 30; ++i) {
      std::vector<Vector3d> offsets(box.group_count());
      for (Vector3d& offset : offsets)
        for (double& component : offset)
          component = i % 2 == 0 ? 1e-4 * random.gaussian() : 1e-3 * (2 * random.uniform() - 1);
      surface->set_offsets(offsets);
      for (int k = 0; k < 150; ++k) {
        const Vector3d place(inside.min_x + random.uniform() * (inside.max_x - inside.min_x),
                             0.005 + 0.018 * random.uniform(),
                             inside.min_z + random.uniform() * (inside.max_z - inside.min_z));
        double nearest = std::min({place.x() - inside.min_x, inside.max_x - place.x(),
                                   place.z() - inside.min_z, inside.max_z - place.z()});
        const std::uint32_t region = surface->region(place);
        const auto named = surface->groups(region);
        for (const auto& corners : mesh.triangles) {
          std::array<Vector3d, 3> at;
          for (std::size_t c = 0; c < 3; ++c)
            at[c] = mesh.place(corners[c], offsets);
          const double height = (at[1] - at[0]).cross(at[2] - at[0]).dot(place - at[0]);
          if (height < 0) continue;  // from behind nothing is touched
          const double distance = distance_to_triangle(at, place);
          nearest = std::min(nearest, distance);
          if (distance >= spelling::kMarbleRadius) continue;
          for (const std::uint32_t corner : corners)
            if (const auto& group = mesh.vertices[corner].group) {
              EXPECT_TRUE(std::binary_search(named.begin(), named.end(), *group));
            }
        }
        SurfaceContacts contacts;
        surface->find_contacts(region, place, contacts);
        ASSERT_EQ(contacts.list().empty(), nearest >= spelling::kMarbleRadius) << place.transpose();
        if (contacts.list().empty()) continue;
        ++touching;
        EXPECT_NEAR(contacts.list()[0].overlap, spelling::kMarbleRadius - nearest, 1e-12);
        EXPECT_NEAR(contacts.list()[0].normal.norm(), 1, 1e-12);
      }
    }
    EXPECT_GT(touching, 1000);
  }
}

}  // namespace
}  // namespace retake::tests
