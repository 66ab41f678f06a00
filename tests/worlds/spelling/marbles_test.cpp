// The model of a box of marbles and its proposals: p_w, its support, and the ratios.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"
#include "worlds/spelling/marbles.h"
#include "worlds/spelling/proposals.h"

namespace retake::tests {
namespace {

using spelling::Box;
using spelling::Drops;
using spelling::MarbleModel;
using spelling::Tessellation;

struct Marbles {
  Box box{7, 5, Tessellation::two};
  MarbleModel model{box, 10};

  State draw(std::uint64_t seed) const {
    RandomStream random({.seed = seed});
    return draw_state(*model.model(), random);
  }
  std::size_t active(const State& state) const {
    std::size_t count = 0;
    for (const auto& place : model.read(state).places)
      count += place ? 1 : 0;
    return count;
  }
};

TEST(SpellingMarbles, AStateHasASwitchAndADropAMarbleAndAnOffsetAVertexGroup) {
  const Marbles marbles;
  EXPECT_EQ(marbles.model.group_count(), 96u) << "two at each of 8 x 6 crossings";
  EXPECT_EQ(marbles.model.model()->size(), 10 * 3 + 96 * 3u);
  const State state = marbles.draw(1);
  const Drops drops = marbles.model.read(state);
  ASSERT_EQ(drops.places.size(), 10u);
  ASSERT_EQ(drops.offsets.size(), 96u);
  for (std::size_t marble = 0; marble < 10; ++marble) {
    EXPECT_EQ(drops.places[marble].has_value(), at(state, marbles.model.switch_of(marble)) == 1);
    if (!drops.places[marble]) continue;
    EXPECT_TRUE(marbles.box.drop_area().contains(drops.places[marble]->x(), drops.places[marble]->y()));
  }
  EXPECT_EQ(drops.offsets[95].z(), state[state.size() - 1]);
}

TEST(SpellingMarbles, ThePriorIsThePapers) {
  const Marbles marbles;
  const State state = marbles.draw(2);
  const Drops drops = marbles.model.read(state);
  EXPECT_NEAR(marbles.box.drop_area().area(), 0.136 * 0.092, 1e-12);
  double expected = 10 * std::log(0.5);
  for (const auto& place : drops.places)
    if (place) expected -= std::log(0.136 * 0.092);
  for (const Eigen::Vector3d& offset : drops.offsets)
    expected -= offset.squaredNorm() / (2 * 0.0001 * 0.0001) + 1.5 * std::log(2 * M_PI * 0.0001 * 0.0001);
  EXPECT_NEAR(marbles.model.model()->log_prior(state), expected, 1e-8);
}

TEST(SpellingMarbles, AnOffsetBeyondWhatTheBoxAllowsHasNoDensity) {
  const Marbles marbles;
  State state = marbles.draw(3);
  for (const double offset : {0.001, -0.001}) {
    at(state, marbles.model.offset_of(95) + 2) = offset;
    EXPECT_TRUE(std::isfinite(marbles.model.model()->log_prior(state)));
    at(state, marbles.model.offset_of(95) + 2) = 1.000001 * offset;
    EXPECT_FALSE(std::isfinite(marbles.model.model()->log_prior(state)));
  }
}

const Kernel& kernel(const KernelTable& table, const std::string& name) {
  for (const WeightedKernel& row : table.rows())
    if (row.name == name) return *row.kernel;
  ADD_FAILURE() << name;
  return *table.rows()[0].kernel;
}

TEST(SpellingMarbles, TheProposalsAreThoseOfB2) {
  const Marbles marbles;
  for (const Ratios ratios : {Ratios::exact, Ratios::paper}) {
    const KernelTable table = marbles.model.kernels(ratios);
    ASSERT_EQ(table.rows().size(), 4u);
    EXPECT_EQ(table.rows()[table.choose(0.0399)].name, "change_all");
    EXPECT_EQ(table.rows()[table.choose(0.0401)].name, "vertices");
    EXPECT_EQ(table.rows()[table.choose(0.3599)].name, "vertices");
    EXPECT_EQ(table.rows()[table.choose(0.3601)].name, "ball");
    EXPECT_EQ(table.rows()[table.choose(0.6799)].name, "ball");
    EXPECT_EQ(table.rows()[table.choose(0.6801)].name, "on_off");
  }
}

TEST(SpellingMarbles, OneBallMovesAndStaysInTheDropArea) {
  const Marbles marbles;
  const KernelTable table = marbles.model.kernels(Ratios::exact);
  State current = marbles.draw(4);
  for (std::size_t marble = 0; marble < 10; ++marble)  // in the middle, 46 mm from where it would wrap
    if (at(current, marbles.model.switch_of(marble)) == 1)
      current.segment<2>(static_cast<Eigen::Index>(marbles.model.drop_of(marble))).setZero();
  const Drops before = marbles.model.read(current);
  std::vector<int> moved(10, 0);
  double squared = 0;
  int near = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    State candidate = current;
    RandomStream random({.seed = 5, .iteration = i});
    EXPECT_EQ(kernel(table, "ball").propose(*marbles.model.model(), current, candidate, random), 0);
    const Drops after = marbles.model.read(candidate);
    EXPECT_EQ(after.offsets, before.offsets);
    int changes = 0;
    for (std::size_t marble = 0; marble < 10; ++marble) {
      EXPECT_EQ(after.places[marble].has_value(), before.places[marble].has_value());
      if (!after.places[marble] || *after.places[marble] == *before.places[marble]) continue;
      ++changes;
      ++moved[marble];
      EXPECT_TRUE(marbles.box.drop_area().contains(after.places[marble]->x(), after.places[marble]->y()));
      const double distance = (*after.places[marble] - *before.places[marble]).norm();
      if (distance < 0.03) squared += distance * distance, ++near;  // so that none has wrapped
    }
    EXPECT_EQ(changes, 1);
  }
  const auto active = static_cast<double>(marbles.active(current));
  ASSERT_GT(active, 2);
  for (std::size_t marble = 0; marble < 10; ++marble) {
    const double expected = before.places[marble] ? 4000 / active : 0;
    EXPECT_NEAR(moved[marble], expected, 5 * std::sqrt(expected)) << marble;
  }
  // A Gaussian distance of standard deviation 20 mm, cut at 1.5 of them: mean square 0.5516 of the whole.
  EXPECT_NEAR(squared / near / (0.02 * 0.02), 0.5516, 0.05);
}

TEST(SpellingMarbles, WithNoBallOnNoneMoves) {
  const Marbles marbles;
  State current = marbles.draw(6);
  for (std::size_t marble = 0; marble < 10; ++marble)
    for (std::size_t i = 0; i < 3; ++i)
      at(current, marbles.model.switch_of(marble) + i) = i == 0 ? 0 : kAbsent;
  State candidate = current;
  RandomStream random({.seed = 7});
  EXPECT_EQ(kernel(marbles.model.kernels(Ratios::exact), "ball")
                .propose(*marbles.model.model(), current, candidate, random),
            0);
  EXPECT_TRUE(identical(candidate, current));
}

TEST(SpellingMarbles, RatiosOfSwitchingAreTheExactOnesOrThePublishedOnes) {
  const Marbles marbles;
  const double area = marbles.box.drop_area().area();
  int switched_on = 0, switched_off = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const State current = marbles.draw(100 + i);
    const auto before = static_cast<double>(marbles.active(current));
    for (const Ratios ratios : {Ratios::exact, Ratios::paper}) {
      State candidate = current;
      RandomStream random({.seed = 8, .iteration = i});
      const double log_hastings = kernel(marbles.model.kernels(ratios), "on_off")
                                      .propose(*marbles.model.model(), current, candidate, random);
      const auto after = static_cast<double>(marbles.active(candidate));
      // p_w times the ratio: the area cancels; what is left is 0.75^(N - m - m') or its inverse.
      const double drops = (before - after) * std::log(area);
      const double sign = after > before ? -1 : 1;
      const double choices = after == before ? 0 : sign * (10 - before - after) * std::log(0.75);
      if (ratios == Ratios::paper || after != before) {
        EXPECT_NEAR(log_hastings + drops, ratios == Ratios::exact ? choices : 0, 1e-9);
      }
      switched_on += after > before;
      switched_off += after < before;
    }
  }
  EXPECT_GT(switched_on, 50);
  EXPECT_GT(switched_off, 50);
}

