// See played.h.
#include "worlds/terms/played.h"

#include <algorithm>
#include <cmath>

namespace retake::terms {
namespace {

using Eigen::Vector3d;

/// A time as a frame and the share of the way to the next one.
struct Place {
  Eigen::Index frame;
  double share;
};

Place place_of(const Animation& animation, double time) {
  const double frames = time * animation.rate, whole = std::floor(frames);
  // Far beyond any animation, but still an integer.
  return {static_cast<Eigen::Index>(std::min(whole, 1e15)), frames - whole};
}

/// Of a frame before the last one, of at least two frames.
Vector3d velocity_at_frame(const Track& track, Eigen::Index frame, double rate) {
  const auto& p = track.positions;
  if (frame > 0) return (p.col(frame + 1) - p.col(frame - 1)) * (rate / 2);
  if (p.cols() == 2) return (p.col(1) - p.col(0)) * rate;
  return (4 * p.col(1) - 3 * p.col(0) - p.col(2)) * (rate / 2);
}

}  // namespace

std::optional<Vector3d> position_at(const Animation& animation, const Track& track, double time,
                                    Progress progress) {
  const auto [frame, share] = place_of(animation, time);
  const auto last = static_cast<Eigen::Index>(animation.frames) - 1;
  if (frame < last) return track.positions.col(frame) * (1 - share) + track.positions.col(frame + 1) * share;
  if (progress == Progress::unfinished) return std::nullopt;
  return track.rest.position;
}

std::optional<PlayedMotion> motion_at(const Animation& animation, const Track& track, double time,
                                      Progress progress) {
  const auto [frame, share] = place_of(animation, time);
  const auto last = static_cast<Eigen::Index>(animation.frames) - 1;
  // The differences reach one frame further.
  if (progress == Progress::unfinished && frame + 1 >= last) return std::nullopt;
  const auto position = position_at(animation, track, time, progress);
  if (!position) return std::nullopt;
  if (frame >= last) return PlayedMotion{*position, Vector3d::Zero()};
  const Vector3d before = velocity_at_frame(track, frame, animation.rate);
  const Vector3d after =
      frame + 1 < last ? velocity_at_frame(track, frame + 1, animation.rate) : Vector3d::Zero();
  return PlayedMotion{*position, before * (1 - share) + after * share};
}

}  // namespace retake::terms
