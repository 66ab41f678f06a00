// How dice move: against closed forms on a plane, energy, coming to rest, fairness, step size.
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/dice/fixture.h"

namespace retake::tests {
namespace {

using dice::DiceSettings;
using dice::DieState;
using dice::EngineSettings;
using Eigen::Vector3d;

/// One die on a table that is as good as plane and alike everywhere.
class PlaneTable {
 public:
  PlaneTable(double restitution, double friction, const dice::DieShape& shape = die_shape())
      : shape_(shape),
        table_({.height_deviation = 1e-12,
                .restitution_mean = restitution,
                .restitution_deviation = 1e-12,
                .friction_mean = friction,
                .friction_deviation = 1e-12}),
        step_(engine_, shape_, table_) {
    table_.reset(content_);
  }

  /// Moves until something rests or the time [s] is over, and looks at every state.
  template <typename Look>
  void play(DieState& state, double time, Look&& look) {
    dice::MovingDie die{&state, 0};
    const auto steps = std::lround(time / engine_.time_step);
    for (std::int64_t step = 0; step < steps && !die.rests; ++step) {
      step_.advance(step, {&die, 1}, hits_, meetings_);
      look(state);
    }
  }
  double gravity() const { return engine_.gravity; }
  const std::vector<dice::Hit>& hits() const { return hits_; }

