// What is uncertain in a throw and how it is changed, against the formulas of appendices A.1 and A.2 written
// out. Seeds are fixed; comparisons err with probability 1e-6.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/bowling/fixture.h"
#include "worlds/bowling/lane.h"

namespace retake::tests {
namespace {

using namespace bowling;

constexpr double kDegree = std::numbers::pi / 180;
// The State's order (A.1).
enum Index : Eigen::Index { kRadius, kDensity, kPlace, kHeight, kVelocityX, kVelocityZ, kSpin, kFirstPin };
constexpr double kLargest = 0.1085;

/// log p_w of A.1, up to a constant, with the product over pins that the printed sum stands for.
double log_paper(const State& s) {
  const auto square = [](double x) { return x * x; };
  double log = -0.5 * square((s[kHeight] - 1.1 * kLargest) / (0.1 * kLargest)) -
               0.5 * square(s[kVelocityX] - 7) - 0.5 * square(s[kVelocityZ] / 0.1) -
               0.5 * square(s[kSpin] / 0.2);
  for (Eigen::Index i = kFirstPin; i + 1 < s.size(); i += 2)
    log -= 0.5 * square(std::hypot(s[i], s[i + 1]) / 0.001);
  return log;
}

TEST(BowlingRelease, DensitiesAreThePapersFormula) {
  for (const std::vector<int>& rack : {kFullRack, std::vector<int>{6, 7}}) {
    const ReleaseModel releases(ReleaseStyle::paper, rack);
    const Model& model = *releases.model();
    ASSERT_EQ(model.size(), 7 + 2 * rack.size());
    const std::vector<State> states = draw_states(model, 241, 200);
    for (std::size_t i = 1; i < states.size(); ++i)
      EXPECT_NEAR(model.log_prior(states[i]) - model.log_prior(states[0]),
                  log_paper(states[i]) - log_paper(states[0]), 1e-9);
  }
}

TEST(BowlingRelease, StatesOutsideTheFormulasRangesAreImpossible) {
  const ReleaseModel releases(ReleaseStyle::paper, kFullRack);
  const Model& model = *releases.model();
  State state = draw_states(model, 242, 1)[0];
  state[kRadius] = 0.1;
  state[kHeight] = 0.1001;
  const auto log_with = [&](Eigen::Index variable, double value) {
    State other = state;
    other[variable] = value;
    return model.log_prior(other);
  };
  EXPECT_TRUE(std::isfinite(model.log_prior(state)));
  const double impossible = -std::numeric_limits<double>::infinity();
  EXPECT_EQ(log_with(kHeight, 0.0999), impossible) << "inside the lane";
  EXPECT_TRUE(std::isfinite(log_with(kHeight, 0.1))) << "on the lane";
  EXPECT_EQ(log_with(kRadius, 0.1002), impossible) << "inside the lane";
  EXPECT_EQ(log_with(kRadius, 0.79 * kLargest), impossible);
  EXPECT_EQ(log_with(kRadius, 1.01 * kLargest), impossible);
  EXPECT_EQ(log_with(kDensity, 0.79 * 1440), impossible);
  EXPECT_EQ(log_with(kDensity, 1441), impossible);
  EXPECT_EQ(log_with(kPlace, 0.5275), impossible) << "beside the lane";
  EXPECT_EQ(log_with(kPlace, -0.5275), impossible);
  EXPECT_EQ(log_with(kVelocityX, 0.4), impossible) << "hardly moves";
  EXPECT_EQ(log_with(kVelocityX, -7), impossible);
}

TEST(BowlingRelease, AStateMeansWhatItSays) {
  const ReleaseModel releases(ReleaseStyle::paper, {6, 7});
  State state(11);
  state << 0.1, 1200, 0.2, 0.12, 7.5, -0.05, 0.3, 0.001, -0.002, 0.003, 0.0005;
  const Release release = releases.read(state);
  EXPECT_EQ(release.ball.radius, 0.1);
  EXPECT_NEAR(release.ball.mass, 1200 * 4.0 / 3 * std::numbers::pi * 0.001, 1e-12);
  EXPECT_EQ(release.motion.position, Eigen::Vector3d(kFoulLine, 0.12, 0.2));
  EXPECT_EQ(release.motion.linear_velocity, Eigen::Vector3d(7.5, 0, -0.05));
  EXPECT_EQ(release.motion.angular_velocity, Eigen::Vector3d(0, 0.3, 0));
  ASSERT_EQ(release.offsets.size(), 2u);
  EXPECT_EQ(release.offsets[0], Eigen::Vector3d(0.001, 0, -0.002));
  EXPECT_EQ(release.offsets[1], Eigen::Vector3d(0.003, 0, 0.0005));
}

// --- Proposals
// -----------------------------------------------------------------------------------------------

TEST(BowlingRelease, KernelsHaveThePapersShares) {
  for (const ReleaseStyle style : {ReleaseStyle::paper, ReleaseStyle::modern}) {
    const KernelTable kernels = ReleaseModel(style, kFullRack).kernels(Ratios::exact);
    const std::vector<double> shares = {0.05, 0.075, 0.075, 0.2, 0.2, 0.2, 0.2};
    ASSERT_EQ(kernels.rows().size(), shares.size());
    double sum = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
      EXPECT_NEAR(kernels.rows()[i].weight, shares[i], 1e-12) << kernels.rows()[i].name;
      sum += kernels.rows()[i].weight;
    }
    EXPECT_NEAR(sum, 1, 1e-12);
  }
}

/// What one kernel does to one Variable over many proposals from one State.
struct Steps {
  double moved = 0;  ///< share of proposals
  double mean = 0, deviation = 0;
};
std::vector<Steps> steps_of(const Model& model, const Kernel& kernel, const State& from, int count) {
  std::vector<std::vector<double>> steps(model.size());
  for (int i = 0; i < count; ++i) {
    RandomStream random = stream(243, static_cast<std::uint64_t>(i), Purpose::proposal);
    State candidate = from;
    EXPECT_EQ(kernel.propose(model, from, candidate, random), 0) << "the step is symmetric";
    for (std::size_t k = 0; k < model.size(); ++k)
      steps[k].push_back(candidate[static_cast<Eigen::Index>(k)] - from[static_cast<Eigen::Index>(k)]);
  }
  std::vector<Steps> result;
  for (const std::vector<double>& all : steps) {
    const Moments of = moments(all);
    const auto moved = std::count_if(all.begin(), all.end(), [](double step) { return step != 0; });
    result.push_back({static_cast<double>(moved) / count, of.mean, std::sqrt(of.variance)});
  }
  return result;
}

TEST(BowlingRelease, StepsHaveThePapersSizes) {
  const ReleaseModel releases(ReleaseStyle::paper, kFullRack);
  const Model& model = *releases.model();
  const KernelTable kernels = releases.kernels(Ratios::exact);
  constexpr int kCount = 20000;
  State middle = draw_states(model, 244, 1)[0];
  middle[kRadius] = 0.9 * kLargest;
  middle[kDensity] = 0.9 * 1440;
  middle[kPlace] = 0;
  // A.2; the place wraps, so a Gaussian of 0.21 m folds back and is judged by itself below.
  const std::vector<std::map<Eigen::Index, double>> sizes = {{},
                                                             {{kRadius, 0.04 * kLargest}},
                                                             {{kDensity, 0.04 * 1440}},
                                                             {{kPlace, 0.0}, {kHeight, 0.05 * kLargest}},
                                                             {{kVelocityX, 0.5}, {kVelocityZ, 0.05}},
                                                             {{kSpin, 0.1}}};
  for (std::size_t row = 1; row < sizes.size(); ++row) {
    const auto steps = steps_of(model, *kernels.rows()[row].kernel, middle, kCount);
    for (std::size_t k = 0; k < model.size(); ++k) {
      const auto size = sizes[row].find(static_cast<Eigen::Index>(k));
      EXPECT_EQ(steps[k].moved, size == sizes[row].end() ? 0 : 1) << kernels.rows()[row].name << " " << k;
      if (size == sizes[row].end() || size->second == 0) continue;
      // Wrapping at 2.5 standard deviations moves the spread by less than 4 %; a sample's errs by 2.5 %.
      EXPECT_NEAR(steps[k].deviation / size->second, 1, 0.04) << kernels.rows()[row].name << " " << k;
      EXPECT_LT(std::abs(steps[k].mean), 5 * size->second / std::sqrt(kCount));
    }
  }
  // The pins: each with probability 1/2, in a random direction by a Gaussian distance of 0.5 mm.
  const auto steps = steps_of(model, *kernels.rows()[6].kernel, middle, kCount);
  for (std::size_t k = 0; k < model.size(); ++k) {
    if (k < static_cast<std::size_t>(kFirstPin)) {
      EXPECT_EQ(steps[k].moved, 0);
      continue;
    }
    EXPECT_LT(std::abs(z_of_share(steps[k].moved * kCount, kCount, 0.5)), kLargestZ);
    EXPECT_NEAR(steps[k].deviation, 0.0005 / std::sqrt(4), 0.00001) << "half of the time, half of the square";
  }
}

TEST(BowlingRelease, UniformVariablesWrapIntoTheirRanges) {
  const ReleaseModel releases(ReleaseStyle::paper, kFullRack);
  const Model& model = *releases.model();
  const KernelTable kernels = releases.kernels(Ratios::exact);
  State state = draw_states(model, 245, 1)[0];
  state[kRadius] = 0.999 * kLargest;
  state[kPlace] = 0.52;
  int wrapped_radius = 0, wrapped_place = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    for (const std::size_t row : {1u, 3u}) {
      RandomStream random = stream(246, 2 * i + (row == 1), Purpose::proposal);
      State candidate = state;
      kernels.rows()[row].kernel->propose(model, state, candidate, random);
      EXPECT_GE(candidate[kRadius], 0.8 * kLargest);
      EXPECT_LE(candidate[kRadius], kLargest);
      EXPECT_LE(std::abs(candidate[kPlace]), kLaneHalfWidth);
      wrapped_radius += candidate[kRadius] < 0.88 * kLargest;
      wrapped_place += candidate[kPlace] < -0.2;
    }
  }
  // Nearly half of the steps lead outside, and come in again at the other end.
  EXPECT_GT(wrapped_radius, 500);
  EXPECT_GT(wrapped_place, 400);
}

