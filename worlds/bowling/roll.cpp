// See roll.h.
#include "worlds/bowling/roll.h"

#include <algorithm>
#include <cmath>

#include "worlds/gravity.h"

namespace retake::bowling {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kNoSlip = 1e-9;  // [m/s]

/// The first time after now at which x0 + v t + a t^2 / 2 reaches `goal`.
double first_time(double x0, double velocity, double acceleration, double goal) {
  const double distance = goal - x0, half = 0.5 * acceleration;
  const double discriminant = velocity * velocity + 4 * half * distance;
  if (discriminant < 0) return kNever;
  // The two roots without cancellation.
  const double q = -0.5 * (velocity + std::copysign(std::sqrt(discriminant), velocity));
  double first = kNever;
  for (const double root : {half != 0 ? q / half : kNever, q != 0 ? -distance / q : kNever})
    if (root > 0 && root < first) first = root;
  return first;
}

/// Velocity of the ball's lowest point over the lane: what friction opposes.
Eigen::Vector3d slip_of(const Motion& motion, double radius) {
  const auto& v = motion.linear_velocity;
  const auto& w = motion.angular_velocity;
  return {v.x() + radius * w.z(), 0, v.z() - radius * w.x()};
}

/// The torque of a horizontal force at the lowest point: r x f with r = (0, -radius, 0).
Eigen::Vector3d torque_of(const Eigen::Vector3d& force, double radius) {
  return {-radius * force.z(), 0, radius * force.x()};
}

}  // namespace

Motion Roll::Stretch::after(double seconds) const {
  return {.position =
              motion.position + seconds * motion.linear_velocity + (0.5 * seconds * seconds) * acceleration,
          .linear_velocity = motion.linear_velocity + seconds * acceleration,
          .angular_velocity = motion.angular_velocity + seconds * angular_acceleration};
}

Roll::Roll(const Ball& ball, const Motion& release, const LaneFriction& friction) {
  const double radius = ball.radius;
  Motion now = release;
  double time = 0;
  bool in_oil = now.position.x() < friction.change;
  while (stretch_count_ < kMostStretches) {
    Stretch& stretch = stretches_[stretch_count_++];
    stretch = {.start = time, .duration = kNever, .motion = now};
    const double mu = in_oil ? friction.before : friction.beyond;

    // What ends this stretch: a touch-down, the end of the slip, or the end of the oil.
    const bool flies = now.position.y() > radius || now.linear_velocity.y() > 0;
    double touch_down = kNever, slip_end = kNever;
    if (flies) {
      stretch.acceleration = {0, -kGravity, 0};
      const double vy = now.linear_velocity.y(), height = now.position.y() - radius;
      touch_down = (vy + std::sqrt(vy * vy + 2 * kGravity * height)) / kGravity;
    } else if (const Eigen::Vector3d slip = slip_of(now, radius); slip.norm() > kNoSlip) {
      const Eigen::Vector3d force = -mu * kGravity * slip.normalized();  // per mass
      stretch.acceleration = force;
      stretch.angular_acceleration = torque_of(force, radius) / (0.4 * radius * radius);
      slip_end = slip.norm() / (3.5 * mu * kGravity);
    }
    const auto reaches = [&](int axis, double goal) {
      return first_time(now.position[axis], now.linear_velocity[axis], stretch.acceleration[axis], goal);
    };
    const double oil_end = in_oil ? reaches(0, friction.change) : kNever;
    stretch.duration = std::min({touch_down, slip_end, oil_end});

    // What ends the roll.
    const double side = std::min(reaches(2, kLaneHalfWidth), reaches(2, -kLaneHalfWidth));
    const double tail = reaches(0, kDeckEnd + 1);
    if (std::min(side, tail) <= stretch.duration) {
      if (side < tail) gutter_time_ = time + side;
      stretch.duration = std::min(side, tail);
      return;
    }

    time += stretch.duration;
    now = stretch.after(stretch.duration);
    if (stretch.duration == touch_down) {
      now.position.y() = radius;
      bounce(ball, now, mu, time);
    } else if (stretch.duration == slip_end) {
      now.angular_velocity.x() = now.linear_velocity.z() / radius;
      now.angular_velocity.z() = -now.linear_velocity.x() / radius;
    } else {
      in_oil = false;
    }
  }
}

void Roll::bounce(const Ball& ball, Motion& motion, double friction, double time) {
  const double approach = -motion.linear_velocity.y();
  const double restitution = approach > kSlowestBounce ? kLaneBallRestitution : 0;
  motion.linear_velocity.y() = restitution * approach;
  if (touch_count_ < kMostTouches)
    touches_[touch_count_++] = {.time = time,
                                .impulse = ball.mass * (1 + restitution) * approach,
                                .position = motion.position - Eigen::Vector3d(0, ball.radius, 0)};
  // Friction acts for as long as the normal impulse lasts, or until the slip is gone.
  const Eigen::Vector3d slip = slip_of(motion, ball.radius);
  if (slip.norm() <= kNoSlip) return;
  const double change = std::min(friction * (1 + restitution) * approach, slip.norm() / 3.5);
  const Eigen::Vector3d impulse = -change * slip.normalized();  // per mass
  motion.linear_velocity += impulse;
  motion.angular_velocity += torque_of(impulse, ball.radius) / (0.4 * ball.radius * ball.radius);
}

const Roll::Stretch& Roll::stretch_at(double time) const {
  std::size_t last = 0;
  while (last + 1 < stretch_count_ && stretches_[last + 1].start <= time)
    ++last;
  return stretches_[last];
}

Motion Roll::at(double time) const {
  const Stretch& stretch = stretch_at(time);
  return stretch.after(time - stretch.start);
}

double Roll::time_at(double x) const {
  for (std::size_t i = 0; i < stretch_count_; ++i) {
    const Stretch& stretch = stretches_[i];
    const double time = first_time(stretch.motion.position.x(), stretch.motion.linear_velocity.x(),
                                   stretch.acceleration.x(), x);
    if (time <= stretch.duration) return stretch.start + time;
  }
  return kNever;
}

}  // namespace retake::bowling
