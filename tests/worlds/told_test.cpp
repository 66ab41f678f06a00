// What every registered world tells people: measures with units and summaries, wishes as clauses, what one
// try is called, and what its physics saves. Seeds are fixed.
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
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

const std::set<std::string> kUnits = {"", "m", "s", "kg", "rad", "m/s", "rad/s", "N s"};

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

TEST_P(WorldTells, IntegersAreWhole) {
  for (const auto& scenario : examples()) {
    const auto performer = scenario->make_performer();
    RandomStream random = stream(161);
    for (int draw = 0; draw < 5; ++draw) {
      const auto take = performer->perform(draw_state(scenario->model(), random));
      if (!take.complete) continue;
      for (std::size_t i = 0; i < take.score.measures.size(); ++i) {
        const double value = take.score.measures[i];
        if (scenario->measures()[i].kind == Measure::Kind::integer && !std::isnan(value)) {
          EXPECT_EQ(value, std::floor(value)) << scenario->measures()[i].name;
        }
      }
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

// --- Savings -----------------------------------------------------------------------------------------

/// Counts the simulations that stop because `needed` is out of reach, which no watch asked for.
class CountsStops final : public Simulator {
 public:
  explicit CountsStops(Simulator& simulator) : simulator_(simulator) {}
  std::unique_ptr<Run> make_run() const override { return simulator_.make_run(); }
  SimulationOutcome simulate(const State& candidate, const SimulationRequest& request,
                             Score& score) override {
    const SimulationOutcome outcome = simulator_.simulate(candidate, request, score);
    stops += outcome.end == SimulationEnd::stopped && !request.watch;
    return outcome;
  }
  int stops = 0;

 private:
  Simulator& simulator_;
};

/// An example's model with the wish that contacts of two bodies come in the other order than in a draw; null
/// where no two bodies touch anything.
std::shared_ptr<const Scenario> against_a_draw(const json& example) {
  json document = example;
  document["constraints"] = json::array();
  const auto free = Scenario::read(document);
  RandomStream random = stream(162);
  const auto performer = free->make_performer();
  const auto take = performer->perform(draw_state(free->model(), random));
  std::vector<std::string> touched;
  for (const ContactEvent& event : take.animation.events) {
    const std::string name = take.animation.bodies[event.bodies[0]].name;
    if (std::find(touched.begin(), touched.end(), name) == touched.end()) touched.push_back(name);
  }
  if (touched.size() < 2) return nullptr;
  document["constraints"] = {
      {{"kind", "order"},
       {"events",
        {{{"kind", "contact"}, {"body", touched[1]}}, {{"kind", "contact"}, {"body", touched[0]}}}}}};
  return Scenario::read(document);
}

TEST_P(WorldTells, AWorldStopsEarlyIfAndOnlyIfItSaysSo) {
  constexpr int kSteps = 200;
  std::vector<std::shared_ptr<const Scenario>> wished = examples();
  for (const json& example : world.examples())
    if (auto scenario = against_a_draw(example)) wished.push_back(std::move(scenario));
  int stops = 0;
  for (const auto& scenario : wished) {
    const auto performer = scenario->make_performer();
    CountsStops counting(*performer);
    Chain chain(scenario->target(Ratios::exact), {.seed = 163, .method = Method::metropolis});
    for (int step = 0; step < kSteps && counting.stops == 0; ++step)
      chain.step(counting);
    stops += counting.stops;
    if (world.savings().stops_early && stops > 0) return;
  }
  EXPECT_EQ(stops > 0, world.savings().stops_early);
}

}  // namespace
}  // namespace retake::tests
