// Contacts against brute force over the surfaces of random poses. Paper, section 5.2. Seeds are fixed; what
// is sampled densely is found a little too far away, and each tolerance says by how much.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "worlds/bowling/contacts.h"

namespace retake::tests {
namespace {

using namespace bowling;
using Eigen::Vector3d;

double uniform(RandomStream& random, double low, double high) {
  return low + (high - low) * random.uniform();
}
Vector3d direction(RandomStream& random) {
  return Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
}
Vector3d mirrored(const Vector3d& v) {
  return {v.x(), v.y(), -v.z()};
}

/// Points of a pin's surface, at most `spacing` apart along the outline and around it.
std::vector<Vector3d> surface(const PinPlace& pin, double spacing) {
  std::vector<Vector3d> points;
  const double centre = pin_body().centre_of_mass;
  const Vector3d across = pin.axis.unitOrthogonal(), along = pin.axis.cross(across);
  const auto add_ring = [&](double height, double radius) {
    const int count = std::max(1, static_cast<int>(std::ceil(2 * std::numbers::pi * radius / spacing)));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      points.push_back(pin.centre + (height - centre) * pin.axis +
                       radius * (std::cos(angle) * across + std::sin(angle) * along));
    }
  };
  std::array<double, 2> before = {0, 0};
  for (const auto& ring : kPinProfile) {
    const double length = std::hypot(ring[0] - before[0], ring[1] - before[1]);
    const int parts = std::max(1, static_cast<int>(std::ceil(length / spacing)));
    for (int k = 0; k <= parts; ++k) {
      const double share = static_cast<double>(k) / parts;
      add_ring(before[0] + share * (ring[0] - before[0]), before[1] + share * (ring[1] - before[1]));
    }
    before = ring;
  }
  return points;
}

/// Distance of a point from a pin, negative inside.
double signed_distance(const PinPlace& pin, const Vector3d& point) {
  const Vector3d apart = point - pin.centre;
  const double along = apart.dot(pin.axis), height = along + pin_body().centre_of_mass;
  const double off_axis = std::sqrt(std::max(0.0, apart.squaredNorm() - along * along));
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = false;
  std::array<double, 2> before = {0, 0};
  for (const auto& ring : kPinProfile) {
    const double dh = ring[0] - before[0], dr = ring[1] - before[1];
    const double share =
        std::clamp(((height - before[0]) * dh + (off_axis - before[1]) * dr) / (dh * dh + dr * dr), 0.0, 1.0);
    nearest =
        std::min(nearest, std::hypot(height - before[0] - share * dh, off_axis - before[1] - share * dr));
    if (dh > 0 && height >= before[0] && height < ring[0])
      inside = off_axis < before[1] + dr * (height - before[0]) / dh;
    before = ring;
  }
  return inside ? -nearest : nearest;
}

void expect_unit_normals(const Contacts& contacts) {
  for (const Contact& contact : contacts.list())
    EXPECT_NEAR(contact.normal.norm(), 1, 1e-12);
}

/// The deepest of the contacts.
const Contact* deepest(const Contacts& contacts) {
  const auto list = contacts.list();
  const auto found =
      std::min_element(list.begin(), list.end(), [](auto& a, auto& b) { return a.gap < b.gap; });
  return found == list.end() ? nullptr : &*found;
}

/// Every contact of one has its mirror image among those of the other.
void expect_mirrored(const Contacts& contacts, const Contacts& mirror) {
  ASSERT_EQ(contacts.list().size(), mirror.list().size());
  for (const Contact& contact : contacts.list()) {
    bool found = false;
    for (const Contact& other : mirror.list())
      found |= (other.point - mirrored(contact.point)).norm() < 1e-9 &&
               (other.normal - mirrored(contact.normal)).norm() < 1e-9 &&
               std::abs(other.gap - contact.gap) < 1e-12 && other.with == contact.with;
    EXPECT_TRUE(found) << "no mirror image of the contact at " << contact.point.transpose();
  }
}

// --- Ball and pin ------------------------------------------------------------------------------------------

TEST(BowlingContacts, BallAndPinTouchWhereTheirSurfacesDo) {
  RandomStream random = stream(211);
  int touching = 0;
  for (int i = 0; i < 80; ++i) {
    const PinPlace pin{.centre = {uniform(random, 0, 1), 0.3, uniform(random, -0.4, 0.4)},
                       .axis = direction(random)};
    const double radius = uniform(random, 0.0868, 0.1085);
    // A ball that nearly touches, found by walking in from outside; overlaps of half a millimetre as well.
    const Vector3d way = direction(random);
    const double wanted = uniform(random, -0.0005, 0.0003);
    double away = 0.5;
    for (int k = 0; k < 100; ++k)
      away -= signed_distance(pin, pin.centre + away * way) - radius - wanted;
    const Vector3d centre = pin.centre + away * way;
    double squared = std::numeric_limits<double>::infinity();
    Vector3d nearest;
    for (const Vector3d& point : surface(pin, 0.001))
      if (const double distance = (point - centre).squaredNorm(); distance < squared) {
        squared = distance;
        nearest = point;
      }
    const double gap = std::sqrt(squared) - radius;  // too large by 5 um at most

    Contacts contacts, mirror;
    find_ball_and_pin(centre, radius, pin, contacts);
    find_ball_and_pin(mirrored(centre), radius, {mirrored(pin.centre), mirrored(pin.axis)}, mirror);
    expect_mirrored(contacts, mirror);
    if (std::abs(gap - kHitGap) > 1e-5) {
      ASSERT_EQ(contacts.list().empty(), gap > kHitGap) << gap;
    }
    if (contacts.list().empty()) continue;
    ++touching;
    ASSERT_EQ(contacts.list().size(), 1u);
    const Contact& contact = contacts.list()[0];
    EXPECT_EQ(contact.with, bowling::Surface::pin);
    EXPECT_NEAR(contact.normal.norm(), 1, 1e-12);
    EXPECT_NEAR(contact.gap, gap, 1e-5);
    EXPECT_LE(contact.gap, gap + 1e-12);
    EXPECT_NEAR(signed_distance(pin, contact.point), 0, 1e-12);
    EXPECT_LT((centre - (radius + contact.gap) * contact.normal - contact.point).norm(), 1e-12);
    // Two outlines can be almost equally near at the neck; elsewhere the nearest points agree.
    if ((nearest - contact.point).norm() < 0.005) {
      EXPECT_LT((contact.normal - (centre - nearest).normalized()).norm(), 0.02);
    }
  }
  EXPECT_GT(touching, 40);
}

// --- Pin and planes ----------------------------------------------------------------------------------------

/// Lowers a pin in a random pose until its surface overlaps a plane by a wanted depth; the plane's normal
/// points to the pin.
PinPlace near_plane(RandomStream& random, const Vector3d& normal, double offset, const Vector3d& somewhere,
                    double gap, double upright_share) {
  PinPlace pin{.centre = somewhere, .axis = direction(random)};
  if (random.uniform() < upright_share) {
    const Vector3d lean(uniform(random, -0.08, 0.08), 1, uniform(random, -0.08, 0.08));
    pin.axis = lean.normalized();
  }
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vector3d& point : surface(pin, 0.001))
    lowest = std::min(lowest, normal.dot(point) - offset);
  pin.centre -= (lowest - gap) * normal;
  return pin;
}

