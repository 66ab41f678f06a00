// Views: measures of every kind as JSON, in samples and in traces.
#include "server/api/views.h"

#include <vector>

#include <gtest/gtest.h>

#include "server/chains/measures.h"
#include "tests/worlds/stub_world.h"

namespace retake {
namespace {

using nlohmann::json;

const std::vector<Measure> kMeasures = {{.name = "miss"},
                                        {.name = "strike", .kind = Measure::Kind::flag},
                                        {.name = "fallen", .kind = Measure::Kind::integer_set},
                                        {.name = "contacts", .kind = Measure::Kind::integer}};

TEST(Views, MeasuresAreNumbersBooleansAndLists) {
  const auto view = [](std::vector<double> values) { return measures_json(kMeasures, values); };
  EXPECT_EQ(view({0.5, 1, set_of(std::vector<int>{10, 2, 7}), 3}).dump(),
            R"({"contacts":3,"fallen":[2,7,10],"miss":0.5,"strike":true})");
  EXPECT_EQ(view({-2, 0, set_of({}), 0}).dump(), R"({"contacts":0,"fallen":[],"miss":-2.0,"strike":false})");
  EXPECT_EQ(view({kAbsent, kAbsent, kAbsent, kAbsent}).dump(),
            R"({"contacts":null,"fallen":null,"miss":null,"strike":null})");
  EXPECT_EQ(view({std::numeric_limits<double>::infinity(), 0, 0, 0})["miss"], nullptr);
}

TEST(Views, MeasuresOfOneListAreOneList) {
  const std::vector<Measure> measures = {{.name = "miss"},
                                         {.name = "bin_1", .list = "bin"},
                                         {.name = "bin_2", .list = "bin"},
                                         {.name = "place_1", .list = "place"}};
  EXPECT_EQ(measures_json(measures, std::vector<double>{1, 2, kAbsent, 4}),
            json({{"miss", 1.0}, {"bin", {2.0, nullptr}}, {"place", {4.0}}}));
}

TEST(Views, WhatMeasuresMeanIsToldOnceForAList) {
  const std::vector<Measure> measures = {
      {.name = "miss", .unit = "m", .summary = "How far off"},
      {.name = "bin_1", .kind = Measure::Kind::integer, .list = "bin", .summary = "In which bin"},
      {.name = "bin_2", .kind = Measure::Kind::integer, .list = "bin", .summary = "In which bin"},
      {.name = "met", .kind = Measure::Kind::flag, .summary = "Whether they met"},
      {.name = "fallen", .kind = Measure::Kind::integer_set, .summary = "Which fell"}};
  EXPECT_EQ(measures_json(measures), json::parse(R"([
    {"name":"miss","kind":"number","unit":"m","summary":"How far off"},
    {"name":"bin","kind":"list","of":"integer","unit":"","summary":"In which bin"},
    {"name":"met","kind":"flag","unit":"","summary":"Whether they met"},
    {"name":"fallen","kind":"set","unit":"","summary":"Which fell"}])"));
}

TEST(Views, UnitsOfVariablesThatDifferInNumbersAloneAreToldOnce) {
  const auto prior = Distribution::gaussian(0, 1);
  const Model model({{.name = "height_1_12", .unit = "m", .prior = prior},
                     {.name = "height_10_2", .unit = "m", .prior = prior},
                     {.name = "share", .unit = "", .prior = prior},
                     {.name = "spin", .unit = "rad/s", .prior = prior}});
  EXPECT_EQ(variable_units_json(model), json({{"height_#_#", "m"}, {"spin", "rad/s"}}));
}

TEST(Views, ATraceHasTheSameJsonAtEveryPoint) {
  const auto scenario = tests::read_stub_scenario({{"world", "stub"}, {"constraints", json::array()}});
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 3, .method = Method::rejection});
  Trace trace(scenario->measures());
  for (int i = 0; i < 200; ++i) {
    chain.step(*performer);
    trace.record(chain);
  }
  const json view = trace_json(trace, scenario->measures(), 1000);
  int none = 0;
  ASSERT_EQ(view["x"].size(), 200u);
  for (std::size_t i = 0; i < 200; ++i) {
    const double x = view["x"][i];
    EXPECT_EQ(view["past_the_middle"][i], json(x > 5));
    const json passed = x > 3 ? json({1, 2, 3}) : x > 2 ? json({1, 2}) : x > 1 ? json({1}) : json(nullptr);
    EXPECT_EQ(view["passed"][i], passed) << x;
    none += passed.is_null();
  }
  EXPECT_GT(none, 0);
}

TEST(Views, OddsSayWhatTheyAreKnownBy) {
  EXPECT_EQ(odds_json({}), nullptr);
  const json none = odds_json({.basis = OddsBasis::rejection, .draws = 12000});
  EXPECT_EQ(none["probability"], 0);
  EXPECT_EQ(none["low"], 0);
  EXPECT_NEAR(none["high"].get<double>(), 3.69 / 12000, 1e-6) << "-log 0.025";
  EXPECT_EQ(none["basis"], "rejection");
  EXPECT_EQ(none["draws"], 12000);
  EXPECT_EQ(none["hits"], 0);
  const json learned = odds_json(
      {.basis = OddsBasis::learned, .draws = 100, .hits = 20, .sum = 0.5, .squares = 0.02, .largest = 0.05});
  EXPECT_EQ(learned["probability"], 0.005);
  EXPECT_LT(learned["low"], 0.005);
  EXPECT_GT(learned["high"], 0.005);
  EXPECT_EQ(learned["basis"], "learned");
}