TEST(BowlingRelease, ThePapersRatiosDifferInTheRedrawAlone) {
  for (const ReleaseStyle style : {ReleaseStyle::paper, ReleaseStyle::modern}) {
    const ReleaseModel releases(style, {1, 7});
    const Model& model = *releases.model();
    const KernelTable exact = releases.kernels(Ratios::exact), paper = releases.kernels(Ratios::paper);
    ASSERT_EQ(exact.rows().size(), paper.rows().size());
    const std::vector<State> states = draw_states(model, 247, 50);
    for (std::size_t row = 0; row < exact.rows().size(); ++row) {
      EXPECT_EQ(exact.rows()[row].name, paper.rows()[row].name);
      EXPECT_EQ(exact.rows()[row].weight, paper.rows()[row].weight);
      for (std::size_t i = 0; i < states.size(); ++i) {
        State one = states[i], other = states[i];
        RandomStream first = stream(248, i, Purpose::proposal), second = stream(248, i, Purpose::proposal);
        const double hastings = exact.rows()[row].kernel->propose(model, states[i], one, first);
        const double printed = paper.rows()[row].kernel->propose(model, states[i], other, second);
        ASSERT_TRUE(identical(one, other)) << exact.rows()[row].name;
        EXPECT_EQ(printed, 0) << "all of these proposals are symmetric, the paper says";
        if (row == 0 && std::isfinite(model.log_prior(one))) {
          EXPECT_NEAR(hastings, model.log_prior(states[i]) - model.log_prior(one), 1e-9)
              << "the prior's own draw cancels p_w";
          EXPECT_NE(hastings, 0);
        }
        if (row > 0) {
          EXPECT_EQ(hastings, 0);
        }
      }
    }
  }
}

