// The two methods that every other one is measured against: the paper's chain, and rejection from the prior.
// Paper, section 4. Internal to the sampler.
#pragma once

#include "sampler/walk.h"

namespace retake {

/// The paper's algorithm: one kernel of the world's table an iteration, on p(A). Where the target has scored
/// kernels too, they take most iterations.
class Metropolis final : public Walk {
 public:
  Metropolis(const Target& target, const ChainSettings& settings, ChainCounts& counts)
      : Walk(target, settings, counts) {}
  static std::vector<std::string> kernel_names(const Target& target);

  void start(Simulator& simulator) override;
  bool step(Simulator& simulator) override;

 private:
  bool propose(Simulator& simulator);
};

/// Independent draws from the prior, kept with probability p_c.
class Rejection final : public Walk {
 public:
  Rejection(const Target& target, const ChainSettings& settings, ChainCounts& counts)
      : Walk(target, settings, counts) {
    counts_.odds.basis = OddsBasis::rejection;
  }
  bool step(Simulator& simulator) override;
};

}  // namespace retake
