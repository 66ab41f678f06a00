// See contacts.h.
#include "worlds/bowling/contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace retake::bowling {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kSpheres = 15;
constexpr double kSteep = 0.06;  // sine of the tilt up to which a pin stands on its whole base
constexpr double kApart = 0.06;  // [m] along the pin between two contacts with the same plane
constexpr double kDeepestOnLane =
    -0.03;  // [m]; what lies deeper beside the lane's edge has come from the side

/// The pin's outline with the centre of mass as origin, and the spheres inscribed along its axis.
struct Outline {
  std::array<double, kRings> height, radius;
  std::array<double, kSpheres> sphere_height, sphere_radius;
  std::array<std::size_t, kRings> hull;  // the rings that a plane can touch: all but the neck's
  std::size_t hull_count = 0;
  double reach = 0;   // [m] from the centre of mass to the farthest point
  double widest = 0;  // [m] from the axis

  Outline() {
    const double centre = pin_body().centre_of_mass;
    for (std::size_t i = 0; i < kRings; ++i) {
      height[i] = kPinProfile[i][0] - centre;
      radius[i] = kPinProfile[i][1];
      reach = std::max(reach, std::hypot(height[i], radius[i]));
      widest = std::max(widest, radius[i]);
    }
    // The upper convex hull of (height, radius).
    for (std::size_t i = 0; i < kRings; ++i) {
      const auto lies_below = [&](std::size_t a,
                                  std::size_t b) {  // whether b lies below the chord from a to i
        return (radius[b] - radius[a]) * (height[i] - height[a]) <=
               (radius[i] - radius[a]) * (height[b] - height[a]);
      };
      while (hull_count >= 2 && lies_below(hull[hull_count - 2], hull[hull_count - 1]))
        --hull_count;
      hull[hull_count++] = i;
    }
    // From just above the base to the middle of the head.
    constexpr double kLowest = 0.026, kHighest = kPinHeight - 0.0323;
    for (std::size_t k = 0; k < kSpheres; ++k) {
      const double share = static_cast<double>(k) / (kSpheres - 1);
      sphere_height[k] = kLowest + share * (kHighest - kLowest) - centre;
      sphere_radius[k] = distance(0, sphere_height[k]).distance;
    }
  }

  struct Nearest {
    double distance, radius, height;
  };
  /// The point of the outline that is nearest to (radius, height).
  Nearest distance(double r, double h) const {
    Nearest nearest{std::numeric_limits<double>::infinity(), 0, 0};
    double r0 = 0, h0 = height[0];  // the base, from the axis outwards
    for (std::size_t i = 0; i < kRings; ++i) {
      const double r1 = radius[i], h1 = height[i], dr = r1 - r0, dh = h1 - h0;
      const double along = std::clamp(((r - r0) * dr + (h - h0) * dh) / (dr * dr + dh * dh), 0.0, 1.0);
      const double x = r0 + along * dr, y = h0 + along * dh;
      const double squared = (r - x) * (r - x) + (h - y) * (h - y);
      if (squared < nearest.distance) nearest = {squared, x, y};
      r0 = r1;
      h0 = h1;
    }
    nearest.distance = std::sqrt(nearest.distance);
    return nearest;
  }
};
const Outline kOutline;

double sine_of(double cosine) {
  return std::sqrt(std::max(0.0, 1 - cosine * cosine));
}

bool is_apart(std::size_t ring, std::size_t other) {
  return std::abs(kOutline.height[ring] - kOutline.height[other]) > kApart;
}

/// The lowest points of a pin's rings along a normal.
struct Lowest {
  double cosine, sine;  // between normal and axis
  Vector3d outwards;    // unit vector across the axis, as much along the normal as can be
  double offset;        // of the centre of mass along the normal [m]

  Lowest(const PinPlace& pin, const Vector3d& normal)
      : cosine(normal.dot(pin.axis)), sine(sine_of(cosine)), offset(normal.dot(pin.centre)) {
    outwards = sine > 1e-9 ? ((normal - cosine * pin.axis) / sine).eval() : pin.axis.unitOrthogonal();
  }
  double height(std::size_t ring) const {
    return offset + kOutline.height[ring] * cosine - kOutline.radius[ring] * sine;
  }
  Vector3d point(const PinPlace& pin, std::size_t ring) const {
    return pin.centre + kOutline.height[ring] * pin.axis - kOutline.radius[ring] * outwards;
  }
  std::size_t ring() const {
    return lowest([](std::size_t) { return true; });
  }
  /// The lowest ring far enough from another one; kRings if there is none.
  std::size_t ring_apart_from(std::size_t other) const {
    return lowest(
        [&](std::size_t i) { return std::abs(kOutline.height[i] - kOutline.height[other]) > kApart; });
  }

