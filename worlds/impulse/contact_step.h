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
SphereState fall(const Settings& settings, const SphereState& state);
/// Only the position of what `fall` gives.
Eigen::Vector3d fallen_position(const Settings& settings, const SphereState& state);

/// Whether two spheres touch.
bool overlap(const Settings& settings, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Thread safety: one thread at a time. Its memory is reused.
class ContactStep {
 public:
  /// What a step made of one sphere.
  struct Outcome {
    std::uint32_t body;
    std::uint32_t region;  ///< of the surface, where it looked for contacts
    SphereState state;
    bool rests;  ///< from now on, for good; its velocities are then zero
  };
  /// An Impact without its step.
  struct Hit {
    std::uint32_t body;
    std::int32_t other;
    double impulse;
    Eigen::Vector3d point, normal;
  };

  explicit ContactStep(const Settings& settings);

  void clear();
  /// A sphere that moves; `fallen` is what `fall` gives. Requires: ascending bodies.
  void add(std::uint32_t body, const SphereState& fallen);
  /// Two that overlap, `second` a body that was added or one that rests at `place`.
  /// Requires: ascending pairs (lower index, higher index), each once.
  void add_pair(std::uint32_t a, std::uint32_t b);
  void add_pair_with_resting(std::uint32_t body, std::uint32_t resting, const Eigen::Vector3d& place);
  void solve(const Surface& surface);

  std::span<const Outcome> outcomes() const { return outcomes_; }  ///< by body
  std::span<const Hit> hits() const { return hits_; }              ///< pairs first, then the surface

 private:
  Settings settings_;
  std::vector<Outcome> outcomes_;
  std::vector<Hit> hits_;
};

}  // namespace retake::impulse
