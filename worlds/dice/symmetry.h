// Symmetry: puts the throw of one die where it is wished, painted as it is wished. What the motion in the
// grid does not depend on is drawn given how it came out: where the die starts, in which direction it flies,
// handedness and paint. doc/design.md, section 3, "Symmetry sampling". It must not know how dice move.
#pragma once

#include <array>
#include <memory>

#include "sampler/placed_redraw.h"
#include "worlds/dice/dice_model.h"
#include "worlds/dice/end_wish.h"
#include "worlds/dice/throw.h"

namespace retake::dice {

/// Requires: one die, GridPose::random.
class Symmetry final : public PlacedRedraw {
 public:
  Symmetry(std::shared_ptr<const DiceModel> model, const EndWish& wish, const EndMeasures& measures);

  double place(const State& drawn, const Score& score, State& candidate, RandomStream& random) const override;
  bool plays_roulette() const override { return wish_.place.has_value(); }
  /// By the weight that is to be expected of a throw that will come to rest about there: closed again, as a
  /// wider start would make it.
  double survival(std::size_t look, std::span<const double> features) const override;
  /// Over throws up to five deviations faster than the mean.
  double most_log_weight() const override { return most_log_weight_; }

  /// From start to rest, seen along the heading of the throw, not mirrored: (along, across) [m].
  Eigen::Vector2d displacement(const State& state, const Score& score) const;
  /// log of the prior's density that a throw of that horizontal speed [m/s] and displacement ends at
  /// `target`, mirrored or not, times the disc's area: heading and start integrated out.
  double log_weight_of_place(double speed, const Eigen::Vector2d& displacement,
                             const Eigen::Vector2d& target) const;

 private:
  double concentration(double speed) const;
  double log_promise(std::size_t look, const Eigen::Vector2d& rest) const;
  double place_die(const State& drawn, const Score& score, State& candidate, RandomStream& random) const;
  double paint_die(const State& drawn, const Score& score, State& candidate, RandomStream& random) const;
  double most_log_weight_of_place() const;
  double most_log_promise(std::size_t look) const;

  std::shared_ptr<const DiceModel> model_;
  EndWish wish_;
  EndMeasures measures_;
  double most_log_weight_ = 0;
  std::array<double, kLooks> most_log_promise_{};
};

/// log of exp(-x) I0(x), x >= 0.
double log_scaled_bessel_i0(double x);
/// An angle with density exp(concentration cos(angle - mean)) (Best and Fisher 1979).
double draw_von_mises(double mean, double concentration, RandomStream& random);

}  // namespace retake::dice
