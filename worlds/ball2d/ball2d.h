// The world `ball2d`: a ball dropped on a table whose normal is uncertain at every collision.
// Paper, sections 3.1 and 5.1.
#pragma once

#include "worlds/world.h"

namespace retake::ball2d {

const World& world();

}  // namespace retake::ball2d
