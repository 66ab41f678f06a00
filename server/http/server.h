// HttpServer: HTTP/1.1 on a guarded socket, with our own requests, responses and routes.
// Realises doc/http.md: the library is used only behind a bounded stream, and only listener.cpp and
// connection_queue.h see it. It must not know what a scenario is; routes are given to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "worlds/document.h"

namespace retake {

struct HttpRequest {
  std::string method;
  std::string path;                                ///< decoded, without the query
  std::map<std::string, std::string> path_values;  ///< {name} parts of the route, decoded
  std::map<std::string, std::string> query;        ///< decoded; a repeated parameter is refused before
  std::map<std::string, std::string> headers;      ///< names in lower case; a repeated header's last value
  std::string body;
  std::string remote_address;
};

/// Writes one piece of a stream to the client; false once the client is gone or the server stops.
using StreamSink = std::function<bool(std::string_view)>;

struct HttpResponse {
  int status = 200;
  std::string content_type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::string etag;  ///< strong entity tag without quotes; a matching If-None-Match gives 304
  std::string cache_control = "no-store";  ///< with an etag and nothing else said: "no-cache"
  std::string content_encoding;            ///< of a body that is compressed already ("gzip"); sent as it is
  /// Set for a stream (server-sent events): called on the connection's thread until it returns.
  /// Such connections are counted against HttpSettings::most_streams.
  std::function<void(const StreamSink&)> stream;
};

using HttpHandler = std::function<HttpResponse(const HttpRequest&)>;

/// A refusal with the status of RFC 9457's problem details. Thrown by handlers.
class HttpProblem : public std::runtime_error {
 public:
  HttpProblem(int status, std::string type, std::string title, std::string detail,
              std::vector<Fault> errors = {}, std::vector<std::pair<std::string, std::string>> headers = {});
  int status;
  std::string type;  ///< short name such as "no-samples-yet"; sent as "/problems/no-samples-yet"
  std::string title;
  std::string detail;
  std::vector<Fault> errors;
  std::vector<std::pair<std::string, std::string>> headers;
};

/// The response of a problem: application/problem+json {"type","title","status","detail","errors"}.
HttpResponse problem_response(const HttpProblem& problem);

/// Serialises JSON for a client; invalid UTF-8 is replaced, never thrown.
HttpResponse json_response(const nlohmann::json& body, int status = 200);

struct HttpSettings {
  std::string address = "127.0.0.1";
  int port = 8080;    ///< 0: the system picks one
  std::string token;  ///< bearer token that every request but /healthz must carry; empty: none
  std::vector<std::string>
      allowed_hosts;  ///< further Host names beside loopback names and the address itself
  std::vector<std::string> allowed_origins;  ///< origins that may read answers (CORS) and send unsafe methods
  std::size_t threads = 48;                  ///< connections served at once
  std::size_t most_streams = 8;
  std::size_t most_head_bytes = 16 * 1024;
  std::size_t most_body_bytes = 1024 * 1024;
  std::size_t most_path_bytes = 512;
  double head_seconds = 5;
  double body_seconds = 10;
  double write_stall_seconds = 10;
  double idle_seconds = 15;  ///< keep-alive
  std::size_t requests_per_connection = 10'000'000;
};

struct HttpCounters {
  std::uint64_t requests = 0;
  std::map<int, std::uint64_t> by_status;
  std::uint64_t refused = 0;  ///< cut or refused by the guard
  std::uint64_t open_connections = 0;
  std::uint64_t open_streams = 0;
};

/// Thread safety: add routes before run(); counters() and stop() from any thread.
class HttpServer {
 public:
  /// Throws: std::runtime_error if the token holds anything but letters, digits and -._~+/= (a cookie carries
  /// it).
  explicit HttpServer(HttpSettings settings);
  ~HttpServer();

  /// `pattern` is a path whose {name} segments match one segment each: "/v1/scenarios/{id}/chains".
  /// A GET route serves HEAD too. A path with routes answers other methods with 405 and Allow.
  void route(std::string_view method, std::string_view pattern, HttpHandler handler);

  /// Binds and listens. Returns the port. Throws: std::runtime_error naming the address.
  int bind();
  /// Serves until stop(). Throws: std::runtime_error if the socket fails for good.
  void run();
  /// Stops accepting, ends streams, lets requests under way finish.
  void stop();
  HttpCounters counters() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace retake
