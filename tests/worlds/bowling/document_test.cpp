// Documents of the world bowling: what is refused, with its pointer, and what is filled in.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/bowling/fixture.h"

namespace retake::tests {
namespace {

using Pointers = std::vector<std::string>;

Pointers refusals(json model, json down) {
  return pointers(faults_of([&] { bowling_scenario(std::move(model), std::move(down)); }));
}

TEST(BowlingDocument, RefusesPinsThatDoNotExist) {
  EXPECT_EQ(refusals(json::object(), {1, 11}), Pointers{"/constraints/0/down/1"});
  EXPECT_EQ(refusals(json::object(), {0, 1}), Pointers{"/constraints/0/down/0"});
  EXPECT_EQ(refusals(json::object(), {1, 2.5}), Pointers{"/constraints/0/down/1"});
  EXPECT_EQ(refusals(json::object(), {1, "2"}), Pointers{"/constraints/0/down/1"});
  EXPECT_EQ(refusals(json::object(), 3), Pointers{"/constraints/0/down"});
  EXPECT_EQ(refusals({{"rack", {0, 1}}}, {1}), Pointers{"/model/rack/0"});
  EXPECT_EQ(refusals({{"rack", {3, 11}}}, {3}), Pointers{"/model/rack/1"});
}

TEST(BowlingDocument, RefusesPinsNamedTwice) {
  EXPECT_EQ(refusals(json::object(), {3, 1, 3}), Pointers{"/constraints/0/down/2"});
  EXPECT_EQ(refusals({{"rack", {6, 7, 6}}}, {6}), Pointers{"/model/rack/2"});
}

/// At the place that the client wrote, not at the place in the ordered set.
TEST(BowlingDocument, RefusesPinsThatAreNotInTheRack) {
  EXPECT_EQ(refusals({{"rack", {6, 7}}}, {7, 10, 6}), Pointers{"/constraints/0/down/1"});
  EXPECT_EQ(refusals({{"rack", {6, 7}}}, {10, 1}),
            (Pointers{"/constraints/0/down/0", "/constraints/0/down/1"}));
  const auto faults = faults_of([] { bowling_scenario({{"rack", {6, 7}}}, {7, 10}); });
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults.begin()->second.find("10"), std::string::npos) << faults.begin()->second;
}

TEST(BowlingDocument, RefusesRacksWithoutPinsAndUnknownFields) {
  EXPECT_EQ(refusals({{"rack", json::array()}}, json::array()), Pointers{"/model/rack"});
  EXPECT_EQ(refusals({{"release", "underarm"}}, {1}), Pointers{"/model/release"});
  EXPECT_EQ(refusals({{"wind", 3}}, {1}), Pointers{"/model/wind"});
  EXPECT_EQ(refusals({{"lane_friction", 0}}, {1}), Pointers{"/model/lane_friction"});
  EXPECT_EQ(refusals({{"oil_length", 30}}, {1}), Pointers{"/model/oil_length"});
  EXPECT_EQ(refusals({{"cushion_restitution", 1.5}}, {1}), Pointers{"/model/cushion_restitution"});
  json document = bowling_document(json::object(), {1});
  document["constraints"][0]["log_lambda"] = 0;
  document["constraints"][0]["up"] = 3;
  EXPECT_EQ(pointers(faults_of([&] { Scenario::read(document); })),
            (Pointers{"/constraints/0/log_lambda", "/constraints/0/up"}));
  document["constraints"][0] = {{"kind", "pins"}};
  EXPECT_EQ(pointers(faults_of([&] { Scenario::read(document); })), Pointers{"/constraints/0/down"});
}

TEST(BowlingDocument, ReportsEveryFaultAtOnce) {
  EXPECT_EQ(refusals({{"rack", {0, 1}}, {"release", "underarm"}}, {11}),
            (Pointers{"/constraints/0/down/0", "/model/rack/0", "/model/release"}));
}

TEST(BowlingDocument, FillsInWhatIsNotSaid) {
  const json document = strike()->document();
  EXPECT_EQ(document.at("model").at("rack"), json(kFullRack));
  EXPECT_EQ(document.at("model").at("release"), "paper");
  EXPECT_EQ(document.at("model").at("lane_friction"), 0.12);
  EXPECT_EQ(document.at("model").at("oil"), false);
  EXPECT_EQ(document.at("model").at("pit_cushion"), false);
  EXPECT_EQ(document.at("constraints").at(0).at("log_lambda"), 2.5);
}

TEST(BowlingDocument, TheSoftnessFitsTheRack) {
  const auto log_lambda = [](json model, json down) {
    return bowling_scenario(std::move(model), std::move(down))
        ->document()
        .at("constraints")
        .at(0)
        .at("log_lambda")
        .get<double>();
  };
  EXPECT_EQ(log_lambda({{"rack", {6, 7}}}, {6, 7}), 5);
  EXPECT_EQ(log_lambda({{"rack", {10}}}, {10}), 5);
  EXPECT_EQ(log_lambda({{"rack", {1, 2, 3}}}, {2}), 2.5);
  json document = bowling_document({{"rack", {10}}}, {10});
  document["constraints"][0]["log_lambda"] = 1.5;
  EXPECT_EQ(Scenario::read(document)->document().at("constraints").at(0).at("log_lambda"), 1.5);
}

TEST(BowlingDocument, EqualWishesAreOneDocument) {
  const json one = bowling_scenario({{"rack", {7, 6}}}, {7, 6})->document();
  EXPECT_EQ(one, bowling_scenario({{"rack", {6, 7}}}, {6, 7})->document());
  EXPECT_EQ(one.at("model").at("rack"), json({6, 7}));
  EXPECT_EQ(one.at("constraints").at(0).at("down"), json({6, 7}));
  EXPECT_EQ(Scenario::read([&] {
              json again = one;
              again.erase("world_version");
              return again;
            }())
                ->document(),
            one);
}

TEST(BowlingDocument, NothingNeedsToFall) {
  const auto scenario = bowling_scenario({{"rack", {7}}}, json::array());
  EXPECT_EQ(scenario->document().at("constraints").at(0).at("down"), json::array());
  const auto performer = scenario->make_performer();
  // Hardly a ball reaches the corner.
  int satisfied = 0;
  for (const State& state : draw_states(scenario->model(), 251, 20))
    satisfied += performer->perform(state).score.satisfied;
  EXPECT_GT(satisfied, 5);
}

}  // namespace
}  // namespace retake::tests
