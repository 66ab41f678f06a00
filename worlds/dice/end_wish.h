// EndWish: what terms wish of where dice end. It must not know how dice move or how wishes are met.
#pragma once

#include <optional>
#include <vector>

#include "worlds/term.h"

namespace retake::dice {

/// What is wished of a die's end.
struct EndWish {
  /// A disc on the floor [m].
  struct Disc {
    double x, z, radius;
  };
  std::optional<Disc> place;
  std::optional<int> face;  ///< pips

  bool is_wish() const { return place || face; }
};

/// Of each die the first wish of each kind; the others are weighed by their terms alone.
std::vector<EndWish> end_wishes(const Terms& wishes, std::size_t dice);

/// The first sum that is wished of all dice together.
std::optional<int> total_wish(const Terms& wishes);

/// Of which measures of a Score it reads where a throw of so many dice ended: those of the first die; those
/// of the others follow each.
struct EndMeasures {
  std::size_t top_face, rest_x, rest_z;
};
EndMeasures end_measures(std::size_t dice);

}  // namespace retake::dice
