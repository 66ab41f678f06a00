// ChainRun: a chain being run - stepped in slices, its samples recorded, its progress gathered for the store.
// Shared by the daemon's Runner and by `retake sample`. It must not know threads or the store's methods.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "db/records.h"
#include "sampler/chain.h"
#include "server/trace.h"
#include "worlds/scenario.h"

namespace retake {

/// Thread safety: one thread at a time, not always the same.
class ChainRun {
 public:
  /// Starts a chain, or continues it if there is a checkpoint.
  /// Throws: std::runtime_error if the checkpoint or the trace cannot be read.
  ChainRun(std::shared_ptr<const Scenario> scenario, ChainRecord record, std::string_view checkpoint,
           const std::vector<std::string>& trace_blocks);

  const ChainRecord& record() const { return record_; }
  const std::shared_ptr<const Scenario>& scenario() const { return scenario_; }

  /// Steps until the time is up, the stop rule applies or `most_samples` are gathered. At least one step,
  /// unless the stop rule applies already.
  void step_for(Scenario::Performer& performer, std::chrono::duration<double> time, std::size_t most_samples);

  /// What ended the chain by its stop rule: "samples", "iterations" or "seconds"; empty while it may go on.
  std::string_view ended_by() const;

  /// Samples gathered since the last take_progress().
  std::size_t gathered() const { return samples_.size(); }
  /// Everything since the last call, for one transaction.
  ChainProgress take_progress();

 private:
  void step(Scenario::Performer& performer);
  void record_sample(Scenario::Performer& performer);
  void close_stay(std::uint64_t weight);
  void update_counters();

  std::shared_ptr<const Scenario> scenario_;
  ChainRecord record_;
  Chain chain_;
  Trace trace_;
  std::vector<NewSample> samples_;
  std::vector<WeightUpdate> weights_;
  // The sample on which the chain stands: still among samples_ (always the last one), or handed over before.
  enum class Standing { on_no_sample, on_gathered, on_handed_over };
  Standing standing_ = Standing::on_no_sample;
  std::uint64_t standing_iteration_ = 0;
  std::uint64_t steps_between_clocks_ = 1;
};

/// The settings of the sampler's Chain that a record stands for. Requires: its method and ratios are known.
ChainSettings settings_of(const ChainRecord& record);

}  // namespace retake
