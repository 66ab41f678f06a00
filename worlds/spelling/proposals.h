// Proposals of appendix B.2 that are the marbles' own: moving one ball, and two of them as they were
// published. It must not know what a simulation says.
#pragma once

#include <cstddef>
#include <vector>

#include "sampler/kernel.h"

namespace retake::spelling {

/// Moves one ball that is on, chosen uniformly, in a random direction by a Gaussian distance; what leaves the
/// drop area comes back in at the other end. Symmetric: log_hastings is 0. With no ball on, nothing changes.
class MoveOneBall final : public Kernel {
 public:
  /// Requires: every switch governs two uniform Variables; step [m] > 0.
  MoveOneBall(const Model& model, std::vector<std::size_t> switches, double step);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::vector<std::size_t> switches_;
  double step_;
};

/// "Change all" as B.2 has it: balls are drawn from their prior, every vertex is offset in a random direction
/// by a Gaussian distance, and the proposal is called symmetric. Drops enter p_w and q alike and cancel; of
/// the offsets only p_w counts. Such offsets are shorter than the model's, one standard deviation squared
/// where it has three, so log p_w leaps up: the "change-all effect". It does not leave p(A) invariant.
class PublishedChangeAll final : public Kernel {
 public:
  /// Requires: from `first_offset` on, the model has three Variables a vertex.
  PublishedChangeAll(const Model& model, std::size_t first_offset, double deviation);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::size_t first_offset_;
  double deviation_;  ///< [m]
};

/// Toggle with the ratio that B.2 means: the drop area cancels, and the ways to choose the balls are left
/// out. It does not leave p(A) invariant. (As printed, with the area upside down, it would depend on the
/// unit.)
class PublishedToggle final : public Kernel {
 public:
  /// Requires: what Toggle requires.
  PublishedToggle(const Model& model, std::vector<std::size_t> switches, double probability);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::vector<std::size_t> switches_;
  Toggle toggle_;
};

}  // namespace retake::spelling
