// Pour: marbles dropped one by one into the box until all of them rest - what is measured, and the animation
// that a viewer sees. Paper, section 5.3. It must not know wishes beyond what a Recording passes on.
#pragma once

#include <cstdint>
#include <memory>

#include "worlds/impulse/sphere.h"
#include "worlds/spelling/box.h"
#include "worlds/spelling/marbles.h"
#include "worlds/world.h"

namespace retake::spelling {

struct PourSettings {
  impulse::Settings engine{};
  std::int64_t interval_steps = 150;  ///< from one drop to the next, in time steps, whether or not it is on
};

/// Names and kinds of what a pour of so many marbles measures.
std::vector<Measure> pour_measures(std::size_t marbles);
/// Which of them is the bin of the first marble; those of the others follow.
inline constexpr std::size_t kFirstBinMeasure = 3;

/// The physics of pours of one scene, for one thread. Its animations have a track for each marble that takes
/// part, in the order of their drops.
std::unique_ptr<Physics> make_pours(std::shared_ptr<const MarbleModel> marbles,
                                    std::shared_ptr<const Box> box, const PourSettings& settings);

}  // namespace retake::spelling
