// See connection.h.
#include "server/http/connection.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <utility>

#include "server/http/chunks.h"
#include "server/http/problem.h"

namespace retake {
namespace {

using std::chrono::duration_cast;
using std::chrono::milliseconds;

constexpr std::size_t kReadBytes = 4096;
constexpr milliseconds kGlance{200};   ///< chosen: how often a waiting connection looks at the load
constexpr double kHurriedSeconds = 1;  ///< chosen: for a head while others wait for a thread
constexpr std::size_t kSlowestWindow =
    16 * 1024;                        ///< [bytes] chosen: what a reader takes in write_stall_seconds
constexpr double kGentleSeconds = 2;  ///< chosen: reading on after a refusal
constexpr std::size_t kGentleBytes = 64 << 20;  ///< chosen: nothing of it is kept
constexpr std::size_t kMostEmptyLines = 4;      ///< [bytes] before a request line, as RFC 9112 (2.2) asks

std::chrono::steady_clock::duration to_duration(double seconds) {
  return duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(seconds));
}

/// Waits for `events`, at most until `deadline` and one glance. Returns poll()'s result.
int wait_for(int socket, short events, std::chrono::steady_clock::time_point deadline) {
  const auto left =
      duration_cast<milliseconds>(deadline - std::chrono::steady_clock::now()) + milliseconds(1);
  pollfd descriptor{socket, events, 0};
  return poll(&descriptor, 1, static_cast<int>(std::clamp(left, milliseconds(0), kGlance).count()));
}

std::string address_of_peer(int socket) {
  sockaddr_storage address{};
  socklen_t length = sizeof(address);
  std::array<char, NI_MAXHOST> text{};
  if (getpeername(socket, reinterpret_cast<sockaddr*>(&address), &length) != 0 ||
      getnameinfo(reinterpret_cast<sockaddr*>(&address), length, text.data(), text.size(), nullptr, 0,
                  NI_NUMERICHOST) != 0)
    return {};
  return text.data();
}

}  // namespace

HttpConnection::HttpConnection(int socket, const HttpSettings& settings, const ServerLoad& load)
    : socket_(socket),
      remote_address_(address_of_peer(socket)),
      settings_(settings),
      load_(load),
      head_began_(Clock::now()) {}

HttpConnection::Clock::time_point HttpConnection::after(double seconds) {
  return Clock::now() + to_duration(seconds);
}

bool HttpConnection::wait_for_request() {
  const auto deadline = after(head_began_ ? settings_.head_seconds : settings_.idle_seconds);
  while (!load_.is_stopping && Clock::now() < deadline) {
    const Wait result =
        begin_ < buffer_.size() ? Wait::ready : fill(std::min(deadline, Clock::now() + kGlance));
    if (result == Wait::gone) return false;
    if (result == Wait::ready) {
      if (!head_began_) head_began_ = Clock::now();
      return true;
    }
    // While others wait for a thread, a connection that says nothing loses its own.
    if (load_.waiting_connections > 0) return false;
  }
  return false;
}

std::optional<std::string> HttpConnection::read_head() {
  buffer_.erase(0, begin_);
  begin_ = line_begin_ = scanned_ = 0;
  const auto began = std::exchange(head_began_, std::nullopt).value_or(Clock::now());
  const auto deadline = began + to_duration(settings_.head_seconds);
  const auto hurried = began + to_duration(std::min(settings_.head_seconds, kHurriedSeconds));
  bool is_late = false;
  while (true) {
    const std::optional<std::size_t> end = end_of_head();
    const std::size_t size = end.value_or(buffer_.size()) - begin_;
    if (size > settings_.most_head_bytes) refuse_long_head();
    if (end) {
      std::string head = buffer_.substr(begin_, size);
      begin_ = *end;
      return head;
    }
    if (is_late)
      throw HttpProblem(408, "request-timeout", "The request took too long",
                        "The request's head did not arrive in time.");
    const bool hurry = load_.is_stopping || load_.waiting_connections > 0;
    const auto limit = hurry ? hurried : deadline;
    if (fill(std::min(limit, Clock::now() + kGlance)) == Wait::gone) return std::nullopt;
    is_late = Clock::now() >= limit;
  }
}

void HttpConnection::refuse_long_head() const {
  if (buffer_.find('\n', begin_) > begin_ + settings_.most_head_bytes)
    throw HttpProblem(414, "uri-too-long", "The address is too long", "The request line is too long.");
  throw HttpProblem(431, "header-fields-too-large", "The header is too large",
                    "A request's head may have " + std::to_string(settings_.most_head_bytes) + " bytes.");
}

/// Looks on for the empty line. Lines end with CR LF and nothing else.
std::optional<std::size_t> HttpConnection::end_of_head() {
  while (true) {
    const std::size_t feed = buffer_.find('\n', scanned_);
    if (feed == std::string::npos) {
      scanned_ = buffer_.size();
      return std::nullopt;
    }
    if (feed == line_begin_ || buffer_[feed - 1] != '\r')
      throw HttpProblem(400, "bad-request", "The request is malformed",
                        "A line of the head does not end with CR LF.");
    const bool is_empty = feed == line_begin_ + 1;
    const bool is_before_request = line_begin_ == begin_;
    scanned_ = line_begin_ = feed + 1;
    if (is_empty && !is_before_request) return feed + 1;
    if (!is_empty) continue;
    begin_ = feed + 1;
    if (begin_ > kMostEmptyLines)
      throw HttpProblem(400, "bad-request", "The request is malformed",
                        "There are empty lines before the request.");
  }
}

