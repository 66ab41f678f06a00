// Pilot: a first look at every scenario - so many draws from the prior, and how many satisfy the wish.
// doc/design.md, section 3, "Odds". It must not know chains' progress or HTTP.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "db/store.h"
#include "sampler/chain.h"
#include "server/chains/event_hub.h"
#include "server/chains/scenario_library.h"

namespace retake {

/// One thread of low priority that looks at one scenario after another and stores what it found. A scenario
/// that is deleted meanwhile, cannot be run or cannot be stored is left without a pilot; the next start tries
/// those that are still there again.
/// Thread safety: every method may be called from any thread.
class Pilot {
 public:
  struct Settings {
    double seconds = 1;               ///< [s] of CPU time that a look takes at most, to within a draw
    std::uint64_t most_hits = 1'000;  ///< a look ends there; chosen: the odds are then known to 6 %
    /// What a chain's counts say of its draws.
    std::function<OddsTally(const ChainCounts&)> tally = [](const ChainCounts& counts) {
      return counts.odds;
    };
  };
  Pilot(Store& store, ScenarioLibrary& library, EventHub& events, Settings settings);
  Pilot(Store& store, ScenarioLibrary& library, EventHub& events)
      : Pilot(store, library, events, Settings{}) {}
  /// As drain().
  ~Pilot();

  /// Looks at a scenario next.
  void add(std::string_view scenario);
  /// Looks at every stored scenario that has no pilot, the newest first. Throws: StoreError.
  void add_missing();
  /// Stops the thread; a look under way is given up, whatever it simulates.
  void drain();

 private:
  class Interruptible;

  void work();
  std::optional<std::string> next_scenario();
  void look_at(const std::string& id);
  std::optional<PilotTally> draw(const Scenario& scenario);

  Store& store_;
  ScenarioLibrary& library_;
  EventHub& events_;
  const Settings settings_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> queue_;
  std::atomic<bool> draining_ = false;
  Interruption* interruption_ = nullptr;  ///< of the look under way
  std::jthread thread_;
};

}  // namespace retake
