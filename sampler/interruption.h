// Interruption: how another thread ends a simulation that nobody waits for any more.
// doc/design.md, section 1. What was interrupted is done again from where it began, so a chain finds the
// same.
#pragma once

#include <atomic>
#include <exception>

namespace retake {

/// A simulation was given up half way. Whoever simulated and the chain that it was for are good for nothing
/// any more: both are to be made again, the chain from its last checkpoint.
class Interrupted : public std::exception {
 public:
  const char* what() const noexcept override { return "the simulation was interrupted"; }
};

/// Thread safety: every method may be called from any thread.
class Interruption {
 public:
  void ask() { is_asked_.store(true, std::memory_order_relaxed); }
  void withdraw() { is_asked_.store(false, std::memory_order_relaxed); }
  /// Called at every step. Throws: Interrupted, if that was asked for.
  void check() const {
    if (is_asked_.load(std::memory_order_relaxed)) throw Interrupted();
  }

 private:
  std::atomic<bool> is_asked_{false};
};

}  // namespace retake
