// Settings and state of the spheres that the impulse engine moves. Paper, sections 5.3 and 5.4.
// It must not know what the spheres touch.
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "worlds/gravity.h"

namespace retake::impulse {

/// What all spheres of a scene have in common, and how their contacts are resolved. The defaults are the
/// marbles of appendix B; measured ones were compared with finer steps and with each other.
struct Settings {
  double time_step = 0.001;          ///< [s], measured: what comes to rest where agrees from 1 kHz up
  double gravity = kGravity;         ///< [m/s2], along -y
  double radius = 0.008;             ///< [m], chosen: marbles in bins of 20 mm
  double density = 2500;             ///< [kg/m3], glass
  double restitution = 0.5;          ///< of normal speeds above restitution_speed; chosen
  double restitution_speed = 0.05;   ///< [m/s], well above what gravity adds in a step; measured
  double friction = 0.25;            ///< Coulomb's coefficient; chosen
  double rolling_resistance = 0.01;  ///< lever of the normal force, in radii; chosen
  int sweeps = 3;                    ///< over a step's contacts; restitution acts in the first; measured
  double separation = 0.6;           ///< share of an overlap that a step takes away; measured
  double permitted_overlap = 5e-6;   ///< [m] that stays, so that resting contacts last; measured
  double rest_speed = 0.01;          ///< [m/s]; must exceed gravity * time_step
  double rest_time = 0.1;            ///< [s] below rest_speed and touching something, then it stays for good

  double mass() const;              ///< [kg]
  std::int32_t rest_steps() const;  ///< rest_time in steps
};

/// Whether two vectors are equal bit for bit; 0 and -0 differ.
bool same_bits(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// All that decides how a sphere goes on. How it is turned does not matter to a sphere; playback.h
/// integrates that from the angular velocities.
struct SphereState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();          ///< [m] of the centre
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   ///< [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
  std::int32_t quiet_steps = 0;                                ///< successive steps slow and touching

  bool same_bits(const SphereState& other) const;
};

}  // namespace retake::impulse