 private:
  template <typename Counts>
  std::size_t lowest(const Counts& counts) const {
    std::size_t best = kRings;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < kOutline.hull_count; ++k) {
      const std::size_t i = kOutline.hull[k];
      if (const double here = height(i); here < least && counts(i)) {
        least = here;
        best = i;
      }
    }
    return best;
  }
};

bool over_lane(double x, double z) {
  return x <= kDeckEnd && std::abs(z) <= kLaneHalfWidth;
}

/// What lies below a point: its height and surface, if anything does.
struct Ground {
  double height;
  Surface surface;
  double deepest;  // [m]; a point this far below has not come from above
};
std::optional<Ground> ground_below(double x, double z, const Surroundings& surroundings) {
  constexpr double kAnything = -std::numeric_limits<double>::infinity();
  if (x > kDeckEnd)
    return surroundings.pit ? std::optional<Ground>({kPitFloor, Surface::pit, kAnything}) : std::nullopt;
  if (over_lane(x, z)) return Ground{0, Surface::lane, kDeepestOnLane};
  return Ground{-kGutterDepth, Surface::gutter, kAnything};
}

void find_pin_and_ground(const PinPlace& pin, const Surroundings& surroundings, Contacts& contacts) {
  const Lowest lowest(pin, Vector3d::UnitY());
  const auto contact_at = [&](const Vector3d& point) -> std::optional<Contact> {
    const auto ground = ground_below(point.x(), point.z(), surroundings);
    if (!ground) return std::nullopt;
    const double gap = point.y() - ground->height;
    if (gap >= kLaneGap || gap <= ground->deepest) return std::nullopt;
    return Contact{.point = {point.x(), ground->height, point.z()},
                   .normal = Vector3d::UnitY(),
                   .gap = gap,
                   .with = ground->surface};
  };
  const std::size_t ring = lowest.ring();
  if (lowest.height(ring) >= kLaneGap) return;
  if (ring == 0 && lowest.sine < kSteep) {
    // It stands: the base's lowest point, the opposite one, and one on either side.
    const Vector3d base = pin.centre + kOutline.height[0] * pin.axis;
    const Vector3d along = kOutline.radius[0] * lowest.outwards, across = pin.axis.cross(along);
    for (const Vector3d& offset : {Vector3d(-along), Vector3d(along), Vector3d(-across), across})
      if (const auto contact = contact_at(base + offset)) contacts.add(*contact);
    return;
  }
  // It leans or lies: the ring that is deepest in the ground below it, and one apart from that.
  std::array<std::optional<Contact>, kRings> found;
  const auto deepest = [&](const auto& counts) {
    std::size_t best = kRings;
    for (std::size_t k = 0; k < kOutline.hull_count; ++k) {
      const std::size_t i = kOutline.hull[k];
      if (found[i] && counts(i) && (best == kRings || found[i]->gap < found[best]->gap)) best = i;
    }
    return best;
  };
  for (std::size_t k = 0; k < kOutline.hull_count; ++k)
    if (const std::size_t i = kOutline.hull[k]; lowest.height(i) < kLaneGap)
      found[i] = contact_at(lowest.point(pin, i));
  const std::size_t first = deepest([](std::size_t) { return true; });
  if (first == kRings) return;
  contacts.add(*found[first]);
  const std::size_t second = deepest([&](std::size_t i) { return is_apart(i, first); });
  if (second < kRings) contacts.add(*found[second]);
}

