// Roll: the ball from its release to the pins in closed form - drop, bounces, slip, pure roll, gutter.
// Paper, section 5.2 and figure 4. It must not know pins or Bullet.
//
// Under Coulomb friction the direction of a sphere's slip never changes, so every stretch between two events
// is a parabola: the bounces, the end of the oil, and the moment at which the slip has died.
#pragma once

#include <array>
#include <limits>
#include <span>

#include <Eigen/Core>

#include "worlds/bowling/lane.h"

namespace retake::bowling {

struct Ball {
  double radius;  ///< [m]
  double mass;    ///< [kg]
  /// Of a solid sphere [kg m^2].
  double inertia() const { return 0.4 * mass * radius * radius; }
};

struct Motion {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();          ///< [m] of the centre
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
};

/// Friction between ball and lane: one coefficient before a line across the lane, another one beyond it.
struct LaneFriction {
  double before;
  double beyond;
  double change;  ///< [m], x of the line
};

inline constexpr double kLaneBallRestitution = 0.2;
inline constexpr double kSlowestBounce = 0.1;  ///< [m/s]; an approach below this does not bounce

class Roll {
 public:
  /// Follows a ball from its release until its centre passes the deck's end or the edge of the lane.
  /// Requires: the ball moves down the lane and does not start inside it.
  Roll(const Ball& ball, const Motion& release, const LaneFriction& friction);

  /// The motion at a time [s]; after the end of the roll, what the last stretch would go on to do.
  Motion at(double time) const;
  /// When the centre passes this x [s]; infinity if it leaves the lane before.
  double time_at(double x) const;
  /// When the centre passes the edge of the lane [s]; infinity if it does not.
  double gutter_time() const { return gutter_time_; }
  /// The instants at which the ball touches down [s] and the impulses [N s].
  struct Touch {
    double time;
    double impulse;
    Eigen::Vector3d position;  ///< [m] of the point of contact
  };
  std::span<const Touch> touches() const { return {touches_.data(), touch_count_}; }

 private:
  /// A piece of constant acceleration.
  struct Stretch {
    double start = 0;     ///< [s]
    double duration = 0;  ///< [s]
    Motion motion{};      ///< at its start
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();
    Motion after(double seconds) const;
  };
  void bounce(const Ball& ball, Motion& motion, double friction, double time);
  const Stretch& stretch_at(double time) const;

  static constexpr std::size_t kMostStretches = 24, kMostTouches = 8;
  std::array<Stretch, kMostStretches> stretches_;
  std::size_t stretch_count_ = 0;
  std::array<Touch, kMostTouches> touches_;
  std::size_t touch_count_ = 0;
  double gutter_time_ = std::numeric_limits<double>::infinity();
};

}  // namespace retake::bowling
