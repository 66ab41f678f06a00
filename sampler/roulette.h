// Roulette: gives up simulations that promise little, by chance, and lets those that go on count for them.
// DESIGN section 3, "Symmetry sampling"; in particle transport, Russian roulette. It must not know what is
// promised, or what features are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sampler/bytes.h"
#include "sampler/random.h"
#include "sampler/simulator.h"

namespace retake {

/// How likely a simulation is to survive, by checkpoint and bin of what it looks like there: proportional to
/// the root of expected squared weight over time still needed. Learned from simulations that were played to
/// their end, then frozen, so that what is counted with 1 / survival has the right mean.
class Roulette {
 public:
  /// Without checkpoints everything survives.
  Roulette(std::size_t checkpoints, std::size_t bins);

  struct Visit {
    std::size_t checkpoint, bin;
    double seconds;  ///< simulated until then
  };
  /// A simulation that was played to its end: what it weighed, and how long it took [s].
  void learn(const std::vector<Visit>& visits, double weight, double seconds);
  void freeze();
  bool is_frozen() const { return is_frozen_; }
  /// In (0, 1]; 1 until it is frozen.
  double survival(std::size_t checkpoint, std::size_t bin) const;

  void write(ByteWriter& out) const;
  /// Of one with as many checkpoints and bins. Throws: std::out_of_range.
  void read(ByteReader& in);

 private:
  struct Cell {
    double square = 0, seconds = 0, count = 0;  ///< sums; of squared weights, and of seconds still needed
  };
  std::size_t bins_;
  bool is_frozen_ = false;
  std::vector<Cell> cells_;        ///< checkpoints x bins, until it is frozen
  std::vector<double> survivals_;  ///< checkpoints x bins
};

}  // namespace retake