struct Plane {
  const char* name;
  Vector3d normal;
  double offset;
  Vector3d low, high;  ///< where the pin's centre is
  bowling::Surface with;
  double seen;  ///< [m], the gap below which a contact is reported
};

TEST(BowlingContacts, PinsTouchPlanesAtTheirLowestPoints) {
  const Vector3d up = Vector3d::UnitY();
  const double far = 0.28;  // from edges, more than a pin reaches
  const std::vector<Plane> planes = {
      {"lane", up, 0, {-1, 0, -0.2}, {kDeckEnd - far, 0, 0.2}, bowling::Surface::lane, kLaneGap},
      {"pit", up, kPitFloor, {1.2, 0, -0.4}, {1.25, 0, 0.4}, bowling::Surface::pit, kLaneGap},
      {"left wall", Vector3d::UnitZ(), -kWall, {0.4, 0.4, 0}, {0.8, 0.5, 0}, bowling::Surface::wall, kHitGap},
      {"right wall", -Vector3d::UnitZ(), -kWall, {0.4, 0.4, 0}, {0.8, 0.5, 0}, bowling::Surface::wall, kHitGap},
      {"cushion", -Vector3d::UnitX(), -kCushion, {0, 0.4, -0.4}, {0, 0.5, 0.4}, bowling::Surface::cushion, kHitGap}};
  RandomStream random = stream(212);
  for (const Plane& plane : planes) {
    int touching = 0, apart = 0;
    for (int i = 0; i < 30; ++i) {
      const Vector3d somewhere(uniform(random, plane.low.x(), plane.high.x()),
                               uniform(random, plane.low.y(), plane.high.y()),
                               uniform(random, plane.low.z(), plane.high.z()));
      const double wanted =
          i % 3 == 0 ? uniform(random, plane.seen, 3 * plane.seen) : uniform(random, -0.004, plane.seen);
      const PinPlace pin =
          near_plane(random, plane.normal, plane.offset, somewhere, wanted, plane.normal == up ? 0.5 : 0);
      Contacts contacts, mirror;
      find_pin_and_lane(pin, {.pit = true}, contacts);
      find_pin_and_lane({mirrored(pin.centre), mirrored(pin.axis)}, {.pit = true}, mirror);
      expect_unit_normals(contacts);
      expect_mirrored(contacts, mirror);
      const Contact* lowest = deepest(contacts);
      // Sampled rings miss their lowest point by 5 um at most.
      if (std::abs(wanted - plane.seen) > 1e-5) {
        ASSERT_EQ(lowest == nullptr, wanted > plane.seen) << plane.name << " " << wanted;
      }
      if (!lowest) {
        ++apart;
        continue;
      }
      ++touching;
      EXPECT_NEAR(lowest->gap, wanted, 1e-5) << plane.name;
      for (const Contact& contact : contacts.list()) {
        EXPECT_EQ(contact.with, plane.with) << plane.name;
        EXPECT_EQ(contact.normal, plane.normal) << plane.name;
        EXPECT_NEAR(plane.normal.dot(contact.point), plane.offset, 1e-12) << plane.name;
        EXPECT_NEAR(signed_distance(pin, contact.point + contact.gap * contact.normal), 0, 1e-9)
            << plane.name;
      }
    }
    EXPECT_GT(touching, 15) << plane.name;
    EXPECT_GT(apart, 0) << plane.name;
  }
}