/// A plane that keeps a pin on its side, wherever `counts` says that it exists.
template <typename Counts>
void find_pin_and_plane(const PinPlace& pin, const Vector3d& normal, double offset, Surface surface,
                        const Counts& counts, Contacts& contacts) {
  if (normal.dot(pin.centre) - offset > kOutline.reach + kHitGap) return;
  const Lowest lowest(pin, normal);
  const std::size_t ring = lowest.ring();
  const auto add = [&](std::size_t at) {
    const double gap = lowest.height(at) - offset;
    const Vector3d point = lowest.point(pin, at);
    if (gap < kHitGap && counts(point))
      contacts.add({.point = point - gap * normal, .normal = normal, .gap = gap, .with = surface});
  };
  add(ring);
  if (const std::size_t other = lowest.ring_apart_from(ring); other < kRings) add(other);
}

/// A sphere beside the lane against its edge or side.
std::optional<Contact> beside_lane(const Vector3d& centre, double radius) {
  const Vector3d nearest(std::min(centre.x(), kDeckEnd), std::min(centre.y(), 0.0),
                         std::clamp(centre.z(), -kLaneHalfWidth, kLaneHalfWidth));
  const Vector3d apart = centre - nearest;
  const double squared = apart.squaredNorm(), touching = radius + kLaneGap;
  if (squared >= touching * touching || squared == 0) return std::nullopt;
  const double distance = std::sqrt(squared);
  return Contact{
      .point = nearest, .normal = apart / distance, .gap = distance - radius, .with = Surface::lane};
}

void find_pin_and_edges(const PinPlace& pin, Contacts& contacts) {
  std::array<std::optional<Contact>, kSpheres> found;
  const auto deepest = [&](const auto& counts) {
    std::size_t best = kSpheres;
    for (std::size_t k = 0; k < kSpheres; ++k)
      if (found[k] && counts(k) && (best == kSpheres || found[k]->gap < found[best]->gap)) best = k;
    return best;
  };
  for (std::size_t k = 0; k < kSpheres; ++k) {
    const Vector3d centre = pin.centre + kOutline.sphere_height[k] * pin.axis;
    if (!over_lane(centre.x(), centre.z())) found[k] = beside_lane(centre, kOutline.sphere_radius[k]);
  }
  const std::size_t first = deepest([](std::size_t) { return true; });
  if (first == kSpheres) return;
  contacts.add(*found[first]);
  const std::size_t second = deepest([&](std::size_t k) {
    return std::abs(kOutline.sphere_height[k] - kOutline.sphere_height[first]) > kApart;
  });
  if (second < kSpheres) contacts.add(*found[second]);
}

}  // namespace

void find_ball_and_lane(const Vector3d& centre, double radius, const Surroundings& surroundings,
                        Contacts& contacts) {
  if (over_lane(centre.x(), centre.z())) {
    if (const double gap = centre.y() - radius; gap < kLaneGap)
      contacts.add({.point = {centre.x(), 0, centre.z()},
                    .normal = Vector3d::UnitY(),
                    .gap = gap,
                    .with = Surface::lane});
  } else {
    if (const auto edge = beside_lane(centre, radius)) contacts.add(*edge);
    if (const auto ground = ground_below(centre.x(), centre.z(), surroundings))
      if (const double gap = centre.y() - radius - ground->height; gap < kLaneGap)
        contacts.add({.point = {centre.x(), ground->height, centre.z()},
                      .normal = Vector3d::UnitY(),
                      .gap = gap,
                      .with = ground->surface});
  }
  // The gutters' outer sides run along the whole lane.
  const double side = centre.z() < 0 ? -1 : 1;
  if (const double gap = kWall - radius - side * centre.z(); gap < kHitGap)
    contacts.add({.point = {centre.x(), centre.y(), side * kWall},
                  .normal = {0, 0, -side},
                  .gap = gap,
                  .with = Surface::wall});
  if (const double gap = kCushion - radius - centre.x(); surroundings.pit && gap < kHitGap)
    contacts.add({.point = {kCushion, centre.y(), centre.z()},
                  .normal = -Vector3d::UnitX(),
                  .gap = gap,
                  .with = Surface::cushion});
}

