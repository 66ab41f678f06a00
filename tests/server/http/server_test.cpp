// What HttpServer answers: routes, errors in one shape, validators, compression, access. doc/api.md,
// "Conventions".
#include "server/http/server.h"

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/http/message.h"
#include "server/http/representation.h"
#include "server/http/settings.h"
#include "tests/server/http/test_routes.h"
#include "tests/server/raw_client.h"

namespace retake {
namespace {

using nlohmann::json;
using test::ask;
using test::expect_problem;
using test::get;
using test::post;
using test::RawClient;
using test::RawResponse;
using test::RunningServer;

TEST(HttpServer, RoutesByMethodAndPath) {
  const RunningServer server;
  struct Case {
    const char* target;
    json expected;
  };
  const Case cases[] = {
      {"/things/7", {{"id", "7"}}},
      {"/things/special", {{"special", true}}},
      {"/things/a%20b", {{"id", "a b"}}},
      {"/things/%C3%A9/parts/x.y", {{"id", "é"}, {"part", "x.y"}}},
  };
  for (const Case& c : cases) {
    const RawResponse response = ask(server.port(), get(c.target));
    EXPECT_EQ(response.status, 200) << c.target;
    EXPECT_EQ(json::parse(response.body), c.expected) << c.target;
  }
  for (const char* target :
       {"/nothing", "/things", "/things/", "/things/1/", "/things/1/parts", "//", "/things/../echo"})
    expect_problem(ask(server.port(), get(target)), 404, "not-found");
}

TEST(HttpServer, DecodesTheQueryOnce) {
  const RunningServer server;
  const json echo = json::parse(ask(server.port(), get("/echo?a=1+2&b=%2526&c&=d&")).body);
  EXPECT_EQ(echo.at("query"), (json{{"a", "1 2"}, {"b", "%26"}, {"c", ""}, {"", "d"}}));
}

TEST(HttpServer, KnownPathsRefuseOtherMethodsWithAllow) {
  const RunningServer server;
  const RawResponse refused = ask(server.port(), post("/things/special", "{}"));
  expect_problem(refused, 405, "method-not-allowed");
  EXPECT_EQ(refused.header("allow"), "DELETE, GET, HEAD, OPTIONS");
  const RawResponse options = ask(server.port(), "OPTIONS /echo HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(options.status, 204);
  EXPECT_EQ(options.header("allow"), "GET, HEAD, OPTIONS, POST");
  EXPECT_EQ(options.header("content-length"), "");
  EXPECT_EQ(ask(server.port(), "OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 204);
  expect_problem(ask(server.port(), "OPTIONS /nothing HTTP/1.1\r\nHost: localhost\r\n\r\n"), 404);
}

TEST(HttpServer, HeadIsGetWithoutTheBody) {
  const RunningServer server;
  RawClient client(server.port());
  const RawResponse full = client.ask(get("/tagged"));
  const RawResponse head = client.ask("HEAD /tagged HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("content-length"), std::to_string(full.body.size()));
  EXPECT_EQ(head.header("etag"), full.header("etag"));
  EXPECT_EQ(client.ask(get("/healthz")).status, 200) << "the connection lost its place";
  EXPECT_EQ(client.ask("HEAD /events HTTP/1.1\r\nHost: localhost\r\n\r\n").header("content-type"),
            "text/event-stream");
  EXPECT_EQ(client.ask(get("/healthz")).status, 200) << "the connection lost its place";
}

TEST(HttpServer, AConnectionServesManyRequestsOfAllKinds) {
  const RunningServer server;
  RawClient client(server.port());
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(client.ask(get("/things/1")).status, 200);
    const RawResponse echo = client.ask(post("/echo", "{\"a\":" + std::to_string(i) + "}"));
    EXPECT_EQ(json::parse(echo.body).at("body"), "{\"a\":" + std::to_string(i) + "}");
    EXPECT_EQ(client.ask("DELETE /things/1 HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 204);
    EXPECT_EQ(client.ask(get("/tagged", "If-None-Match: \"v1\"\r\n")).status, 304);
    EXPECT_EQ(client.ask(get("/nothing")).status, 404);
    EXPECT_EQ(client.ask(post("/echo", "")).status, 201);
    EXPECT_EQ(client.ask("POST /echo HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 201);
  }
}

TEST(HttpServer, BodiesArriveWholeWhateverTheirPieces) {
  const RunningServer server;
  const std::string body = "\"" + std::string(1024 * 1024 - 2, 'b') + "\"";
  EXPECT_EQ(json::parse(ask(server.port(), post("/echo", body)).body).at("size"), body.size());
  RawClient client(server.port());
  const std::string request = post("/echo", "{\"pieces\":[1,2,3]}");
  for (const char c : request)
    ASSERT_TRUE(client.send(std::string(1, c)));
  EXPECT_EQ(json::parse(client.read().body).at("body"), "{\"pieces\":[1,2,3]}");
}

TEST(HttpServer, ChunkedBodiesArriveWholeWhateverTheirPieces) {
  const RunningServer server;
  RawClient client(server.port());
  struct Case {
    const char* chunks;
    const char* body;
  };
  const Case cases[] = {
      {"7\r\n{\"a\":1}\r\n0\r\n\r\n", "{\"a\":1}"},
      {"1\r\n{\r\n006\r\n\"a\":1}\r\n000\r\n\r\n", "{\"a\":1}"},
      {"2 ;a=\"b c\";d\r\n{}\r\n0;e\r\nX-Sum: 1\r\nY: 2\r\n\r\n", "{}"},
      {"0\r\n\r\n", ""},
  };
  for (const Case& c : cases) {
    client.send(test::chunked("/echo", c.chunks) + get("/things/next"));
    EXPECT_EQ(json::parse(client.read().body).at("body"), c.body) << c.chunks;
    EXPECT_EQ(json::parse(client.read().body).at("id"), "next") << "the connection lost its place";
    for (const char byte : test::chunked("/echo", c.chunks))
      ASSERT_TRUE(client.send(std::string(1, byte)));
    EXPECT_EQ(json::parse(client.read().body).at("body"), c.body) << c.chunks << ", byte by byte";
  }
  // As large as a body may be.
  std::string large;
  for (int i = 0; i < 16; ++i)
    large += "10000\r\n" + std::string(0x10000, 'b') + "\r\n";
  EXPECT_EQ(json::parse(client.ask(test::chunked("/echo", large + "0\r\n\r\n")).body).at("size"), 1 << 20);
  // A client that waits to be asked for it.
  client.send(
      "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
      "Transfer-Encoding: chunked\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(client.read().status, 100);
  client.send("2\r\n{}\r\n0\r\n\r\n");
  EXPECT_EQ(client.read().status, 201);
}

TEST(HttpServer, SaysContinueToAClientThatWaitsForIt) {
  const RunningServer server;
  RawClient client(server.port());
  const std::string request = post("/echo", "{\"a\":1}", "Expect: 100-continue\r\n");
  client.send(request.substr(0, request.size() - 7));
  EXPECT_EQ(client.read().status, 100);
  client.send(request.substr(request.size() - 7));
  EXPECT_EQ(client.read().status, 201);
  RawClient refused(server.port());
  expect_problem(refused.ask("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                             "Content-Length: 2000000\r\nExpect: 100-continue\r\n\r\n"),
                 413);
}

TEST(HttpServer, WhatHandlersThrowBecomesAProblemWithoutItsText) {
  const RunningServer server;
  struct Case {
    const char* how;
    int status;
    const char* type;
    std::size_t fault_count;
    const char* retry_after;
  };
  const Case cases[] = {
      {"problem", 409, "conflict", 1, "7"},         {"invalid", 422, "invalid-request", 2, ""},
      {"malformed", 400, "invalid-request", 1, ""}, {"environment", 503, "unavailable", 0, "5"},
      {"logic", 500, "internal-error", 0, ""},      {"anything", 500, "internal-error", 0, ""},
  };
  for (const Case& c : cases) {
    RawClient client(server.port());
    const RawResponse response = client.ask(get(std::string("/fails/") + c.how));
    expect_problem(response, c.status, c.type);
    EXPECT_EQ(json::parse(response.body).at("errors").size(), c.fault_count) << c.how;
    EXPECT_EQ(response.header("retry-after"), c.retry_after) << c.how;
    EXPECT_EQ((response.head + response.body).find("secret"), std::string::npos) << c.how;
    EXPECT_EQ(response.header("exception_what"), "") << c.how;
    EXPECT_EQ(client.ask(get("/healthz")).status, 200) << "a failed handler must not cost the connection";
  }
  EXPECT_EQ(json::parse(ask(server.port(), get("/fails/invalid")).body).at("errors").at(0),
            (json{{"pointer", "/x/0"}, {"detail", "is wrong"}}));
}

TEST(HttpServer, PipelinedRequestsAreAnsweredInOrder) {
  const RunningServer server;
  RawClient client(server.port());
  client.send(get("/things/1") + post("/echo", "{\"b\":2}") + get("/things/3") + get("/nothing") +
              get("/things/5"));
  EXPECT_EQ(json::parse(client.read().body), (json{{"id", "1"}}));
  EXPECT_EQ(json::parse(client.read().body).at("body"), "{\"b\":2}");
  EXPECT_EQ(json::parse(client.read().body), (json{{"id", "3"}}));
  EXPECT_EQ(client.read().status, 404);
  EXPECT_EQ(json::parse(client.read().body), (json{{"id", "5"}}));
}

TEST(HttpServer, ConnectionsEndWhenTheClientOrTheVersionSaysSo) {
  HttpSettings settings;
  settings.requests_per_connection = 3;
  settings.idle_seconds = 0.3;
  const RunningServer server(settings);
  struct Case {
    std::string request;
    bool stays;
  };
  const Case cases[] = {
      {get("/healthz"), true},
      {get("/healthz", "Connection: close\r\n"), false},
      {get("/healthz", "Connection: x, Close\r\n"), false},
      {"GET /healthz HTTP/1.0\r\nHost: localhost\r\n\r\n", false},
      {"GET /healthz HTTP/1.0\r\nHost: localhost\r\nConnection: keep-alive\r\n\r\n", true},
  };
  for (const Case& c : cases) {
    RawClient client(server.port());
    EXPECT_EQ(client.ask(c.request).status, 200);
    EXPECT_EQ(client.ask(get("/healthz")).status, c.stays ? 200 : 0) << c.request;
  }
  RawClient idle(server.port());
  idle.ask(get("/healthz"));
  EXPECT_TRUE(idle.is_closed_within(5));
  RawClient busy(server.port());
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(busy.ask(get("/healthz")).header("connection"), i == 2 ? "close" : "keep-alive");
  EXPECT_TRUE(busy.is_closed_within(5));
}

TEST(HttpServer, SaysForHowLongAConnectionWaitsForTheNextRequest) {
  HttpSettings settings;
  settings.requests_per_connection = 3;
  settings.idle_seconds = 2;
  const RunningServer server(settings);
  RawClient client(server.port());
  for (const char* request : {"/healthz", "/nothing"})
    EXPECT_EQ(client.ask(get(request)).header("keep-alive"), "timeout=2");
  const RawResponse last = client.ask(get("/healthz"));
  EXPECT_EQ(last.header("connection") + last.header("keep-alive"), "close") << "the last answer";
  EXPECT_EQ(ask(server.port(), get("/healthz", "Connection: close\r\n")).header("keep-alive"), "");
  EXPECT_EQ(ask(server.port(), "BREW / HTTP/1.1\r\n\r\n").header("keep-alive"), "");
  RawClient idle(server.port());
  idle.ask(get("/healthz"));
  EXPECT_FALSE(idle.is_closed_within(1)) << "closed before its time";
  EXPECT_TRUE(idle.is_closed_within(5));
}

TEST(HttpServer, AnUnchangedBodyIsNotSentAgain) {
  const RunningServer server;
  struct Case {
    const char* if_none_match;
    int status;
  };
  const Case cases[] = {
      {"\"v1\"", 304},        {"\"v1-gzip\"", 304}, {"W/\"v1\"", 304}, {"*", 304}, {"\"a\", \"v1\"", 304},
      {"\"a\",W/\"b\"", 200}, {"v1", 200},          {"\"v12\"", 200},  {"", 200},
  };
  for (const Case& c : cases) {
    const RawResponse response =
        ask(server.port(), get("/tagged", "If-None-Match: " + std::string(c.if_none_match) + "\r\n"));
    EXPECT_EQ(response.status, c.status) << c.if_none_match;
    EXPECT_EQ(response.header("etag"), "\"v1\"");
    EXPECT_EQ(response.header("cache-control"), "no-cache");
    EXPECT_EQ(response.header("vary"), "Accept-Encoding");
    if (c.status == 304) {
      EXPECT_EQ(response.header("content-type") + response.header("content-length"), "");
    }
  }
  const RawResponse immutable = ask(server.port(), get("/immutable"));
  EXPECT_EQ(immutable.header("cache-control"), "public, max-age=31536000, immutable");
  EXPECT_EQ(ask(server.port(), get("/healthz")).header("cache-control"), "no-store");
}

TEST(HttpServer, CompressesOnlyForClientsThatAcceptIt) {
  const RunningServer server;
  struct Case {
    const char* accept;
    bool is_gzip;
  };
  const Case cases[] = {
      {"gzip", true},         {"GZIP, deflate, br", true},
      {"gzip;q=0", false},    {"gzip; q=0.0", false},
      {"gzip;q=0.5", true},   {"*", true},
      {"*;q=0", false},       {"identity, gzip;q=0.5", false},
      {"br", false},          {"", false},
      {"gzip;q=0, *", false}, {"deflate, x-gzip;q=0.001", true},
  };
  const std::string plain = ask(server.port(), get("/tagged")).body;
  for (const Case& c : cases) {
    const RawResponse response =
        ask(server.port(), get("/tagged", "Accept-Encoding: " + std::string(c.accept) + "\r\n"));
    EXPECT_EQ(response.header("content-encoding"), c.is_gzip ? "gzip" : "") << c.accept;
    EXPECT_EQ(response.header("etag"), c.is_gzip ? "\"v1-gzip\"" : "\"v1\"") << c.accept;
    EXPECT_EQ(response.header("vary"), "Accept-Encoding");
    EXPECT_EQ(c.is_gzip ? gunzip(response.body) : response.body, plain) << c.accept;
  }
  for (const char* target : {"/large", "/healthz"}) {
    const RawResponse response = ask(server.port(), get(target, "Accept-Encoding: gzip\r\n"));
    EXPECT_EQ(response.header("content-encoding"), "") << target;
    EXPECT_EQ(response.header("vary"), "") << target;
  }
}

TEST(HttpServer, ABodyThatIsCompressedAlreadyIsNotCompressedAgain) {
  HttpSettings settings;
  settings.port = 0;
  HttpServer server(settings);
  const std::string page = "<p>" + std::string(5000, 'p');
  server.route("GET", "/page", [&](const HttpRequest&) {
    HttpResponse response;
    response.content_type = "text/html";
    response.body = gzip(page);
    response.content_encoding = "gzip";
    return response;
  });
  const int port = server.bind();
  std::thread thread([&] { server.run(); });
  const RawResponse compressed = ask(port, get("/page", "Accept-Encoding: gzip, br\r\n"));
  EXPECT_EQ(compressed.header("content-encoding"), "gzip");
  EXPECT_EQ(gunzip(compressed.body), page);
  const RawResponse plain = ask(port, get("/page"));
  EXPECT_EQ(plain.header("content-encoding"), "");
  EXPECT_EQ(plain.body, page);
  EXPECT_EQ(plain.header("vary"), "Accept-Encoding");
  server.stop();
  thread.join();
}

TEST(HttpServer, APortIsBoundOnce) {
  RunningServer server;
  HttpSettings settings;
  settings.port = server.port();
  HttpServer second(settings);
  try {
    second.bind();
    FAIL() << "two servers on one port";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("127.0.0.1"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(std::to_string(server.port())), std::string::npos);
  }
  server.stop();
  EXPECT_EQ(second.bind(), settings.port) << "a port must be free once its server has stopped";
}

TEST(HttpServer, CountsWhatItDoes) {
  RunningServer server;
  RawClient client(server.port());
  client.ask(get("/healthz"));
  client.ask(get("/nothing"));
  ask(server.port(), "BREW / HTTP/1.1\r\n\r\n");
  const HttpCounters counters = server.server().counters();
  EXPECT_EQ(counters.requests, 3u);
  EXPECT_EQ(counters.by_status, (std::map<int, std::uint64_t>{{200, 1}, {404, 1}, {501, 1}}));
  EXPECT_EQ(counters.refused, 1u);
  EXPECT_GE(counters.open_connections, 1u);
}

TEST(HttpServer, StopBeforeRunAndWithoutRunEnds) {
  HttpSettings settings;
  settings.port = 0;
  HttpServer never_run(settings);
  never_run.bind();
  HttpServer stopped(settings);
  stopped.bind();
  stopped.stop();
  stopped.stop();
  stopped.run();
}

}  // namespace
}  // namespace retake
