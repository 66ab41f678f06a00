// Painting: paints thrown dice so that they show what is wished. Paint is drawn from the prior and changes
// nothing of the motion, so every throw at rest can show any face. doc/design.md, section 3, "Symmetry
// sampling". It must not know how dice move.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "sampler/placed_redraw.h"
#include "worlds/dice/dice_model.h"
#include "worlds/dice/end_wish.h"

namespace retake::dice {

/// What dice shall show.
struct FaceWish {
  std::vector<std::optional<int>> faces{};  ///< of each die [pips]
  std::optional<int> sum{};                 ///< of all

  bool is_wish() const;
};

/// Faces are drawn uniformly among those that show what is wished, of dice that lean none. So many ways over
/// 6^dice are the weight of every throw, and q covers all that satisfies.
class Painting final : public PlacedRedraw {
 public:
  /// Requires: random paint, a face or none for each die, and as many dice as ways() has room for.
  Painting(std::shared_ptr<const DiceModel> model, FaceWish wish, const EndMeasures& measures);

  double place(const State& drawn, const Score& score, State& candidate, RandomStream& random) const override;
  double most_log_weight() const override { return log_weight_; }

 private:
  /// In how many ways the dice from this one on show what is wished, if they shall show `rest` together;
  /// whatever they show if no sum is wished.
  double ways(std::size_t die, int rest) const;
  bool may_show(std::size_t die, int face) const { return wish_.faces[die].value_or(face) == face; }

  std::shared_ptr<const DiceModel> model_;
  FaceWish wish_;
  EndMeasures measures_;
  std::vector<std::vector<double>> ways_;  ///< [die, rest]
  double log_weight_ = 0;
};

}  // namespace retake::dice
