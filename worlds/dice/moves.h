// Moves: how `conditional` walks among throws of dice that end where it is wished - several dice on one
// table, or one on a table that is glued to the world. doc/design.md, section 3, "Informed proposals". It
// must not know chains.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "sampler/guide.h"
#include "worlds/dice/dice_model.h"
#include "worlds/dice/end_wish.h"

namespace retake::dice {

/// Dice that are brought to their places one by one, the farthest first, by what they meet late; then walks
/// by these kernels, which leave p(A | satisfied) as it is:
///
/// - `alone`: one die is thrown anew, on a table of which only what other dice touch is as it was;
/// - `later`: of the table, what one die has touched before some time and what the others touch is as it was;
/// - `launch`: one die is thrown anew on the same table, whatever it hits;
/// - `all_later`: of the table, what any die has touched before some time is as it was;
/// - `point`: one control point that some die touches is moved a little;
/// - `pose`: grid and dice are turned and shifted together, if the grid's pose is random.
///
/// `alone` and `later` are given up if the die has met another one since, before or after: else what the
/// others touch would change, and there would be no way back. Where dice are thrown anew, simulations that
/// promise little are given up by chance. Paint is drawn among that which shows the faces that are wished.
std::shared_ptr<const Guide> make_dice_guide(std::shared_ptr<const DiceModel> model,
                                             const EngineSettings& engine, std::vector<EndWish> wishes,
                                             const EndMeasures& measures);

}  // namespace retake::dice
