// ContactStep: one time step of spheres that may touch each other - what touches, and what that does to them.
// Paper, section 5.3 (impulse-based simulation). It must not know runs or records.
//
// Semi-implicit Euler: gravity, then places, then contacts at these places. What a sphere does in a step
// depends on itself, the surface and the spheres that it overlaps, and through those on theirs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "worlds/impulse/run.h"
#include "worlds/impulse/surface.h"

namespace retake::impulse {

/// A sphere after gravity and motion, before contacts. Contacts are looked for at its position.
inline SphereState fall(const Settings& settings, const SphereState& state) {
  SphereState fallen = state;
  fallen.linear_velocity.y() -= settings.gravity * settings.time_step;
  fallen.position += settings.time_step * fallen.linear_velocity;
  return fallen;
}
/// Only the position of what `fall` gives, in the same bits.
inline Eigen::Vector3d fallen_position(const Settings& settings, const SphereState& state) {
  Eigen::Vector3d velocity = state.linear_velocity;
  velocity.y() -= settings.gravity * settings.time_step;
  return state.position + settings.time_step * velocity;
}

/// Whether two spheres touch.
inline bool overlap(const Settings& settings, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).squaredNorm() < 4 * settings.radius * settings.radius;
}

/// Thread safety: one thread at a time. Its memory is reused.
class ContactStep {
 public:
  /// What a step makes of one sphere.
  struct Outcome {
    std::uint32_t body;
    std::uint32_t region;  ///< of the surface, where it looked for contacts
    SphereState state;
    bool touches = false;  ///< anything
    bool rests = false;    ///< from now on, for good; its velocities are then zero
  };
  /// An Impact without its step. Of two spheres that move, both have one.
  struct Hit {
    std::uint32_t body;
    std::int32_t other;
    double impulse;          ///< [N s]
    Eigen::Vector3d point;   ///< [m]
    Eigen::Vector3d normal;  ///< unit vector that pushes `body`
  };

  explicit ContactStep(const Settings& settings);

  void clear();
  /// Adds a sphere that moves; `fallen` is what `fall` gives. Returns its place among the outcomes.
  std::size_t add(std::uint32_t body, const SphereState& fallen);
  /// Adds what two spheres at places `a` and `b` among the outcomes do to each other, or one and a sphere
  /// that rests. Requires: they overlap; each pair once, ascending by the lower, then by the higher body; a
  /// is the lower.
  void add_pair(std::size_t a, std::size_t b);
  void add_pair_with_resting(std::size_t a, std::uint32_t resting, const Eigen::Vector3d& place);
  void solve(const Surface& surface);

  std::span<const Outcome> outcomes() const { return outcomes_; }  ///< as they were added
  std::span<const Hit> hits() const { return hits_; }              ///< of pairs, then of the surface

 private:
  struct Contact {
    std::size_t first;       ///< place among the outcomes
    std::size_t second;      ///< or kStill
    std::int32_t other;      ///< the second body, or kSurface
    double overlap;          ///< [m]
    Eigen::Vector3d normal;  ///< unit vector that pushes the first
    double impulse = 0;      ///< [m/s] along the normal: that of a sphere of mass 1
    bool hits = false;
  };
  static constexpr std::size_t kStill = static_cast<std::size_t>(-1);

  void add_contact(std::size_t a, std::size_t b, std::int32_t other, const Eigen::Vector3d& place);
  void find_surface_contacts(const Surface& surface);
  void resolve(Contact& contact, bool rebounds);
  void separate(const Contact& contact);
  void note_hit(const Contact& contact);
  void settle(Outcome& outcome) const;

  Settings settings_;
  double rest_speed_squared_;
  std::int32_t rest_steps_;
  std::vector<Outcome> outcomes_;
  std::vector<Contact> contacts_;
  std::vector<Hit> hits_;
  SurfaceContacts found_;
};

}  // namespace retake::impulse
