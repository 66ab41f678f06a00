// Throw: a whole bowling shot - the roll, the deck, what is measured, and the animation that a viewer sees.
// Paper, section 5.2. It must not know wishes beyond what a Recording passes on.
#pragma once

#include <memory>

#include "worlds/bowling/deck.h"
#include "worlds/bowling/release.h"
#include "worlds/world.h"

namespace retake::bowling {

/// Names and kinds of what a throw at so many pins measures; the last ones are the pins in the order in which
/// they fall, absent from the first that stands.
std::vector<Measure> throw_measures(std::size_t pins);

/// The physics of throws of one scene, for one thread.
std::unique_ptr<Physics> make_throws(std::shared_ptr<const ReleaseModel> releases,
                                     const LaneFriction& friction, const DeckSettings& deck);

}  // namespace retake::bowling
