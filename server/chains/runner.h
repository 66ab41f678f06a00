// Runner: the threads that step chains in fair slices and hand their samples to the Store.
// doc/design.md, section 1. Which thread steps a chain, and when, never changes what the chain finds. It must
// not know HTTP.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "db/store.h"
#include "server/chains/event_hub.h"
#include "server/chains/live_chain.h"
#include "server/chains/scenario_library.h"

namespace retake {

/// Thread safety: every method may be called from any thread.
class Runner {
 public:
  /// Requests come first: Linux gives a thread of this niceness a tenth of what the threads that serve
  /// requests get.
  static constexpr int kNiceness = 10;

  struct Settings {
    std::size_t threads = 2;
    /// Chains end there, so that no wish fills the disk.
    std::uint64_t most_samples_per_scenario = std::numeric_limits<std::uint64_t>::max();
    /// So long may a step under way keep somebody waiting; then it is interrupted and done again when the
    /// chain goes on. Chosen: nearly every step ends by itself within it.
    std::chrono::milliseconds patience{200};
  };
  Runner(Store& store, ScenarioLibrary& library, EventHub& events, Settings settings);
  /// As drain().
  ~Runner();

  /// A chain that was stepped as often when the process died, and had committed nothing since, is not taken
  /// up again by itself. Chosen: twice may be bad luck.
  static constexpr std::uint64_t kMostAttempts = 3;

  /// Takes up every chain that the store says was running. Chains that cannot go on become failed. Those of a
  /// world that has another version here are finished, paused ones too: what they found moves by other
  /// physics.
  void resume_stored();

  /// Adds chains to the store and runs them. One whose progress the store cannot take waits, and goes on by
  /// itself: it stays `running`. Throws: StoreError.
  void add(const std::vector<ChainRecord>& chains);

  /// Each returns the chain as it is afterwards; nothing happens to one that is in that state already, or has
  /// finished. What a chain did since its last commit, at most a quarter of a second ago but for the step
  /// under way, is done again after a pause that had to interrupt it.
  /// Empty: no such chain. Throws: StoreError; OtherVersion if it cannot be resumed here.
  std::optional<ChainRecord> pause(std::string_view id);
  std::optional<ChainRecord> resume(
      std::string_view id);                              ///< a failed chain goes on from its last checkpoint
  std::optional<ChainRecord> stop(std::string_view id);  ///< finishes it
  /// Lets it run, paused, failed or finished as it may be, if `stop` lies farther than where it stands; that
  /// is then its stop rule. One that runs keeps its own, unless this one allows more in every respect.
  std::optional<ChainRecord> go_on(std::string_view id, const StopRule& stop);
  /// Whether go_on() would change anything.
  static bool may_go_on(const ChainRecord& record, const StopRule& stop);

  /// A chain as the store has it, but with a failure that the store could not take yet.
  std::optional<ChainRecord> chain(std::string_view id) const;
  std::vector<ChainRecord> chains(std::string_view scenario) const;
  Page<ChainRecord> chains(std::string_view scenario, std::size_t limit, std::string_view cursor) const;

  /// Ends the chains of a scenario without a trace, before it is deleted.
  void drop_scenario(std::string_view scenario);

  /// Stops the threads and commits a checkpoint of every chain, all at once. The chains stay `running` in the
  /// store, so that the next start takes them up again.
  void drain();

  struct Counters {
    std::uint64_t iterations = 0;  ///< since the start of the process
    std::uint64_t samples = 0;
    std::uint64_t simulations = 0;
    std::uint64_t failed_simulations = 0;
    std::uint64_t live_chains = 0;
  };
  Counters counters() const;

 private:
  enum class Wish { run, pause, stop, drop };
  struct Live {
    explicit Live(LiveChain of) : chain(std::move(of)) {}
    LiveChain chain;
    Wish wish = Wish::run;
    bool in_slice = false;  // some thread has it, the queue has not
    bool is_noted = true;   // that it is run; else its first step has to wait until the store knows
    Interruption* interruption = nullptr;  // of the step under way
  };
  using Lives = std::vector<std::shared_ptr<Live>>;
  class Turn;
  using Performers =
      std::vector<std::pair<std::shared_ptr<const Scenario>, std::unique_ptr<Scenario::Performer>>>;

  void work();
  std::shared_ptr<Live> next_chain();
  /// False: the performer is good for nothing any more.
  bool slice(const std::shared_ptr<Live>& live, Scenario::Performer& performer);
  /// False: it was interrupted, and the chain has to go back to its last commit.
  bool step(Live& live, Scenario::Performer& performer);
  /// The chain waits until the store can be written, and goes on from its last commit then.
  void hold(const std::shared_ptr<Live>& live, std::optional<Wish> wish);
  void give_back(const std::shared_ptr<Live>& live);
  void fulfil(const std::shared_ptr<Live>& live);
  Wish wish_of(const Live& live) const;
  /// Requires, as for the next two: mutex_ is held.
  bool is_live(const std::shared_ptr<Live>& live) const;
  /// Takes a chain from the queue. False: another thread has it.
  bool take(const std::shared_ptr<Live>& live);
  /// Waits until `has_ended`, and interrupts those that are stepped when patience is at its end.
  void wait_for(std::unique_lock<std::mutex>& lock, const Lives& lives,
                const std::function<bool()>& has_ended);
  /// Ends a chain that this thread has, where that is wished or due. False: it goes on.
  bool end_if_wished(const std::shared_ptr<Live>& live);
  void leave(const std::shared_ptr<Live>& live);
  void fail(const std::shared_ptr<Live>& live, const std::string& error);
  void make_live(const ChainRecord& record);
  bool has_world_if_sound(std::string_view scenario) const;
  void set_state(std::string_view id, ChainState state, std::string_view ended_by, std::string_view error);
  void try_set_state(std::string_view id, ChainState state, std::string_view ended_by,
                     std::string_view error);
  std::optional<ChainRecord> wish(std::string_view id, Wish wish);
  void show_unsaved_failure(ChainRecord& record) const;
  void count(const ChainCounters& before, const ChainCounters& after);

  Store& store_;
  ScenarioLibrary& library_;
  EventHub& events_;
  const Settings settings_;

  mutable std::mutex mutex_;
  std::condition_variable work_;     // something to step, or the end
  std::condition_variable changed_;  // a chain left, or a slice ended
  std::map<std::string, std::shared_ptr<Live>, std::less<>> live_;
  std::deque<std::shared_ptr<Live>> queue_;
  std::set<std::string, std::less<>> turns_;  // chains that a request is changing just now
  std::map<std::string, std::string, std::less<>> unsaved_failures_;  // chain id -> error
  bool draining_ = false;
  std::atomic<std::uint64_t> iterations_{0}, samples_{0}, simulations_{0}, failed_simulations_{0};
  std::vector<std::jthread> threads_;
};

}  // namespace retake
