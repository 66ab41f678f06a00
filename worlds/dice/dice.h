// The world of dice thrown on random tables. Paper, section 5.4.
#pragma once

#include "worlds/world.h"

namespace retake::dice {

const World& world();

}  // namespace retake::dice
