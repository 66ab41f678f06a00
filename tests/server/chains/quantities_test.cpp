// Quantities: variables, numbers and flags in one table, sets left out.
#include "server/chains/quantities.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/worlds/stub_world.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;

DrawRecord draw(double x, const json& past_the_middle) {
  const json measures = {{"x", 10 * x}, {"past_the_middle", past_the_middle}, {"passed", {1, 2}}};
  return {.measures = measures.dump(), .state = encode_state(State::Constant(1, x))};
}

TEST(Quantities, AreVariablesAndMeasuresButNotSets) {
  const auto scenario = tests::read_stub_scenario({{"world", "stub"}, {"constraints", json::array()}});
  const auto all = quantities(*scenario, {{draw(1, false), draw(2, true), draw(3, nullptr), draw(4, true)},
                                          {draw(5, true), draw(6, false)}});
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].name, "x") << "the variable";
  ASSERT_EQ(all[0].draws.size(), 2u);
  EXPECT_EQ(all[0].draws[0], Eigen::Vector4d(1, 2, 3, 4));
  EXPECT_EQ(all[0].draws[1], Eigen::Vector2d(5, 6)) << "each chain has its own length";
  EXPECT_EQ(all[1].name, "x") << "the measure";
  EXPECT_EQ(all[1].draws[1], Eigen::Vector2d(50, 60));
  EXPECT_EQ(all[2].name, "past_the_middle");
  EXPECT_EQ(all[2].draws[0][0], 0);
  EXPECT_EQ(all[2].draws[0][1], 1);
  EXPECT_TRUE(std::isnan(all[2].draws[0][2]));
  EXPECT_EQ(all[2].draws[1], Eigen::Vector2d(1, 0));
}

TEST(Quantities, MembersOfListsAreQuantitiesOfTheirOwn) {
  const auto scenario =
      Scenario::read({{"world", "ball2d"}, {"model", {{"collisions", 2}}}, {"constraints", json::array()}});
  const auto record = [&](const json& bounces) {
    return DrawRecord{
        .measures = json({{"bounces", bounces}}).dump(),
        .state = encode_state(State::Zero(static_cast<Eigen::Index>(scenario->model().size())))};
  };
  const auto all = quantities(*scenario, {{record({1, -1}), record({-1, nullptr}), record({1}), record(3)}});
  const auto named = [&](const std::string& name) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Quantity& q) { return q.name == name; });
    EXPECT_NE(found, all.end()) << name;
    return found->draws.at(0);
  };
  EXPECT_EQ(named("bounce_1").head(3), Eigen::Vector3d(1, -1, 1));
  EXPECT_TRUE(std::isnan(named("bounce_1")[3]));
  EXPECT_EQ(named("bounce_2")[0], -1);
  EXPECT_TRUE(named("bounce_2").tail(3).array().isNaN().all());
}

/// A column of draws, each of which keeps `memory` of the one before.
Quantity walked(const std::string& name, bool is_one_of_many, double memory, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Quantity made{.name = name, .is_one_of_many = is_one_of_many, .draws = {Eigen::VectorXd(400)}};
  double x = 0;
  for (Eigen::Index i = 0; i < 400; ++i) {
    x = memory * x + std::sqrt(1 - memory * memory) * normal(random);
    made.draws[0][i] = x;
  }
  return made;
}

TEST(Quantities, OfVeryManyTheSlowestAreJudgedAndThoseThatStandForThemselves) {
  std::mt19937 random(1);
  std::vector<Quantity> all = {walked("alone", false, 0, random)};
  for (int i = 0; i < 500; ++i)
    all.push_back(walked("quick_" + std::to_string(i), true, 0, random));
  all.push_back({.name = "constant", .is_one_of_many = true, .draws = {Eigen::VectorXd::Constant(400, 2)}});
  for (int i = 0; i < 5; ++i)
    all.insert(all.begin() + 70 * (i + 1), walked("slow_" + std::to_string(i), true, 0.97, random));
  std::vector<std::string> names;
  for (const Quantity& quantity : slowest(all)) {
    EXPECT_EQ(quantity.draws.at(0).size(), 400);
    names.push_back(quantity.name);
  }
  const auto has = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  EXPECT_EQ(names.size(), 121u);
  EXPECT_EQ(names.front(), "alone");
  EXPECT_FALSE(has("constant"));
  for (int i = 0; i < 5; ++i)
    EXPECT_TRUE(has("slow_" + std::to_string(i))) << i;

  // Few are judged all.
  const std::vector<Quantity> few(all.begin(), all.begin() + 121);
  ASSERT_EQ(slowest(few).size(), few.size());
  for (std::size_t i = 0; i < few.size(); ++i)
    EXPECT_EQ(slowest(few)[i].name, few[i].name);
}

}  // namespace
}  // namespace retake
