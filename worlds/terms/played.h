// Played: where a track is at any time as an animation is played - straight between two frames, and at rest
// after the last one. It reads the frames, which are the same bits whoever asked for them.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "worlds/animation.h"

namespace retake::terms {

/// Whether an animation goes on after its frames.
enum class Progress { finished, unfinished };

struct PlayedMotion {
  Eigen::Vector3d position;  ///< [m]
  Eigen::Vector3d velocity;  ///< [m/s]
};

/// The position of a track at a time [s], and its velocity by central differences of the frames around: exact
/// in free flight, a mean over two frames where something is hit, 0 after the end. None: not known yet.
std::optional<PlayedMotion> motion_at(const Animation& animation, const Track& track, double time,
                                      Progress progress);

/// The same without the velocity, which needs to know less.
std::optional<Eigen::Vector3d> position_at(const Animation& animation, const Track& track, double time,
                                           Progress progress);

}  // namespace retake::terms
