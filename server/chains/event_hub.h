// EventHub: which chains and scenarios changed, for streams that show them live.
// Keeps only versions, so a slow stream costs nothing and misses no last state. It must not know HTTP or the
// store.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace retake {

/// Thread safety: every method may be called from any thread.
class EventHub {
 public:
  void chain_changed(std::string_view id);
  void scenario_changed(std::string_view id);
  void scenario_deleted(std::string_view id, const std::vector<std::string>& chains);

  std::uint64_t version();
  /// Waits until the scenario changes after `version`, but no longer than until `deadline` or close(). The
  /// version to be given to the next call.
  std::uint64_t wait_for_scenario(std::string_view id, std::uint64_t version,
                                  std::chrono::steady_clock::time_point deadline);
  /// Nobody waits any more: the end is near.
  void close();

  struct Changes {
    std::uint64_t version = 0;  ///< to be given to the next call
    std::vector<std::string> chains;
    std::vector<std::string> scenarios;
    std::vector<std::string> deleted_scenarios;
  };
  /// What changed after `version` (0: everything known since the start); waits up to `wait` for something to
  /// change.
  Changes changes_since(std::uint64_t version, std::chrono::milliseconds wait);

 private:
  using Versions = std::map<std::string, std::uint64_t, std::less<>>;
  void mark(Versions& versions, std::string_view id);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t version_ = 0;
  bool closed_ = false;
  Versions chains_, scenarios_, deleted_;
};

}  // namespace retake
