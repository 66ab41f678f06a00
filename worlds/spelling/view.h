// What a viewer of a pour sees: the bodies of the animation, in one fixed order, and where to look.
// Paper, figures 5 and 8. It must not know how anything moves.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "worlds/animation.h"
#include "worlds/roster.h"
#include "worlds/spelling/box.h"
#include "worlds/spelling/letters.h"
#include "worlds/world.h"

namespace retake::spelling {

/// What a constraint can name: so many marbles, each of which tells when it comes to rest, and what they can
/// hit.
Roster roster(std::size_t marbles);

/// Of the marble with an index from 0 on; names count from 1.
std::string marble_name(std::size_t marble);

/// Fills in Animation::bodies: the marbles, one for each track, named after their number from 1 on; then the
/// box with its vertices where this pour's offsets put them, its walls, and what it stands on.
void write_scene(const Box& box, std::span<const Eigen::Vector3d> offsets,
                 std::span<const std::size_t> marbles, Animation& animation);

/// Which of Animation::bodies is hit at a place [m], if there are so many marbles.
std::size_t still_body(const Box& box, const Eigen::Vector3d& place, std::size_t marbles);

/// The floors of the designated bins, which show what is wished.
Body designated_floors(const Box& box, const BinPattern& pattern);

/// The box of an animation from above, at an angle. Requires: bodies from write_scene.
Viewpoint box_viewpoint(const Animation& animation);

}  // namespace retake::spelling
