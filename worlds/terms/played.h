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

/// Whether a body is there at a time [s], which is known as soon as it has a track.
inline bool is_there(const Track& track, double time) {
  constexpr double kRounding = 1e-9;  // [s]
  return time >= track.from - kRounding;
}

/// The position of a track at a time [s], and its velocity by central differences of the frames around: exact
/// in free flight, a mean over two frames where something is hit, 0 after the end. Frames from before the
/// body is there count for nothing. None: not known yet. Requires: the body is there, is_there().
std::optional<PlayedMotion> motion_at(const Animation& animation, const Track& track, double time,
                                      Progress progress);

/// The same without the velocity, which needs to know less.
std::optional<Eigen::Vector3d> position_at(const Animation& animation, const Track& track, double time,
                                           Progress progress);

}  // namespace retake::terms
