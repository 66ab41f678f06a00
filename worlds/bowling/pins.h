// The term `pins`: which pins shall fall, and that the others stay where they are.
// Paper, section 5.2.1. It reads the animation alone.
#pragma once

#include "worlds/term.h"

namespace retake::bowling {

TermKind pins_term();

}  // namespace retake::bowling
