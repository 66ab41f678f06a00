// Contradictions: terms that no animation satisfies together, found by their claims alone.
// doc/design.md, section 4, "Contradictions". It must not know kinds of terms or worlds.
#pragma once

#include <string>
#include <vector>

#include "worlds/claim.h"
#include "worlds/document.h"

namespace retake {

/// A term as others see it.
struct Claimant {
  std::string pointer;  ///< JSON Pointer of the term
  std::string wish;     ///< what it wishes, as a clause for people
  Claims claims;
};

/// Appends faults for terms that exclude each other, one at each place that has a part in it, which names the
/// others: the first few contradictions, none of which is a consequence of two terms named together before.
/// What it does not find may still be impossible; what it finds is.
void find_contradictions(const std::vector<Claimant>& terms, std::vector<Fault>& faults);

}  // namespace retake
