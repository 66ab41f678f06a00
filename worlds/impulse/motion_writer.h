// MotionWriter: how a Motion comes about, step by step or copied from another one. Whichever way, equal
// steps give equal bits. doc/design.md, section 3. It must not know why.
#pragma once

#include <memory>
#include <span>

#include "worlds/impulse/run.h"

namespace retake::impulse {

/// Thread safety: one thread at a time.
class MotionWriter {
 public:
  /// A motion that has only its first state, or none yet, to be copied to.
  explicit MotionWriter(const SphereState& birth);
  MotionWriter();

  const SphereState& state() const { return motion_->states.back(); }
  bool rests() const { return motion_->rests; }

  struct Step {
    SphereState state;     ///< at its end
    std::uint32_t region;  ///< of the surface
    std::span<const std::int32_t> partners;
    std::span<const Impact> impacts;
    bool rests;
  };
  void append(const Step& step);
  /// Copies from `source` what follows, up to state `end` since birth. Requires: this motion's last state, if
  /// it has one, is the one in `source`.
  void copy(const Motion& source, std::int32_t end);
  /// Gives the motion away.
  std::shared_ptr<const Motion> finish(const Settings& settings);

 private:
  void meet(std::int32_t other, std::int32_t begin, std::int32_t end);
  void stay(std::uint32_t region, std::int32_t begin);

  std::shared_ptr<Motion> motion_;
};

/// Whether step k of a motion was this one: partners, impacts and the state at its end.
bool has_step(const Motion& motion, std::int32_t k, const MotionWriter::Step& step);

}  // namespace retake::impulse
