// NaiveMarbles: marbles that fall into the partitioned box, on Bullet with stock parts alone, for the impulse
// engine to be measured against. Paper, section 5.3. It must not know how worlds/impulse simulates, only the
// box and what is dropped.
#pragma once

#include <memory>

#include "worlds/impulse/run.h"
#include "worlds/spelling/box.h"

namespace retake::spelling {

/// Simulates in centimetres, for which Bullet's thresholds are made. Thread safety: one thread at a time.
class NaiveMarbles {
 public:
  /// The box as it was built: offsets are left out.
  explicit NaiveMarbles(const Box& box);
  ~NaiveMarbles();
  NaiveMarbles(const NaiveMarbles&) = delete;
  NaiveMarbles& operator=(const NaiveMarbles&) = delete;

  /// Drops marbles and plays until everything sleeps, at most to the scene's latest step. Returns the number
  /// that sleep in a bin.
  int in_bins(const impulse::Settings& settings, const impulse::Scene& scene);

 private:
  struct Parts;
  const Box& box_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace retake::spelling
