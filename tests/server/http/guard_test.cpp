// Who and what HttpServer refuses before a route sees it: malformed requests, hosts, tokens, origins.
// doc/http.md and doc/api.md, "Conventions".
#include <stdexcept>
#include <string>

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
using test::expect_problem;
using test::get;
using test::post;
using test::RawClient;
using test::RawResponse;
using test::RunningServer;

TEST(HttpServer, RefusesMalformedAndUnwantedRequests) {
  const RunningServer server;
  const std::string host = "Host: localhost\r\n";
  const std::string json_type = "Content-Type: application/json\r\n";
  struct Case {
    const char* what;
    std::string request;
    int status;
  };
  const Case cases[] = {
      {"no Host", "GET /echo HTTP/1.1\r\n\r\n", 400},
      {"two Hosts", "GET /echo HTTP/1.1\r\n" + host + host + "\r\n", 400},
      {"a foreign Host", "GET /echo HTTP/1.1\r\nHost: evil.example\r\n\r\n", 421},
      {"an empty Host", "GET /echo HTTP/1.1\r\nHost:\r\n\r\n", 421},
      {"a Host with a user", "GET /echo HTTP/1.1\r\nHost: localhost@evil\r\n\r\n", 421},
      {"a Host that begins well", "GET /echo HTTP/1.1\r\nHost: localhost.evil.example\r\n\r\n", 421},
      {"a Host with a port of letters", "GET /echo HTTP/1.1\r\nHost: localhost:80a\r\n\r\n", 421},
      {"a long path", get("/" + std::string(512, 'a')), 414},
      {"a long query", get("/echo?a=" + std::string(4000, 'a')), 414},
      {"a path of 8 KB", get("/" + std::string(8192, 'a')), 414},
      {"a repeated parameter", get("/echo?a=1&b=2&a=1"), 400},
      {"a parameter repeated in disguise", get("/echo?a=1&%61=1"), 400},
      {"bad percent-encoding", get("/echo%2"), 400},
      {"bad percent-encoding in the query", get("/echo?a=%zz"), 400},
      {"an encoded NUL", get("/things/a%00b"), 400},
      {"an encoded line end", get("/things/a%0d%0ab"), 400},
      {"an encoded slash", get("/things/a%2Fb"), 400},
      {"a path that is not UTF-8", get("/things/%ff"), 400},
      {"an overlong slash", get("/things/%c0%af"), 400},
      {"a fragment", get("/echo#a"), 400},
      {"raw bytes in the path", get("/things/\xc3\xa9"), 400},
      {"a target without slash", "GET echo HTTP/1.1\r\n" + host + "\r\n", 400},
      {"an absolute target elsewhere", "GET http://evil.example/echo HTTP/1.1\r\n" + host + "\r\n", 421},
      {"an asterisk for GET", "GET * HTTP/1.1\r\n" + host + "\r\n", 400},
      {"CONNECT", "CONNECT localhost:80 HTTP/1.1\r\n" + host + "\r\n", 501},
      {"TRACE", "TRACE /echo HTTP/1.1\r\n" + host + "\r\n", 501},
      {"an invented method", "BREW /echo HTTP/1.1\r\n" + host + "\r\n", 501},
      {"a method in lower case", "get /echo HTTP/1.1\r\n" + host + "\r\n", 501},
      {"HTTP/2's preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505},
      {"HTTP/0.9", "GET /echo\r\n\r\n", 400},
      {"a version of letters", "GET /echo HTTP/x.1\r\n" + host + "\r\n", 505},
      {"two spaces", "GET  /echo HTTP/1.1\r\n" + host + "\r\n", 400},
      {"no request", "\r\n\r\n\r\n\r\n", 400},
      {"a TLS greeting", std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\n", 12), 400},
      {"a folded header", "GET /echo HTTP/1.1\r\n" + host + "X-A: b\r\n c\r\n\r\n", 400},
      {"a bare line feed", "GET /echo HTTP/1.1\nHost: localhost\n\n", 400},
      {"a bare line feed in the header", "GET /echo HTTP/1.1\r\n" + host + "X-A: b\nX-B: c\r\n\r\n", 400},
      {"a bare carriage return", "GET /echo HTTP/1.1\r\n" + host + "X-A: b\rX-B: c\r\n\r\n", 400},
      {"NUL in the header", "GET /echo HTTP/1.1\r\n" + host + std::string("X-A: b\0c\r\n\r\n", 12), 400},
      {"NUL in the request line", std::string("GET /echo\0 HTTP/1.1\r\n", 21) + host + "\r\n", 400},
      {"a space before the colon", "GET /echo HTTP/1.1\r\nHost : localhost\r\n\r\n", 400},
      {"a header without a name", "GET /echo HTTP/1.1\r\n" + host + ": b\r\n\r\n", 400},
      {"a header without a colon", "GET /echo HTTP/1.1\r\n" + host + "X-A\r\n\r\n", 400},
      {"a head over the limit", get("/echo", "X-A: " + std::string(20000, 'a') + "\r\n"), 431},
      {"a request line over the limit", "GET /" + std::string(30000, 'a'), 414},
      {"chunks and more", test::chunked("/echo", "2\r\n{}\r\n0\r\n\r\n", "x, CHUNKED"), 501},
      {"chunks twice", test::chunked("/echo", "2\r\n{}\r\n0\r\n\r\n", "chunked, chunked"), 501},
      {"no chunks at the end", test::chunked("/echo", "2\r\n{}\r\n0\r\n\r\n", "chunked, gzip"), 501},
      {"a packed coding", test::chunked("/echo", "2\r\n{}\r\n0\r\n\r\n", "gzip"), 501},
      {"a coding that is none", test::chunked("/echo", "{}", "identity"), 501},
      {"an empty coding", test::chunked("/echo", "{}", ""), 501},
      {"two codings", test::chunked("/echo", "2\r\n{}\r\n0\r\n\r\n", "chunked\r\nTransfer-Encoding: chunked"),
       400},
      {"chunks of HTTP/1.0",
       "POST /echo HTTP/1.0\r\n" + host + json_type +
           "Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n",
       400},
      {"chunks on GET", "GET /echo HTTP/1.1\r\n" + host + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400},
      {"chunks without a type",
       "POST /echo HTTP/1.1\r\n" + host + "Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n", 415},
      {"a chunk over the limit", test::chunked("/echo", "100001\r\n"), 413},
      {"chunks over the limit", test::chunked("/echo", "1\r\n{\r\n100000\r\n"), 413},
      {"a size of 2^64-1", test::chunked("/echo", "ffffffffffffffff\r\n"), 413},
      {"a size of 2^64", test::chunked("/echo", "10000000000000000\r\n"), 400},
      {"a size with a sign", test::chunked("/echo", "+2\r\n{}\r\n0\r\n\r\n"), 400},
      {"a size with a prefix", test::chunked("/echo", "0x2\r\n{}\r\n0\r\n\r\n"), 400},
      {"a size behind a space", test::chunked("/echo", " 2\r\n{}\r\n0\r\n\r\n"), 400},
      {"a size before a space", test::chunked("/echo", "2 \r\n{}\r\n0\r\n\r\n"), 400},
      {"no size", test::chunked("/echo", "\r\n{}\r\n0\r\n\r\n"), 400},
      {"a size that ends with a line feed", test::chunked("/echo", "2\n{}\r\n0\r\n\r\n"), 400},
      {"an extension with a line feed", test::chunked("/echo", "2;a\nb\r\n{}\r\n0\r\n\r\n"), 400},
      {"an extension with a carriage return", test::chunked("/echo", "2;a\rb\r\n{}\r\n0\r\n\r\n"), 400},
      {"a chunk that is longer", test::chunked("/echo", "2\r\n{} \r\n0\r\n\r\n"), 400},
      {"a chunk that is shorter", test::chunked("/echo", "3\r\n{}\r\n0\r\n\r\n"), 400},
      {"a chunk that ends with a line feed", test::chunked("/echo", "2\r\n{}\n0\r\n\r\n"), 400},
      {"long extensions", test::chunked("/echo", "2;" + std::string(5000, 'a') + "\r\n{}\r\n0\r\n\r\n"), 400},
      {"long trailers", test::chunked("/echo", "2\r\n{}\r\n0\r\nX: " + std::string(5000, 'a') + "\r\n\r\n"),
       400},
      {"chunks that break off", test::chunked("/echo", "2\r\n{}\r\n"), 400},
      {"a target without a host", "GET http:///echo HTTP/1.1\r\n" + host + "\r\n", 400},
      {"a target of a port", "GET http://:80/echo HTTP/1.1\r\n" + host + "\r\n", 400},
      {"both lengths",
       "POST /echo HTTP/1.1\r\n" + host + json_type +
           "Content-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n{}",
       400},
      {"two lengths",
       "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 2\r\nContent-Length: 3\r\n\r\n{} ",
       400},
      {"two equal lengths",
       "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 2\r\nContent-Length: 2\r\n\r\n{}",
       400},
      {"a list of lengths", "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 2, 2\r\n\r\n{}",
       400},
      {"a signed length", "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: +2\r\n\r\n{}", 400},
      {"a negative length", "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: -1\r\n\r\n", 400},
      {"a hexadecimal length", "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 0x2\r\n\r\n{}",
       400},
      {"an empty length", "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length:\r\n\r\n{}", 400},
      {"a length of 2^64-1",
       "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 18446744073709551615\r\n\r\n", 400},
      {"a length of 2^64+1",
       "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 18446744073709551617\r\n\r\n", 400},
      {"a length over the limit",
       "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 1048577\r\n\r\n", 413},
      {"no length with a body and its type", "POST /echo HTTP/1.1\r\n" + host + json_type + "\r\n{\"a\":1}",
       411},
      {"no length with a body", "POST /echo HTTP/1.1\r\n" + host + "\r\n{\"a\":1}", 411},
      {"a body on GET", "GET /echo HTTP/1.1\r\n" + host + "Content-Length: 2\r\n\r\n{}", 400},
      {"a compressed body", post("/echo", "{}", "Content-Encoding: gzip\r\n"), 415},
      {"several ranges", get("/large", "Range: bytes=0-1,2-3\r\n"), 416},
      {"an odd expectation", get("/echo", "Expect: miracles\r\n"), 417},
      {"no type", "POST /echo HTTP/1.1\r\n" + host + "Content-Length: 2\r\n\r\n{}", 415},
      {"a form",
       "POST /echo HTTP/1.1\r\n" + host +
           "Content-Type: application/x-www-form-urlencoded\r\nContent-Length: 2\r\n\r\n{}",
       415},
      {"plain text",
       "POST /echo HTTP/1.1\r\n" + host +
           "Content-Type: text/plain; application/json\r\nContent-Length: 2\r\n\r\n{}",
       415},
      {"several parts",
       "POST /echo HTTP/1.1\r\n" + host +
           "Content-Type: multipart/form-data; boundary=x\r\nContent-Length: 2\r\n\r\n{}",
       415},
      {"a body that breaks off",
       "POST /echo HTTP/1.1\r\n" + host + json_type + "Content-Length: 10\r\n\r\n{}", 400},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    RawClient client(server.port());
    client.send(c.request);
    if (std::string_view(c.what).ends_with("off")) client.finish_sending();
    expect_problem(client.read(), c.status);
    EXPECT_TRUE(client.is_closed_within(5)) << "a refused connection must not be used further";
    EXPECT_EQ(ask(server.port(), get("/healthz")).status, 200);
  }
}

TEST(HttpServer, AcceptsWhatIsUnusualButSane) {
  const RunningServer server;
  const std::string port = std::to_string(server.port());
  const std::string requests[] = {
      "GET /echo HTTP/1.0\r\nHost: localhost\r\n\r\n",
      "GET /echo HTTP/1.1\r\nhOsT: LOCALHOST:" + port + "\r\n\r\n",
      "GET /echo HTTP/1.1\r\nHost: [::1]:" + port + "\r\n\r\n",
      "GET /echo HTTP/1.1\r\nHost: [0:0:0:0:0:0:0:1]\r\n\r\n",
      "GET /echo HTTP/1.1\r\nHost:127.0.0.1\t \r\n\r\n",
      "GET http://localhost:" + port + "/echo?a=1 HTTP/1.1\r\nHost: localhost\r\n\r\n",
      "\r\n" + get("/echo"),
      get("/echo", "X-Empty:\r\nX-Latin: \xe9\r\n"),
      get("/echo", "Range: bytes=0-1\r\n"),
      get("/echo?q=" + std::string(2000, 'q')),
  };
  for (const std::string& request : requests)
    EXPECT_EQ(ask(server.port(), request).status, 200) << request;
  EXPECT_EQ(ask(server.port(), get("/large", "Range: bytes=0-1\r\n")).body.size(), 1'000'000u)
      << "ranges are ignored";
  const std::string types[] = {"application/json; charset=utf-8", "Application/JSON",
                               "application/merge-patch+json"};
  for (const std::string& type : types)
    EXPECT_EQ(ask(server.port(),
                  "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\nContent-Type: " + type +
                      "\r\n\r\n{}")
                  .status,
              201)
        << type;
}

TEST(HttpServer, ARequestWithoutABodyMayNameItsType) {
  const RunningServer server;
  RawClient client(server.port());
  const std::string ends[] = {"\r\n", "Content-Length: 0\r\n\r\n",
                              "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"};
  for (const char* type : {"application/json", "application/json; charset=utf-8", "text/plain"})
    for (const std::string& end : ends) {
      // An empty body in chunks is one all the same, and judged by its type.
      if (type == std::string_view("text/plain") && end.starts_with("Transfer")) continue;
      const std::string fields =
          " HTTP/1.1\r\nHost: localhost\r\nContent-Type: " + std::string(type) + "\r\n" + end;
      EXPECT_EQ(client.ask("DELETE /things/1" + fields).status, 204) << fields;
      EXPECT_EQ(json::parse(client.ask("POST /echo" + fields).body).at("size"), 0) << fields;
      // One that is sent at once behind another.
      client.send("DELETE /things/1" + fields + get("/things/2"));
      EXPECT_EQ(client.read().status, 204) << fields;
      EXPECT_EQ(json::parse(client.read().body), (json{{"id", "2"}})) << fields;
    }
}

TEST(HttpServer, AHeaderNamedLikeTheLibrarysOwnDoesNotShadowTheAddress) {
  const RunningServer server;
  const json echo =
      json::parse(ask(server.port(), get("/echo", "REMOTE_ADDR: 6.6.6.6\r\nREMOTE_PORT: 1\r\n")).body);
  EXPECT_EQ(echo.at("remote_address"), "127.0.0.1");
}

TEST(HttpServer, WithATokenOnlyHealthIsOpen) {
  HttpSettings settings;
  settings.token = "s3cret-._~+/=";
  const RunningServer server(settings);
  EXPECT_EQ(ask(server.port(), get("/healthz")).status, 200);
  const std::string refused[] = {"",
                                 "Authorization: Bearer wrong\r\n",
                                 "Authorization: Bearer s3cret-._~+/=x\r\n",
                                 "Authorization: Bearer\r\n",
                                 "Authorization: Basic s3cret-._~+/=\r\n",
                                 "Cookie: retake_token=\r\n",
                                 "Cookie: other=s3cret-._~+/=\r\n"};
  for (const std::string& field : refused) {
    const RawResponse response = ask(server.port(), get("/echo", field));
    expect_problem(response, 401, "unauthorized");
    EXPECT_EQ(response.header("www-authenticate"), "Bearer realm=\"retake\"");
  }
  const std::string accepted[] = {"Authorization: Bearer s3cret-._~+/=\r\n",
                                  "Authorization: bearer s3cret-._~+/=\r\n",
                                  "Cookie: a=b; retake_token=s3cret-._~+/=; c=d\r\n"};
  for (const std::string& field : accepted)
    EXPECT_EQ(ask(server.port(), get("/echo", field)).status, 200) << field;
  expect_problem(ask(server.port(), get("/nothing")), 401);
  expect_problem(ask(server.port(), post("/healthz", "{}")), 401);
  expect_problem(ask(server.port(),
                     "OPTIONS /echo HTTP/1.1\r\nHost: localhost\r\nOrigin: http://x\r\n"
                     "Access-Control-Request-Method: POST\r\n\r\n"),
                 401);
}

TEST(HttpServer, WhoGuessesTokensIsSlowedAndHoldsNobodyUp) {
  HttpSettings settings;
  settings.token = "right";
  settings.threads = 2;
  const RunningServer server(settings);
  const auto with = [&](const std::string& token, const char* source = "127.0.0.1") {
    RawClient client(server.port(), 0, source);
    return client.ask(get("/echo", "Authorization: Bearer " + token + "\r\n"));
  };
  // An old token that comes again and again is no guess.
  for (int i = 0; i < 100; ++i)
    expect_problem(with("old"), 401, "unauthorized");
  EXPECT_EQ(with("right").status, 200);

  int looked_at = 0;
  for (int i = 0; i < 200; ++i) {
    const RawResponse response = with("guess" + std::to_string(i));
    looked_at += response.status == 401;
    if (response.status == 401) continue;
    expect_problem(response, 429, "too-many-tokens");
    EXPECT_EQ(response.header("retry-after"), "1");
  }
  EXPECT_GE(looked_at, 19);
  EXPECT_LT(looked_at, 60) << "200 guesses take seconds on a busy machine, but not 40";
  EXPECT_EQ(ask(server.port(), get("/healthz")).status, 200) << "what needs no token is served on";
  expect_problem(ask(server.port(), get("/echo")), 401, "unauthorized");
  EXPECT_EQ(with("right", "127.0.0.2").status, 200) << "another client pays for it";
  EXPECT_TRUE(test::eventually([&] { return with("right").status == 200; })) << "locked out for good";
}

TEST(HttpServer, ThePagesAddressExchangesTheTokenForACookie) {
  HttpSettings settings;
  settings.token = "a+b";
  const RunningServer server(settings);
  const RawResponse response = ask(server.port(), get("/?token=a%2Bb"));
  EXPECT_EQ(response.status, 303);
  EXPECT_EQ(response.header("location"), "/");
  EXPECT_EQ(response.header("set-cookie"), "retake_token=a+b; HttpOnly; SameSite=Strict; Path=/");
  EXPECT_EQ(response.header("cache-control"), "no-store");
  EXPECT_EQ(ask(server.port(), get("/", "Cookie: retake_token=a+b\r\n")).status, 200);
  expect_problem(ask(server.port(), get("/?token=wrong")), 401);
  expect_problem(ask(server.port(), get("/echo?token=a%2Bb")), 401);
}

TEST(HttpServer, OtherSitesCannotChangeAnything) {
  HttpSettings settings;
  settings.allowed_origins = {"https://game.example"};
  const RunningServer server(settings);
  struct Case {
    const char* fields;
    int status;
  };
  const Case cases[] = {
      {"", 201},
      {"Origin: http://localhost\r\n", 201},
      {"Origin: HTTP://LocalHost:80\r\n", 201},
      {"Origin: https://game.example\r\nSec-Fetch-Site: cross-site\r\n", 201},
      {"Sec-Fetch-Site: same-origin\r\n", 201},
      {"Origin: null\r\n", 403},
      {"Origin: http://evil.example\r\n", 403},
      {"Origin: http://localhost:1234\r\n", 403},
      {"Origin: http://127.0.0.1\r\n", 403},
      {"Origin: ftp://localhost\r\n", 403},
      {"Origin: https://game.example.evil\r\n", 403},
      {"Origin:\r\n", 403},
      {"Sec-Fetch-Site: cross-site\r\n", 403},
  };
  for (const Case& c : cases)
    EXPECT_EQ(ask(server.port(), post("/echo", "{}", c.fields)).status, c.status) << c.fields;
  const std::string cross_site = "Sec-Fetch-Site: cross-site\r\n";
  expect_problem(ask(server.port(), get("/events", cross_site + "Sec-Fetch-Mode: no-cors\r\n")), 403);
  EXPECT_EQ(ask(server.port(), get("/", cross_site + "Sec-Fetch-Mode: navigate\r\n")).status, 200)
      << "a link";
  EXPECT_EQ(ask(server.port(), get("/echo", "Origin: http://evil.example\r\n"))
                .header("access-control-allow-origin"),
            "");
}

TEST(HttpServer, OnlyOriginsAllowedByNameMayReadAnswers) {
  HttpSettings settings;
  settings.token = "t";
  settings.allowed_origins = {"https://game.example"};
  const RunningServer server(settings);
  const std::string preflight =
      "OPTIONS /echo HTTP/1.1\r\nHost: localhost\r\nAccess-Control-Request-Method: POST\r\n";
  const RawResponse allowed = ask(server.port(), preflight + "Origin: https://game.example\r\n\r\n");
  EXPECT_EQ(allowed.status, 204);
  EXPECT_EQ(allowed.header("access-control-allow-origin"), "https://game.example");
  EXPECT_EQ(allowed.header("access-control-allow-methods"), "GET, HEAD, OPTIONS, POST");
  EXPECT_NE(allowed.header("access-control-allow-headers").find("Authorization"), std::string::npos);
  EXPECT_EQ(ask(server.port(), preflight + "Origin: https://evil.example\r\n\r\n")
                .header("access-control-allow-origin"),
            "");
  const RawResponse read =
      ask(server.port(), get("/echo", "Origin: https://game.example\r\nAuthorization: Bearer t\r\n"));
  EXPECT_EQ(read.header("access-control-allow-origin"), "https://game.example");
  EXPECT_EQ(read.header("cross-origin-resource-policy"), "cross-origin");
  const RawResponse refused = ask(server.port(), get("/echo", "Origin: https://game.example\r\n"));
  EXPECT_EQ(refused.status, 401);
  EXPECT_EQ(refused.header("access-control-allow-origin"), "https://game.example")
      << "the page could not read why";
  EXPECT_EQ(ask(server.port(), get("/healthz")).header("vary"), "Origin");
}

TEST(HttpServer, FurtherHostsAreAllowedByName) {
  HttpSettings settings;
  settings.allowed_hosts = {"Retake.Example", "[fe80::0:1]:99"};
  const RunningServer server(settings);
  for (const char* host : {"retake.example", "RETAKE.example:1234", "[FE80::1]"})
    EXPECT_EQ(ask(server.port(), "GET /echo HTTP/1.1\r\nHost: " + std::string(host) + "\r\n\r\n").status, 200)
        << host;
  expect_problem(ask(server.port(), "GET /echo HTTP/1.1\r\nHost: sub.retake.example\r\n\r\n"), 421);
}

TEST(HttpServer, OriginsAndHostsThatNobodySendsAreRefused) {
  const char* const never_sent[] = {"a.example",
                                    "https://a.example/",
                                    "https://a.example/path",
                                    "*",
                                    "null",
                                    "HTTPS://a.example",
                                    "https://A.example",
                                    "https://u@a.example",
                                    "https://a.example:443",
                                    "http://a.example:80",
                                    "https://a.example:",
                                    "https://a.example:0",
                                    "https://a.example:65536",
                                    "https://a.example:x",
                                    "https://*.a.example",
                                    "https://",
                                    "://a",
                                    "https://a.example?b",
                                    "https://a.example#b",
                                    " https://a.example",
                                    "https://\xc3\xa9.example",
                                    "http://[::1",
                                    "http://[0:0::1]",
                                    "http://::1"};
  for (const char* origin : never_sent) {
    HttpSettings settings;
    settings.allowed_origins = {origin};
    EXPECT_THROW(HttpServer{settings}, std::runtime_error) << origin;
  }
  for (const char* origin : {"https://a.example", "http://localhost:3000", "http://[::1]:8080",
                             "https://a.example:80", "capacitor://localhost", "https://xn--9ca.example"}) {
    HttpSettings settings;
    settings.allowed_origins = {origin};
    EXPECT_NO_THROW(HttpServer{settings}) << origin;
  }
  for (const char* host :
       {"https://a.example", "a.example/", "*", "*.a.example", "a b", "a:b", "[::1", "u@a"}) {
    HttpSettings settings;
    settings.allowed_hosts = {host};
    EXPECT_THROW(HttpServer{settings}, std::runtime_error) << host;
  }
}

TEST(HttpServer, ATokenThatACookieCannotHoldIsRefused) {
  HttpSettings settings;
  settings.token = "a;b";
  EXPECT_THROW(HttpServer{settings}, std::runtime_error);
}

}  // namespace
}  // namespace retake
