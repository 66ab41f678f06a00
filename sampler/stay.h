// Stay: where a chain stands, what it counts and by which settings it walks, as plain values.
// doc/design.md, section 3. Everything that others keep or show of a chain is here; how it walks is not.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sampler/odds.h"
#include "sampler/simulator.h"
#include "sampler/target.h"

namespace retake {

/// When a conditional chain begins to learn, and when it stops. It begins after so many draws of the prior,
/// and never where chance alone finds what is wished. It stops at so many hits, if the prior alone would have
/// found some of them (others come from where some were found before), or after so many draws if there is
/// anything to learn from.
struct LearningLimits {
  std::uint64_t hits = 200;
  double plain_hits = 20;
  std::uint64_t draws = 2'000'000;
  std::uint64_t plain_draws = 64;  ///< 0: it learns whatever chance finds
};

struct ChainSettings {
  std::uint64_t seed = 0;
  std::uint32_t index = 0;
  Method method = Method::metropolis;
  /// Off: every candidate is simulated to its end. The chain is the same bit for bit; only slower.
  bool early_rejection = true;
  LearningLimits learning{};
  /// The bytes of a Lesson to begin from, in place of learning; empty: none.
  std::string lesson{};
};

struct KernelCounter {
  std::string name;
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
  double simulated_seconds = 0;  ///< [s] of the world's time
  double skipped_seconds = 0;    ///< [s] of the world's time that did not have to be stepped
  std::vector<KernelCounter> kernels;
  /// Whether it explores or adapts. What it finds then has weight 0, but for draws of the prior before
  /// anything was learned, and is no part of any estimate.
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

/// Calls `visit(name, value)` for every counter that is one number, in the order in which checkpoints hold
/// them. Who keeps, sends or shows the counters goes by this list.
template <typename Counts, typename Visitor>
void visit_counters(Counts&& counts, Visitor&& visit) {
  visit("iteration", counts.iteration);
  visit("accepted", counts.accepted);
  visit("samples", counts.samples);
  visit("simulations", counts.simulations);
  visit("failed_simulations", counts.failed_simulations);
  visit("simulated_seconds", counts.simulated_seconds);
  visit("skipped_seconds", counts.skipped_seconds);
}

}  // namespace retake
