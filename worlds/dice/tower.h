// Tower: out of which dice are thrown, so that a viewer sees where each comes from. It is looks alone: dice
// are thrown by the model, and the tower is built around them. It must not know how anything moves.
#pragma once

#include <optional>

#include "worlds/animation.h"
#include "worlds/dice/die.h"

namespace retake::dice {

inline constexpr const char* kTower = "tower";  ///< its name

/// A shaft that stands on the table around where dice are let go, open towards +x: wide and high enough that
/// no die of the animation ever is in its walls. None if it would have to be too large, because dice are let
/// go all over the place or come back. Requires: the frames of the tracks, all of which are dice.
std::optional<Body> tower_around(const Animation& thrown, const DieShape& shape);

}  // namespace retake::dice
