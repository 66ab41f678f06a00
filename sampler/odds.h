// Odds: how likely the prior is to satisfy the constraint, from weighted independent draws, with an interval.
// doc/design.md, section 3, "Odds". Intervals: Fay & Feuer, "Confidence intervals for directly standardized
// rates", Statistics in Medicine 16 (1997) 791-801; where weights are equal, Clopper & Pearson, Biometrika 26
// (1934) 404-413. It must not know where the draws came from.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>

namespace retake {

/// What the draws are that a tally counts. A later one is the better ground to stand on.
enum class OddsBasis : std::uint8_t {
  none,
  ladder,     ///< estimated over a ladder of tempered targets
  rejection,  ///< draws from the prior
  learned,    ///< draws from a frozen mixture of the prior and learned kernels, weighted by p / q
};
std::string_view to_string(OddsBasis basis);
/// OddsBasis::none for any other name.
OddsBasis odds_basis_from(std::string_view name);

/// Draws, and the weights p / q of those that satisfy the constraint; 1 for draws from the prior. Tallies of
/// independent draws of one basis add up.
struct OddsTally {
  OddsBasis basis = OddsBasis::none;
  std::uint64_t draws = 0;
  std::uint64_t hits = 0;
  double sum = 0;      ///< of the hits' weights
  double squares = 0;  ///< of the hits' squared weights
  double largest = 0;  ///< weight

  void add_hit(double weight) {
    ++hits;
    sum += weight;
    squares += weight * weight;
    largest = std::max(largest, weight);
  }
  void add(const OddsTally& other) {
    draws += other.draws;
    hits += other.hits;
    sum += other.sum;
    squares += other.squares;
    largest = std::max(largest, other.largest);
  }
};

/// Tallies of independent draws of whatever bases. Those of a basis add up; of draws of the prior and learned
/// ones those with more hits are told. A ladder is told where there is nothing else.
class OddsPool {
 public:
  void add(const OddsTally& tally);
  OddsTally tally() const;

 private:
  OddsTally ladder_, rejection_, learned_;
};

/// P(satisfied) with its 95 % interval; without a hit the probability is 0 and `high` says what is excluded.
struct Odds {
  double probability;
  double low;
  double high;
};
/// None without draws.
std::optional<Odds> odds(const OddsTally& tally);

}  // namespace retake
