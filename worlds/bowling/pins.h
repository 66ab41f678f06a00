// The term `pins`: which pins shall fall, and that the others stay where they are.
// Paper, section 5.2.1. It reads the animation alone.
#pragma once

#include "worlds/term.h"

namespace retake::bowling {

TermKind pins_term();

/// Which of Animation::tracks the pins follow: those after the ball's, in the rack's order.
inline constexpr std::size_t kFirstPinTrack = 1;

}  // namespace retake::bowling
