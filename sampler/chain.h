// Chain: one seeded walk over one target, by one of four methods.
// Paper, section 4; doc/design.md, section 3. It must not know physics, storage or clocks: a seed decides
// everything.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "sampler/lesson.h"
#include "sampler/simulator.h"
#include "sampler/stay.h"
#include "sampler/target.h"

namespace retake {

class Walk;

/// Contract: after the same number of steps two chains with equal target and settings are equal bit for bit,
/// whatever threads, simulators, pauses or checkpoints lie between. (Of the counters, simulated_seconds and
/// skipped_seconds tell what was really stepped: a chain that comes from a checkpoint has no Run to resume
/// from at first.) Thread safety: one thread at a time, not always the same.
class Chain {
 public:
  /// Throws: std::runtime_error if the settings' lesson is none of this target and method.
  Chain(std::shared_ptr<const Target> target, const ChainSettings& settings);
  /// Continues from `checkpoint()` of a chain with equal target and settings.
  /// Throws: std::runtime_error if the bytes are not such a checkpoint.
  Chain(std::shared_ptr<const Target> target, const ChainSettings& settings, std::string_view checkpoint);

  /// One iteration. True if the chain moved to a new State (an accepted candidate equal to the current State
  /// is no move, and costs no simulation). The first step of a new chain also simulates the initial State.
  /// Throws: std::runtime_error if the prior never draws a State within its support; whatever the simulator
  /// throws. The chain then stands nowhere, and is to be made again from a checkpoint.
  bool step(Simulator& simulator);

  /// How many walkers there are: the replicas of a ladder, one with every other method. It may change.
  std::size_t walkers() const;
  /// The walker that took the last step.
  std::size_t walker() const;
  const Stay& stay(std::size_t walker) const;
  const Stay& stay() const { return stay(walker()); }
  /// What the stay weighed that the last move of a walker ended.
  std::uint64_t ended_weight() const;
  const ChainCounts& counts() const { return *counts_; }
  const ChainSettings& settings() const { return *settings_; }
  const Target& target() const { return *target_; }
  std::string checkpoint() const;
  /// What it knows, for others to begin from; none while it knows nothing, and where the method has nothing
  /// to learn.
  std::optional<Lesson> lesson() const;
  ~Chain();
  Chain(Chain&&) noexcept;
  Chain& operator=(Chain&&) noexcept;

 private:
  std::shared_ptr<const Target> target_;
  std::unique_ptr<const ChainSettings> settings_;
  std::unique_ptr<ChainCounts> counts_;
  std::unique_ptr<Walk> walk_;
};

}  // namespace retake
