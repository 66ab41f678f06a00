// Total: the dice's own constraint - how much they show together. Beyond the paper.
// It must not know how dice move.
#pragma once

#include "worlds/term.h"

namespace retake::dice {

/// `total`: the faces on top add up to a sum.
TermKind total_term();

}  // namespace retake::dice
