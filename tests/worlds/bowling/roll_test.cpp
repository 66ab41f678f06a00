// The closed-form roll against a numerical integration that shares nothing with it, and against Bullet.
// Paper, section 5.2. Seeds are fixed.
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "worlds/bowling/deck.h"
#include "worlds/bowling/roll.h"
#include "worlds/gravity.h"

namespace retake::tests {
namespace {

using namespace bowling;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

// --- Against numerical integration -------------------------------------------------------------------

/// A sphere under gravity and Coulomb friction in tiny steps: forces and torques as they act, no knowledge of
/// what a path looks like.
struct Integration {
  std::vector<Motion> samples;  ///< every kBetween seconds
  std::vector<Roll::Touch> touches;
  double gutter_time = std::numeric_limits<double>::infinity();
  double pins_time = std::numeric_limits<double>::infinity();  ///< at the head pin's spot

  static constexpr double kStep = 2e-6, kBetween = 0.05;

  Integration(const Ball& ball, Motion motion, const LaneFriction& friction) {
    const double m = ball.mass, r = ball.radius, inertia = 0.4 * m * r * r;
    const Vector3d arm(0, -r, 0);
    const auto slip = [&] {
      Vector3d velocity = motion.linear_velocity + motion.angular_velocity.cross(arm);
      velocity.y() = 0;
      return velocity;
    };
    const auto push = [&](const Vector3d& impulse) {
      motion.linear_velocity += impulse / m;
      motion.angular_velocity += arm.cross(impulse) / inertia;
    };
    // An impulse that would stop the slip at once.
    const auto stopping = [&] { return slip().norm() / (1 / m + r * r / inertia); };
    bool lies = false;
    const int between = static_cast<int>(std::lround(kBetween / kStep));
    for (int step = 0; motion.position.x() < kDeckEnd && step * kStep < 5; ++step) {
      const double time = step * kStep;
      if (step % between == 0) samples.push_back(motion);
      const double mu = motion.position.x() < friction.change ? friction.before : friction.beyond;
      if (!lies && motion.position.y() <= r && motion.linear_velocity.y() <= 0) {
        const double approach = -motion.linear_velocity.y();
        const double restitution = approach > kSlowestBounce ? kLaneBallRestitution : 0;
        const double normal = m * (1 + restitution) * approach;
        touches.push_back({.time = time, .impulse = normal, .position = motion.position + arm});
        motion.linear_velocity.y() = restitution * approach;
        if (slip().norm() > 0) push(-std::min(mu * normal, stopping()) * slip().normalized());
        motion.position.y() = r;
        lies = restitution == 0;
      }
      if (lies) {
        if (const double norm = slip().norm(); norm > 1e-12)
          push(-std::min(mu * m * kGravity * kStep, stopping()) * (slip() / norm));
      } else {
        motion.position.y() -= 0.5 * kGravity * kStep * kStep;
        motion.position.y() += motion.linear_velocity.y() * kStep;
        motion.linear_velocity.y() -= kGravity * kStep;
      }
      motion.position.x() += motion.linear_velocity.x() * kStep;
      motion.position.z() += motion.linear_velocity.z() * kStep;
      if (std::isinf(gutter_time) && std::abs(motion.position.z()) > kLaneHalfWidth) gutter_time = time;
      if (std::isinf(pins_time) && motion.position.x() > 0) pins_time = time;
      if (std::isfinite(gutter_time)) return;
    }
  }
};

struct Thrown {
  Ball ball;
  Motion motion;
  LaneFriction friction;
};

/// All sorts of throws: high and low, spinning forwards, backwards and sideways, on one or two kinds of lane.
std::vector<Thrown> all_sorts(std::uint64_t seed, int count, double sideways) {
  RandomStream random = stream(seed);
  const auto uniform = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  std::vector<Thrown> throws;
  for (int i = 0; i < count; ++i) {
    Thrown thrown;
    const double r = uniform(0.8, 1) * kBallLargestRadius;
    thrown.ball = {.radius = r, .mass = uniform(0.8, 1) * 1440 * 4 / 3 * std::numbers::pi * r * r * r};
    thrown.motion = {.position = {kFoulLine, r * uniform(1, 1.6), uniform(-0.2, 0.2)},
                     .linear_velocity = {uniform(4, 10), 0, uniform(-sideways, sideways)},
                     .angular_velocity = {uniform(-15, 15), uniform(-10, 10), uniform(-60, 20)}};
    const double before = uniform(0.03, 0.3);
    thrown.friction = i % 2 == 0 ? LaneFriction{before, before, kFoulLine}
                                 : LaneFriction{before, uniform(0.03, 0.3), kFoulLine + uniform(2, 16)};
    throws.push_back(thrown);
  }
  return throws;
}

void expect_close(const Motion& roll, const Motion& expected, double radius, double time) {
  EXPECT_LT((roll.position - expected.position).norm(), 5e-5) << "at " << time << " s";
  EXPECT_LT((roll.linear_velocity - expected.linear_velocity).norm(), 2e-4) << "at " << time << " s";
  EXPECT_LT(radius * (roll.angular_velocity - expected.angular_velocity).norm(), 4e-4)
      << "at " << time << " s";
}

TEST(BowlingRoll, FollowsANumericalIntegration) {
  int bounces = 0, gutters = 0;
  for (const Thrown& thrown : all_sorts(201, 16, 0.15)) {
    const Integration expected(thrown.ball, thrown.motion, thrown.friction);
    const Roll roll(thrown.ball, thrown.motion, thrown.friction);
    for (std::size_t i = 0; i < expected.samples.size(); ++i) {
      const double time = static_cast<double>(i) * Integration::kBetween;
      expect_close(roll.at(time), expected.samples[i], thrown.ball.radius, time);
    }
    // Touch-downs, of which the numerical ones that are hardly any are not told apart.
    ASSERT_GE(roll.touches().size(), expected.touches.size() > 0 ? 1u : 0u);
    for (std::size_t i = 0; i < std::min(roll.touches().size(), expected.touches.size()); ++i) {
      EXPECT_NEAR(roll.touches()[i].time, expected.touches[i].time, 1e-5);
      EXPECT_NEAR(roll.touches()[i].impulse, expected.touches[i].impulse, 1e-3);
      EXPECT_LT((roll.touches()[i].position - expected.touches[i].position).norm(), 1e-4);
      bounces += expected.touches[i].impulse > 0.5;
    }
    // Its end.
    if (std::isfinite(expected.gutter_time)) {
      ++gutters;
      EXPECT_NEAR(roll.gutter_time(), expected.gutter_time, 1e-4);
    } else {
      EXPECT_NEAR(roll.time_at(0), expected.pins_time, 1e-5);
      EXPECT_GT(roll.gutter_time(), roll.time_at(0));
    }
  }
  EXPECT_GT(bounces, 10);
  EXPECT_GT(gutters, 2) << "the throws do not cover gutters";
  EXPECT_LT(gutters, 12) << "the throws do not cover the pins";
}

TEST(BowlingRoll, TimesAtAPlaceAreThoseAtWhichItIsThere) {
  int arrived = 0;
  for (const Thrown& thrown : all_sorts(202, 300, 0.05)) {
    const Roll roll(thrown.ball, thrown.motion, thrown.friction);
    double before = 0;
    for (double x = kFoulLine + 0.25; x < kDeckEnd; x += 0.5) {
      const double time = roll.time_at(x);
      if (std::isinf(time)) {
        EXPECT_TRUE(std::isfinite(roll.gutter_time()));
        EXPECT_LT(roll.at(roll.gutter_time()).position.x(), x + 1e-9);
        continue;
      }
      EXPECT_NEAR(roll.at(time).position.x(), x, 1e-9);
      EXPECT_GT(time, before);
      EXPECT_LE(time, roll.gutter_time());
      before = time;
    }
    arrived += std::isfinite(roll.time_at(0));
    if (std::isfinite(roll.gutter_time())) {
      EXPECT_NEAR(std::abs(roll.at(roll.gutter_time()).position.z()), kLaneHalfWidth, 1e-9);
    }
    EXPECT_TRUE(std::isinf(roll.time_at(kFoulLine - 1))) << "it never moves back";
  }
  EXPECT_GT(arrived, 50);
}

TEST(BowlingRoll, ABallThatRollsKeepsRolling) {
  const Ball ball{.radius = 0.108, .mass = 6.8};
  const double speed = 7, across = 0.01;
  const Motion release{.position = {kFoulLine, ball.radius, 0},
                       .linear_velocity = {speed, 0, across},
                       .angular_velocity = {across / ball.radius, 3, -speed / ball.radius}};
  const Roll roll(ball, release, {0.1, 0.3, kFoulLine + 5});
  for (const double time : {0.5, 1.0, 2.0}) {
    EXPECT_NEAR(roll.at(time).position.x(), kFoulLine + speed * time, 1e-9);
    EXPECT_NEAR(roll.at(time).position.z(), across * time, 1e-9);
    EXPECT_EQ(roll.at(time).position.y(), ball.radius);
    EXPECT_EQ(roll.at(time).angular_velocity.y(), 3) << "a point contact does not brake the turn about y";
  }
  EXPECT_TRUE(std::isinf(roll.gutter_time()));
  EXPECT_TRUE(roll.touches().empty());
}

// --- Against Bullet ------------------------------------------------------------------------------------

Motion hooking_release(double radius, double turns, double rotation) {
  constexpr double kSpeed = 8, kTilt = 15 * kDegree;
  const double across = turns * std::cos(kTilt);
  return {.position = {kFoulLine, 1.1 * radius, 0.35},
          .linear_velocity = {kSpeed, 0, 0.05},
          .angular_velocity = {-across * std::sin(rotation), turns * std::sin(kTilt),
                               -across * std::cos(rotation)}};
}

/// Lets Bullet roll a ball until its centre passes x.
Motion bullet_roll(const Ball& ball, const Motion& from, double friction, double x, int rate, double& time) {
  Deck deck({.rack = {7}, .ball_lane_friction = friction, .impact_rate = rate, .settle_rate = 120});
  deck.set({.ball = ball, .motion = from, .offsets = {Vector3d::Zero()}, .pins_fixed = true});
  while (deck.motion(0).position.x() < x)
    deck.step();
  time += deck.time();
  return deck.motion(0);
}

/// Bullet rolls through the oil, and goes on from where it has come to on the dry lane.
void expect_bullet_hooks_alike(double turns, double rotation) {
  const Ball ball{.radius = 0.108, .mass = 6.8};
  const Motion release = hooking_release(ball.radius, turns, rotation);
  constexpr double kEdge = kFoulLine + 12, kPins = -0.4;
  const auto lateral_error = [&](const Roll& roll, const Motion& bullet) {
    return bullet.position.z() - roll.at(roll.time_at(bullet.position.x())).position.z();
  };

  // Oil all the way.
  double time = 0;
  const Roll oiled(ball, release, {0.04, 0.04, kFoulLine});
  EXPECT_LT(std::abs(lateral_error(oiled, bullet_roll(ball, release, 0.04, kPins, 240, time))), 0.002);

  // The dry zone alone, from the closed form's motion at its start.
  const Roll roll(ball, release, {0.04, 0.2, kEdge});
  const Motion at_edge = roll.at(roll.time_at(kEdge));
  const Motion dry = bullet_roll(ball, at_edge, 0.2, kPins, 240, time);
  EXPECT_LT(std::abs(lateral_error(roll, dry)), 0.002);

  // Both.
  time = 0;
  const Motion oil_end = bullet_roll(ball, release, 0.04, kEdge, 240, time);
  const Motion pins = bullet_roll(ball, oil_end, 0.2, kPins, 240, time);
  EXPECT_LT(std::abs(lateral_error(roll, pins)), 0.002);
  EXPECT_NEAR(time, roll.time_at(pins.position.x()), 0.002);
  const Motion expected = roll.at(roll.time_at(pins.position.x()));
  EXPECT_LT((pins.linear_velocity - expected.linear_velocity).norm(), 0.03);
  EXPECT_LT(expected.position.z(), release.position.z() - 0.25) << "it should hook to the left";
  std::printf("%2.0f rad/s, %2.0f degrees: hook %.3f m, apart %.2f mm\n", turns, rotation / kDegree,
              release.position.z() - expected.position.z(), 1000 * lateral_error(roll, pins));
}

TEST(BowlingRoll, HooksWithinTwoMillimetresOfBullet) {
  for (const double turns : {20.0, 30.0, 40.0})
    for (const double rotation : {45 * kDegree, 60 * kDegree})
      expect_bullet_hooks_alike(turns, rotation);
}

}  // namespace
}  // namespace retake::tests
