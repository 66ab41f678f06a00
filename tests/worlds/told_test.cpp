// What every registered world tells people: measures and variables with units and summaries, wishes as
// clauses, and what one try is called.
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

class WorldTells : public ::testing::TestWithParam<const World*> {
 protected:
  const World& world = *GetParam();

  std::vector<std::shared_ptr<const Scenario>> examples() const {
    std::vector<std::shared_ptr<const Scenario>> scenarios;
    for (const json& example : world.examples())
      scenarios.push_back(Scenario::read(example));
    return scenarios;
  }
};
INSTANTIATE_TEST_SUITE_P(All, WorldTells, ::testing::ValuesIn(worlds()),
                         [](const ::testing::TestParamInfo<const World*>& tested) {
                           return std::string(tested.param->name());
                         });

const std::set<std::string> kUnits = {"", "m", "s", "kg", "kg/m^3", "rad", "m/s", "rad/s", "N s"};

TEST_P(WorldTells, EveryMeasureHasAUnitAndASummaryAndListsAreOfOneKind) {
  for (const auto& scenario : examples()) {
    std::map<std::string, Measure> lists;
    for (const Measure& measure : scenario->measures()) {
      EXPECT_FALSE(measure.summary.empty()) << measure.name;
      EXPECT_TRUE(kUnits.contains(measure.unit)) << measure.name << ": " << measure.unit;
      if (measure.kind != Measure::Kind::number) {
        EXPECT_EQ(measure.unit, "") << measure.name;
      }
      if (measure.list.empty()) continue;
      const Measure& first = lists.try_emplace(measure.list, measure).first->second;
      EXPECT_EQ(measure.kind, first.kind) << measure.name;
      EXPECT_EQ(measure.unit, first.unit) << measure.name;
      EXPECT_EQ(measure.summary, first.summary) << measure.name;
    }
  }
}

/// Names that differ in numbers alone, such as those of a table's points.
TEST_P(WorldTells, VariablesOfOneKindHaveOneUnit) {
  for (const auto& scenario : examples()) {
    std::map<std::string, std::string> units;
    for (const Variable& variable : scenario->model().variables()) {
      std::string family = variable.name;
      std::erase_if(family, [](char character) { return character >= '0' && character <= '9'; });
      EXPECT_TRUE(kUnits.contains(variable.unit)) << variable.name << ": " << variable.unit;
      EXPECT_EQ(units.try_emplace(family, variable.unit).first->second, variable.unit) << variable.name;
    }
  }
}

TEST_P(WorldTells, EveryKindOfTermHasASentenceAndOneTryHasANoun) {
  EXPECT_NE(world.attempt(), "try");
  for (const TermKind& kind : world.term_kinds())
    EXPECT_TRUE(kind.sentence) << kind.kind;
  for (const auto& scenario : examples()) {
    const std::vector<std::string> wishes = wishes_of(scenario->document());
    ASSERT_EQ(wishes.size(), scenario->document().at("constraints").size());
    for (const std::string& wish : wishes) {
      EXPECT_GT(wish.size(), 8u) << wish;
      EXPECT_TRUE(wish.front() >= 'a' && wish.front() <= 'z') << wish;
      EXPECT_NE(wish.back(), '.') << wish;
    }
  }
}

}  // namespace
}  // namespace retake::tests