void find_pin_and_lane(const PinPlace& pin, const Surroundings& surroundings, Contacts& contacts) {
  const double reach = kOutline.reach + kLaneGap;
  if (pin.centre.y() < reach) find_pin_and_ground(pin, surroundings, contacts);
  const double beside = std::abs(pin.centre.z());
  if (beside + reach > kLaneHalfWidth || pin.centre.x() + reach > kDeckEnd) find_pin_and_edges(pin, contacts);
  if (beside + reach > kWall) {
    const double side = pin.centre.z() < 0 ? -1 : 1;
    find_pin_and_plane(
        pin, {0, 0, -side}, -kWall, Surface::wall,
        [](const Vector3d& point) { return point.x() > 0 || point.y() < 0; }, contacts);
  }
  if (surroundings.pit && pin.centre.x() + reach > kCushion)
    find_pin_and_plane(
        pin, -Vector3d::UnitX(), -kCushion, Surface::cushion, [](const Vector3d&) { return true; }, contacts);
}

void find_ball_and_pin(const Vector3d& centre, double radius, const PinPlace& pin, Contacts& contacts) {
  const Vector3d apart = centre - pin.centre;
  const double height = apart.dot(pin.axis), touching = radius + kHitGap;
  if (height > kOutline.height[kRings - 1] + touching || height < kOutline.height[0] - touching) return;
  const Vector3d across = apart - height * pin.axis;
  const double squared = across.squaredNorm(), farthest = kOutline.widest + touching;
  if (squared >= farthest * farthest) return;
  const double off_axis = std::sqrt(squared);
  const auto nearest = kOutline.distance(off_axis, height);
  if (nearest.distance >= touching || nearest.distance == 0) return;
  const Vector3d outwards = off_axis > 1e-12 ? (across / off_axis).eval() : pin.axis.unitOrthogonal();
  contacts.add({.point = pin.centre + nearest.height * pin.axis + nearest.radius * outwards,
                .normal = ((off_axis - nearest.radius) * outwards + (height - nearest.height) * pin.axis) /
                          nearest.distance,
                .gap = nearest.distance - radius,
                .with = Surface::pin});
}

void find_pin_and_pin(const PinPlace& first, const PinPlace& second, Contacts& contacts) {
  const Vector3d apart = first.centre - second.centre;
  const double squared = apart.squaredNorm(), farthest = 2 * kOutline.reach;
  if (squared > farthest * farthest) return;
  // |(c0 + h a0) - (c1 + k a1)|^2, expanded so that the loops hold numbers only.
  const double along_first = 2 * apart.dot(first.axis), along_second = 2 * apart.dot(second.axis),
               together = 2 * first.axis.dot(second.axis);
  double best_gap = kHitGap;
  std::size_t best_first = kSpheres, best_second = kSpheres;
  for (std::size_t i = 0; i < kSpheres; ++i) {
    const double h = kOutline.sphere_height[i], base = squared + h * (h + along_first);
    const double slope = along_second + h * together;
    // Even the nearest point of the other axis may be too far away.
    const double farthest_here = kOutline.sphere_radius[i] + kOutline.widest + kHitGap;
    if (base - 0.25 * slope * slope >= farthest_here * farthest_here) continue;
    for (std::size_t j = 0; j < kSpheres; ++j) {
      const double k = kOutline.sphere_height[j],
                   radii = kOutline.sphere_radius[i] + kOutline.sphere_radius[j];
      const double between = base + k * (k - slope), reach = radii + best_gap;
      if (between >= reach * reach) continue;
      best_gap = std::sqrt(std::max(between, 0.0)) - radii;
      best_first = i;
      best_second = j;
    }
  }
  if (best_first == kSpheres) return;
  const Vector3d from = second.centre + kOutline.sphere_height[best_second] * second.axis;
  const Vector3d to = first.centre + kOutline.sphere_height[best_first] * first.axis;
  const double distance = (to - from).norm();
  if (distance == 0) return;
  const Vector3d normal = (to - from) / distance;
  contacts.add({.point = from + kOutline.sphere_radius[best_second] * normal,
                .normal = normal,
                .gap = best_gap,
                .with = Surface::pin});
}

std::array<Vector3d, 2> pin_bounds(const Vector3d& axis) {
  Vector3d low, high;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double sine = sine_of(axis[k]);
    low[k] = high[k] = 0;
    for (std::size_t n = 0; n < kOutline.hull_count; ++n) {
      const double along = kOutline.height[kOutline.hull[n]] * axis[k],
                   out = kOutline.radius[kOutline.hull[n]] * sine;
      low[k] = std::min(low[k], along - out);
      high[k] = std::max(high[k], along + out);
    }
  }
  return {low, high};
}

}  // namespace retake::bowling
