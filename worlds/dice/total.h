// Total: the dice's own constraint - how much they show together. Beyond the paper.
// It must not know how dice move.
#pragma once

#include <optional>

#include "worlds/term.h"

namespace retake::dice {

/// The sum that a term wishes; none if it is no `total`.
std::optional<int> total_of(const Term& term);

/// `total`: the faces on top add up to a sum.
TermKind total_term();

}  // namespace retake::dice
