// ChainRun: a chain being run - stepped in slices, its samples recorded, its progress gathered for the store.
// Shared by the daemon's Runner and by `retake sample`. It must not know threads or the store's methods.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "db/records.h"
#include "sampler/chain.h"
#include "server/chains/trace.h"
#include "worlds/scenario.h"

namespace retake {

/// The most effective samples that a stop rule may wish for. Chosen: two digits of every mean.
inline constexpr std::uint64_t kMostEffectiveSamples = 1000;

/// ChainRecord::ended_by of a chain whose world has another version than when it began.
inline constexpr const char* kEndedByVersion = "world_version";

/// Thread safety: one thread at a time, not always the same.
class ChainRun {
 public:
  /// What a chain goes by besides its record; `lesson` is the record's.
  struct Stored {
    std::string lesson{};
    std::string checkpoint{};
    std::vector<std::string> trace_blocks{};
  };
  /// Starts a chain, or continues it if there is a checkpoint.
  /// Throws: std::runtime_error if something stored cannot be read.
  ChainRun(std::shared_ptr<const Scenario> scenario, ChainRecord record, const Stored& stored);

  const ChainRecord& record() const { return record_; }
  const std::shared_ptr<const Scenario>& scenario() const { return scenario_; }

  /// Steps until the time is up, the stop rule applies, the chain awaits its judgement or `most_samples` are
  /// gathered. At least one step, unless the stop rule applies or the chain waits already.
  void step_for(Scenario::Performer& performer, std::chrono::duration<double> time, std::size_t most_samples);

  /// What ended the chain by its stop rule: one of its limits' names; empty while it may
  /// go on.
  std::string_view ended_by() const;

  /// Whether the stop rule by effective samples has to be looked at before the next step. That is so at fixed
  /// numbers of samples alone: 8, and from there on a quarter more each time. A chain that was waiting when
  /// its checkpoint was taken waits again.
  bool awaits_judgement() const { return awaits_judgement_; }
  /// Ends the wait; the chain ends if `effective_samples` reach the wish. They have to be those of everything
  /// that the chain found so far. Requires: awaits_judgement().
  void judge(std::optional<double> effective_samples);

  /// Samples gathered since the last take_progress().
  std::size_t gathered() const { return samples_.size(); }
  /// Everything since the last call, for one transaction. What it has learned is part of it once: a proposal
  /// as soon as learning has ended, else in the last progress of a chain.
  ChainProgress take_progress(bool is_last = false);

 private:
  /// What is known of the sample on which a walker stands.
  struct Standing {
    enum class Place { on_no_sample, on_gathered, on_handed_over };
    Place place = Place::on_no_sample;
    std::size_t gathered = 0;     ///< where it is among samples_
    std::uint64_t iteration = 0;  ///< that of the sample
    std::uint64_t told = 0;       ///< the weight that was handed over last
  };

  void step(Scenario::Performer& performer);
  void record_sample(Scenario::Performer& performer);
  void close_stay(Standing& standing, std::uint64_t weight);
  void update_counters();
  std::optional<Lesson> take_lesson(bool is_last);

  std::shared_ptr<const Scenario> scenario_;
  ChainRecord record_;
  Chain chain_;
  Trace trace_;
  std::vector<NewSample> samples_;
  std::vector<WeightUpdate> weights_;
  std::vector<Standing> standings_;  ///< one a walker
  bool was_learning_ = false;        ///< as far as was handed over
  bool awaits_judgement_ = false;
  bool reached_ess_ = false;
  std::uint64_t steps_between_clocks_ = 1;
};

/// Which limit of a rule a chain has reached, but for effective samples: its name, empty for none.
/// `counters` are those beside `counts`.
std::string_view limit_reached(const StopRule& stop, const ChainCounts& counts,
                               const ChainCounters& counters);

/// The settings of the sampler's Chain that a record stands for, but for its lesson's bytes. Requires: its
/// method and ratios are known.
ChainSettings settings_of(const ChainRecord& record);

}  // namespace retake
