// Answers that HttpServer sends piece by piece: bodies that are made on the way, and streams of events.
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/http/message.h"
#include "server/http/representation.h"
#include "server/http/server.h"
#include "server/http/settings.h"
#include "tests/server/http/test_routes.h"
#include "tests/server/raw_client.h"

namespace retake {
namespace {

using test::ask;
using test::expect_problem;
using test::get;
using test::RawClient;
using test::RawResponse;
using test::RunningServer;

/// A server with a body of some megabytes that is written in pieces, and one that breaks off.
class PiecesServer {
 public:
  PiecesServer() : server_(settings()) {
    server_.route("GET", "/pieces", [](const HttpRequest&) {
      HttpResponse response;
      response.etag = "p1";
      response.pieces = [](const StreamSink& sink) {
        for (int i = 0; i < 500; ++i)
          if (!sink(std::string(10'000, static_cast<char>('a' + i % 26)))) return false;
        return true;
      };
      return response;
    });
    server_.route("GET", "/broken", [](const HttpRequest&) {
      HttpResponse response;
      response.pieces = [](const StreamSink& sink) -> bool {
        sink(std::string(100'000, 'x'));
        throw std::runtime_error("secret");
      };
      return response;
    });
    server_.route("GET", "/healthz", [](const HttpRequest&) { return json_response({{"ok", true}}); });
    port_ = server_.bind();
    thread_ = std::thread([this] { server_.run(); });
  }
  ~PiecesServer() {
    server_.stop();
    thread_.join();
  }
  int port() const { return port_; }
  static std::string whole() {
    std::string text;
    for (int i = 0; i < 500; ++i)
      text += std::string(10'000, static_cast<char>('a' + i % 26));
    return text;
  }

 private:
  static HttpSettings settings() {
    HttpSettings settings;
    settings.port = 0;
    return settings;
  }
  HttpServer server_;
  int port_ = 0;
  std::thread thread_;
};

TEST(HttpServer, ABodyInPiecesIsSentAsAnyOther) {
  const PiecesServer server;
  RawClient client(server.port());
  const RawResponse plain = client.ask(get("/pieces"));
  EXPECT_EQ(plain.status, 200);
  EXPECT_EQ(plain.header("transfer-encoding"), "chunked");
  EXPECT_EQ(plain.header("content-length"), "");
  EXPECT_EQ(plain.header("content-type"), "application/json");
  EXPECT_EQ(plain.header("etag"), "\"p1\"");
  EXPECT_EQ(plain.header("connection"), "keep-alive");
  EXPECT_EQ(plain.body, PiecesServer::whole());
  const RawResponse packed = client.ask(get("/pieces", "Accept-Encoding: gzip\r\n"));
  EXPECT_EQ(packed.header("content-encoding"), "gzip");
  EXPECT_EQ(packed.header("etag"), "\"p1-gzip\"");
  EXPECT_EQ(packed.header("vary"), "Accept-Encoding");
  EXPECT_LT(packed.body.size(), 100'000u);
  EXPECT_EQ(gunzip(packed.body), PiecesServer::whole());
  const RawResponse known = client.ask(get("/pieces", "If-None-Match: \"p1\"\r\n"));
  EXPECT_EQ(known.status, 304);
  EXPECT_EQ(known.body + known.header("transfer-encoding"), "");
  const RawResponse head = client.ask("HEAD /pieces HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("etag"), "\"p1\"");
  EXPECT_EQ(client.ask(get("/healthz")).status, 200) << "the connection lost its place";
  const RawResponse old = ask(server.port(), "GET /pieces HTTP/1.0\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(old.header("transfer-encoding"), "");
  EXPECT_EQ(old.body, PiecesServer::whole());
}

TEST(HttpServer, ABodyThatBreaksOffIsNotTakenForWhole) {
  const PiecesServer server;
  for (const char* fields : {"", "Accept-Encoding: gzip\r\n"}) {
    RawClient client(server.port());
    client.send(get("/broken", fields));
    const RawResponse head = client.read_head();
    EXPECT_EQ(head.status, 200);
    std::string body;
    for (std::string chunk = client.read_chunk(2); !chunk.empty(); chunk = client.read_chunk(2))
      body += chunk;
    EXPECT_FALSE(client.ended_with_last_chunk()) << fields;
    EXPECT_EQ((head.head + body).find("secret"), std::string::npos);
    EXPECT_TRUE(client.is_closed_within(5)) << fields;
  }
  EXPECT_EQ(ask(server.port(), get("/healthz")).status, 200);
}

/// Asks for a stream and takes its head and first piece.
RawResponse begin_stream(RawClient& client) {
  client.send(get("/events"));
  RawResponse response = client.read_head();
  if (response.status == 200) response.body = client.read_chunk();
  return response;
}

TEST(HttpServer, StreamsUntilTheClientLeavesAndRefusesTooMany) {
  HttpSettings settings;
  settings.most_streams = 2;
  settings.most_streams_of_client = 3;
  RunningServer server(settings);
  RawClient first(server.port());
  {
    RawClient second(server.port());
    for (RawClient* client : {&first, &second}) {
      const RawResponse response = begin_stream(*client);
      EXPECT_EQ(response.status, 200);
      EXPECT_EQ(response.header("content-type"), "text/event-stream");
      EXPECT_EQ(response.header("cache-control"), "no-store");
      EXPECT_EQ(response.header("connection"), "close") << "a stream is a connection's last answer";
      EXPECT_EQ(response.body, "data: tick\n\n");
      EXPECT_EQ(client->read_chunk(), "data: tick\n\n");
    }
    const RawResponse refused = ask(server.port(), get("/events"));
    expect_problem(refused, 503, "too-many-streams");
    EXPECT_NE(refused.header("retry-after"), "");
    EXPECT_EQ(server.server().counters().open_streams, 2u);
    EXPECT_EQ(ask(server.port(), "HEAD /events HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 200);
  }
  EXPECT_TRUE(test::eventually([&] { return server.server().counters().open_streams == 1; }));
  RawClient third(server.port());
  EXPECT_EQ(begin_stream(third).status, 200) << "a client that left still counts";
}

TEST(HttpServer, StreamsAreLimitedByClientBeforeTheyAreForAll) {
  HttpSettings settings;
  settings.most_streams = 5;
  settings.most_streams_of_client = 2;
  const RunningServer server(settings);
  std::vector<std::unique_ptr<RawClient>> open;
  const auto ask_from = [&](const char* source) {
    open.push_back(std::make_unique<RawClient>(server.port(), 0, source));
    return begin_stream(*open.back());
  };
  for (const char* source : {"127.0.0.1", "127.0.0.2"}) {
    EXPECT_EQ(ask_from(source).status, 200);
    EXPECT_EQ(ask_from(source).status, 200);
    EXPECT_EQ(ask_from(source).status, 429) << "one client has more than its share";
  }
  EXPECT_EQ(ask_from("127.0.0.3").status, 200);
  EXPECT_EQ(ask_from("127.0.0.3").status, 503) << "all are taken";
  expect_problem(ask(server.port(), get("/events")), 429, "too-many-streams");
  open.front()->reset();
  EXPECT_TRUE(test::eventually([&] { return ask_from("127.0.0.1").status == 200; }));
}

}  // namespace
}  // namespace retake
