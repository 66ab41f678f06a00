// HttpConnection: one client's socket, whose reads and writes have budgets of bytes and seconds.
// Realises doc/http.md: whatever a client does or leaves undone, a connection costs little memory and ends in
// time. It must not know what a request means, beyond where its head ends.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
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

  /// Bytes of the body that follows the head; the time for it begins to run.
  void expect_body(std::size_t bytes);
  /// At most `size` bytes of the body, 0 at its end, -1 if the client left or was too slow.
  ssize_t read_body(char* data, std::size_t size);
  bool body_was_late() const { return body_was_late_; }
  bool has_unread_body() const { return body_left_ > 0; }
  /// Bytes were sent beyond the request's end already.
  bool has_unread_bytes() const { return begin_ < buffer_.size(); }

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
  std::string remote_address() const;

 private:
  using Clock = std::chrono::steady_clock;
  enum class Wait { ready, late, gone };

  Wait fill(Clock::time_point deadline);
  std::optional<std::size_t> end_of_head();
  [[noreturn]] void refuse_long_head() const;
  bool send_all(std::string_view first, std::string_view second);
  static Clock::time_point after(double seconds);

  int socket_;
  const HttpSettings& settings_;
  const ServerLoad& load_;
  std::optional<Clock::time_point> head_began_;  ///< a new connection's time for its head runs from the start
  std::string buffer_;                           ///< received, consumed up to begin_
  std::size_t begin_ = 0;
  std::size_t line_begin_ = 0;  ///< of the line that end_of_head() is in
  std::size_t scanned_ = 0;     ///< bytes of the buffer that end_of_head() has seen
  std::size_t body_left_ = 0;
  Clock::time_point body_deadline_;
  bool body_was_late_ = false;
  bool holds_next_write_ = false;
  std::string held_;
};

}  // namespace retake
