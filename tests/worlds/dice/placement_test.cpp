// Where the grid lies in the world, and paint: rigid maps and mirrored ones, the rotations of a cube, faces.
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "tests/worlds/dice/fixture.h"
#include "worlds/dice/placement.h"

namespace retake::tests {
namespace {

using dice::Placement;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d direction(double angle) {
  return {std::cos(angle), std::sin(angle)};
}

Vector3d draw_vector(RandomStream& random) {
  const double x = random.gaussian(), y = random.gaussian(), z = random.gaussian();
  return {x, y, z};
}

Quaterniond draw_rotation(RandomStream& random) {
  const double w = random.gaussian(), x = random.gaussian(), y = random.gaussian(), z = random.gaussian();
  return Quaterniond(w, x, y, z).normalized();
}

/// Calls `check` with random placements.
template <typename Check>
void for_placements(std::uint64_t seed, Check&& check) {
  RandomStream random = stream(seed);
  for (int i = 0; i < 100; ++i) {
    const Vector3d from = draw_vector(random), to(from.z(), from.y(), 2 * from.x());
    const Vector2d in_grid = direction(6 * random.uniform()), in_world = direction(6 * random.uniform());
    const bool mirrored = i % 2 == 1;
    check(Placement(from, to, in_grid, in_world, mirrored), from, to, in_grid, in_world, mirrored, random);
  }
}

TEST(DicePlacement, LeadsTheStartAndTheHeadingToWhereTheyBelong) {
  for_placements(
      341, [](const Placement& placement, const Vector3d& from, const Vector3d& to, const Vector2d& in_grid,
              const Vector2d& in_world, bool mirrored, RandomStream& random) {
        EXPECT_EQ(placement.point(from), to);
        const Vector3d led = placement.direction({in_grid.x(), 0, in_grid.y()});
        EXPECT_LT((led - Vector3d(in_world.x(), 0, in_world.y())).norm(), 1e-14);
        EXPECT_EQ(placement.direction(Vector3d::UnitY()), Vector3d::UnitY());
        // Lengths and heights stay; so does handedness, unless it is mirrored.
        const Vector3d a = draw_vector(random), b = draw_vector(random);
        EXPECT_NEAR((placement.point(a) - placement.point(b)).norm(), (a - b).norm(), 1e-12);
        EXPECT_NEAR(placement.point(a).y(), a.y(), 1e-14);
        const double sign = mirrored ? -1 : 1;
        const Vector3d crossed = placement.direction(a).cross(placement.direction(b));
        EXPECT_LT((crossed - sign * placement.direction(a.cross(b))).norm(), 1e-12);
        // And back again.
        EXPECT_LT((placement.point_in_grid(placement.point(a)) - a).norm(), 1e-12);
        EXPECT_LT((placement.direction_in_grid(placement.direction(a)) - a).norm(), 1e-12);
      });
}

TEST(DicePlacement, TurnsABoxToWhereItsCornersAreLed) {
  for_placements(342, [](const Placement& placement, const Vector3d&, const Vector3d&, const Vector2d&,
                         const Vector2d&, bool, RandomStream& random) {
    const Quaterniond in_grid = draw_rotation(random), in_world = placement.rotation(in_grid);
    const Vector3d box(1, 1.2, 1.5);
    for (const double x : {-1, 1})
      for (const double y : {-1, 1})
        for (const double z : {-1, 1}) {
          const Vector3d led = placement.direction(in_grid * Vector3d(x, y, z).cwiseProduct(box));
          double nearest = 10;
          for (const double u : {-1, 1})
            for (const double v : {-1, 1})
              for (const double w : {-1, 1})
                nearest = std::min(nearest, (led - in_world * Vector3d(u, v, w).cwiseProduct(box)).norm());
          EXPECT_LT(nearest, 1e-12);
        }
    // What is on top stays there: up to a mirrored die, faces are led with the box.
    EXPECT_EQ(dice::top_face(in_grid) == 0, dice::top_face(in_world) == 0);
  });
}

TEST(DicePlacement, PaintsAreTheRotationsOfACube) {
  std::set<std::array<int, 2>> seen;  // of what is on top and in front
  for (const Quaterniond& paint : dice::paints()) {
    EXPECT_NEAR(paint.norm(), 1, 1e-15);
    std::array<int, 2> shows{};
    for (int face = 1; face <= 6; ++face) {
      const Vector3d led = paint * dice::face_normal(face);
      EXPECT_NEAR(led.cwiseAbs().maxCoeff(), 1, 1e-15) << "axes are led to axes";
      if (led.y() > 0.5) shows[0] = face;
      if (led.z() > 0.5) shows[1] = face;
    }
    EXPECT_EQ(shows[0], dice::top_face(paint));
    EXPECT_TRUE(seen.insert(shows).second);
  }
  EXPECT_EQ(seen.size(), dice::kPaints);
  EXPECT_TRUE(dice::paints()[dice::kPlainPaint].isApprox(Quaterniond::Identity(), 0));
}

TEST(DicePlacement, OppositeFacesAddUpToSeven) {
  for (int face = 1; face <= 6; ++face)
    EXPECT_EQ(dice::face_normal(face), -dice::face_normal(7 - face));
  const Vector3d corner = dice::face_normal(1).cross(dice::face_normal(2));
  EXPECT_EQ(corner, dice::face_normal(3)) << "counter-clockwise, seen from their corner";
}

TEST(DicePlacement, ADieThatLeansShowsNoFace) {
  const auto leaning = [](double degrees) {
    return Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vector3d::UnitX()));
  };
  EXPECT_EQ(dice::top_face(leaning(0)), 2);
  EXPECT_EQ(dice::top_face(leaning(25)), 2);
  EXPECT_EQ(dice::top_face(leaning(30)), 0);
  EXPECT_EQ(dice::top_face(leaning(45)), 0);
  EXPECT_EQ(dice::top_face(leaning(180)), 5);
}

}  // namespace
}  // namespace retake::tests
