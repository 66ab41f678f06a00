// Release: what is uncertain in a throw, how candidates are proposed, and what a State means.
// Paper, appendices A.1 and A.2; meant to be read beside them. It must not know how the throw goes on.
#pragma once

#include <memory>
#include <vector>

#include "sampler/kernel.h"
#include "sampler/learned.h"
#include "sampler/model.h"
#include "worlds/bowling/roll.h"

namespace retake::bowling {

enum class ReleaseStyle {
  paper,   ///< A.1: hardly any spin
  modern,  ///< the speed, revolutions, axis rotation and tilt of professional players
};

inline constexpr double kPinOffset = 0.001;  ///< [m] standard deviation of where a pin is set, each way (A.1)

/// A throw as a State says it.
struct Release {
  Ball ball;
  Motion motion;  ///< at the foul line
  /// Of each pin of the rack from its spot [m].
  std::vector<Eigen::Vector3d> offsets;
};

class ReleaseModel {
 public:
  /// Requires: `rack` is ascending, pins 1 to 10.
  ReleaseModel(ReleaseStyle style, const std::vector<int>& rack);

  std::shared_ptr<const Model> model() const { return model_; }
  KernelTable kernels(Ratios ratios) const;
  /// The ball's variables, its place last and as the place where it would cross `x` [m]: that is what a wish
  /// depends on most.
  std::vector<Coordinate> learned(const LaneFriction& friction, double x) const;
  /// Requires: a State within the model's support.
  Release read(const State& state) const;

 private:
  Release read_ball(const State& state) const;
  ReleaseStyle style_;
  std::size_t pins_;
  std::shared_ptr<const Model> model_;
};

}  // namespace retake::bowling
