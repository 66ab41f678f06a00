// Scenario: every fault of a document at once, one canonical document for equal scenarios, and what chains
// get.
#include "worlds/scenario.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"
#include "tests/worlds/stub_world.h"

namespace retake::tests {
namespace {

std::vector<std::string> fault_pointers(const json& document) {
  return pointers(faults_of([&] { Scenario::read(document); }));
}

const char* const kWhole = R"({"world":"ball2d","title":"t","model":{"collisions":3},
                               "constraints":[{"kind":"rest_position","x":1}]})";

TEST(Scenario, SaysEveryFaultOfADocumentAtOnce) {
  const json document = json::parse(R"({"world":"ball2d","title":"","colour":1,"a/b":2,
    "model":{"collisions":2.5,"gravity":0,"spin":1},
    "constraints":[{"kind":"rest_position"},{"kind":"strike","x":1},7,{"x":1},
                   {"kind":"rest_position","x":2000,"sd":0,"tolerance":true,"y":1}]})");
  EXPECT_EQ(fault_pointers(document),
            (std::vector<std::string>{"/a~1b", "/colour", "/constraints/0/x", "/constraints/1/kind",
                                      "/constraints/2", "/constraints/3/kind", "/constraints/4/sd",
                                      "/constraints/4/tolerance", "/constraints/4/x", "/constraints/4/y",
                                      "/model/collisions", "/model/gravity", "/model/spin", "/title"}));
}

TEST(Scenario, WithoutItsWorldNothingElseIsJudged) {
  for (const char* text : {R"({})", R"({"world":"nowhere","model":7})", R"({"world":5,"title":9})"})
    EXPECT_EQ(fault_pointers(json::parse(text)), std::vector<std::string>{"/world"}) << text;
  EXPECT_EQ(fault_pointers(json::parse(R"({"world":"nowhere","x":1})")),
            (std::vector<std::string>{"/world", "/x"}));
  for (const json& document : {json::array(), json(1), json("ball2d"), json(nullptr)})
    EXPECT_EQ(fault_pointers(document), std::vector<std::string>{""}) << document;
}

/// What measures are, beside what they say of themselves.
struct NamedUnit {
  std::string name;
  Measure::Kind kind = Measure::Kind::number;
  std::string list{}, unit{};
  friend bool operator==(const NamedUnit&, const NamedUnit&) = default;
};
std::vector<NamedUnit> told(const Scenario& scenario) {
  std::vector<NamedUnit> all;
  for (const Measure& measure : scenario.measures())
    all.push_back({measure.name, measure.kind, measure.list, measure.unit});
  return all;
}

/// What the ball of ball2d measures by itself.
const std::vector<NamedUnit> kBallMeasures = {{.name = "x", .unit = "m"},
                                              {"bounce_1", Measure::Kind::integer, "bounces"},
                                              {"bounce_2", Measure::Kind::integer, "bounces"},
                                              {"bounce_3", Measure::Kind::integer, "bounces"},
                                              {"bounce_4", Measure::Kind::integer, "bounces"},
                                              {"bounce_5", Measure::Kind::integer, "bounces"}};

TEST(Scenario, ConstraintsAreRequiredButMayBeNone) {
  EXPECT_EQ(fault_pointers({{"world", "ball2d"}}), std::vector<std::string>{"/constraints"});
  for (const json& wrong : {json::object(), json(nullptr), json("none")})
    EXPECT_EQ(fault_pointers({{"world", "ball2d"}, {"constraints", wrong}}),
              std::vector<std::string>{"/constraints"});
  const auto scenario = read_scenario(R"({"world":"ball2d","constraints":[]})");
  EXPECT_EQ(scenario->document().at("constraints"), json::array());
  EXPECT_EQ(told(*scenario), kBallMeasures);
  const auto performer = scenario->make_performer();
  const auto take = performer->perform(State::Constant(5, 0.1));
  EXPECT_EQ(take.score.log_constraint, 0);
  EXPECT_TRUE(take.score.satisfied);
}

TEST(Scenario, ThirtyTwoConstraintsAreTheMost) {
  json document = json::parse(kWhole);
  const json term = document["constraints"][0];
  for (std::size_t count : {32, 33}) {
    document["constraints"] = std::vector<json>(count, term);
    EXPECT_EQ(fault_pointers(document).empty(), count == 32);
  }
}

