// Contacts between pins, ball and lane: exact for the shapes at hand, and a few times faster than a general
// narrow phase. It must not know Bullet, velocities or time.
//
// A pin is its surface of revolution (lane.h): rings against planes, its outline against the ball, and
// spheres inscribed along its axis against edges and other pins.
#pragma once

#include <array>
#include <optional>
#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "worlds/bowling/lane.h"

namespace retake::bowling {

/// A pin's place: rotation about its own axis changes nothing.
struct PinPlace {
  Eigen::Vector3d centre;  ///< [m] of mass
  Eigen::Vector3d axis;    ///< unit vector from base to head
};

/// What the second of two bodies touches with.
enum class Surface { lane, gutter, wall, pit, cushion, pin };

struct Contact {
  Eigen::Vector3d point;   ///< [m] on the second body
  Eigen::Vector3d normal;  ///< unit vector that pushes the first body
  double gap;              ///< [m], negative where they overlap
  Surface with;            ///< the second body's surface
};

/// Gaps below which two bodies count as touching [m]. A contact that is seen before it happens loses part of
/// its rebound to Bullet's solver, so those of hits are small; the lane's is larger to keep pins steady.
inline constexpr double kHitGap = 1e-4;
inline constexpr double kLaneGap = 1e-3;

/// At most four, the most a contact manifold of Bullet holds.
class Contacts {
 public:
  void add(const Contact& contact) {
    if (count_ < contacts_.size()) contacts_[count_++] = contact;
  }
  std::span<const Contact> list() const { return {contacts_.data(), count_}; }

 private:
  std::array<Contact, 4> contacts_;
  std::size_t count_ = 0;
};

/// Everything that stands still: lane, gutters, walls, and the pit where there is one.
struct Surroundings {
  bool pit = false;  ///< a floor behind the deck and a cushion at its end; else there is nothing
};
void find_ball_and_lane(const Eigen::Vector3d& centre, double radius, const Surroundings& surroundings,
                        Contacts& contacts);
void find_pin_and_lane(const PinPlace& pin, const Surroundings& surroundings, Contacts& contacts);
/// The ball is the first body.
void find_ball_and_pin(const Eigen::Vector3d& centre, double radius, const PinPlace& pin, Contacts& contacts);
void find_pin_and_pin(const PinPlace& first, const PinPlace& second, Contacts& contacts);

/// The lowest and the highest corner of the smallest upright box around a pin, from its centre of mass [m].
std::array<Eigen::Vector3d, 2> pin_bounds(const Eigen::Vector3d& axis);

}  // namespace retake::bowling
