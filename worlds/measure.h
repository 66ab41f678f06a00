// Measure: what a world or a term says of an animation besides its density, for people to read.
// doc/design.md, section 1. A Score holds every measure as a double, NaN where there is none; here is what
// the double means. It must not know JSON.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace retake {

struct Measure {
  enum class Kind {
    number,
    integer,      ///< a count, or a number that is always whole
    flag,         ///< 0 or 1
    integer_set,  ///< see set_of
  };
  std::string name{};
  Kind kind = Kind::number;
  /// The list of which it is a member, with the measures before and after it that name the same list; none if
  /// empty. Clients see the list in place of its members, which agree in kind, unit and summary.
  std::string list{};
  std::string unit{};     ///< SI, as in "m/s"; "" for a pure number
  std::string summary{};  ///< what it is, for people; of a list's member: what the list holds

  friend bool operator==(const Measure&, const Measure&) = default;
};

inline constexpr int kLargestMember = 52;  ///< a double holds 53 bits exactly

/// A set of integers as the double whose bit i says whether i is a member. Requires: each from 0 to
/// kLargestMember.
double set_of(std::span<const int> members);
/// The members in ascending order. Requires: a result of set_of.
std::vector<int> members_of(double set);

}  // namespace retake
