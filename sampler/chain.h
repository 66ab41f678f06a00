// Chain: one seeded walk over one target, by one of four methods.
// Paper, section 4; doc/design.md, section 3. It must not know physics, storage or clocks: a seed decides
// everything.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sampler/guide.h"
#include "sampler/kernel.h"
#include "sampler/learned.h"
#include "sampler/model.h"
#include "sampler/odds.h"
#include "sampler/placed_redraw.h"
#include "sampler/simulator.h"

namespace retake {

enum class Method {
  metropolis,   ///< walks p(A) by the world's proposals
  rejection,    ///< independent draws from the prior, kept with probability p_c
  conditional,  ///< walks p(A | satisfied): the way the world shows, or else by a redraw learned from hits
  tempering,    ///< replicas between the prior and p(A) that swap places
};
std::string_view to_string(Method method);
std::optional<Method> method_from(std::string_view name);
std::string_view to_string(Ratios ratios);
std::optional<Ratios> ratios_from(std::string_view name);

/// What a chain walks on. Immutable, shared by all chains of a scenario.
struct Target {
  std::shared_ptr<const Model> model;
  KernelTable kernels;
  std::vector<std::string> measure_names;
  /// The least log_constraint of a satisfied animation, minus infinity if unknown. 0: log_constraint is
  /// constant where the constraint is satisfied, so a satisfied State of any beta is a draw of p(A |
  /// satisfied).
  double least_satisfied = -std::numeric_limits<double>::infinity();
  /// What a redraw learns from hits; empty: every Variable that is always present.
  std::vector<Coordinate> learned{};
  /// How `conditional` walks where the world knows; null: it learns.
  std::shared_ptr<const Guide> guide{};
  /// How `conditional` puts draws where they satisfy, where the world can; null: it cannot. Without a guide.
  std::shared_ptr<const PlacedRedraw> placed{};
  /// Proposals on p(A) that look at Scores, which `metropolis` mixes with `kernels`; null: none.
  std::shared_ptr<const ScoredKernelTable> scored_kernels{};
};

/// When a conditional chain stops learning: at so many hits, if the prior alone would have found some of them
/// (others come from where some were found before), or after so many draws if there is anything to learn
/// from.
struct LearningLimits {
  std::uint64_t hits = 200;
  double plain_hits = 20;
  std::uint64_t draws = 2'000'000;
};

struct ChainSettings {
  std::uint64_t seed = 0;
  std::uint32_t index = 0;
  Method method = Method::metropolis;
  /// Off: every candidate is simulated to its end. The chain is the same bit for bit; only slower.
  bool early_rejection = true;
  LearningLimits learning{};
};

struct KernelCounter {
  std::uint64_t proposed = 0;
  std::uint64_t accepted = 0;
};

/// One rung of a tempering ladder: a replica there walks p_w p_c^beta.
struct RungCounter {
  double beta = 0;
  std::uint64_t proposed = 0;  ///< swaps with the next rung, since the ladder was changed last
  std::uint64_t accepted = 0;
};

struct ChainCounts {
  std::uint64_t iteration = 0;
  std::uint64_t accepted = 0;
  std::uint64_t samples = 0;  ///< States moved to whose animation is satisfied
  std::uint64_t simulations = 0;
  std::uint64_t failed_simulations = 0;
  double simulated_seconds = 0;        ///< [s] of the world's time
  double skipped_seconds = 0;          ///< [s] of the world's time that did not have to be stepped
  std::vector<KernelCounter> kernels;  ///< in the order of Chain::kernel_names()
  /// While it explores or adapts, its Samples have weight 0: they are no part of any estimate.
  bool is_learning = false;
  OddsTally odds;
  std::vector<RungCounter> rungs;  ///< of a ladder, from the prior up; else empty
};

/// Where a walker stands and since when. With rejection: the draw that was kept last.
struct Stay {
  std::uint64_t iteration =
      0;  ///< the iteration that moved here; 0: the initial State, which is never a sample
  /// How often it counts as a draw of p(A | satisfied) so far: the steps for which it has stayed; with
  /// conditional a number drawn on arrival, and with rejection always 1. 0 for what was found while learning.
  std::uint64_t weight = 1;
  bool is_sample = false;
  State state;
  double log_prior = 0;
  Score score;
};

class Walk;

/// Contract: after the same number of steps two chains with equal target and settings are equal bit for bit,
/// whatever threads, simulators, pauses or checkpoints lie between. (Of the counters, simulated_seconds and
/// skipped_seconds tell what was really stepped: a chain that comes from a checkpoint has no Run to resume
/// from at first.) Thread safety: one thread at a time, not always the same.
class Chain {
 public:
  Chain(std::shared_ptr<const Target> target, const ChainSettings& settings);
  /// Continues from `checkpoint()` of a chain with equal target and settings.
  /// Throws: std::runtime_error if the bytes are not such a checkpoint.
  Chain(std::shared_ptr<const Target> target, const ChainSettings& settings, std::string_view checkpoint);

  /// One iteration. True if the chain moved to a new State (an accepted candidate equal to the current State
  /// is no move, and costs no simulation). The first step of a new chain also simulates the initial State.
  /// Throws: std::runtime_error if the prior never draws a State within its support.
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
  /// What ChainCounts::kernels counts.
  std::vector<std::string> kernel_names() const;
  std::string checkpoint() const;
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
