// A PlacedRedraw without its roulette, for tests and benchmarks that hold the two side by side.
#pragma once

#include <memory>
#include <utility>

#include "sampler/placed_redraw.h"

namespace retake::tests {

/// The same without a look before the end.
class WithoutRoulette final : public PlacedRedraw {
 public:
  explicit WithoutRoulette(std::shared_ptr<const PlacedRedraw> placed) : placed_(std::move(placed)) {}
  double place(const State& drawn, const Score& score, State& candidate,
               RandomStream& random) const override {
    return placed_->place(drawn, score, candidate, random);
  }
  double most_log_weight() const override { return placed_->most_log_weight(); }

 private:
  std::shared_ptr<const PlacedRedraw> placed_;
};

}  // namespace retake::tests
