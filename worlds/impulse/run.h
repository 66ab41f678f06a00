// Run: what a simulation of spheres that are born from rest did, whole. Paper, section 5.3; doc/design.md,
// section 3. It must not know how spheres move.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sampler/simulator.h"
#include "worlds/impulse/sphere.h"

namespace retake::impulse {

class Surface;

/// A sphere that is born at rest.
struct Drop {
  std::int64_t step;      ///< number of the step before which it appears, not negative
  Eigen::Vector3d place;  ///< [m] of its centre
};

/// What is simulated: everything that decides a run, besides Settings and the surface as it was built.
struct Scene {
  std::vector<std::optional<Drop>> bodies;  ///< a body is known by its index; none: it takes no part
  std::vector<Eigen::Vector3d> offsets;     ///< [m] of the surface's vertex groups
  std::int64_t latest_step = 0;             ///< what moves after so many steps never rests
};

/// What a body touches that is not a body.
inline constexpr std::int32_t kSurface = -1;

/// A hit: what met faster than Settings::restitution_speed.
struct Impact {
  std::int32_t step;       ///< since birth
  std::int32_t other;      ///< which body, or kSurface
  double impulse;          ///< [N s], along the normal
  Eigen::Vector3d point;   ///< [m]
  Eigen::Vector3d normal;  ///< unit vector that pushes this body
};

/// Successive steps in which a body that moves touches another, which moves or rests. What rests does not
/// list those that touch it.
struct Meeting {
  std::int32_t other;
  std::int32_t begin, end;  ///< steps since birth, [begin, end)
};

/// Successive steps in one region of the surface.
struct Stay {
  std::int32_t begin;  ///< step since birth; it ends where the next one begins
  std::uint32_t region;
};

/// The motion of one body, in steps since its birth: step k leads from states[k] to states[k + 1]. It does
/// not say when the birth was, so equal motions at other times are equal. Immutable once it is in a Run.
struct Motion {
  std::vector<SphereState> states;  ///< from birth to rest, or to the run's latest step
  std::vector<Impact> impacts;      ///< by step
  std::vector<Meeting> meetings;    ///< by begin, then by other
  std::vector<Stay> stays;
  bool rests = false;  ///< its last state is at rest, for good

  /// Bounds of the centres that kBlock successive steps look for contacts at [m].
  struct Bounds {
    Eigen::Vector3d low, high;
  };
  static constexpr std::int32_t kBlock = 16;
  std::vector<Bounds> blocks;

  std::int32_t step_count() const { return static_cast<std::int32_t>(states.size()) - 1; }
};

/// The first step since birth in which a body was where a vertex group can matter.
struct FirstTouch {
  std::uint32_t group;
  std::int32_t step;
};

/// One simulation. Motions are shared between runs and by whoever copies one. About 80 bytes a body and
/// step: 0.1 MB a marble.
struct Run : retake::Run {
  Scene scene;
  std::vector<std::shared_ptr<const Motion>> motions;  ///< of Scene::bodies; null where one takes no part
  bool complete = false;  ///< not stopped early; only such a run can be continued from
  bool rests = false;     ///< everything is at rest by the latest step; a run that is not is of no use
};

/// The first touches of a motion, by group.
std::vector<FirstTouch> first_touches(const Motion& motion, const Surface& surface);

/// Whether two impacts are the same in every bit.
bool same_impact(const Impact& a, const Impact& b);

/// Whether two motions are the same in every bit: states, impacts, meetings and stays.
bool same_bits(const Motion& a, const Motion& b);

}  // namespace retake::impulse