TEST(Views, DifficultyIsCommonRareOrNothingYet) {
  EXPECT_EQ(difficulty_json(std::nullopt), nullptr);
  EXPECT_EQ(difficulty_json(PilotTally{}), nullptr) << "without a draw nothing is known";
  const json common = difficulty_json(PilotTally{.draws = 5000, .hits = 50, .seconds = 0.5});
  EXPECT_EQ(common["verdict"], "common");
  EXPECT_EQ(common["one_in"], 100);
  EXPECT_LT(common["at_least"], 100);
  EXPECT_EQ(common["seconds"], 0.5);
  const json rare = difficulty_json(PilotTally{.draws = 5000, .hits = 49, .seconds = 1});
  EXPECT_EQ(rare["verdict"], "rare");
  const json nothing = difficulty_json(PilotTally{.draws = 12000, .hits = 0, .seconds = 1});
  EXPECT_EQ(nothing["verdict"], "nothing-yet");
  EXPECT_EQ(nothing["one_in"], nullptr);
  EXPECT_NEAR(nothing["at_least"].get<double>(), 12000 / 3.69, 2);
}

TEST(Views, AChainSaysWhetherItsWorldGuidesIt) {
  const auto guided = [](const json& document, Method method) {
    ChainRecord chain;
    chain.method = to_string(method);
    return chain_json(chain, Scenario::read(document).get()).at("guided").get<bool>();
  };
  const json word = {{"world", "spelling"}, {"constraints", {{{"kind", "spell"}, {"text", "I"}}}}};
  EXPECT_TRUE(guided(word, Method::conditional));
  EXPECT_FALSE(guided(word, Method::tempering));
  const json rest = {{"world", "ball2d"}, {"constraints", {{{"kind", "rest_position"}, {"x", 1}}}}};
  EXPECT_FALSE(guided(rest, Method::conditional)) << "it learns";
  EXPECT_FALSE(chain_json({}, nullptr).contains("guided")) << "nobody knows";
}

TEST(Views, PhasesAndWhatWasFoundMeanwhileAreTold) {
  ChainRecord chain;
  EXPECT_EQ(chain_json(chain, nullptr)["phase"], "sampling");
  EXPECT_EQ(chain_json(chain, nullptr)["effective_samples"], nullptr);
  chain.counters.is_learning = true;
  chain.counters.effective_samples = 8.5;
  chain.counters.skipped_seconds = 2.5;
  chain.stop.ess = 30;
  const json view = chain_json(chain, nullptr);
  EXPECT_EQ(view["phase"], "exploring");
  EXPECT_EQ(view["effective_samples"], 8.5);
  EXPECT_EQ(view["skipped_seconds"], 2.5);
  EXPECT_EQ(view["stop"], json({{"ess", 30}}));
  SampleRecord sample;
  EXPECT_EQ(sample_json(sample)["learning"], false);
  sample.weight = 0;
  EXPECT_EQ(sample_json(sample)["learning"], true);
}

TEST(Views, DiagnosticsLeaveOutWhatIsNotKnown) {
  Health health;
  json view = diagnostics_json(health);
  EXPECT_EQ(view["effective"], nullptr);
  EXPECT_EQ(view["saved"]["share"], nullptr);
  health.quantities = {{.name = "x",
                        .unit = "m",
                        .together = {1.01, 90, kAbsent, 2, 3},
                        .ess_within = 120,
                        .ess_across = kAbsent}};
  health.effective = {.samples = 90, .quantity = "x", .within = 120, .per_cpu_minute = {}};
  health.odds = {.basis = OddsBasis::ladder, .draws = 10};
  health.first_sample_seconds = 0.5;
  health.eta_seconds = 12;
  health.simulated_seconds = 30;
  health.skipped_seconds = 10;
  health.swaps = {{.chain = "c", .low = 0.25, .high = 1, .proposed = 8, .accepted = 3}};
  view = diagnostics_json(health);
  EXPECT_EQ(view["quantities"][0],
            json::parse(R"({"name":"x","unit":"m","rhat":1.01,"ess_bulk":90.0,"ess_tail":null,
    "ess_within":120.0,"ess_across":null,"mean":2.0,"sd":3.0})"));
  EXPECT_EQ(view["effective"],
            json::parse(R"({"samples":90.0,"quantity":"x","within":120.0,"per_cpu_minute":null})"));
  EXPECT_EQ(view["odds"]["basis"], "ladder");
  EXPECT_EQ(view["first_sample"], json({{"seconds", 0.5}}));
  EXPECT_EQ(view["eta_seconds"], 12);
  EXPECT_EQ(view["saved"]["share"], 0.25);
  EXPECT_EQ(view["swaps"][0],
            json::parse(R"({"chain":"c","low":0.25,"high":1.0,"proposed":8,"accepted":3})"));
}

}  // namespace
}  // namespace retake
