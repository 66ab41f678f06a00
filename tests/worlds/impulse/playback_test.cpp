// What a viewer sees of a run: poses at a rate, and hits.
#include <cmath>
#include <numbers>
#include <tuple>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/impulse/fixture.h"
#include "worlds/impulse/contact_step.h"
#include "worlds/impulse/playback.h"

namespace retake::tests {
namespace {

using namespace impulse;
using Eigen::Vector3d;

/// A body that rolls along x for a second without slipping, on its own.
impulse::Run rolling(double speed) {
  const Settings settings;
  auto motion = std::make_shared<Motion>();
  for (int k = 0; k <= 1000; ++k)
    motion->states.push_back({.position = {speed * k * settings.time_step, settings.radius, 0},
                              .linear_velocity = {speed, 0, 0},
                              .angular_velocity = {0, 0, -speed / settings.radius}});
  motion->rests = true;
  impulse::Run run;
  run.scene.bodies = {Drop{500, {0, settings.radius, 0}}};
  run.motions = {motion};
  return run;
}

TEST(ImpulsePlayback, ARollingSphereTurnsByItsWay) {
  const Settings settings;
  const double speed = 0.02;  // a third of a turn
  const impulse::Run run = rolling(speed);
  EXPECT_DOUBLE_EQ(duration(settings, run), 1.5);
  EXPECT_EQ(frame_count(settings, run, 60), 91u);
  Track track;
  write_track(settings, run, 0, 60, 91, track);
  ASSERT_EQ(track.positions.cols(), 91);
  for (Eigen::Index frame = 0; frame < 91; ++frame) {
    const double way = speed * std::max(0.0, static_cast<double>(frame) / 60 - 0.5);
    EXPECT_NEAR(track.positions(0, frame), way, 1e-9) << frame;
    const Eigen::Quaterniond expected(Eigen::AngleAxisd(-way / settings.radius, Vector3d::UnitZ()));
    EXPECT_LT(expected.angularDistance(Eigen::Quaterniond(Eigen::Vector4d(track.rotations.col(frame)))), 1e-4)
        << frame;
  }
  EXPECT_NEAR(track.rest.position.x(), speed, 1e-9);
  EXPECT_EQ(track.start.position, Vector3d(0, settings.radius, 0));
}

TEST(ImpulsePlayback, SuccessiveRotationsLieInOneHemisphere) {
  const Settings settings;
  Track track;
  write_track(settings, rolling(0.5), 0, 60, 91, track);  // ten turns
  for (Eigen::Index frame = 1; frame < 91; ++frame)
    EXPECT_GT(track.rotations.col(frame).dot(track.rotations.col(frame - 1)), 0);
}

TEST(ImpulsePlayback, EveryHitIsSeenOnceAndInOrder) {
  const Marbles marbles = crowded();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(571);
  std::size_t all_of_pairs = 0, all_with_resting = 0;
  for (int i = 0; i < 20; ++i) {
    const impulse::Scene scene = draw_scene(marbles, random);
    impulse::Run run;
    resimulation.simulate(scene, nullptr, &run);
    const std::vector<Hit> seen = hits(resimulation.settings(), run);
    std::size_t impacts = 0, of_pairs = 0;
    for (const auto& motion : run.motions)
      impacts += motion->impacts.size();
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const Hit& hit = seen[k];
      if (k > 0) {
        EXPECT_LE(std::tie(seen[k - 1].time, seen[k - 1].body), std::tie(hit.time, hit.body));
      }
      EXPECT_GT(hit.impulse, 0);
      EXPECT_NEAR(hit.normal.norm(), 1, 1e-12);
      if (hit.other == kSurface) continue;
      const auto other = static_cast<std::size_t>(hit.other);
      const auto step =
          std::llround(hit.time / resimulation.settings().time_step) - 1 - scene.bodies[other]->step;
      const bool rested = step >= run.motions[other]->step_count();
      EXPECT_TRUE(rested || other > hit.body);
      all_with_resting += rested ? 1 : 0;
      of_pairs += rested ? 0 : 1;
    }
    EXPECT_EQ(seen.size() + of_pairs, impacts);  // a pair's is in both motions
    all_of_pairs += of_pairs;
  }
  EXPECT_GT(all_of_pairs, 50u);
  EXPECT_GT(all_with_resting, 0u);
}

}  // namespace
}  // namespace retake::tests
