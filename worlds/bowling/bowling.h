// The world `bowling`: any ten-pin shot, told by the pins that are set and the pins that shall fall.
// Paper, section 5.2 and appendix A.
#pragma once

#include "worlds/world.h"

namespace retake::bowling {

const World& world();

}  // namespace retake::bowling