/// Receives once, waiting until `deadline` for something to receive.
HttpConnection::Wait HttpConnection::fill(Clock::time_point deadline) {
  const std::size_t old_size = buffer_.size();
  while (true) {
    buffer_.resize(old_size + kReadBytes);
    const ssize_t received = recv(socket_, buffer_.data() + old_size, kReadBytes, MSG_DONTWAIT);
    const int error = errno;
    buffer_.resize(old_size + static_cast<std::size_t>(std::max<ssize_t>(received, 0)));
    if (received > 0) return Wait::ready;
    if (received == 0 || (error != EAGAIN && error != EWOULDBLOCK && error != EINTR)) return Wait::gone;
    if (Clock::now() >= deadline) return Wait::late;
    wait_for(socket_, POLLIN, deadline);
  }
}

/// Has bytes of the body in the buffer. Throws: HttpProblem with 400 or 408.
void HttpConnection::fill_with_body(Clock::time_point deadline) {
  if (begin_ < buffer_.size()) return;
  buffer_.clear();
  begin_ = 0;
  const Wait result = Clock::now() >= deadline ? Wait::late : fill(deadline);
  if (result == Wait::late)
    throw HttpProblem(408, "request-timeout", "The request took too long",
                      "The request's body did not arrive in time.");
  if (result == Wait::gone)
    throw HttpProblem(400, "bad-request", "The request is malformed", "The body is shorter than announced.");
}

std::string HttpConnection::read_body(std::size_t length) {
  const auto deadline = after(settings_.body_seconds);
  std::string body;
  body.reserve(length);
  while (body.size() < length) {
    fill_with_body(deadline);
    const std::string_view piece = unread_bytes().substr(0, length - body.size());
    body += piece;
    begin_ += piece.size();
  }
  return body;
}

std::string HttpConnection::read_chunked_body(const std::function<void(std::size_t)>& admit) {
  const auto deadline = after(settings_.body_seconds);
  ChunkReader reader(settings_.most_body_bytes);
  std::string body;
  while (!reader.is_complete()) {
    fill_with_body(deadline);
    const std::size_t further = unread_bytes().size();
    admit(further);
    if (body.size() + further > body.capacity())
      body.reserve(std::min(settings_.most_body_bytes, 2 * body.capacity() + further));
    begin_ += reader.take(unread_bytes(), body);
  }
  return body;
}

void HttpConnection::begin_response() {
  held_.clear();
  holds_next_write_ = true;
}

bool HttpConnection::write(std::string_view data) {
  if (holds_next_write_) {
    holds_next_write_ = false;
    held_ = data;
    return true;
  }
  const std::string first = std::exchange(held_, {});
  return send_all(first, data);
}

bool HttpConnection::flush() {
  holds_next_write_ = false;
  const std::string first = std::exchange(held_, {});
  return first.empty() || send_all(first, {});
}

bool HttpConnection::send_all(std::string_view first, std::string_view second) {
  auto window_end = after(settings_.write_stall_seconds);
  std::size_t window_bytes = 0;
  while (!first.empty() || !second.empty()) {
    std::array<iovec, 2> parts = {iovec{const_cast<char*>(first.data()), first.size()},
                                  iovec{const_cast<char*>(second.data()), second.size()}};
    msghdr message{};
    message.msg_iov = parts.data();
    message.msg_iovlen = parts.size();
    const ssize_t sent = sendmsg(socket_, &message, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent > 0) {
      const auto count = static_cast<std::size_t>(sent);
      window_bytes += count;
      const std::size_t of_first = std::min(count, first.size());
      first.remove_prefix(of_first);
      second.remove_prefix(count - of_first);
      continue;
    }
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return false;
    if (Clock::now() >= window_end) {
      if (window_bytes < kSlowestWindow) return false;
      window_end = after(settings_.write_stall_seconds);
      window_bytes = 0;
    }
    wait_for(socket_, POLLOUT, window_end);
  }
  return true;
}

bool HttpConnection::client_is_gone() const {
  pollfd descriptor{socket_, POLLRDHUP, 0};
  return poll(&descriptor, 1, 0) > 0 && (descriptor.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

void HttpConnection::close_gently() {
  shutdown(socket_, SHUT_WR);
  const bool hurry = load_.is_stopping || load_.waiting_connections > 0;
  const auto deadline = after(hurry ? kGentleSeconds / 10 : kGentleSeconds);
  for (std::size_t discarded = 0; discarded < kGentleBytes && Clock::now() < deadline;) {
    std::array<char, 16 * 1024> unread;
    const ssize_t count = recv(socket_, unread.data(), unread.size(), MSG_DONTWAIT);
    if (count > 0) {
      discarded += static_cast<std::size_t>(count);
      continue;
    }
    if (count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) return;
    wait_for(socket_, POLLIN, deadline);
  }
}

}  // namespace retake
