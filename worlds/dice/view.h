// View: what a viewer sees of thrown dice besides their motion - bodies, colours, the viewpoint.
// It must not know how anything moves.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "worlds/animation.h"
#include "worlds/dice/dice_model.h"
#include "worlds/roster.h"
#include "worlds/world.h"

namespace retake::dice {

/// What a constraint can name: so many dice with their faces, each of which tells when it comes to rest, and
/// the table.
Roster roster(std::size_t dice);

/// Of the die with an index from 0 on; names count from 1.
std::string die_name(std::size_t die);

/// Fills in the bodies: the dice, the table, and the pips of each die; then what only the eye needs, a tray
/// of felt on a desk. `states` says where the dice went, in the grid's frame: the table's bumps are shown
/// there and 3.5 cm around, and end in the felt. The tray has one size, unless dice went beyond it.
void write_scene(const DieShape& shape, const DiceThrow& thrown, const std::vector<DieState>& states,
                 Table& table, Animation& animation);

/// Which of the bodies is the table.
inline std::size_t table_body(std::size_t dice) {
  return dice;
}

/// The box in which the dice move from their launches on, and where most throws go.
Viewpoint throw_viewpoint(const Animation& animation);

}  // namespace retake::dice
