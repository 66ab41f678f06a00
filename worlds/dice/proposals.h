// Proposals of section 5.4: one control point, or one component of the initial conditions.
// It must not know what a simulation says.
#pragma once

#include <cstddef>
#include <vector>

#include "sampler/kernel.h"
#include "worlds/dice/table.h"

namespace retake::dice {

/// Draws one control point anew from its prior, as an override of what the key says. On tables as a whole
/// this is a redraw from the prior, so log_hastings and the change of log p_w cancel; log_prior leaves
/// overrides out, and log_hastings is 0.
class RedrawControlPoint final : public Kernel {
 public:
  /// Overrides of `count` control points begin at a Variable: height, restitution and friction of each.
  RedrawControlPoint(std::size_t first_override, std::size_t count, const TableSettings& settings);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::size_t first_override_, count_;
  TableSettings settings_;
};

/// Adds to one Variable, chosen uniformly, a Gaussian number of the prior's standard deviation, or a third of
/// its width, times 10^(-2u), u uniform; what leaves a uniform prior's range comes back in at the other end.
/// Symmetric: log_hastings is 0.
class PerturbOne final : public Kernel {
 public:
  /// Requires: at least one Variable; no Switch, no override.
  PerturbOne(const Model& model, std::vector<std::size_t> variables);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::vector<std::size_t> variables_;
};

}  // namespace retake::dice