TEST(Scenario, EqualScenariosHaveEqualDocuments) {
  const auto canonical = [](const char* text) { return read_scenario(text)->document().dump(); };
  const std::string expected = canonical(kWhole);
  for (
      const char* same :
      {R"({"constraints":[{"x":1.0,"kind":"rest_position"}],"model":{"collisions":3.0},"title":"t","world":"ball2d"})",
       R"({"world":"ball2d","title":"t","model":{"collisions":3,"drop_height":4.5,"gravity":9.81,"redraw_share":0.05},
            "constraints":[{"kind":"rest_position","x":1,"sd":0.1,"tolerance":1e-1}]})"})
    EXPECT_EQ(canonical(same), expected) << same;
  for (
      const char* other :
      {R"({"world":"ball2d","title":"u","model":{"collisions":3},"constraints":[{"kind":"rest_position","x":1}]})",
       R"({"world":"ball2d","title":"t","model":{"collisions":4},"constraints":[{"kind":"rest_position","x":1}]})",
       R"({"world":"ball2d","title":"t","model":{"collisions":3},"constraints":[{"kind":"rest_position","x":1.5}]})",
       R"({"world":"ball2d","title":"t","model":{"collisions":3},"constraints":[]})"})
    EXPECT_NE(canonical(other), expected) << other;
}

TEST(Scenario, MinusZeroIsZero) {
  EXPECT_EQ(read_scenario(R"({"world":"ball2d","constraints":[{"kind":"rest_position","x":-0.0}]})")
                ->document()
                .dump(),
            read_scenario(R"({"world":"ball2d","constraints":[{"kind":"rest_position","x":0}]})")
                ->document()
                .dump());
}

TEST(Scenario, ItsDocumentReadsBackAsItself) {
  json document = read_scenario(kWhole)->document();
  EXPECT_EQ(document.at("world_version"), 1);
  document.erase("world_version");
  const auto again = Scenario::read(document);
  document["world_version"] = 1;
  EXPECT_EQ(again->document().dump(), document.dump());
}

TEST(Scenario, MeasuresOfEqualTermsHaveUniqueNames) {
  const auto scenario = read_scenario(R"({"world":"ball2d","constraints":[
    {"kind":"rest_position","x":1,"tolerance":2},{"kind":"rest_position","x":-1,"tolerance":2},
    {"kind":"rest_position","x":0.5,"tolerance":2}]})");
  std::vector<NamedUnit> expected = kBallMeasures;
  for (const char* name : {"miss", "miss_2", "miss_3"})
    expected.push_back({.name = name, .unit = "m"});
  EXPECT_EQ(told(*scenario), expected);
  std::vector<std::string> names;
  for (const NamedUnit& measure : expected)
    names.push_back(measure.name);
  EXPECT_EQ(scenario->target(Ratios::exact)->measure_names, names);
  const auto performer = scenario->make_performer();
  const auto take = performer->perform(State::Constant(5, 0.1));
  const std::vector<double>& measures = take.score.measures;
  EXPECT_EQ(measures[6], measures[0] - 1);
  EXPECT_EQ(measures[7], measures[0] + 1);
  EXPECT_EQ(measures[8], measures[0] - 0.5);
}

TEST(Scenario, MeasuresKeepTheirKinds) {
  const auto scenario = read_stub_scenario({{"world", "stub"}, {"constraints", {{{"kind", "before"}}}}});
  EXPECT_EQ(told(*scenario), (std::vector<NamedUnit>{{"x"},
                                                     {"past_the_middle", Measure::Kind::flag},
                                                     {"passed", Measure::Kind::integer_set},
                                                     {"past_the_middle_2", Measure::Kind::flag}}));
}

TEST(Scenario, ListsOfEqualTermsHaveUniqueNames) {
  const auto scenario = read_scenario(R"({"world":"bowling","constraints":[
    {"kind":"order","events":[{"kind":"fall","body":"pin_1"},{"kind":"fall","body":"pin_2"}]},
    {"kind":"order","events":[{"kind":"fall","body":"pin_2"},{"kind":"fall","body":"pin_3"}]}]})");
  std::vector<NamedUnit> ordered = told(*scenario);
  ordered.erase(ordered.begin(), ordered.end() - 6);
  const auto number = Measure::Kind::number, integer = Measure::Kind::integer;
  EXPECT_EQ(ordered, (std::vector<NamedUnit>{{"out_of_order", integer},
                                             {"event_times_1", number, "event_times", "s"},
                                             {"event_times_2", number, "event_times", "s"},
                                             {"out_of_order_2", integer},
                                             {"event_times_1_2", number, "event_times_2", "s"},
                                             {"event_times_2_2", number, "event_times_2", "s"}}));
}

