// Playback: what a viewer sees of a run - poses at a fixed rate, and hits. doc/design.md, section 4.
// It must not know colours, shapes or names.
#pragma once

#include <cstddef>
#include <vector>

#include "worlds/animation.h"
#include "worlds/impulse/run.h"

namespace retake::impulse {

/// When the last body came to rest, or the run's latest step was over [s].
double duration(const Settings& settings, const Run& run);

/// Frames that show a run to its end at a rate [1/s]: the last one is the first in which all is at rest.
std::size_t frame_count(const Settings& settings, const Run& run, double rate);

/// Fills `track` with the poses of a body: until its birth, unturned, where it is dropped.
/// Requires: the body takes part in the run.
void write_track(const Settings& settings, const Run& run, std::size_t body, double rate, std::size_t frames,
                 Track& track);

/// A hit as seen by a viewer.
struct Hit {
  double time;               ///< [s]
  std::size_t body;          ///< which of Scene::bodies
  std::int32_t other;        ///< a body with a higher index or at rest, or kSurface
  double impulse;            ///< [N s]
  Eigen::Vector3d position;  ///< [m]
  Eigen::Vector3d normal;    ///< unit vector that pushes `body`
};

/// Every hit of a run once, in order of time, then of bodies.
std::vector<Hit> hits(const Settings& settings, const Run& run);

}  // namespace retake::impulse
