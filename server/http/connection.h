// HttpConnection: one client's socket, whose reads and writes have budgets of bytes and seconds.
// Realises doc/http.md: whatever a client does or leaves undone, a connection costs little memory and ends in
// time. It must not know what a request means, beyond where its head ends.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <sys/types.h>

#include "server/http/settings.h"

namespace retake {

/// What connections must know of the server that they belong to.
struct ServerLoad {
  std::atomic<bool> is_stopping{false};
  std::atomic<std::size_t> waiting_connections{
      0};  ///< accepted, but no thread is free; makes the others hurry
};

/// Thread safety: used by one thread. Does not own the socket.
class HttpConnection {
 public:
  HttpConnection(int socket, const HttpSettings& settings, const ServerLoad& load);

  /// Waits for the first byte of a request: head_seconds for the first one, idle_seconds for further ones.
  /// False if none came in time, the client left or the server stops.
  bool wait_for_request();
  /// The next request's head with its empty line; std::nullopt if the client left. Throws: HttpProblem with
  /// 400, 408, 414 or 431.
  std::optional<std::string> read_head();

  /// The body that follows the head, within body_seconds. Throws: HttpProblem with 400 or 408.
  std::string read_body(std::size_t length);
  /// The same of a chunked one. `admit` is asked before so many further bytes are kept. Throws: HttpProblem
  /// with 400, 408, 413, and what `admit` throws.
  std::string read_chunked_body(const std::function<void(std::size_t further_bytes)>& admit);
  /// What was sent beyond the request's end already.
  std::string_view unread_bytes() const { return std::string_view(buffer_).substr(begin_); }

  /// The next write is a response's head: it is kept and sent together with what follows.
  void begin_response();
  /// Writes all of it; false if the client left or stalls.
  bool write(std::string_view data);
  /// Sends what begin_response() made wait.
  bool flush();

  /// True if the client closed its side or the connection broke.
  bool client_is_gone() const;
  /// Closes our side and reads on for a moment, so that the last response is not lost to a reset.
  void close_gently();

  int socket() const { return socket_; }
  const std::string& remote_address() const { return remote_address_; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class Wait { ready, late, gone };

  Wait fill(Clock::time_point deadline);
  void fill_with_body(Clock::time_point deadline);
  std::optional<std::size_t> end_of_head();
  [[noreturn]] void refuse_long_head() const;
  bool send_all(std::string_view first, std::string_view second);
  static Clock::time_point after(double seconds);

  int socket_;
  const std::string remote_address_;
  const HttpSettings& settings_;
  const ServerLoad& load_;
  std::optional<Clock::time_point> head_began_;  ///< a new connection's time for its head runs from the start
  std::string buffer_;                           ///< received, consumed up to begin_
  std::size_t begin_ = 0;
  std::size_t line_begin_ = 0;  ///< of the line that end_of_head() is in
  std::size_t scanned_ = 0;     ///< bytes of the buffer that end_of_head() has seen
  bool holds_next_write_ = false;
  std::string held_;
};

}  // namespace retake