// --- The modern release
// ----------------------------------------------------------------------------------------

TEST(BowlingRelease, TheModernReleaseIsThatOfProfessionals) {
  const ReleaseModel releases(ReleaseStyle::modern, {1});
  constexpr int kCount = 20000;
  std::vector<double> speeds, turns, launches;
  for (const State& state : draw_states(*releases.model(), 249, kCount)) {
    const Release release = releases.read(state);
    const auto& v = release.motion.linear_velocity;
    speeds.push_back(v.norm());
    turns.push_back(release.motion.angular_velocity.norm());
    launches.push_back(std::atan2(v.z(), v.x()));
    EXPECT_EQ(v.y(), 0);
  }
  EXPECT_LT(std::abs(z_of_mean(speeds, 8.32)), kLargestZ);
  EXPECT_LT(std::abs(z_of_mean(turns, 45.7)), kLargestZ) << "436 revolutions a minute";
  EXPECT_LT(std::abs(z_of_mean(launches, 1.8 * kDegree)), kLargestZ) << "to the right";
  EXPECT_NEAR(436 * 2 * std::numbers::pi / 60, 45.7, 0.05);
}

TEST(BowlingRelease, TheMeanModernBallIsARightHandersHook) {
  const ReleaseModel releases(ReleaseStyle::modern, {1});
  // radius, density, place, height, speed, launch angle, revolutions, rotation, tilt, and the pin.
  State state(11);
  state << 0.108, 1300, 0.3, 0.119, 8.32, 1.8 * kDegree, 45.7, 45 * kDegree, 15 * kDegree, 0, 0;
  const Release release = releases.read(state);
  const auto& w = release.motion.angular_velocity;
  EXPECT_LT(w.z(), 0) << "it turns forwards";
  EXPECT_LT(w.x(), 0) << "and to the left";
  EXPECT_NEAR(std::asin(std::abs(w.y()) / w.norm()), 15 * kDegree, 1e-9);
  // Rotation counts from the direction of travel: the axis of a pure forward roll is at 0.
  const auto& v = release.motion.linear_velocity;
  const Eigen::Vector3d roll = v.cross(Eigen::Vector3d::UnitY()).normalized();
  const Eigen::Vector3d across(w.x(), 0, w.z());
  EXPECT_NEAR(std::acos(-across.normalized().dot(roll)), 45 * kDegree, 1e-9);
  const Roll rolled(release.ball, release.motion, {0.04, 0.2, kFoulLine + 12.192});
  const Motion entry = rolled.at(rolled.time_at(0));
  EXPECT_LT(entry.linear_velocity.z(), 0) << "it comes in from the right";
  EXPECT_LT(entry.position.z(), release.motion.position.z() + 18.288 * std::tan(1.8 * kDegree) - 0.3);
}

}  // namespace
}  // namespace retake::tests
