// Stage: a world of ball, pins and what stands still around them, moved by Bullet.
// It must not know what a throw is. The one place where Bullet is seen is stage.cpp: its broad phase, islands
// and solver; contacts are ours (contacts.h).
#pragma once

#include <memory>

#include <Eigen/Core>

#include "worlds/animation.h"
#include "worlds/bowling/hit_log.h"
#include "worlds/bowling/roll.h"

namespace retake::bowling {

/// The rates at which every pin loses its velocities [1/s], unless damped otherwise.
inline constexpr double kPinDamping = 0.02;
inline constexpr double kPinSpinDamping = 0.15;

struct StageSettings {
  std::size_t bodies;  ///< the ball, which is body 0, and the pins
  Surroundings surroundings;
  double ball_lane_friction;
  double cushion_restitution;
};

/// Contract: what happens is a pure function of what was added since `clear`, bit for bit.
/// Thread safety: one thread at a time.
class Stage {
 public:
  explicit Stage(const StageSettings& settings);
  ~Stage();
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// Empties the world whole, so that it is as new.
  void clear(bool watched);
  void add_ball(const Ball& ball, const Pose& pose, const Motion& motion);
  void add_pin(std::size_t body, const Pose& pose, const Motion& motion);
  void remove(std::size_t body);
  bool has(std::size_t body) const;

  /// Moves everything on by a time [s]; `now` is the time at its end.
  void step(double seconds, double now);
  bool ball_has_touched_pin() const;
  const std::vector<Hit>& finish_hits();  ///< of a watched world

  // What follows is of a body that is there.
  Pose pose(std::size_t body) const;
  Motion motion(std::size_t body) const;
  Eigen::Vector3d position(std::size_t body) const;
  Eigen::Vector3d velocity(std::size_t body) const;
  Eigen::Vector3d axis(std::size_t body) const;  ///< of a pin, from base to head
  double energy(std::size_t body) const;         ///< kinetic and potential [J]
  bool is_active(std::size_t body) const;        ///< not asleep
  bool is_fixed(std::size_t body) const;
  /// From now on nothing moves the body.
  void fix(std::size_t body);
  /// The rates at which the body loses its velocities [1/s].
  void damp(std::size_t body, double linear, double angular);
  /// Speeds below which the body falls asleep [m/s], [rad/s].
  void set_sleeping_speeds(std::size_t body, double linear, double angular);
  void put_to_sleep(std::size_t body);
  void keep_awake(std::size_t body);
  void let_sleep(std::size_t body);    ///< after keep_awake
  void delay_sleep(std::size_t body);  ///< by as long as it takes to fall asleep

 private:
  class World;
  std::unique_ptr<World> world_;
};

}  // namespace retake::bowling
