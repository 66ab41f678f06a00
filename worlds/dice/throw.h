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

/// When a throw of one die is looked at, see Watch: the features are where it may come to rest, from its
/// start along and across its heading [m], and its horizontal speed [m/s].
struct Look {
  double seconds;   ///< [s] from the start
  double rolls_on;  ///< [s] times its velocity is how far it still goes, on the whole
};
std::array<Look, 7> look_times(const DiceSettings& settings);

/// Names and kinds of what a throw of so many dice measures.
std::vector<Measure> throw_measures(std::size_t dice);

/// The physics of throws of one scene, for one thread. An animation's first tracks and bodies are the dice;
/// tracks are turned by the paint, so that face_normal() says which face is where.
std::unique_ptr<Physics> make_throws(std::shared_ptr<const DiceModel> model, const EngineSettings& engine,
                                     const DieShape& shape);

}  // namespace retake::dice
