// The stream of events: what it tells while chains run, its signs of life, how many there may be.
#include <chrono>
#include <memory>
#include <set>

#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

struct Event {
  std::string name;  ///< empty: a comment, which is a sign of life
  json data;
};

class EventStream {
 public:
  explicit EventStream(const Daemon& daemon) : client_(daemon.port()) {
    client_.send("GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n");
    head_ = client_.read_head(60);
  }
  const RawResponse& head() const { return head_; }

  /// The next event; nothing if none comes in `seconds`.
  std::optional<Event> next(double seconds = 60) {
    std::size_t end = text_.find("\n\n");
    for (; end == std::string::npos; end = text_.find("\n\n")) {
      const std::string chunk = client_.read_chunk(seconds);
      if (chunk.empty()) return std::nullopt;
      text_ += chunk;
    }
    const std::string block = text_.substr(0, end);
    text_.erase(0, end + 2);
    Event event;
    std::size_t begin = 0;
    while (begin < block.size()) {
      const std::size_t line_end = std::min(block.find('\n', begin), block.size());
      const std::string line = block.substr(begin, line_end - begin);
      if (line.starts_with("event: ")) event.name = line.substr(7);
      if (line.starts_with("data: ")) event.data = json::parse(line.substr(6));
      begin = line_end + 1;
    }
    return event;
  }
  /// The next event that satisfies the condition; an empty one if it does not come.
  template <typename Condition>
  Event next_that(Condition condition) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < deadline) {
      const auto event = next();
      if (!event) break;
      if (!event->name.empty() && condition(*event)) return *event;
    }
    return {};
  }

 private:
  RawClient client_;
  RawResponse head_;
  std::string text_;
};

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
  for (const json& sample : samples.data["latest"])
    EXPECT_EQ(differences(sample, "Sample"), "");

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
  EXPECT_EQ(ninth.status, 503);
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
