// Throw: dice thrown on a table until all of them rest, placed in the world - what is measured, and the
// animation that a viewer sees. Paper, section 5.4. It must not know wishes beyond what a Recording passes
// on.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "worlds/dice/dice_model.h"
#include "worlds/dice/tumble.h"
#include "worlds/world.h"

namespace retake::dice {

/// When a die is looked at, see Watch.
struct Look {
  double seconds;   ///< [s] from its start
  double rolls_on;  ///< [s] times its velocity is how far it still goes, on the whole
  double spread;    ///< [m] standard deviation, along each axis, of where it comes to rest instead
};
inline constexpr std::size_t kLooks = 7;
std::array<Look, kLooks> look_times(const DiceSettings& settings);

/// Where a die may come to rest, from its start along and across its heading [m], and its horizontal speed
/// [m/s].
using LookFeatures = std::array<double, 3>;
LookFeatures look_at(const DieState& start, const DieState& now, double rolls_on);

/// Names and kinds of what a throw of so many dice measures.
std::vector<Measure> throw_measures(std::size_t dice);

/// The physics of throws of one scene, for one thread. An animation's first tracks and bodies are the dice;
/// tracks are turned by the paint, so that face_normal() says which face is where.
std::unique_ptr<Physics> make_throws(std::shared_ptr<const DiceModel> model, const EngineSettings& engine,
                                     const DieShape& shape);

}  // namespace retake::dice
