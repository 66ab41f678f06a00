// Recorder: what every world does with the Animation that it fills, written once - begin it, give it up, put
// frames into its tracks. doc/design.md, section 4. It must not know what moves.
#pragma once

#include <cmath>
#include <cstddef>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "worlds/animation.h"
#include "worlds/world.h"

namespace retake {

/// Makes an animation one of which nothing is known yet but how many tracks it has, whose memory is kept: no
/// frames, no events, nothing has fallen or come to rest. Names, starts and rests are the world's to fill in.
void begin_animation(Animation& animation, double rate, std::size_t tracks);

/// Whether no term can exceed what is needed any more, whatever comes.
bool is_out_of_reach(const Recording& recording, const Animation& so_far);

/// How many frames show `seconds` [s] at a rate [frames/s]: the last one is not before the end.
inline std::size_t frames_until(double seconds, double rate) {
  constexpr double kRounding = 1e-9;  // of a frame
  return static_cast<std::size_t>(std::ceil(seconds * rate - kRounding)) + 1;
}

/// Writes the frames of a track one after the other, successive rotations in one hemisphere.
class TrackWriter {
 public:
  TrackWriter(Track& track, std::size_t frames) : track_(track) {
    track_.positions.resize(3, static_cast<Eigen::Index>(frames));
    track_.rotations.resize(4, static_cast<Eigen::Index>(frames));
  }
  /// Requires: fewer than `frames` were added.
  void add(const Pose& pose) {
    track_.positions.col(frame_) = pose.position;
    track_.rotations.col(frame_) = before_ = nearer(pose.rotation.coeffs(), before_);
    ++frame_;
  }
  /// The pose after the last frame, in which the animation ends.
  void rest(const Pose& pose) {
    track_.rest = {.position = pose.position,
                   .rotation = Eigen::Quaterniond(nearer(pose.rotation.coeffs(), before_))};
  }

 private:
  Track& track_;
  Eigen::Vector4d before_ = Eigen::Vector4d::Zero();
  Eigen::Index frame_ = 0;
};

}  // namespace retake
