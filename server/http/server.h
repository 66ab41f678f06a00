// HttpServer: HTTP/1.1 on a guarded socket, with our own requests, responses and routes.
// Realises doc/http.md: the library is used only behind a bounded stream, and only listener.cpp and
// connection_queue.h see it. It must not know what a scenario is; routes are given to it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/message.h"
#include "server/http/problem.h"
#include "server/http/settings.h"

namespace retake {

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

  /// How faults that routes throw and HTTP does not know are told; none: as the server's own failure.
  using Explain = std::function<std::optional<HttpProblem>(const std::runtime_error&)>;
  void explain(Explain explain);

  /// Method and pattern of every route.
  std::vector<std::pair<std::string, std::string>> routes() const;

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