TEST(BowlingContacts, AStandingPinHasFourContactsAroundItsBase) {
  const PinPlace pin{.centre = {0.1, pin_body().centre_of_mass, 0.2}, .axis = Vector3d::UnitY()};
  Contacts contacts;
  find_pin_and_lane(pin, {}, contacts);
  ASSERT_EQ(contacts.list().size(), 4u);
  Vector3d middle = Vector3d::Zero();
  for (const Contact& contact : contacts.list()) {
    EXPECT_NEAR(contact.gap, 0, 1e-12);
    EXPECT_NEAR(std::hypot(contact.point.x() - 0.1, contact.point.z() - 0.2), kPinProfile[0][1], 1e-12);
    middle += contact.point / 4;
  }
  EXPECT_LT((middle - Vector3d(0.1, 0, 0.2)).norm(), 1e-12);
}

TEST(BowlingContacts, NothingCarriesAPinBehindTheDeckUnlessThereIsAPit) {
  const PinPlace pin{.centre = {1.2, kPitFloor + 0.06, 0}, .axis = Vector3d::UnitZ()};
  Contacts without, with;
  find_pin_and_lane(pin, {.pit = false}, without);
  find_pin_and_lane(pin, {.pit = true}, with);
  EXPECT_TRUE(without.list().empty());
  EXPECT_FALSE(with.list().empty());
}

// --- Pins and balls beside the lane
// --------------------------------------------------------------------------

/// Distance from the lane as a solid that ends at its edges, zero inside.
double distance_from_lane(const Vector3d& point) {
  const Vector3d nearest(std::min(point.x(), kDeckEnd), std::min(point.y(), 0.0),
                         std::clamp(point.z(), -kLaneHalfWidth, kLaneHalfWidth));
  return (point - nearest).norm();
}

