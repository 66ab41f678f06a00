// What a viewer of a throw sees: the bodies of the animation, in one fixed order, and where to look.
// It must not know how anything moves.
#pragma once

#include <string>
#include <vector>

#include "worlds/animation.h"
#include "worlds/bowling/deck.h"
#include "worlds/roster.h"
#include "worlds/world.h"

namespace retake::bowling {

/// What a constraint can name: the ball, the pins of a rack, and what they can hit. A pin tells when it
/// falls.
Roster roster(const std::vector<int>& rack);

/// Which of Animation::tracks the pins follow: those after the ball's, in the rack's order.
inline constexpr std::size_t kFirstPinTrack = 1;

inline constexpr const char* kBallName = "ball";
std::string pin_name(int pin);

/// Fills in Animation::bodies: the ball and the pins as the deck counts them, then what stands still, then
/// what only the eye needs: the stripes on the pins, the lane's surroundings and markings, the finger holes.
void write_scene(const std::vector<int>& rack, double ball_radius, Animation& animation);

/// Which of Animation::bodies has this surface at a place on this side of the lane.
std::size_t still_body(Surface surface, double z, std::size_t pins);

/// The pin deck, seen from behind the ball.
Viewpoint deck_viewpoint();

}  // namespace retake::bowling