 private:
  EngineSettings engine_;
  dice::DieShape shape_;
  dice::Table table_;
  dice::TableContent content_;
  dice::DiceStep step_;
  std::vector<dice::Hit> hits_;
  std::vector<dice::Meeting> meetings_;
};

TEST(DicePhysics, ADieThatFallsFlatRebounds) {
  constexpr double kFall = 0.1;  // [m]
  for (const double restitution : {0.3, 0.5, 0.8}) {
    PlaneTable plane(restitution, 0.3);
    DieState state;
    state.position = {0, kDieSide / 2 + kFall, 0};
    double highest = 0;
    plane.play(state, 2, [&](const DieState& now) {
      if (!plane.hits().empty()) highest = std::max(highest, now.position.y() - kDieSide / 2);
    });
    // The step before the hit may be cut short by its whole length.
    const double error = 2 * std::sqrt(2 * plane.gravity() * kFall) * 0.001;
    EXPECT_NEAR(highest, restitution * restitution * kFall, error);
  }
}

TEST(DicePhysics, ASlidingDieIsSlowedByCoulombsFriction) {
  constexpr double kSpeed = 0.4;  // [m/s]
  for (const double friction : {0.1, 0.3}) {
    PlaneTable plane(0.5, friction);
    DieState state;
    state.position = {0, kDieSide / 2, 0};
    state.linear_velocity = {kSpeed, 0, 0};
    plane.play(state, 2, [](const DieState&) {});
    const double distance = kSpeed * kSpeed / (2 * friction * plane.gravity());
    EXPECT_NEAR(state.position.x(), distance, 0.03 * distance);
    EXPECT_NEAR(state.position.z(), 0, 1e-4);
    EXPECT_GT(state.rotation.w(), 0.999) << "slides without tipping over";
  }
}

TEST(DicePhysics, AFreeDieKeepsItsAngularMomentum) {
  const dice::DieShape shape({0.012, 0.016, 0.02}, 0.001, kDieDensity);
  PlaneTable plane(0.5, 0.3, shape);
  DieState state;
  state.position = {0, 10, 0};
  state.angular_velocity = {12, -7, 20};
  const auto momentum = [&](const DieState& now) -> Vector3d {
    const Vector3d turning = now.rotation.conjugate() * now.angular_velocity;
    return now.rotation * turning.cwiseProduct(shape.inertia());
  };
  const Vector3d before = momentum(state), spin_before = state.angular_velocity;
  const double energy_before = dice::energy(shape, state, plane.gravity());
  plane.play(state, 0.5, [](const DieState&) {});
  EXPECT_LT((momentum(state) - before).norm(), 1e-9 * before.norm());
  EXPECT_GT((state.angular_velocity - spin_before).norm(), 1) << "its axis wanders";
  // The fall itself: semi-implicit steps fall g dt t / 2 too far.
  const double too_far = plane.gravity() * plane.gravity() * 0.001 * 0.5 / 2 * shape.mass();
  EXPECT_NEAR(dice::energy(shape, state, plane.gravity()), energy_before, 1.05 * too_far);
}

TEST(DicePhysics, EnergyNeverGrows) {
  // What lifting dice out of the table adds: measured 2e-4 of the start's energy a throw on average, 1.2e-4
  // in one step and 2.3e-3 in one throw at most, of 3,000.
  DiceTable table;
  const dice::DieShape shape = die_shape();
  const EngineSettings engine;
  double mean = 0;
  constexpr int kThrows = 150;
  for (int i = 0; i < kThrows; ++i) {
    dice::Tumble run;
    ASSERT_EQ(table.tumbler.simulate(table.draw_scene(311, static_cast<std::uint64_t>(i)), nullptr, &run).end,
              dice::TumbleEnd::rests);
    const double start = dice::energy(shape, run.paths[0]->states.front(), engine.gravity);
    double before = start, gained = 0;
    for (const DieState& state : run.paths[0]->states) {
      const double now = dice::energy(shape, state, engine.gravity);
      EXPECT_LT(now - before, 3e-4 * start);
      gained += std::max(now - before, 0.0);
      before = now;
    }
    EXPECT_LT(gained, 5e-3 * start);
    EXPECT_LT(before, 0.2 * start) << "most of it is gone in the end";
    mean += gained / start / kThrows;
  }
  EXPECT_LT(mean, 4e-4);
}

TEST(DicePhysics, DiceThatCollideKeepTheirMomentum) {
  // Two dice meet in the air, so that nothing but each other can push them.
  const dice::DieShape shape = die_shape();
  const EngineSettings engine{.gravity = 0, .separation = 0};  // lifting apart would shift the axis
  dice::Table table({});
  const dice::TableContent content;
  table.reset(content);
  dice::DiceStep step(engine, shape, table);
  RandomStream random = stream(312);
  int met = 0;
  for (int i = 0; i < 100; ++i) {
    std::array<DieState, 2> dice;
    for (std::size_t die = 0; die < 2; ++die) {
      DieState& state = dice[die];
      state.position = {die == 0 ? -0.02 : 0.02, 1, 0};
      for (double& component : state.linear_velocity)
        component = 0.1 * random.gaussian();
      for (double& component : state.angular_velocity)
        component = 10 * random.gaussian();
      state.linear_velocity.x() = die == 0 ? 0.5 : -0.5;
      const double w = random.gaussian(), x = random.gaussian(), y = random.gaussian(), z = random.gaussian();
      state.rotation = Eigen::Quaterniond(w, x, y, z).normalized();
    }
    const auto momentum = [&]() -> Vector3d { return dice[0].linear_velocity + dice[1].linear_velocity; };
    const auto spin = [&] {
      Vector3d sum = Vector3d::Zero();
      for (const DieState& state : dice)
        sum += state.position.cross(state.linear_velocity) + shape.inertia().x() * state.angular_velocity;
      return sum;
    };
    const auto energies = [&] { return dice::energy(shape, dice[0], 0) + dice::energy(shape, dice[1], 0); };
    const Vector3d momentum_before = momentum(), spin_before = spin();
    const double energy_before = energies();
    std::array<dice::MovingDie, 2> moving = {dice::MovingDie{&dice[0], 0}, dice::MovingDie{&dice[1], 1}};
    std::vector<dice::Hit> hits;
    std::vector<dice::Meeting> meetings;
    for (int k = 0; k < 100; ++k)
      step.advance(k, moving, hits, meetings);
    EXPECT_LT((momentum() - momentum_before).norm(), 1e-12);
    EXPECT_LT((spin() - spin_before).norm(), 1e-9);
    EXPECT_LT(energies(), energy_before * (1 + 1e-12));
    for (const dice::Hit& hit : hits) {
      EXPECT_EQ(hit.die, 0);
      EXPECT_EQ(hit.other, 1);
      EXPECT_LT(hit.normal.x(), 0.5) << "pushes the first away from the second";
    }
    met += hits.empty() ? 0 : 1;
  }
  EXPECT_GT(met, 95);
}

// --- Statistics --------------------------------------------------------------------------------------

/// Where throws of one die end.
struct Ends {
  std::array<double, 6> faces{};  ///< by pips - 1
  double throws = 0, flat = 0;
  std::vector<double> distances, settling;
};

Ends ends_of(std::uint64_t seed, int throws, double rate = 1000, double shortening = 0) {
  DiceTable table({.random_paint = false}, {.time_step = 1 / rate}, die_shape(shortening));
  Ends ends;
  for (int i = 0; i < throws; ++i) {
    const dice::TumbleScene scene = table.draw_scene(seed, static_cast<std::uint64_t>(i));
    const dice::TumbleOutcome outcome = table.tumbler.simulate(scene, nullptr, nullptr);
    EXPECT_EQ(outcome.end, dice::TumbleEnd::rests);
    const DieState& rest = table.tumbler.states()[0];
    const int face = dice::top_face(rest.rotation);
    ++ends.throws;
    if (face > 0) {
      ++ends.flat;
      ++ends.faces[static_cast<std::size_t>(face - 1)];
    }
    const Vector3d moved = rest.position - scene.dice[0].state.position;
    ends.distances.push_back(std::hypot(moved.x(), moved.z()));
    ends.settling.push_back(static_cast<double>(outcome.step_count) / rate);
  }
  return ends;
}

double uniform_p(const Ends& ends) {
  return chi_square_p({ends.faces.begin(), ends.faces.end()}, std::vector<double>(6, ends.flat / 6));
}

/// Measured: 99.87 % lie flat, of 40,000.
void expect_flat(const Ends& ends) {
  EXPECT_GT(z_of_share(ends.flat, ends.throws, 0.997), -kLargestZ) << ends.flat / ends.throws;
}

TEST(DicePhysics, DiceRestFlatAndAreFair) {
  const Ends ends = ends_of(313, 6000);
  expect_flat(ends);
  EXPECT_GT(uniform_p(ends), kErrorRate);
}

TEST(SlowDicePhysics, ThirtyThousandDiceAreFair) {
  const Ends ends = ends_of(314, 30000);
  expect_flat(ends);
  EXPECT_GT(uniform_p(ends), kErrorRate);
  std::printf("flat %.4f, faces", ends.flat / ends.throws);
  for (const double count : ends.faces)
    std::printf(" %.4f", count / ends.flat);
  std::printf(", p = %.3g\n", uniform_p(ends));
}

TEST(SlowDicePhysics, AShortenedDieFavoursTheFacesOfItsShortAxis) {
  const Ends ends = ends_of(315, 60000, 1000, 0.03);
  const double favoured = ends.faces[0] + ends.faces[5];
  std::printf("shortened by 3 %%: its two faces come up in %.4f +- %.4f, a fair die's in 0.3333\n",
              favoured / ends.flat, std::sqrt(2.0 / 9 / ends.flat));
  EXPECT_GT(z_of_share(favoured, ends.flat, 1.0 / 3), kLargestZ);
  // As much on either side.
  EXPECT_LT(std::abs(z_of_share(ends.faces[0], favoured, 0.5)), kLargestZ);
  expect_flat(ends);
}

TEST(SlowDicePhysics, FinerStepsGiveTheSameStatistics) {
  // Finer steps roll a little farther, 4 % from 1 to 2 kHz and 2 % from there to 4 kHz, and take 2 % longer;
  // which face comes up is the same.
  const Ends coarse = ends_of(316, 20000);
  for (const double rate : {2000.0, 4000.0}) {
    const Ends fine = ends_of(316, 20000, rate);
    expect_flat(fine);
    EXPECT_GT(uniform_p(fine), kErrorRate);
    const Moments far = moments(coarse.distances), farther = moments(fine.distances);
    std::printf("%.0f Hz: distance %.2f +- %.2f cm (1 kHz: %.2f), settling %.3f s (%.3f), flat %.4f\n", rate,
                100 * farther.mean, 100 * farther.standard_error(), 100 * far.mean,
                moments(fine.settling).mean, moments(coarse.settling).mean, fine.flat / fine.throws);
    EXPECT_NEAR(farther.mean, far.mean, 0.08 * far.mean);
    EXPECT_NEAR(std::sqrt(farther.variance), std::sqrt(far.variance), 0.08 * std::sqrt(far.variance));
    EXPECT_NEAR(moments(fine.settling).mean, moments(coarse.settling).mean, 0.05);
  }
}

}  // namespace
}  // namespace retake::tests
