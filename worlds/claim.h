// Claim: what every animation that satisfies a term is like, said so that two terms can be compared without
// an animation. doc/design.md, section 4, "Contradictions". It must not know which term says it.
#pragma once

#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

namespace retake {

/// [s] later than any animation lasts: what is then is what is at the end.
inline constexpr double kEnd = 3600;

/// A number of the animation, such as the face that a die shows, is one of these.
struct NumberClaim {
  std::string what;  ///< of which number; whoever means the same one says the same
  std::set<int> values;
};

/// Some such numbers, each of which is from `least` to `most`, add up to a sum.
struct SumClaim {
  std::vector<std::string> whats;  ///< all different
  int least, most, sum;
};

/// All that is at most `radius` from a box. Sides may be infinitely far.
struct Region {
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  Eigen::Vector3d low{-kFar, -kFar, -kFar}, high{kFar, kFar, kFar};
  double radius = 0;
};

/// Where a body is [m] or how it moves [m/s], at every time of a while at which it is there, the last one
/// among them.
struct StateClaim {
  enum class Quantity { position, velocity };
  std::optional<std::string> body{};  ///< none: every body that takes part
  Quantity quantity = Quantity::position;
  double from, to;              ///< [s]
  std::vector<Region> regions;  ///< in one of these
};

inline constexpr const char* kAnyBody = "any";  ///< in place of a body's name

/// Two bodies touch, of which each may be any.
struct Touch {
  std::string one, other;

  bool is_general() const;

  /// Whether every touch of this kind is one of the other kind.
  bool is_a(const Touch& general) const;
};

/// What happens first, and only then what happens later; both happen.
struct OrderClaim {
  struct Event {
    std::string name;              ///< in words; whoever means the same event says the same
    std::optional<Touch> touch{};  ///< it is the first of these
  };
  Event before, after;
};

/// There is a touch of at least an impulse [N s] within a while [s].
struct TouchClaim {
  Touch touch;
  double least_impulse, from, to;
};

/// Every touch of at least an impulse [N s] is within `tolerance` [s] of a beat.
struct BeatClaim {
  Touch touch;
  double least_impulse, period, tolerance;
  std::optional<double> offset;  ///< [s] when a beat is; none: not known
};

struct Claim {
  std::string field;  ///< JSON Pointer below the term's, of what makes it say so
  std::variant<NumberClaim, SumClaim, StateClaim, OrderClaim, TouchClaim, BeatClaim> demand;
};
using Claims = std::vector<Claim>;

/// That a body falls, or stays as it is; that it shows one of some faces at the end; that it takes part.
NumberClaim falls(const std::string& body, bool whether);
NumberClaim shows(const std::string& body, std::set<int> faces);
NumberClaim takes_part(const std::string& body);

}  // namespace retake
