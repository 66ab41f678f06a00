// See playback.h.
#include "worlds/impulse/playback.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "worlds/recorder.h"

namespace retake::impulse {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Turns by a small angle: exact to its third power.
Quaterniond turned(const Quaterniond& rotation, const Vector3d& angle) {
  const Quaterniond turn(1, angle.x() / 2, angle.y() / 2, angle.z() / 2);
  return (turn * rotation).normalized();
}

/// How a body is turned, followed through its motion.
class Turning {
 public:
  Turning(const Motion& motion, double time_step) : motion_(motion), time_step_(time_step) {}

  /// After a number of steps that is not less than in the call before, and a share of the next one.
  Pose pose(std::int32_t steps, double share) {
    for (; done_ < steps; ++done_)
      rotation_ = turned(rotation_, time_step_ * angular_velocity(done_ + 1));
    const auto at = static_cast<std::size_t>(steps);
    if (steps == motion_.step_count()) return {motion_.states[at].position, rotation_};
    const Vector3d &begin = motion_.states[at].position, &end = motion_.states[at + 1].position;
    return {begin + share * (end - begin),
            turned(rotation_, share * time_step_ * angular_velocity(steps + 1))};
  }

 private:
  const Vector3d& angular_velocity(std::int32_t state) const {
    return motion_.states[static_cast<std::size_t>(state)].angular_velocity;
  }

  const Motion& motion_;
  double time_step_;
  std::int32_t done_ = 0;
  Quaterniond rotation_ = Quaterniond::Identity();
};

}  // namespace

double duration(const Settings& settings, const Run& run) {
  std::int64_t last = 0;
  for (std::size_t body = 0; body < run.motions.size(); ++body)
    if (run.motions[body])
      last = std::max(last, run.scene.bodies[body]->step + run.motions[body]->step_count());
  return static_cast<double>(last) * settings.time_step;
}

std::size_t frame_count(const Settings& settings, const Run& run, double rate) {
  return frames_until(duration(settings, run), rate);
}

void write_track(const Settings& settings, const Run& run, std::size_t body, double rate, std::size_t frames,
                 Track& track) {
  const Motion& motion = *run.motions[body];
  const auto birth = static_cast<double>(run.scene.bodies[body]->step);
  track.start = {motion.states.front().position};
  Turning turning(motion, settings.time_step);
  TrackWriter writer(track, frames);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const double steps = static_cast<double>(frame) / (rate * settings.time_step) - birth;
    const double whole = std::clamp(std::floor(steps), 0.0, static_cast<double>(motion.step_count()));
    writer.add(turning.pose(static_cast<std::int32_t>(whole), std::clamp(steps - whole, 0.0, 1.0)));
  }
  writer.rest(turning.pose(motion.step_count(), 0));
}

std::vector<Hit> hits(const Settings& settings, const Run& run) {
  std::vector<Hit> all;
  for (std::size_t body = 0; body < run.motions.size(); ++body) {
    if (!run.motions[body]) continue;
    const std::int64_t birth = run.scene.bodies[body]->step;
    for (const Impact& impact : run.motions[body]->impacts) {
      const std::int64_t step = birth + impact.step;
      if (impact.other != kSurface && static_cast<std::size_t>(impact.other) < body) {
        // The other one has it too, unless it was at rest.
        const auto other = static_cast<std::size_t>(impact.other);
        if (step < run.scene.bodies[other]->step + run.motions[other]->step_count()) continue;
      }
      all.push_back({static_cast<double>(step + 1) * settings.time_step, body, impact.other, impact.impulse,
                     impact.point, impact.normal});
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Hit& a, const Hit& b) {
    return std::tie(a.time, a.body) < std::tie(b.time, b.body);
  });
  return all;
}

}  // namespace retake::impulse
