// The physics of spheres: rolling, bouncing, sliding and coming to rest as closed forms and energy say.
// Paper, section 5.3. Seeds are fixed.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/impulse/fixture.h"
#include "worlds/impulse/contact_step.h"

namespace retake::tests {
namespace {

using namespace impulse;
using Eigen::Vector3d;
using impulse::Scene;

const Settings kMarble;

/// A flat floor at y = 0.
TriangleSurface plane_floor() {
  TriangleMesh mesh;
  mesh.planes = {{Vector3d::UnitY(), 0}};
  return TriangleSurface(std::make_shared<TriangleIndex>(std::move(mesh), kMarble.radius));
}

/// The same of triangles of 1 cm, a metre long along x.
TriangleSurface triangle_floor() {
  TriangleMesh mesh;
  constexpr int kLong = 100, kWide = 30;
  for (int z = 0; z <= kWide; ++z)
    for (int x = 0; x <= kLong; ++x)
      mesh.vertices.push_back({{0.01 * x - 0.05, 0, 0.01 * z - 0.15}});
  for (int z = 0; z < kWide; ++z)
    for (int x = 0; x < kLong; ++x) {
      const auto a = static_cast<std::uint32_t>(z * (kLong + 1) + x), b = a + 1, c = a + kLong + 1, d = c + 1;
      mesh.triangles.push_back({a, c, d});
      mesh.triangles.push_back({a, d, b});
    }
  return TriangleSurface(std::make_shared<TriangleIndex>(std::move(mesh), kMarble.radius));
}

/// Steps one sphere alone; `watch` sees every state.
template <typename Watch>
SphereState roll(const Settings& settings, const Surface& surface, SphereState state, int steps,
                 const Watch& watch) {
  ContactStep contacts(settings);
  for (int i = 0; i < steps; ++i) {
    contacts.clear();
    contacts.add(0, fall(settings, state));
    contacts.solve(surface);
    state = contacts.outcomes()[0].state;
    watch(state);
  }
  return state;
}
SphereState roll(const Settings& settings, const Surface& surface, const SphereState& state, int steps) {
  return roll(settings, surface, state, steps, [](const SphereState&) {});
}

/// Of a sphere of mass 1 [J].
double energy(const SphereState& state) {
  return state.linear_velocity.squaredNorm() / 2 +
         kMarble.radius * kMarble.radius * state.angular_velocity.squaredNorm() / 5 +
         kMarble.gravity * state.position.y();
}

// --- One sphere --------------------------------------------------------------------------------------------

TEST(ImpulsePhysics, ASphereRollsOverTriangulatedFloorAsOverAPlane) {
  Settings settings;
  settings.rolling_resistance = 0;
  const TriangleSurface triangles = triangle_floor();
  for (const double course : {0.0, 0.1, 0.23}) {
    const Vector3d along(std::cos(course), 0, std::sin(course));
    const SphereState start{.position = {0, settings.radius, -0.05},
                            .linear_velocity = 0.517 * along,
                            .angular_velocity = Vector3d::UnitY().cross(along) * 0.517 / settings.radius};
    double highest = 0;
    const SphereState end = roll(settings, triangles, start, 800, [&](const SphereState& state) {
      highest = std::max(highest, std::abs(state.position.y() - settings.radius));
    });
    EXPECT_NEAR(end.linear_velocity.norm(), 0.517, 0.001 * 0.517) << course;
    const Vector3d way = end.position - start.position;
    EXPECT_NEAR(std::atan2(way.z(), way.x()), course, 0.05 * std::numbers::pi / 180) << course;
    EXPECT_NEAR(std::atan2(end.linear_velocity.z(), end.linear_velocity.x()), course,
                0.05 * std::numbers::pi / 180);
    EXPECT_LT(highest, 2e-5) << course;
  }
}

TEST(ImpulsePhysics, ABounceKeepsWhatTheRestitutionSays) {
  const TriangleSurface floor = plane_floor();
  for (const double restitution : {0.2, 0.5, 0.9}) {
    Settings settings;
    settings.restitution = restitution;
    double before = 0, approach = 0, rebound = 0;
    roll(settings, floor, {.position = {0, 0.2, 0}}, 400, [&](const SphereState& state) {
      if (rebound == 0 && state.linear_velocity.y() > 0) {
        approach = -before;
        rebound = state.linear_velocity.y();
      }
      before = state.linear_velocity.y();
    });
    // The step of the bounce adds gravity before it.
    EXPECT_NEAR(rebound, restitution * (approach + settings.gravity * settings.time_step), 1e-9);
    EXPECT_NEAR(approach, std::sqrt(2 * settings.gravity * (0.2 - settings.radius)), 0.02);
  }
}

TEST(ImpulsePhysics, ASlidingSphereRollsAtFiveSeventhsOfItsSpeed) {
  Settings settings;
  settings.rolling_resistance = 0;
  const double speed = 0.7, rolls_after = 2 * speed / (7 * settings.friction * settings.gravity);
  double rolling_since = -1, time = 0;
  const SphereState end =
      roll(settings, plane_floor(), {.position = {0, settings.radius, 0}, .linear_velocity = {speed, 0, 0}},
           300, [&](const SphereState& state) {
             time += settings.time_step;
             const double slip = state.linear_velocity.x() + settings.radius * state.angular_velocity.z();
             if (rolling_since < 0 && slip < 1e-9) rolling_since = time;
           });
  EXPECT_NEAR(end.linear_velocity.x(), 5.0 / 7 * speed, 1e-6);
  EXPECT_NEAR(rolling_since, rolls_after, 2 * settings.time_step);
}

TEST(ImpulsePhysics, RollingResistanceSlowsARollingSphereDown) {
  const double speed = 0.5;
  const Settings settings;
  const SphereState end = roll(settings, plane_floor(),
                               {.position = {0, settings.radius, 0},
                                .linear_velocity = {speed, 0, 0},
                                .angular_velocity = {0, 0, -speed / settings.radius}},
                               1000);
  // Torque c r N and friction together: 5/7 c g.
  const double deceleration = 5.0 / 7 * settings.rolling_resistance * settings.gravity;
  EXPECT_NEAR(end.linear_velocity.x(), speed - deceleration, 0.01 * deceleration);
}

TEST(ImpulsePhysics, WhatIsSlowAndTouchesStaysForGoodAfterATenthOfASecond) {
  int steps = 0, still = 0;
  ContactStep contacts(kMarble);
  const TriangleSurface floor = plane_floor();
  SphereState state{.position = {0, kMarble.radius + 0.001, 0}};
  for (bool rests = false; !rests && steps < 1000; ++steps) {
    contacts.clear();
    contacts.add(0, fall(kMarble, state));
    contacts.solve(floor);
    state = contacts.outcomes()[0].state;
    rests = contacts.outcomes()[0].rests;
    still = state.quiet_steps;
  }
  EXPECT_EQ(still, 100);
  EXPECT_LT(steps, 300);
  EXPECT_EQ(state.linear_velocity, Vector3d::Zero());
  EXPECT_EQ(state.angular_velocity, Vector3d::Zero());
  EXPECT_NEAR(state.position.y(), kMarble.radius, 2e-5);
}

// --- Two spheres -------------------------------------------------------------------------------------------

TEST(ImpulsePhysics, ACollisionKeepsMomentumAndAngularMomentum) {
  Settings settings;
  settings.rolling_resistance = 0;
  const TriangleSurface nothing = plane_floor();
  RandomStream random = stream(551);
  const auto vector = [&](double size) {
    return Vector3d(size * random.gaussian(), size * random.gaussian(), size * random.gaussian());
  };
  for (int i = 0; i < 200; ++i) {
    SphereState a{.position = {0, 1, 0}, .linear_velocity = vector(1), .angular_velocity = vector(50)}, b = a;
    const Vector3d normal = vector(1).normalized();
    b.position += 1.999 * settings.radius * normal;
    b.linear_velocity = vector(1);
    b.angular_velocity = vector(50);
    const auto spin = [&](const SphereState& x, const SphereState& y) {
      return Vector3d(x.position.cross(x.linear_velocity) + y.position.cross(y.linear_velocity) +
                      0.4 * settings.radius * settings.radius * (x.angular_velocity + y.angular_velocity));
    };
    ContactStep contacts(settings);
    contacts.clear();
    const std::size_t first = contacts.add(0, a), second = contacts.add(1, b);
    contacts.add_pair(first, second);
    contacts.solve(nothing);
    const SphereState x = contacts.outcomes()[0].state, y = contacts.outcomes()[1].state;
    EXPECT_LT((x.linear_velocity + y.linear_velocity - a.linear_velocity - b.linear_velocity).norm(), 1e-12);
    // The lever of friction is a radius, half a part in a thousand more than half their distance.
    EXPECT_LT((spin(x, y) - spin(a, b)).norm(), 2e-5);
    EXPECT_LE(energy(x) + energy(y), energy(a) + energy(b) + 1e-3 * settings.radius * settings.gravity);
    const double approach = (b.linear_velocity - a.linear_velocity).dot(normal);
    const double after = (y.linear_velocity - x.linear_velocity).dot(normal);
    if (approach < -settings.restitution_speed) {
      EXPECT_NEAR(after, -settings.restitution * approach, 1e-9);
    } else {
      EXPECT_GE(after, approach - 1e-12);
    }
    // Both know of the hit.
    EXPECT_EQ(contacts.hits().size(), approach < -settings.restitution_speed ? 2u : 0u);
    for (const ContactStep::Hit& hit : contacts.hits())
      EXPECT_GT(hit.normal.dot(normal) * (hit.body == 0 ? -1 : 1), 0.999);
  }
}

// --- Many spheres ------------------------------------------------------------------------------------------

/// Energy of all that is born, and how deep anything is in anything, over whole runs.
struct Sanity {
  double most_won = 0;      ///< [m] of height of one marble, in one step
  double won = 0;           ///< [m] of height a marble, in a run
  double deepest_rest = 0;  ///< [m] that a marble at rest is in something
  double deepest = 0;       ///< [m] that a marble is in the box
};
Sanity check_runs(const Marbles& marbles, int count, std::uint64_t seed) {
  Sanity sanity;
  Resimulation resimulation({}, marbles.box.make_surface());
  const auto surface = marbles.box.make_surface();
  RandomStream random = stream(seed);
  double won = 0;
  for (int i = 0; i < count; ++i) {
    const Scene scene = draw_scene(marbles, random);
    impulse::Run run;
    resimulation.simulate(scene, nullptr, &run);
    surface->set_offsets(scene.offsets);
    std::vector<double> total(static_cast<std::size_t>(scene.latest_step) + 1), births(total.size());
    const auto depth = [&](const Vector3d& place) {
      SurfaceContacts contacts;
      surface->find_contacts(surface->region(place), place, contacts);
      return contacts.list().empty() ? 0 : contacts.list()[0].overlap;
    };
    for (std::size_t body = 0; body < run.motions.size(); ++body) {
      const Motion& motion = *run.motions[body];
      const auto birth = static_cast<std::size_t>(scene.bodies[body]->step);
      births[birth] += energy(motion.states.front());
      for (std::size_t step = birth; step < total.size(); ++step)
        total[step] += energy(motion.states[std::min(step - birth, motion.states.size() - 1)]);
      for (const SphereState& state : motion.states)
        sanity.deepest = std::max(sanity.deepest, depth(state.position));
      if (!motion.rests) continue;
      const Vector3d place = motion.states.back().position;
      sanity.deepest_rest = std::max(sanity.deepest_rest, depth(place));
      EXPECT_TRUE(marbles.box.interior().contains(place.x(), place.z()));
      EXPECT_GT(place.y(), kMarble.radius - spelling::kFloorDepth);
      for (std::size_t other = 0; other < body; ++other)
        if (run.motions[other]->rests)
          sanity.deepest_rest =
              std::max(sanity.deepest_rest,
                       2 * kMarble.radius - (run.motions[other]->states.back().position - place).norm());
    }
    for (std::size_t step = 1; step < total.size(); ++step) {
      const double gain = (total[step] - total[step - 1] - births[step]) / kMarble.gravity;
      sanity.most_won = std::max(sanity.most_won, gain);
      won += std::max(0.0, gain);
    }
  }
  sanity.won = won / (count * static_cast<double>(marbles.count));
  std::printf("%s: wins %.4f mm in a step, %.3f mm a marble; %.4f mm deep at rest, %.3f mm at most\n",
              marbles.name.c_str(), 1e3 * sanity.most_won, 1e3 * sanity.won, 1e3 * sanity.deepest_rest,
              1e3 * sanity.deepest);
  return sanity;
}

TEST(ImpulsePhysics, EnergyNeverGrowsAndNothingEndsInsideAnything) {
  // A rebound from two edges at once wins a little, of a fall of 64 mm.
  const Sanity sanity = check_runs(hi(), 40, 552);
  EXPECT_LT(sanity.most_won, 1e-3);
  EXPECT_LT(sanity.won, 3e-4);
  EXPECT_LT(sanity.deepest_rest, 5e-5);
  EXPECT_LT(sanity.deepest, 2e-3);
}

/// What is born inside another one is pushed out of it, and not through the box.
TEST(ImpulsePhysics, CrowdedMarblesStayInTheBox) {
  const Sanity sanity = check_runs(crowded(), 20, 553);
  EXPECT_LT(sanity.deepest_rest, 5e-5);
  EXPECT_LT(sanity.deepest, 4e-3);
}

// --- Statistics --------------------------------------------------------------------------------------------

/// Where marbles come to rest, from the same draws at every rate.
struct Settling {
  double same_bin = 0;  ///< share that stays in the bin under its drop
  double on_others = 0;
  double distance = 0;  ///< rms, in bins
  double time = 0;      ///< median, from drop to rest [s]
};
Settling settle(int runs, int rate_factor) {
  Marbles marbles = hi();
  Settings settings;
  settings.time_step /= rate_factor;
  Resimulation resimulation(settings, marbles.box.make_surface());
  marbles.interval *= rate_factor;
  Settling settling;
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) {
    RandomStream random = stream(554, static_cast<std::uint64_t>(i));
    Scene scene = draw_scene(marbles, random);
    scene.latest_step *= rate_factor;
    impulse::Run run;
    EXPECT_EQ(resimulation.simulate(scene, nullptr, &run).end, RunEnd::rests);
    for (std::size_t body = 0; body < run.motions.size(); ++body) {
      const Vector3d &from = scene.bodies[body]->place, &to = run.motions[body]->states.back().position;
      const auto bin = marbles.box.bin_of(to);
      settling.on_others += bin ? 0 : 1;
      settling.same_bin += bin && marbles.box.bin_of({from.x(), to.y(), from.z()}) == bin ? 1 : 0;
      settling.distance += std::pow(std::hypot(from.x() - to.x(), from.z() - to.z()) / spelling::kPitch, 2);
      times.push_back(run.motions[body]->step_count() * settings.time_step);
    }
  }
  const auto count = static_cast<double>(times.size());
  settling.same_bin /= count;
  settling.on_others /= count;
  settling.distance = std::sqrt(settling.distance / count);
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  settling.time = times[times.size() / 2];
  std::printf("%d kHz: %.3f in the bin under the drop, %.3f on others, %.3f bins moved, %.3f s\n",
              rate_factor, settling.same_bin, settling.on_others, settling.distance, settling.time);
  return settling;
}

TEST(SlowImpulsePhysics, SettlingDoesNotDependOnTheStep) {
  constexpr int kRuns = 1500;  // 15,000 marbles: standard errors 0.004, 0.0016 and about 0.007
  const Settling coarse = settle(kRuns, 1);
  for (const int factor : {2, 4}) {
    const Settling fine = settle(kRuns, factor);
    EXPECT_NEAR(fine.same_bin, coarse.same_bin, 0.02) << factor;
    EXPECT_NEAR(fine.on_others, coarse.on_others, 0.008) << factor;
    EXPECT_NEAR(fine.distance, coarse.distance, 0.04) << factor;
    EXPECT_NEAR(fine.time, coarse.time, 0.3) << factor;
  }
}

}  // namespace
}  // namespace retake::tests
