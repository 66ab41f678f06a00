// Guide: a world's own way to walk p(A | satisfied) - how a first State is built, and how it is moved on.
// DESIGN section 3, "informed proposals". It must not know chains.
#pragma once

#include <cstdint>

#include "sampler/kernel.h"
#include "sampler/simulator.h"

namespace retake {

/// A kernel that may look at what the current animation's Score says, and whose ratio may depend on the
/// candidate's. Immutable. Thread safety: shared by all threads.
class ScoredKernel {
 public:
  virtual ~ScoredKernel() = default;
  /// Changes `candidate`, which equals `current` on entry; to leave it alone is a proposal too.
  /// Returns an upper bound of log_hastings(), whatever the candidate's animation: the candidate may be given
  /// up early by it.
  virtual double propose(const Model& model, const State& current, const Score& score, State& candidate,
                         RandomStream& random) const = 0;
  /// log q(current | candidate) - log q(candidate | current). For kernels that do not look: 0.
  virtual double log_hastings(const Model& model, const State& current, const Score& score,
                              const State& candidate, const Score& candidate_score) const {
    (void)model, (void)current, (void)score, (void)candidate, (void)candidate_score;
    return 0;
  }
};
using ScoredKernelTable = WeightedTable<ScoredKernel>;

/// Immutable. Thread safety: shared by all threads.
class Guide {
 public:
  virtual ~Guide() = default;

  /// A State from which a satisfied one can be built up, with a Score of its own.
  virtual void begin(const Model& model, State& state, RandomStream& random) const = 0;
  /// Changes `candidate`, which equals `kept` on entry, to go further; or back, after many tries in vain.
  virtual void extend(const Model& model, const State& kept, const Score& score, std::uint64_t vain_tries,
                      State& candidate, RandomStream& random) const = 0;
  /// Whether the candidate that extend() made is to be kept, now that its animation is known.
  virtual bool keeps(const State& kept, const Score& score, const State& candidate,
                     const Score& candidate_score) const = 0;

  /// Proposals that between satisfied States leave p(A | satisfied) as it is.
  virtual const ScoredKernelTable& kernels() const = 0;
  /// Proposals on p(A), by which every State can be reached from every other one; no rows: none are needed.
  virtual const ScoredKernelTable& soft_kernels() const = 0;
  /// Iterations in which everything has been moved about once.
  virtual std::uint64_t sweep() const = 0;
};

}  // namespace retake
