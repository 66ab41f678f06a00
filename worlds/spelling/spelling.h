// The world `spelling`: marbles poured into a partitioned box, which shall fill the bins of a word.
// Paper, section 5.3 and appendix B.
#pragma once

#include "worlds/world.h"

namespace retake::spelling {

const World& world();

}  // namespace retake::spelling
