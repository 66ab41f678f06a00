// ConnectionQueue: the threads that serve connections, and the connections that wait for one.
// Realises doc/http.md: the library's own pool lets any number wait. One of the two files that see
// cpp-httplib. It must not know what is done with a connection.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <httplib.h>

#include "server/http/connection.h"

namespace retake {

/// A fixed number of threads, and a bounded number of connections that wait for one.
class ConnectionQueue final : public httplib::TaskQueue {
 public:
  ConnectionQueue(std::size_t threads, ServerLoad& load) : load_(load) {
    for (std::size_t i = 0; i < threads; ++i)
      threads_.emplace_back([this] { work(); });
  }

  using Enqueued = decltype(std::declval<httplib::TaskQueue&>().enqueue(std::function<void()>()));
  Enqueued enqueue(std::function<void()> connection) override {
    std::unique_lock lock(mutex_);
    if (waiting_.size() < kMostWaiting) {
      waiting_.push_back(std::move(connection));
      publish();
      changed_.notify_one();
    } else {
      lock.unlock();
      is_surplus_ = true;
      connection();
      is_surplus_ = false;
    }
    return static_cast<Enqueued>(true);
  }

  void shutdown() override {
    {
      const std::lock_guard lock(mutex_);
      is_shut_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_)
      thread.join();
  }

  /// True on a thread that is given a connection on top of those that may wait: turn it away at once.
  static bool is_surplus() { return is_surplus_; }

 private:
  static constexpr std::size_t kMostWaiting = 256;  ///< chosen: below it no healthy client notices a burst
  static inline thread_local bool is_surplus_ = false;

  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      ++idle_threads_;
      changed_.wait(lock, [this] { return is_shut_ || !waiting_.empty(); });
      --idle_threads_;
      if (waiting_.empty()) return;
      const std::function<void()> connection = std::move(waiting_.front());
      waiting_.pop_front();
      publish();
      lock.unlock();
      connection();
      lock.lock();
    }
  }
  void publish() {
    load_.waiting_connections = waiting_.size() > idle_threads_ ? waiting_.size() - idle_threads_ : 0;
  }

  ServerLoad& load_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  std::size_t idle_threads_ = 0;
  bool is_shut_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace retake
