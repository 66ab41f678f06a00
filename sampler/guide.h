// Guide: a world's own way to walk p(A | satisfied) - how a first State is built, and how it is moved on.
// doc/design.md, section 3, "Informed proposals". It must not know chains.
#pragma once

#include <cstdint>
#include <memory>

#include "sampler/kernel.h"
#include "sampler/simulator.h"

namespace retake {

/// A State, and what its simulation gave.
struct Simulated {
  const State& state;
  const Score& score;
  const Run* run = nullptr;  ///< null where the world does not resume, or where the guide does not read runs
};

/// A kernel that may look at what came of the current State, and whose ratio may depend on what comes of the
/// candidate. Immutable. Thread safety: shared by all threads.
class ScoredKernel {
 public:
  virtual ~ScoredKernel() = default;
  /// Changes `candidate`, which equals `current` on entry; to leave it alone is a proposal too.
  /// Returns an upper bound of log_hastings(), whatever comes of the candidate: it may be given up early by
  /// it.
  virtual double propose(const Model& model, const Simulated& current, State& candidate,
                         RandomStream& random) const = 0;
  /// Who looks at the simulation of what was proposed, and may give it up by chance; null if nobody does.
  virtual std::unique_ptr<Watch> watch(const State& current, const State& candidate,
                                       RandomStream& random) const {
    (void)current, (void)candidate, (void)random;
    return nullptr;
  }
  /// log q(current | candidate) - log q(candidate | current), where q counts what watch() gives up. For
  /// kernels that do not look: 0.
  virtual double log_hastings(const Model& model, const Simulated& current,
                              const Simulated& candidate) const {
    (void)model, (void)current, (void)candidate;
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
  virtual void extend(const Model& model, const Simulated& kept, std::uint64_t vain_tries, State& candidate,
                      RandomStream& random) const = 0;
  /// Who looks at the simulation of what extend() made, and may give it up; null if nobody does.
  virtual std::unique_ptr<Watch> watch(const Simulated& kept, const State& candidate,
                                       RandomStream& random) const {
    (void)kept, (void)candidate, (void)random;
    return nullptr;
  }
  /// Whether the candidate that extend() made is to be kept, now that its animation is known.
  virtual bool keeps(const Simulated& kept, const Simulated& candidate) const = 0;

  /// Proposals that between satisfied States leave p(A | satisfied) as it is.
  virtual const ScoredKernelTable& kernels() const = 0;
  /// Proposals on p(A), by which every State can be reached from every other one; no rows: none are needed.
  virtual const ScoredKernelTable& soft_kernels() const = 0;
  /// Iterations in which everything has been moved about once.
  virtual std::uint64_t sweep() const = 0;
  /// Whether two satisfied States give animations that nobody would take for one. So a walk finds how long it
  /// takes to get away from where it was.
  virtual bool differ(const Model& model, const Simulated& a, const Simulated& b) const {
    (void)model, (void)a, (void)b;
    return true;
  }

  /// Whether runs are read: then every Simulated has one.
  virtual bool reads_runs() const { return false; }
  /// Whether place() has something to do.
  virtual bool places() const { return false; }
  /// Sets Variables that the motion does not depend on, in a candidate that was proposed and simulated, from
  /// their prior given that the candidate satisfies. Requires: the share of the prior that does is the same
  /// for all satisfied States. False if nothing satisfies.
  virtual bool place(const Simulated& drawn, State& candidate, RandomStream& random) const {
    (void)drawn, (void)candidate, (void)random;
    return true;
  }
};

}  // namespace retake