TEST(BowlingContacts, PinsOverTheEdgeNeverTouchFromAfar) {
  RandomStream random = stream(213);
  int claimed = 0;
  for (int i = 0; i < 400; ++i) {
    const bool side = random.bernoulli(0.5);
    const PinPlace pin{
        .centre =
            side ? Vector3d(0.4, uniform(random, -0.03, 0.25), kLaneHalfWidth + uniform(random, -0.05, 0.15))
                 : Vector3d(kDeckEnd + uniform(random, -0.05, 0.15), uniform(random, -0.03, 0.25), 0.1),
        .axis = direction(random)};
    Contacts contacts, mirror;
    find_pin_and_lane(pin, {.pit = false}, contacts);
    find_pin_and_lane({mirrored(pin.centre), mirrored(pin.axis)}, {.pit = false}, mirror);
    expect_unit_normals(contacts);
    expect_mirrored(contacts, mirror);
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector3d& point : surface(pin, 0.002))
      nearest = std::min(nearest, distance_from_lane(point));
    for (const Contact& contact : contacts.list()) {
      if (contact.with != bowling::Surface::lane) continue;
      ++claimed;
      // The surface is sampled every 2 mm: over an edge the nearest point is missed by 0.4 mm at most.
      EXPECT_LT(nearest, kLaneGap + 4e-4) << "pose " << i;
      EXPECT_NEAR(distance_from_lane(contact.point), 0, 1e-12);
    }
  }
  EXPECT_GT(claimed, 50);
}

TEST(BowlingContacts, BallsTouchLaneEdgeGutterAndWall) {
  const double r = 0.108;
  const auto only = [&](const Vector3d& centre, bool pit = false) {
    Contacts contacts;
    find_ball_and_lane(centre, r, {.pit = pit}, contacts);
    EXPECT_EQ(contacts.list().size(), 1u) << centre.transpose();
    return contacts.list().empty() ? Contact{} : contacts.list()[0];
  };
  const Contact lane = only({-3, r - 0.001, 0.2});
  EXPECT_EQ(lane.with, bowling::Surface::lane);
  EXPECT_NEAR(lane.gap, -0.001, 1e-12);
  EXPECT_EQ(lane.normal, Vector3d::UnitY());
  // Half over the edge, a third of its radius above: the edge pushes it out and up.
  const double out = 0.09;
  const Contact edge = only({-3, 0.05, -kLaneHalfWidth - out});
  EXPECT_EQ(edge.with, bowling::Surface::lane);
  EXPECT_NEAR(edge.gap, std::hypot(out, 0.05) - r, 1e-12);
  EXPECT_LT((edge.point - Vector3d(-3, 0, -kLaneHalfWidth)).norm(), 1e-12);
  EXPECT_LT((edge.normal - Vector3d(0, 0.05, -out).normalized()).norm(), 1e-12);
  const Contact gutter = only({-3, r - kGutterDepth, kLaneHalfWidth + 0.11});
  EXPECT_EQ(gutter.with, bowling::Surface::gutter);
  EXPECT_NEAR(gutter.gap, 0, 1e-12);
  const Contact wall = only({-3, 0.4, kWall - r + 0.002});
  EXPECT_EQ(wall.with, bowling::Surface::wall);
  EXPECT_NEAR(wall.gap, -0.002, 1e-12);
  EXPECT_EQ(wall.normal, Vector3d(0, 0, -1));
  const Contact cushion = only({kCushion - r, 0.4, 0}, true);
  EXPECT_EQ(cushion.with, bowling::Surface::cushion);
  EXPECT_EQ(cushion.normal, Vector3d(-1, 0, 0));
  EXPECT_EQ(only({1.3, kPitFloor + r, 0}, true).with, bowling::Surface::pit);
  Contacts none;
  find_ball_and_lane({1.3, kPitFloor + r, 0}, r, {}, none);
  find_ball_and_lane({-3, r + 0.0011, 0}, r, {}, none);
  EXPECT_TRUE(none.list().empty());
}

// --- Pin and pin -------------------------------------------------------------------------------------------

/// The least signed distance of one pin's surface from the other, and where; too large by some spacing^2 over
/// a few centimetres. An overlap is as deep as the deepest point.
struct Nearest {
  double gap = std::numeric_limits<double>::infinity();
  Vector3d point = Vector3d::Zero();
};
Nearest nearest_of(const PinPlace& first, const PinPlace& second, double spacing) {
  Nearest nearest;
  for (const Vector3d& point : surface(first, spacing))
    if (const double gap = signed_distance(second, point); gap < nearest.gap) nearest = {gap, point};
  return nearest;
}

/// A second pin placed so that the surfaces are as far apart as wanted, along a random way in.
PinPlace beside(RandomStream& random, const PinPlace& first, double wanted) {
  PinPlace second{.centre = first.centre, .axis = direction(random)};
  const Vector3d way = direction(random);
  double away = 0.6;
  for (int k = 0; k < 25; ++k) {
    second.centre = first.centre + away * way;
    const double rest = nearest_of(first, second, 0.008).gap - wanted;
    away -= rest;
    if (std::abs(rest) < 2e-5) break;
  }
  return second;
}

