// The motion of the 2D ball: parabolic hops, and a reflection about an uncertain normal at each collision.
// Paper, section 5.1. It must not know constraints, frames or JSON.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "worlds/gravity.h"

namespace retake::ball2d {

inline constexpr double kRadius = 0.5;  ///< [m]; the paper's D is 1 m

struct BounceModel {
  double drop_height = 4.5;                  ///< [m] of the centre at rest above x = 0
  double restitution = 0.70710678118654752;  ///< of the normal component of the velocity
  double gravity = kGravity;                 ///< [m/s^2]
};

/// A hop: from a point with a velocity, for a while. `y` is the height of the centre.
struct Hop {
  double start = 0;       ///< [s]
  double duration = 0;    ///< [s]; 0 where the ball collides again at once
  double x = 0, y = 0;    ///< [m]
  double vx = 0, vy = 0;  ///< [m/s]
};

/// Follows the ball through its collisions, one tilt of the normal [rad] each, to the contact after the last
/// one, where it rests. Calls on_hop(Hop) for every hop and on_collision(time, x, sine, cosine, impulse per
/// mass [m/s]) for every collision, the last contact included. Returns the x at which the ball rests [m].
/// Readings where the paper is silent: a ball that leaves downwards collides again at the same place with the
/// next normal; one that already moves away along the normal gets no impulse.
template <typename Tilts, typename OnHop, typename OnCollision>
double bounce(const BounceModel& model, const Tilts& tilts, OnHop&& on_hop, OnCollision&& on_collision) {
  // The drop.
  const double fall = model.drop_height - kRadius;
  Hop hop{.start = 0,
          .duration = std::sqrt(2 * fall / model.gravity),
          .x = 0,
          .y = model.drop_height,
          .vx = 0,
          .vy = 0};
  on_hop(hop);
  double time = hop.duration, x = 0, vx = 0, vy = -model.gravity * hop.duration;

  for (Eigen::Index i = 0; i < tilts.size(); ++i) {
    // The collision: the normal component is reversed and scaled.
    const double sine = std::sin(tilts[i]), cosine = std::cos(tilts[i]);
    const double approach = -(vx * sine + vy * cosine);
    const double impulse = approach > 0 ? (1 + model.restitution) * approach : 0;
    vx += impulse * sine;
    vy += impulse * cosine;
    on_collision(time, x, sine, cosine, impulse);

    // The hop to the next contact; it ends at the height at which it began, with the vertical velocity
    // reversed.
    hop = {.start = time,
           .duration = vy > 0 ? 2 * vy / model.gravity : 0,
           .x = x,
           .y = kRadius,
           .vx = vx,
           .vy = vy};
    on_hop(hop);
    time += hop.duration;
    x += vx * hop.duration;
    if (vy > 0) vy = -vy;
  }
  on_collision(time, x, 0.0, 1.0, -vy);
  return x;
}

}  // namespace retake::ball2d
