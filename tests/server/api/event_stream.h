// EventStream: a client of GET /v1/events that reads one event after the other.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>

#include "tests/server/daemon.h"

namespace retake::test {

struct Event {
  std::string name;  ///< empty: a comment, which is a sign of life
  json data;
};

class EventStream {
 public:
  explicit EventStream(const Daemon& daemon) : client_(daemon.port()) {
    client_.send("GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n");
    head_ = client_.read_head(60);
  }
  const RawResponse& head() const { return head_; }

  /// The next event; nothing if none comes in `seconds`.
  std::optional<Event> next(double seconds = 60) {
    std::size_t end = text_.find("\n\n");
    for (; end == std::string::npos; end = text_.find("\n\n")) {
      const std::string chunk = client_.read_chunk(seconds);
      if (chunk.empty()) return std::nullopt;
      text_ += chunk;
    }
    const std::string block = text_.substr(0, end);
    text_.erase(0, end + 2);
    Event event;
    std::size_t begin = 0;
    while (begin < block.size()) {
      const std::size_t line_end = std::min(block.find('\n', begin), block.size());
      const std::string line = block.substr(begin, line_end - begin);
      if (line.starts_with("event: ")) event.name = line.substr(7);
      if (line.starts_with("data: ")) event.data = json::parse(line.substr(6));
      begin = line_end + 1;
    }
    return event;
  }
  /// The next event that satisfies the condition; an empty one if it does not come.
  template <typename Condition>
  Event next_that(Condition condition) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < deadline) {
      const auto event = next();
      if (!event) break;
      if (!event->name.empty() && condition(*event)) return *event;
    }
    return {};
  }

 private:
  RawClient client_;
  RawResponse head_;
  std::string text_;
};

}  // namespace retake::test
