// What worlds show around what moves: it holds the motion, hides what would mislead, and is the same each
// time.
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"
#include "worlds/bowling/lane.h"
#include "worlds/dice/view.h"
#include "worlds/spelling/box.h"
#include "worlds/spelling/letters.h"
#include "worlds/spelling/view.h"

namespace retake::tests {
namespace {

using Eigen::Vector3d;

/// The first recording of a draw from the prior of a scenario without a wish.
Animation recording(const json& model, const char* world, std::uint64_t seed) {
  const auto scenario = Scenario::read({{"world", world}, {"model", model}, {"constraints", json::array()}});
  const auto performer = scenario->make_performer();
  RandomStream random = stream(seed);
  for (;;) {
    auto take = performer->perform(draw_state(scenario->model(), random));
    if (take.complete) return std::move(take.animation);
  }
}

const Body& body_of(const Animation& animation, const std::string& name) {
  const auto found = std::find_if(animation.bodies.begin(), animation.bodies.end(),
                                  [&](const Body& body) { return body.name == name; });
  EXPECT_NE(found, animation.bodies.end()) << name;
  return *found;
}

/// Of a box that stands still and is not turned.
Eigen::AlignedBox3d extent(const Body& body) {
  const Vector3d half = std::get<Box>(body.shape).half_extents;
  return {body.pose.position - half, body.pose.position + half};
}

TEST(BowlingView, ThePitIsShadedFromTheDeckToTheCushionHigherThanAPin) {
  const Animation shown = recording(json::object(), "bowling", 601);
  const Body& shade = body_of(shown, "pit_shade");
  EXPECT_EQ(shade.surface, Surface::shade);
  EXPECT_TRUE(shade.pose.rotation.isApprox(Eigen::Quaterniond::Identity())) << "darker along x";
  const Eigen::AlignedBox3d dark = extent(shade);
  EXPECT_DOUBLE_EQ(dark.min().x(), bowling::kDeckEnd) << "no pin that stands on the deck is in it";
  EXPECT_DOUBLE_EQ(dark.max().x(), bowling::kCushion);
  for (const double z : {-bowling::kWall, bowling::kWall})
    for (const double y : {bowling::kPitFloor, bowling::kPitFloor + 1.5 * bowling::kPinHeight})
      EXPECT_LT(dark.exteriorDistance(Vector3d(1.2, y, z)), 1e-12) << y << ", " << z;
  // Nothing of the pit is seen over it.
  EXPECT_LE(extent(body_of(shown, "masking")).min().y(), dark.max().y() + 1e-12);
  EXPECT_EQ(body_of(shown, "lane").surface, Surface::varnished);
}

TEST(DiceView, OneTrayHoldsAllThrowsAndTheirBumpsEndInItsFelt) {
  std::set<std::string> trays;
  for (const int dice : {1, 3})
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      const Animation shown = recording({{"dice", dice}}, "dice", 620 + seed);
      const Body& felt = body_of(shown, "felt");
      const Eigen::AlignedBox3d tray = extent(felt);
      const auto& bumps = std::get<HeightField>(shown.bodies.at(dice::table_body(dice)).shape);
      EXPECT_LT(tray.max().y(), *std::min_element(bumps.heights.begin(), bumps.heights.end()));
      EXPECT_EQ(felt.colour, shown.bodies.at(dice::table_body(dice)).colour) << "they are one cloth";
      for (const Track& track : shown.tracks) {
        EXPECT_GT(track.rest.position.x(), tray.min().x());
        EXPECT_LT(track.rest.position.x(), tray.max().x());
        EXPECT_LT(std::abs(track.rest.position.z()), tray.max().z());
      }
      for (const char* rim : {"rim_far", "rim_near", "rim_left", "rim_right"})
        EXPECT_TRUE(tray.exteriorDistance(extent(body_of(shown, rim))) < 1e-9) << rim << " closes the tray";
      trays.insert(::testing::PrintToString(Vector3d(tray.sizes().x(), 0, tray.sizes().z())));
      const Viewpoint view = dice::throw_viewpoint(shown);
      for (const Track& track : shown.tracks)
        EXPECT_TRUE(((track.rest.position - view.center).cwiseAbs() - view.half_extents).maxCoeff() < 0);
    }
  EXPECT_EQ(trays.size(), 1u) << "tiles show one place";
}

TEST(DiceView, TheTrayGrowsForAThrowThatLeavesIt) {
  const Animation usual = recording(json::object(), "dice", 700),
                  far = recording({{"speed", 2.5}}, "dice", 700);
  const Eigen::AlignedBox3d small = extent(body_of(usual, "felt")), large = extent(body_of(far, "felt"));
  EXPECT_GT(far.tracks[0].rest.position.x(), small.max().x());
  EXPECT_LT(far.tracks[0].rest.position.x(), large.max().x());
  EXPECT_NEAR(large.center().x(), small.center().x(), 1e-12);
}

TEST(SpellingView, EveryLetterHasItsOwnColourAndItsNeighboursOthers) {
  using namespace spelling;
  constexpr int kColumns = 40, kRows = 7;
  const spelling::Box box(kColumns, kRows, Tessellation::two);
  const auto pattern = lay_out("HOMEMADE", kColumns, kRows);
  ASSERT_TRUE(pattern);
  Animation shown;
  std::vector<std::size_t> marbles;
  std::vector<int> columns;
  // In an order that has nothing to do with the letters.
  for (std::size_t i = 0; i < box.bin_count(); ++i) {
    const std::size_t bin = 101 * i % box.bin_count();
    if (!pattern->designated[bin]) continue;
    const Rectangle opening = box.opening(bin);
    Track& track = shown.tracks.emplace_back();
    track.rest.position = {(opening.min_x + opening.max_x) / 2, kMarbleRadius, opening.min_z + kMarbleRadius};
    columns.push_back(static_cast<int>(bin) % kColumns);
    marbles.push_back(marbles.size());
  }
  ASSERT_EQ(marbles.size(), 85u);
  write_scene(box, std::vector<Vector3d>(box.group_count(), Vector3d::Zero()), marbles, shown);
  std::map<int, std::set<std::string>> colours;
  for (std::size_t marble = 0; marble < marbles.size(); ++marble) {
    EXPECT_EQ(shown.bodies[marble].surface, Surface::glass);
    colours[columns[marble]].insert(shown.bodies[marble].colour);
  }
  int letters = 0;
  for (auto column = colours.begin(); column != colours.end(); ++column) {
    EXPECT_EQ(column->second.size(), 1u) << "column " << column->first;
    const bool goes_on = column != colours.begin() && std::prev(column)->first == column->first - 1;
    if (goes_on) {
      EXPECT_EQ(column->second, std::prev(column)->second) << "column " << column->first;
    } else if (++letters > 1) {
      EXPECT_NE(column->second, std::prev(column)->second) << "column " << column->first;
    }
  }
  EXPECT_EQ(letters, 8);
}

TEST(BallView, TheTableStandsOnAFloorThatReachesFar) {
  const Animation shown = recording(json::object(), "ball2d", 710);
  EXPECT_EQ(shown.bodies[1].name, "table");
  EXPECT_DOUBLE_EQ(extent(shown.bodies[1]).max().y(), 0) << "the ball bounces on it";
  const Eigen::AlignedBox3d floor = extent(body_of(shown, "floor")),
                            plinth = extent(body_of(shown, "plinth"));
  EXPECT_NEAR(plinth.max().y(), extent(shown.bodies[1]).min().y(), 1e-12);
  EXPECT_NEAR(floor.max().y(), plinth.min().y(), 1e-12);
  EXPECT_GT(floor.sizes().x(), 10 * extent(shown.bodies[1]).sizes().x());
}

}  // namespace
}  // namespace retake::tests
