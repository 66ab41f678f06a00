// What the tests of this folder files share: the routes of the servers under test, such a server on a thread, and
// the shape of a refusal.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/http/message.h"
#include "server/http/problem.h"
#include "server/http/server.h"
#include "server/http/settings.h"
#include "tests/server/raw_client.h"

namespace retake::test {

/// Requests of /slow whose handler has begun, in this process.
inline std::atomic<int> slow_requests{0};

/// True as soon as the condition is; false if it is not within ten seconds.
inline bool eventually(const std::function<bool()>& condition) {
  for (int i = 0; i < 1000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

inline void add_test_routes(HttpServer& server) {
  server.route("GET", "/healthz", [](const HttpRequest&) { return json_response({{"ok", true}}); });
  server.route("GET", "/", [](const HttpRequest&) {
    HttpResponse page;
    page.content_type = "text/html; charset=utf-8";
    page.body = "<!doctype html>";
    page.headers = {{"Content-Security-Policy", "default-src 'self'"}};
    return page;
  });
  server.route("GET", "/echo", [](const HttpRequest& request) {
    return json_response({{"path", request.path},
                          {"query", request.query},
                          {"headers", request.headers},
                          {"remote_address", request.remote_address}});
  });
  server.route("POST", "/echo", [](const HttpRequest& request) {
    return json_response({{"size", request.body.size()}, {"body", request.body.substr(0, 100)}}, 201);
  });
  server.route("GET", "/things/{id}/parts/{part}",
               [](const HttpRequest& request) { return json_response(request.path_values); });
  server.route("GET", "/things/{id}",
               [](const HttpRequest& request) { return json_response(request.path_values); });
  server.route("GET", "/things/special", [](const HttpRequest&) {
    return json_response({{"special", true}});
  });
  server.route("DELETE", "/things/{id}", [](const HttpRequest&) {
    HttpResponse gone;
    gone.status = 204;
    return gone;
  });
  server.route("GET", "/tagged", [](const HttpRequest&) {
    HttpResponse response = json_response({{"text", std::string(2000, 'x')}});
    response.etag = "v1";
    return response;
  });
  server.route("GET", "/immutable", [](const HttpRequest&) {
    HttpResponse response = json_response({{"a", 1}});
    response.etag = "v1";
    response.cache_control = "public, max-age=31536000, immutable";
    return response;
  });
  server.route("GET", "/large", [](const HttpRequest& request) {
    const auto size = request.query.find("bytes");
    HttpResponse response;
    response.content_type = "application/octet-stream";
    response.body.assign(size == request.query.end() ? 1'000'000 : std::stoul(size->second), 'x');
    return response;
  });
  server.route("GET", "/fails/{how}", [](const HttpRequest& request) -> HttpResponse {
    const std::string& how = request.path_values.at("how");
    if (how == "problem")
      throw HttpProblem(409, "conflict", "A conflict", "It is so.", {{"/a", "b"}}, {{"Retry-After", "7"}});
    if (how == "invalid") throw InvalidRequest({{"/x/0", "is wrong"}, {"/y", "is missing"}});
    if (how == "malformed") throw InvalidRequest({{"", "not JSON"}}, true);
    if (how == "environment") throw std::runtime_error("secret /var/lib\nsecond line");
    if (how == "logic") throw std::logic_error("secret invariant");
    throw 42;
  });
  server.route("GET", "/events", [](const HttpRequest&) {
    HttpResponse response;
    response.content_type = "text/event-stream";
    response.stream = [](const StreamSink& sink) {
      while (sink("data: tick\n\n"))
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    };
    return response;
  });
  server.route("GET", "/counters", [&server](const HttpRequest&) {
    return json_response({{"open_connections", server.counters().open_connections}});
  });
  server.route("GET", "/slow", [](const HttpRequest&) {
    ++slow_requests;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return json_response({{"slow", true}});
  });
}

/// A server on a thread of this process, on a port of the system's choice.
class RunningServer {
 public:
  explicit RunningServer(HttpSettings settings = {}) : server_(with_any_port(std::move(settings))) {
    add_test_routes(server_);
    port_ = server_.bind();
    thread_ = std::thread([this] { server_.run(); });
  }
  ~RunningServer() { stop(); }
  RunningServer(const RunningServer&) = delete;
  RunningServer& operator=(const RunningServer&) = delete;

  void stop() {
    server_.stop();
    if (thread_.joinable()) thread_.join();
  }
  int port() const { return port_; }
  HttpServer& server() { return server_; }

 private:
  static HttpSettings with_any_port(HttpSettings settings) {
    settings.port = 0;
    return settings;
  }

  HttpServer server_;
  int port_ = 0;
  std::thread thread_;
};

inline RawResponse ask(int port, std::string_view request) {
  return RawClient(port).ask(request);
}

/// Expects the error shape that every refusal has.
inline void expect_problem(const RawResponse& response, int status, const std::string& type = "") {
  ASSERT_EQ(response.status, status) << response.head << response.body;
  EXPECT_EQ(response.header("content-type"), "application/problem+json");
  EXPECT_EQ(response.header("x-content-type-options"), "nosniff");
  EXPECT_EQ(response.header("referrer-policy"), "no-referrer");
  EXPECT_EQ(response.header("cross-origin-resource-policy"), "same-origin");
  const nlohmann::json problem = nlohmann::json::parse(response.body);
  EXPECT_EQ(problem.at("status"), status);
  EXPECT_TRUE(problem.at("title").is_string() && problem.at("detail").is_string() &&
              problem.at("errors").is_array());
  EXPECT_TRUE(problem.at("type").get<std::string>().starts_with("/problems/"));
  if (!type.empty()) {
    EXPECT_EQ(problem.at("type"), "/problems/" + type);
  }
}

}  // namespace retake::test