/// The sharp edge of the base lies outside of the inscribed spheres.
bool is_at_base(const PinPlace& pin, const Vector3d& point) {
  constexpr double kEdge = 0.025;  // [m] above the base
  return pin.axis.dot(point - pin.centre) + pin_body().centre_of_mass < kEdge;
}

TEST(BowlingContacts, PinsTouchPinsWithinTwoMillimetresOfTheirSurfaces) {
  RandomStream random = stream(214);
  int touching = 0, at_base = 0, unseen_at_base = 0;
  double worst = 0;
  for (int i = 0; i < 60; ++i) {
    const PinPlace first{.centre = {0.3, 0.3, 0}, .axis = direction(random)};
    const double wanted = i % 3 == 0 ? uniform(random, 0.0005, 0.004) : -0.003;
    const PinPlace second = beside(random, first, wanted);
    const Nearest one = nearest_of(first, second, 0.002), other = nearest_of(second, first, 0.002);
    const Nearest nearest = one.gap < other.gap ? one : other;
    Contacts contacts, mirror, exchanged;
    find_pin_and_pin(first, second, contacts);
    find_pin_and_pin({mirrored(first.centre), mirrored(first.axis)},
                     {mirrored(second.centre), mirrored(second.axis)}, mirror);
    find_pin_and_pin(second, first, exchanged);
    expect_mirrored(contacts, mirror);
    ASSERT_EQ(contacts.list().size(), exchanged.list().size());
    if (nearest.gap > kHitGap + 2e-4) {
      EXPECT_TRUE(contacts.list().empty()) << "they are " << nearest.gap << " m apart";
    }
    if (nearest.gap > 0) continue;
    const bool base = is_at_base(first, nearest.point) || is_at_base(second, nearest.point);
    at_base += base;
    unseen_at_base += base && contacts.list().empty();
    if (!base) {
      ASSERT_FALSE(contacts.list().empty()) << "they overlap by " << -nearest.gap << " m";
      EXPECT_LT(contacts.list()[0].gap, nearest.gap + 0.002 + 2e-4);
      worst = std::max(worst, contacts.list()[0].gap - nearest.gap);
    }
    if (contacts.list().empty()) continue;
    ++touching;
    const Contact& contact = contacts.list()[0];
    EXPECT_NEAR(contact.normal.norm(), 1, 1e-12);
    EXPECT_EQ(contact.with, bowling::Surface::pin);
    EXPECT_GT(contact.gap, nearest.gap - 2e-4) << "inscribed spheres do not overlap more than the pins";
    // The normal pushes the first pin away from the second.
    const PinPlace moved{first.centre + 0.001 * contact.normal, first.axis};
    EXPECT_GT(nearest_of(moved, second, 0.002).gap, one.gap + 0.0005);
    EXPECT_LT((exchanged.list()[0].normal + contact.normal).norm(), 1e-9);
    EXPECT_NEAR(exchanged.list()[0].gap, contact.gap, 1e-12);
  }
  EXPECT_GT(touching, 25);
  std::printf("gaps are up to %.2f mm too large; of %d overlaps of 3 mm at a base %d are not seen\n",
              1000 * worst, at_base, unseen_at_base);
}

// --- Bounds
// --------------------------------------------------------------------------------------------------

TEST(BowlingContacts, BoundsEncloseThePinTightly) {
  RandomStream random = stream(215);
  for (int i = 0; i < 60; ++i) {
    const PinPlace pin{.centre = Vector3d::Zero(), .axis = i == 0 ? Vector3d::UnitY() : direction(random)};
    const auto [low, high] = pin_bounds(pin.axis);
    Vector3d lowest = Vector3d::Constant(1), highest = -lowest;
    for (const Vector3d& point : surface(pin, 0.001)) {
      lowest = lowest.cwiseMin(point);
      highest = highest.cwiseMax(point);
    }
    EXPECT_TRUE((low.array() <= lowest.array() + 1e-12).all() && (low.array() > lowest.array() - 1e-5).all());
    EXPECT_TRUE((high.array() >= highest.array() - 1e-12).all() &&
                (high.array() < highest.array() + 1e-5).all());
  }
}

}  // namespace
}  // namespace retake::tests
