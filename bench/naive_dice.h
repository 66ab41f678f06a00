// NaiveDice: a die thrown on a bumpy table, on Bullet with stock parts alone, for the world `dice` to be
// measured against. Paper, section 5.4. It must not know how worlds/dice simulates, only the table and the
// launch.
#pragma once

#include <memory>

#include "worlds/animation.h"
#include "worlds/dice/die.h"
#include "worlds/dice/table.h"

namespace retake::dice {

/// The settings are those at which Bullet functions best: a convex hull of the die's core with the rounding
/// as its margin, over a height field of 5 mm cells, 480 steps a second, in centimetres. Thread safety: one
/// object at a time in the whole program, because Bullet's hook for materials is global.
class NaiveDice {
 public:
  explicit NaiveDice(const DieShape& shape);
  ~NaiveDice();
  NaiveDice(const NaiveDice&) = delete;
  NaiveDice& operator=(const NaiveDice&) = delete;

  struct Rest {
    bool sleeps;  ///< before the longest roll is over
    Pose pose;    ///< where it ended
  };
  /// Throws one die and plays until it sleeps, for four seconds at most.
  Rest play(Table& table, const DieState& launch);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace retake::dice
