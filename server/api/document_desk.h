// DocumentDesk: how many animations are decoded at once to be sent, in bytes of memory.
// doc/http.md. A large one waits for its turn; who reads slowly gives it up to those that wait. It must not
// know what a document says.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>

#include "server/http/message.h"

namespace retake {

/// Thread safety: any thread. Outlives what was taken of it.
class DocumentDesk {
 public:
  struct Limits {
    std::size_t most_bytes = 40u << 20;     ///< in memory at once; a single one may have more
    std::size_t most_waiting = 12;          ///< chosen: a quarter of all connection threads
    double longest_wait = 15;               ///< [s]
    double patience = 10;                   ///< [s] that a reader has in any case
    double slowest_bytes_per_second = 1e6;  ///< of a reader, while others wait
  };

  DocumentDesk() : DocumentDesk(Limits{}) {}
  explicit DocumentDesk(const Limits& limits) : limits_(limits) {}

  /// Waits for room for so many bytes and counts them for as long as the result lives; null if there was none
  /// in time, or too many wait already. It must outlive what the bytes are for: memory goes back to the
  /// system behind a large document.
  std::shared_ptr<void> take(std::size_t bytes);

  /// `sink`, which ends early where a slow reader keeps others waiting.
  StreamSink hurried(const StreamSink& sink);

 private:
  bool has_room(std::size_t bytes) const { return taken_ == 0 || taken_ + bytes <= limits_.most_bytes; }

  const Limits limits_;
  std::mutex mutex_;
  std::condition_variable given_back_;
  std::size_t taken_ = 0;
  std::size_t waiting_ = 0;
};

}  // namespace retake
