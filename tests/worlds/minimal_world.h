// The world `shuffleboard`, small and whole: an example of how a world is written.
// No part of the program, but held to the same contract as the registered ones.
#pragma once

#include "worlds/world.h"

namespace retake::tests {

const World& minimal_world();

}  // namespace retake::tests
