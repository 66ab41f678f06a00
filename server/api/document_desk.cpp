// See document_desk.h.
#include "server/api/document_desk.h"

#include <malloc.h>

namespace retake {
namespace {

constexpr std::size_t kLargeDocument = 4 << 20;  ///< [bytes] chosen

}  // namespace

std::shared_ptr<void> DocumentDesk::take(std::size_t bytes) {
  std::unique_lock lock(mutex_);
  if (!has_room(bytes)) {
    if (waiting_ >= limits_.most_waiting) return nullptr;
    ++waiting_;
    const bool is_free = given_back_.wait_for(lock, std::chrono::duration<double>(limits_.longest_wait),
                                              [&] { return has_room(bytes); });
    --waiting_;
    if (!is_free) return nullptr;
  }
  taken_ += bytes;
  return {this, [bytes](DocumentDesk* desk) {
            {
              const std::lock_guard give_back(desk->mutex_);
              desk->taken_ -= bytes;
            }
            if (bytes >= kLargeDocument) malloc_trim(0);  // the allocator would keep it for good
            desk->given_back_.notify_all();
          }};
}

StreamSink DocumentDesk::hurried(const StreamSink& sink) {
  using Clock = std::chrono::steady_clock;
  return [this, &sink, start = Clock::now(), sent = 0.0](std::string_view piece) mutable {
    sent += static_cast<double>(piece.size());
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (seconds > limits_.patience + sent / limits_.slowest_bytes_per_second) {
      const std::lock_guard lock(mutex_);
      if (waiting_ > 0) return false;
    }
    return sink(piece);
  };
}

}  // namespace retake
