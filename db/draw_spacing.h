// DrawSpacing: which samples of a chain are its draws, when at most so many are looked at.
// Realises doc/design.md, section 3, "Diagnostics". Knows only weights.
#pragma once

#include <algorithm>
#include <cstdint>

namespace retake {

/// Cuts the satisfied iterations of a chain, its samples counted with their weights, into equal parts; the
/// draw of a part is the sample on which the chain stood in the part's middle.
class DrawSpacing {
 public:
  /// `total`: the sum of all weights. There are `most` parts, but no more than `total`.
  DrawSpacing(std::uint64_t total, std::uint64_t most) : total_(total), parts_(std::min(most, total)) {}

  std::uint64_t parts() const { return parts_; }
  bool is_done() const { return drawn_ == parts_; }
  /// How many draws the next sample is, in the order of the chain.
  std::uint64_t take(std::uint64_t weight) {
    passed_ += weight;
    std::uint64_t draws = 0;
    for (; !is_done() && middle(drawn_) < passed_; ++drawn_)
      ++draws;
    return draws;
  }

 private:
  /// (2 part + 1) total / (2 parts), rounded down without overflow.
  std::uint64_t middle(std::uint64_t part) const {
    const std::uint64_t odd = 2 * part + 1, halves = 2 * parts_;
    return odd * (total_ / halves) + odd * (total_ % halves) / halves;
  }

  std::uint64_t total_;
  std::uint64_t parts_;
  std::uint64_t passed_ = 0;
  std::uint64_t drawn_ = 0;
};

}  // namespace retake
