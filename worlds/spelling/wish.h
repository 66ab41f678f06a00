// Wish: the terms `spell` and `bins` - which bins shall hold a marble, and how far an animation is from it.
// Paper, section 5.3. It reads the animation alone.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "worlds/spelling/box.h"
#include "worlds/spelling/letters.h"
#include "worlds/term.h"

namespace retake::spelling {

inline constexpr int kMostColumns = 40, kMostRows = 12;  ///< of a box; chosen

/// The terms of this world. Their scenes have the parameters `columns`, `rows` and `balls`.
std::vector<TermKind> wish_terms();

/// The designated bins of a constraint that may hold anything, in a box of this size; none if it is not one
/// of wish_terms() or has a fault.
std::optional<BinPattern> designated_bins(const nlohmann::json& constraint, int columns, int rows);

/// The box that has room for a constraint's text; none for other constraints, and for a text that no box has
/// room for or that has a fault.
std::optional<TextSize> box_for(const nlohmann::json& constraint);

/// The one box that a constraint `bins` is of; none for other constraints, and where no box is so large.
std::optional<TextSize> box_of(const nlohmann::json& constraint);

/// The log lambda that a wish of so many balls has by default: the paper's 5 up to ten balls, and from there
/// on growing like 2 log N, which keeps the share of satisfied animations (measured: 7.25 for 30 balls).
double default_log_lambda(int balls);

/// log p_c = (k - N) log lambda: k of the N designated bins hold exactly one ball. Satisfied: all do, and no
/// ball lies elsewhere. Every track is a ball's, and whoever simulates says when it has settled.
class Wish final : public Term {
 public:
  /// Requires: a pattern of the box's size with a designated bin.
  /// `field` is what says the pattern, as a JSON Pointer below the term's; `marbles` how many there may be.
  Wish(std::shared_ptr<const Box> box, BinPattern pattern, double log_lambda, std::string field,
       std::size_t marbles);
  const BinPattern& pattern() const { return pattern_; }

  std::vector<Measure> measures() const override;
  TermScore score(const Animation& animation, std::span<double> values) const override;
  double least_when_satisfied() const override { return 0; }
  Claims claims() const override;
  /// A ball that has settled stays, and each that has not may yet fill a bin.
  double upper_bound(const Animation& so_far) const override;
  std::vector<Body> markers(const Animation&) const override;

 private:
  /// How many balls lie in each bin, and how many lie where they are of no use.
  struct Count {
    int filled = 0;    ///< designated bins with exactly one ball
    int stray = 0;     ///< balls that do not fill a bin
    int underway = 0;  ///< balls that have not settled
  };
  Count count(const Animation& animation, bool is_finished) const;

  std::shared_ptr<const Box> box_;
  BinPattern pattern_;
  int wished_;
  double log_lambda_;
  std::string field_;
  std::size_t marbles_;
};

}  // namespace retake::spelling
