// PlacedRedraw: a world's own way to put a draw where it satisfies, once it is known how it moves.
// doc/design.md, section 3, "Symmetry sampling". It must not know chains.
#pragma once

#include "sampler/simulator.h"

namespace retake {

/// A redraw of what the motion does not depend on, such as where a whole scene stands, given how the motion
/// came out. Immutable. Thread safety: shared by all threads.
class PlacedRedraw {
 public:
  virtual ~PlacedRedraw() = default;
  /// Requires: whether a simulation fails does not depend on what is set.
  /// Sets Variables in `candidate`, which equals `drawn` on entry: a draw from the prior, whose animation has
  /// `score`. They are drawn from a density q that covers every value with which the candidate satisfies.
  /// Returns log p(what was set) - log q(what was set); minus infinity if no value can satisfy.
  virtual double place(const State& drawn, const Score& score, State& candidate,
                       RandomStream& random) const = 0;
  /// Whether simulations are looked at, and may be given up by chance.
  virtual bool plays_roulette() const { return false; }
  /// See SurvivalFunction; what goes on counts for what does not.
  virtual double survival(std::size_t checkpoint, std::span<const double> features) const {
    (void)checkpoint, (void)features;
    return 1;
  }
  /// What place() returns at most, but for draws of the prior that are never met; it only says what a large
  /// weight is.
  virtual double most_log_weight() const = 0;
};

}  // namespace retake