TEST(Scenario, ADefaultMayDependOnTheModel) {
  const auto limit = [](double length, const json& term) {
    return read_stub_scenario({{"world", "stub"}, {"model", {{"length", length}}}, {"constraints", {term}}})
        ->document()
        .at("constraints")[0]
        .at("limit");
  };
  EXPECT_EQ(limit(7, {{"kind", "before"}}), 7);
  EXPECT_EQ(limit(20, {{"kind", "before"}}), 20);
  EXPECT_EQ(limit(20, {{"kind", "before"}, {"limit", 3}}), 3);
}

TEST(Scenario, TermsAreMadeOfSoundModelsAlone) {
  const auto faults_with = [](const json& model, const json& terms) {
    const int made_before = stub_world().terms_made;
    auto found = pointers(faults_of([&] {
      read_stub_scenario({{"world", "stub"}, {"model", model}, {"constraints", terms}});
    }));
    return std::pair(std::move(found), stub_world().terms_made - made_before);
  };
  using Found = std::pair<std::vector<std::string>, int>;
  const json whole = {{"kind", "before"}}, beyond = {{"kind", "before"}, {"limit", 50}},
             wrong = {{"kind", "before"}, {"limit", -1}, {"colour", "red"}};
  EXPECT_EQ(faults_with({{"length", 20}}, {whole, beyond, wrong}),
            (Found{{"/constraints/1/limit", "/constraints/2/colour", "/constraints/2/limit"}, 2}));
  EXPECT_EQ(faults_with({{"length", 0}}, {whole, beyond, wrong}),
            (Found{{"/constraints/2/colour", "/constraints/2/limit", "/model/length"}, 0}));
  EXPECT_EQ(faults_with({{"length", 2}}, {whole, wrong}),
            (Found{{"/constraints/1/colour", "/constraints/1/limit", "/model/notches"}, 0}))
      << "what only the parameters together can tell";
}

TEST(Scenario, ConstraintIsTheProductOfItsTerms) {
  const auto scenario = read_scenario(R"({"world":"ball2d","constraints":[
    {"kind":"rest_position","x":1,"sd":0.5,"tolerance":0.01},{"kind":"rest_position","x":-1,"sd":2,"tolerance":1000}]})");
  const auto performer = scenario->make_performer();
  const auto take = performer->perform(State::Constant(5, 0.1));
  const double x = take.score.measures[0];
  EXPECT_NEAR(take.score.log_constraint, -0.5 * std::pow((x - 1) / 0.5, 2) - 0.5 * std::pow((x + 1) / 2, 2),
              1e-12);
  EXPECT_FALSE(take.score.satisfied) << "the first of two is not";
}

TEST(Scenario, PerformedAnimationsShowTheMarkersOfTheTerms) {
  const auto scenario = read_scenario(kWhole);
  const auto performer = scenario->make_performer();
  for (int again = 0; again < 2; ++again) {
    const auto take = performer->perform(State::Zero(3));
    const auto& bodies = take.animation.bodies;
    EXPECT_EQ(
        std::count_if(bodies.begin(), bodies.end(), [](const Body& body) { return body.name == "target"; }),
        1);
  }
}

TEST(Scenario, TitlesAreShortAndPrintable) {
  const auto faults_with = [](const json& title) {
    return fault_pointers({{"world", "ball2d"}, {"constraints", json::array()}, {"title", title}});
  };
  const std::vector<std::string> none, at_title{"/title"};
  EXPECT_EQ(faults_with("A strike, \u00e9\u4e2d"), none);
  EXPECT_EQ(faults_with(std::string(200, 'a')), none);
  EXPECT_EQ(faults_with(std::string(201, 'a')), at_title);
  for (const json& wrong : {json(""), json("a\nb"), json("tab\t"), json("\x7f"), json(std::string("\0", 1)),
                            json(5), json(nullptr), json::array({"a"})})
    EXPECT_EQ(faults_with(wrong), at_title) << wrong;
}

TEST(Scenario, WithoutATitleItHasTheSummaryOfItsWorld) {
  const auto scenario = read_scenario(R"({"world":"ball2d","constraints":[]})");
  EXPECT_EQ(scenario->title(), scenario->world().summary());
}

TEST(Scenario, BothRatiosWalkOnTheSameModel) {
  const auto scenario = read_scenario(kWhole);
  const auto exact = scenario->target(Ratios::exact), paper = scenario->target(Ratios::paper);
  EXPECT_NE(exact, paper);
  EXPECT_EQ(exact->model, paper->model);
  EXPECT_EQ(exact->measure_names, paper->measure_names);
}

}  // namespace
}  // namespace retake::tests
