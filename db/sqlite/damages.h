// Damages: which rows were found to be damaged since the store was opened.
// Realises doc/design.md, section 5. Knows nothing of rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace retake::database {

/// Thread safety: every method may be called from any thread.
class Damages {
 public:
  /// `told`: of each damage once.
  explicit Damages(std::function<void(const std::string&)> told) : told_(std::move(told)) {}

  void note(const std::string& damage) {
    {
      const std::lock_guard lock(mutex_);
      if (known_.size() >= kMostKnown || !known_.insert(damage).second) return;
      if (first_.size() < kMostNamed) first_.push_back(damage);
    }
    if (told_) told_(damage);
  }
  std::vector<std::string> first() const {
    const std::lock_guard lock(mutex_);
    return first_;
  }
  std::uint64_t count() const {
    const std::lock_guard lock(mutex_);
    return known_.size();
  }

 private:
  static constexpr std::size_t kMostNamed = 100;
  static constexpr std::size_t kMostKnown = 10'000;  // chosen: about 1 MB

  const std::function<void(const std::string&)> told_;
  mutable std::mutex mutex_;
  std::set<std::string> known_;
  std::vector<std::string> first_;
};

}  // namespace retake::database
