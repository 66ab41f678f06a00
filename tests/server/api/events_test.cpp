// The stream of events: what it tells while chains run, its signs of life, how many there may be.
#include <chrono>
#include <memory>
#include <set>

#include "tests/server/api/event_stream.h"
#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

class ApiEvents : public DaemonTest {};

TEST_F(ApiEvents, Scenarios_chains_and_samples_are_told_while_a_chain_runs) {
  EventStream stream(daemon);
  ASSERT_EQ(stream.head().status, 200);
  EXPECT_EQ(stream.head().headers.at("content-type"), "text/event-stream");
  EXPECT_EQ(stream.head().headers.at("cache-control"), "no-store");
  const std::string scenario = daemon.add_scenario(prior_document());
  const Event added = stream.next_that([](const Event& event) { return event.name == "scenario"; });
  EXPECT_EQ(differences(added.data, "Scenario"), "");
  EXPECT_EQ(added.data["id"], scenario);

  const std::string chain = daemon.add_chains(scenario, json::object()).at(0);
  const Event running = stream.next_that(
      [&](const Event& event) { return event.name == "chain" && event.data["iteration"] > 0; });
  EXPECT_EQ(differences(running.data, "Chain"), "");
  EXPECT_EQ(running.data["id"], chain);
  const Event samples = stream.next_that([](const Event& event) { return event.name == "samples"; });
  EXPECT_EQ(samples.data["scenario"], scenario);
  EXPECT_GT(samples.data["count"], 0);
  ASSERT_GT(samples.data["latest"].size(), 0);
  EXPECT_EQ(differences(samples.data, "Latest"), "");

  // It goes on, and the last state is told.
  EXPECT_GT(stream
                .next_that([&](const Event& event) {
                  return event.name == "chain" && event.data["iteration"] > running.data["iteration"];
                })
                .data["iteration"],
            0);
  daemon.post("/v1/chains/" + chain + "/stop");
  EXPECT_EQ(stream
                .next_that([](const Event& event) {
                  return event.name == "chain" && event.data["state"] == "finished";
                })
                .data["id"],
            chain);
  daemon.remove("/v1/scenarios/" + scenario);
  EXPECT_EQ(stream.next_that([](const Event& event) { return event.name == "scenario-deleted"; }).data["id"],
            scenario);
}

TEST_F(ApiEvents, A_stream_opened_later_learns_what_happened_before) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 3);
  EventStream stream(daemon);
  std::set<std::string> told;
  stream.next_that([&](const Event& event) {
    told.insert(event.name);
    return event.name == "chain";
  });
  EXPECT_EQ(told, (std::set<std::string>{"scenario", "samples", "chain"}));
}

TEST_F(ApiEvents, An_idle_stream_gives_a_sign_of_life_about_every_second) {
  EventStream stream(daemon);
  ASSERT_EQ(stream.head().status, 200);
  // Ten signs of life; were they ten seconds apart, the deadline of a minute would pass. Busy cores may delay
  // each.
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 10; ++i) {
    const auto event = stream.next();
    ASSERT_TRUE(event.has_value());
    EXPECT_EQ(event->name, "");
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

TEST_F(ApiEvents, The_ninth_stream_is_refused_and_a_closed_one_makes_room) {
  std::vector<std::unique_ptr<EventStream>> streams;
  for (int i = 0; i < 8; ++i) {
    streams.push_back(std::make_unique<EventStream>(daemon));
    ASSERT_EQ(streams.back()->head().status, 200);
  }
  const Answer ninth = daemon.get("/v1/events");
  EXPECT_EQ(ninth.status, 429);
  EXPECT_EQ(ninth.header("content-type"), "application/problem+json");
  EXPECT_EQ(differences(ninth.json(), "Problem"), "");
  EXPECT_GE(std::stoi(ninth.header("retry-after")), 1);
  EXPECT_EQ(daemon.get("/v1/scenarios").status, 200) << "requests go on";
  streams.pop_back();
  EXPECT_TRUE(wait_until([&] { return EventStream(daemon).head().status == 200; }));
}

TEST_F(ApiEvents, Ending_the_daemon_ends_its_streams) {
  EventStream stream(daemon);
  ASSERT_EQ(stream.head().status, 200);
  EXPECT_EQ(daemon.terminate(), 0);
}

}  // namespace
}  // namespace retake
