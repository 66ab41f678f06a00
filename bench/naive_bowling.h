// NaiveBowling: a bowling shot as somebody new to Bullet would build it, for the world `bowling` to be
// measured against. Paper, section 5.2, with stock parts alone: convex hulls, boxes, a world for every throw.
// It must not know how worlds/bowling simulates, only the lane's lengths and what a release is.
#pragma once

#include <memory>

#include "worlds/bowling/release.h"

namespace retake::bowling {

/// Throws at a full rack. Thread safety: one thread at a time, and nobody else simulates meanwhile.
class NaiveBowling {
 public:
  NaiveBowling();
  ~NaiveBowling();
  NaiveBowling(const NaiveBowling&) = delete;
  NaiveBowling& operator=(const NaiveBowling&) = delete;

  /// Plays until everything sleeps, and counts the pins that are down.
  int pins_down(const Release& release);

 private:
  class Shapes;
  class Throw;
  std::unique_ptr<Shapes> shapes_;
};

}  // namespace retake::bowling
