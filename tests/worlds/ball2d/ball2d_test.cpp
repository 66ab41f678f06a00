// The 2D ball's physics: closed forms, and that score mode, frames and events tell the same story.
// sampling_test.cpp has figure 2 and the exactness of the chains.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"
#include "worlds/ball2d/bounce.h"
#include "worlds/gravity.h"

namespace retake::tests {
namespace {

using ball2d::Hop;
using ball2d::kRadius;
using nlohmann::json;

const double kRestitution = 1 / std::numbers::sqrt2;

struct Collision {
  double time, x, sine, cosine, impulse;
};

struct Flight {
  std::vector<Hop> hops;
  std::vector<Collision> collisions;
  double x = 0;
};

Flight fly(const State& tilts) {
  Flight flight;
  flight.x = ball2d::bounce(
      {}, tilts, [&](const Hop& hop) { flight.hops.push_back(hop); },
      [&](double time, double x, double sine, double cosine, double impulse) {
        flight.collisions.push_back({time, x, sine, cosine, impulse});
      });
  return flight;
}

State tilts_of(std::initializer_list<double> tilts) {
  State state(static_cast<Eigen::Index>(tilts.size()));
  std::copy(tilts.begin(), tilts.end(), state.data());
  return state;
}

std::shared_ptr<const Scenario> default_scenario() {
  return read_scenario(R"({"world":"ball2d","constraints":[{"kind":"rest_position","x":1}]})");
}

/// Prior draws of five tilts, some of them wild enough to leave downwards.
std::vector<State> draw_tilts(std::uint64_t seed, int count, double sd) {
  RandomStream random = stream(seed);
  std::vector<State> states(static_cast<std::size_t>(count), State(5));
  for (State& state : states)
    for (double& tilt : state)
      tilt = sd * random.gaussian();
  return states;
}

// --- Closed forms --------------------------------------------------------------------------------

TEST(Ball2d, AStraightDropStaysAboveItsPlaceAndItsBouncesShrinkBySquaredRestitution) {
  const Flight flight = fly(State::Zero(5));
  EXPECT_EQ(flight.x, 0);
  ASSERT_EQ(flight.hops.size(), 6u);
  double height = 4;  // of the fall: the centre starts at 4.5 D and touches at D / 2
  for (std::size_t i = 1; i < 6; ++i) {
    height *= kRestitution * kRestitution;
    EXPECT_NEAR(flight.hops[i].vy * flight.hops[i].vy / (2 * kGravity), height, 1e-12) << i;
    EXPECT_EQ(flight.hops[i].vx, 0);
  }
}

TEST(Ball2d, OneTiltedBounceHasItsClosedForm) {
  // Falling with speed v on a normal tilted by t: v' = v ((1 + e) cos t (sin t, cos t) - (0, 1)), and then a
  // parabola.
  for (const double tilt : {0.1, -0.1, 0.3, -0.5, 0.6}) {
    const double v = std::sqrt(2 * kGravity * 4);
    const double vx = v * (1 + kRestitution) * std::cos(tilt) * std::sin(tilt);
    const double vy = v * ((1 + kRestitution) * std::cos(tilt) * std::cos(tilt) - 1);
    ASSERT_GT(vy, 0);
    EXPECT_NEAR(fly(tilts_of({tilt})).x, vx * 2 * vy / kGravity, 1e-12) << tilt;
  }
}

TEST(Ball2d, PathsDoNotDependOnGravity) {
  for (const State& tilts : draw_tilts(151, 200, 0.2)) {
    const auto nothing = [](auto&&...) {};
    const double x = ball2d::bounce({.gravity = 9.81}, tilts, nothing, nothing);
    EXPECT_NEAR(ball2d::bounce({.gravity = 1.62}, tilts, nothing, nothing), x, 1e-9 * (1 + std::abs(x)));
  }
}

TEST(Ball2d, MirroredTiltsMirrorThePath) {
  for (const State& tilts : draw_tilts(152, 200, 0.2))
    EXPECT_EQ(fly(-tilts).x, -fly(tilts).x);
}

TEST(Ball2d, EnergyNeverGrows) {
  for (const State& tilts : draw_tilts(153, 2000, 0.4)) {
    const Flight flight = fly(tilts);
    double energy = 4.0 * kGravity;  // per mass, above the table
    for (std::size_t i = 1; i < flight.hops.size(); ++i) {
      const Hop& hop = flight.hops[i];
      const double now = 0.5 * (hop.vx * hop.vx + hop.vy * hop.vy);
      ASSERT_LE(now, energy * (1 + 1e-12)) << i;
      energy = now;
    }
  }
}

TEST(Ball2d, EveryCollisionReflectsAboutItsNormalAndScalesItsNormalPart) {
  // From one hop to the next: the tangential velocity stays, the normal one becomes -e times what it was.
  int grazing = 0;
  for (const State& tilts : draw_tilts(154, 2000, 0.4)) {
    const Flight flight = fly(tilts);
    for (std::size_t i = 0; i < 5; ++i) {
      const Hop &before = flight.hops[i], &after = flight.hops[i + 1];
      const Collision& at = flight.collisions[i];
      const double falling = before.vy - kGravity * before.duration;  // at the end of the hop
      const double normal_before = before.vx * at.sine + falling * at.cosine;
      const double normal_after = after.vx * at.sine + after.vy * at.cosine;
      const double along_before = before.vx * at.cosine - falling * at.sine;
      const double along_after = after.vx * at.cosine - after.vy * at.sine;
      ASSERT_NEAR(along_before, along_after, 1e-12);
      if (normal_before < 0) {
        ASSERT_NEAR(normal_after, -kRestitution * normal_before, 1e-12);
        ASSERT_NEAR(at.impulse, (1 + kRestitution) * -normal_before, 1e-12);
      } else {
        ++grazing;
        ASSERT_EQ(at.impulse, 0);
        ASSERT_NEAR(normal_after, normal_before, 1e-12);
      }
    }
  }
  EXPECT_GT(grazing, 10) << "a ball that already moves away has been seen";
}

TEST(Ball2d, ABallThatLeavesDownwardsCollidesAgainAtTheSamePlace) {
  // A wall-like normal sends the ball down; the next collision, upright, is at the same place and time.
  const Flight flight = fly(tilts_of({1.2, 0, 0}));
  ASSERT_LT(flight.hops[1].vy, 0);
  EXPECT_EQ(flight.hops[1].duration, 0);
  EXPECT_EQ(flight.collisions[1].x, flight.collisions[0].x);
  EXPECT_EQ(flight.collisions[1].time, flight.collisions[0].time);
  EXPECT_NEAR(flight.hops[2].vy, -kRestitution * flight.hops[1].vy, 1e-12);
  EXPECT_GT(flight.x, flight.collisions[1].x);
}

TEST(Ball2d, TheModelIsFiveIndependentTiltsOfTenDegrees) {
  const auto scenario = default_scenario();
  ASSERT_EQ(scenario->model().size(), 5u);
  for (const Variable& variable : scenario->model().variables()) {
    EXPECT_EQ(variable.prior.kind(), Distribution::Kind::gaussian);
    EXPECT_EQ(variable.prior.mean(), 0);
    EXPECT_NEAR(variable.prior.standard_deviation(), 10 * std::numbers::pi / 180, 1e-15);
    EXPECT_FALSE(variable.switch_index);
  }
}

// --- The animation -------------------------------------------------------------------------------

TEST(Ball2d, ScoreModeAndRecordedModeAgreeBitForBit) {
  const auto scenario = default_scenario();
  const auto performer = scenario->make_performer();
  Score score;
  score.measures.resize(scenario->measures().size());
  for (const State& tilts : draw_tilts(155, 2000, 0.25)) {
    performer->simulate(tilts, {}, score);
    const auto take = performer->perform(tilts);
    ASSERT_TRUE(identical(score, take.score));
    ASSERT_EQ(score.measures[0], fly(tilts).x);
    ASSERT_EQ(score.measures.back(), score.measures[0] - 1);
    const Flight flight = fly(tilts);
    for (std::size_t bounce = 1; bounce < flight.hops.size(); ++bounce)
      ASSERT_EQ(score.measures[bounce], flight.hops[bounce].vx < 0 ? -1 : 1);
  }
}

TEST(Ball2d, FramesFollowTheClosedFormAndEndAtRest) {
  const auto scenario = default_scenario();
  const auto performer = scenario->make_performer();
  for (const State& tilts : draw_tilts(156, 200, 0.3)) {
    const Flight flight = fly(tilts);
    const auto take = performer->perform(tilts);
    const Animation& animation = take.animation;
    const auto& positions = animation.tracks[0].positions;
    const double end = flight.hops.back().start + flight.hops.back().duration;
    ASSERT_GE(animation.duration(), end);
    ASSERT_LT(animation.duration(), end + 1 / animation.rate + 1e-12);
    for (Eigen::Index frame = 0; frame < positions.cols(); ++frame) {
      const double time = static_cast<double>(frame) / animation.rate;
      Eigen::Vector3d expected(flight.x, kRadius, 0);
      for (const Hop& hop : flight.hops) {
        const double since = time - hop.start;
        if (since < 0 || since > hop.duration) continue;
        expected = {hop.x + hop.vx * since, hop.y + hop.vy * since - 0.5 * kGravity * since * since, 0};
      }
      ASSERT_LT((positions.col(frame) - expected).norm(), 1e-9) << frame;
      ASSERT_GE(positions(1, frame), kRadius - 1e-9) << "below the table";
    }
    EXPECT_LT((positions.rightCols(1) - Eigen::Vector3d(flight.x, kRadius, 0)).norm(), 1e-9);
    EXPECT_EQ(animation.tracks[0].rest.position, Eigen::Vector3d(flight.x, kRadius, 0));
  }
}

TEST(Ball2d, ContactEventsAreTheCollisionsThatPushed) {
  const auto scenario = default_scenario();
  const auto performer = scenario->make_performer();
  for (const State& tilts : draw_tilts(157, 500, 0.3)) {
    const Flight flight = fly(tilts);
    const auto take = performer->perform(tilts);
    auto event = take.animation.events.begin();
    for (const Collision& collision : flight.collisions) {
      if (collision.impulse <= 0) continue;
      ASSERT_NE(event, take.animation.events.end());
      ASSERT_EQ(event->time, collision.time);
      ASSERT_NEAR(event->impulse, collision.impulse, 1e-12) << "of a ball of 1 kg";
      ASSERT_NEAR(event->normal.x(), collision.sine, 1e-15);
      // The point of contact lies a radius below the centre, along the normal that pushes the ball.
      const Eigen::Vector3d centre = event->position + kRadius * event->normal;
      ASSERT_LT((centre - Eigen::Vector3d(collision.x, kRadius, 0)).norm(), 1e-12);
      ++event;
    }
    EXPECT_EQ(event, take.animation.events.end());
    // The last contact, where the ball comes to rest, takes all of its fall.
    const Hop& last = flight.hops.back();
    if (last.duration > 0) {
      EXPECT_NEAR(flight.collisions.back().impulse, last.vy, 1e-12);
    }
  }
}

TEST(Ball2d, NoBallFliesForLongerThanTheBudget) {
  const auto with = [](double height, int collisions, double gravity) {
    return json{{"world", "ball2d"},
                {"model",
                 {{"drop_height", height},
                  {"collisions", collisions},
                  {"gravity", gravity},
                  {"restitution", 1},
                  {"normal_sd", 0.7}}},
                {"constraints", json::array()}};
  };
  for (const auto& [height, collisions] : {std::pair(4.5, 5), std::pair(100.0, 20), std::pair(0.6, 1)}) {
    std::string told;
    try {
      Scenario::read(with(height, collisions, 1e-7));
    } catch (const InvalidRequest& refused) {
      ASSERT_EQ(refused.faults().size(), 1u);
      EXPECT_EQ(refused.faults()[0].pointer, "/model/gravity");
      told = refused.faults()[0].detail;
    }
    const std::string before = "must be at least ";
    ASSERT_EQ(told.find(before), 0u) << told;
    const double least = std::stod(told.substr(before.size()));
    EXPECT_THROW(Scenario::read(with(height, collisions, 0.99 * least)), InvalidRequest);
    const auto scenario = Scenario::read(with(height, collisions, least));
    const auto performer = scenario->make_performer();
    RandomStream random = stream(158);
    State tilts;
    double longest = 0;
    for (int i = 0; i < 2000; ++i) {
      scenario->model().draw(random, tilts);
      longest = std::max(longest, performer->perform(tilts).animation.duration());
    }
    EXPECT_LE(longest, 300);
    EXPECT_GT(longest, 100) << "nor is much refused that would be shorter";
  }
  EXPECT_NO_THROW(Scenario::read(with(100, 20, 9.81)));
}

}  // namespace
}  // namespace retake::tests
