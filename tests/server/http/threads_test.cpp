// HttpServer's threads: many clients, and stopping at any moment. Runs under ThreadSanitizer.
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/http/server.h"
#include "server/http/settings.h"
#include "tests/server/http/test_routes.h"
#include "tests/server/raw_client.h"

namespace retake {
namespace {

using nlohmann::json;
using test::ask;
using test::get;
using test::post;
using test::RawClient;
using test::RunningServer;

TEST(ThreadsHttp, ManyClientsAtOnce) {
  RunningServer server;
  std::atomic<int> answered{0};
  std::vector<std::thread> clients;
  for (int c = 0; c < 8; ++c)
    clients.emplace_back([&, c] {
      RawClient client(server.port());
      for (int i = 0; i < 100; ++i) {
        const std::string body = "{\"c\":" + std::to_string(c * 1000 + i) + "}";
        if (json::parse(client.ask(post("/echo", body)).body).at("body") == body) ++answered;
        if (client.ask(get("/tagged", "Accept-Encoding: gzip\r\n")).status == 200) ++answered;
        server.server().counters();
      }
    });
  for (std::thread& client : clients)
    client.join();
  EXPECT_EQ(answered, 1600);
  EXPECT_EQ(server.server().counters().requests, 1600u);
}

TEST(ThreadsHttp, StopLetsRequestsUnderWayFinishAndEndsStreams) {
  RunningServer server;
  test::slow_requests = 0;
  std::vector<std::thread> clients;
  std::atomic<int> finished{0}, ended{0};
  for (int c = 0; c < 4; ++c) {
    clients.emplace_back([&] { finished += RawClient(server.port()).ask(get("/slow")).status == 200; });
    clients.emplace_back([&] { ended += RawClient(server.port()).ask(get("/events")).status == 200; });
  }
  RawClient idle(server.port());
  idle.ask(get("/healthz"));
  ASSERT_TRUE(test::eventually(
      [&] { return test::slow_requests == 4 && server.server().counters().open_streams == 4; }));
  const auto started = std::chrono::steady_clock::now();
  server.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - started, std::chrono::seconds(5));
  for (std::thread& client : clients)
    client.join();
  EXPECT_EQ(finished, 4);
  EXPECT_EQ(ended, 4);
  EXPECT_TRUE(idle.is_closed_within(5));
  EXPECT_THROW(RawClient(server.port()), std::runtime_error) << "still accepting";
}

TEST(ThreadsHttp, StartsAndStopsAtAnyMoment) {
  for (int i = 0; i < 20; ++i) {
    HttpSettings settings;
    settings.port = 0;
    settings.threads = 4;
    HttpServer server(settings);
    test::add_test_routes(server);
    const int port = server.bind();
    std::thread running([&] { server.run(); });
    std::thread client([&] {
      try {
        ask(port, get("/healthz"));
      } catch (const std::runtime_error&) {
      }
    });
    std::this_thread::sleep_for(std::chrono::microseconds(100 * i));
    std::thread second_stop([&] { server.stop(); });
    server.stop();
    second_stop.join();
    running.join();
    client.join();
  }
}

}  // namespace
}  // namespace retake
