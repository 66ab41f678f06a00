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

/// The first frame in which a body is there; before it, its frames say nothing of how it moves.
Eigen::Index first_frame(const Animation& animation, const Track& track) {
  constexpr double kRounding = 1e-9;  // of a frame
  return static_cast<Eigen::Index>(std::ceil(std::min(track.from * animation.rate, 1e15) - kRounding));
}

/// Of a frame before the last one, of a body whose first frame is before the last one too.
Vector3d velocity_at_frame(const Track& track, Eigen::Index frame, Eigen::Index first, double rate) {
  const auto& p = track.positions;
  if (frame > first) return (p.col(frame + 1) - p.col(frame - 1)) * (rate / 2);
  if (p.cols() == first + 2) return (p.col(first + 1) - p.col(first)) * rate;
  return (4 * p.col(first + 1) - 3 * p.col(first) - p.col(first + 2)) * (rate / 2);
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
  const Eigen::Index first = first_frame(animation, track);
  // The differences reach one frame further.
  if (progress == Progress::unfinished && std::max(frame, first) + 1 >= last) return std::nullopt;
  const auto position = position_at(animation, track, time, progress);
  if (!position) return std::nullopt;
  if (frame >= last) return PlayedMotion{*position, Vector3d::Zero()};
  const auto velocity_at = [&](Eigen::Index at) -> Vector3d {
    return at < last && first < last ? velocity_at_frame(track, at, first, animation.rate) : Vector3d::Zero();
  };
  const Vector3d before = velocity_at(frame), after = velocity_at(frame + 1);
  return PlayedMotion{*position, before * (1 - share) + after * share};
}

}  // namespace retake::terms
