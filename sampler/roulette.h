// Roulette: gives up simulations that promise little, by chance, so that those which go on count for them.
// doc/design.md, section 3, "Symmetry sampling"; in particle transport, Russian roulette. It must not know
// what is promised, or what features are.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>

#include "sampler/random.h"
#include "sampler/simulator.h"

namespace retake {

/// How likely a simulation is to survive a checkpoint where it looks like this, in (0, 1].
using SurvivalFunction = std::function<double(std::size_t checkpoint, std::span<const double> features)>;

/// What survives if its weight is expected to be, of the largest that is, as much as this: the root, as more
/// would cost more than it is worth; sure from a quarter on, and 1 in 50 at least, so that nothing counts
/// more than 50 times what it would. Chosen; measured on dice: half or twice the quarter loses 5 %.
inline double survival_of_promise(double log_share) {
  constexpr double kSure = 0.5, kLeast = 0.02;
  return std::clamp(std::exp(0.5 * log_share) / kSure, kLeast, 1.0);
}

/// The chance to have come so far is the least of the survivals that were met: a function of what is
/// simulated alone, whichever way it was played.
class Roulette : public Watch {
 public:
  /// Requires: `random` outlives it.
  Roulette(SurvivalFunction survival, RandomStream& random) : of_(std::move(survival)), random_(random) {}
  bool goes_on(std::size_t checkpoint, double, std::span<const double> features) override {
    const double least = of_(checkpoint, features);
    if (least >= survival_) return true;
    const double share = least / survival_;
    survival_ = least;
    return random_.uniform() < share;
  }
  double survival() const { return survival_; }

 private:
  SurvivalFunction of_;
  RandomStream& random_;
  double survival_ = 1;
};

}  // namespace retake