TEST(SpellingMarbles, ThePublishedChangeOfAllDrawsShortOffsetsAndCountsTheirDensity) {
  const Marbles marbles;
  const Model& model = *marbles.model.model();
  const State current = marbles.draw(9);
  const auto squares = [&](const State& state) {
    double sum = 0;
    for (const Eigen::Vector3d& offset : marbles.model.read(state).offsets)
      sum += offset.squaredNorm() / (0.0001 * 0.0001);
    return sum;
  };
  double published = 0, exact = 0;
  constexpr int kDraws = 200;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    State candidate = current;
    RandomStream random({.seed = 10, .iteration = i});
    const double ratio = kernel(marbles.model.kernels(Ratios::paper), "change_all")
                             .propose(model, current, candidate, random) +
                         model.log_prior(candidate) - model.log_prior(current);
    EXPECT_NEAR(ratio, (squares(current) - squares(candidate)) / 2, 1e-7);
    published += squares(candidate) / kDraws / 96;
    candidate = current;
    const double cancels = kernel(marbles.model.kernels(Ratios::exact), "change_all")
                               .propose(model, current, candidate, random) +
                           model.log_prior(candidate) - model.log_prior(current);
    EXPECT_NEAR(cancels, 0, 1e-7);
    exact += squares(candidate) / kDraws / 96;
  }
  EXPECT_NEAR(published, 1, 0.06);
  EXPECT_NEAR(exact, 3, 0.1);
}

}  // namespace
}  // namespace retake::tests
