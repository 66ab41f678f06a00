// LiveChain: a chain that runs, and how much of it the store has. It must not know threads.
#pragma once

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "db/store.h"
#include "server/chains/chain_run.h"
#include "server/chains/event_hub.h"
#include "server/chains/scenario_library.h"

namespace retake {

/// Thread safety: one thread at a time, not always the same; id() and scenario() may be called from any.
class LiveChain {
 public:
  /// From the last checkpoint that the store has. Throws: StoreError; std::runtime_error if something stored
  /// cannot be read.
  LiveChain(Store& store, ScenarioLibrary& library, EventHub& events, const ChainRecord& record);

  const std::string& id() const { return id_; }
  const std::string& scenario() const { return scenario_; }
  ChainRun& run() { return *run_; }
  const ChainRun& run() const { return *run_; }

  /// What it did since its last commit is to be done again.
  void spoil() { is_spoiled_ = true; }
  bool is_spoiled() const { return is_spoiled_; }
  /// To its last commit, as after a restart, if it is spoiled. False: it was deleted. Throws: as the
  /// constructor.
  bool restore();

  /// Hands everything since the last time over to the store, in one transaction that is waited for by
  /// settle(). Requires: the last one is settled.
  void hand_over(std::optional<ChainState> state, std::string_view ended_by);
  bool is_handed_over() const { return handed_over_at_ == run_->record().counters.iteration; }
  /// When it was handed over last; at first, long ago.
  std::chrono::steady_clock::time_point handed_over() const { return handed_over_time_; }
  /// Whether the last transaction is not settled, and whether it is under way.
  bool is_unsettled() const { return commit_.valid(); }
  bool is_committing() const;
  /// Looks at the last transaction, which is waited for if it `waits`. False: the chain was deleted. Throws:
  /// StoreError if it failed.
  bool settle(bool waits);

  /// Looks at the stop rule by effective samples. Requires: the store holds everything so far.
  void judge();

 private:
  std::unique_ptr<ChainRun> make_run(const ChainRecord& record) const;

  Store& store_;
  ScenarioLibrary& library_;
  EventHub& events_;
  const std::string id_, scenario_;
  std::unique_ptr<ChainRun> run_;
  bool is_spoiled_ = false;
  std::future<std::uint64_t> commit_;
  std::chrono::steady_clock::time_point handed_over_time_{};
  std::optional<std::uint64_t> handed_over_at_;  ///< the iteration
};

}  // namespace retake
