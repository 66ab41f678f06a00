// What the general terms share: the fields that name a body and say how far it may miss, and the density of a
// miss. Paper, section 5.1.1.
#pragma once

#include <functional>
#include <string>

#include "worlds/terms/terms.h"

namespace retake::terms {

/// What a body that takes no part in an animation misses its place by [m]: farther than anything goes.
/// Chosen.
inline constexpr double kAway = 100;

inline constexpr std::size_t kLongestName = 64;  ///< bytes of a body's name; chosen

/// Log density of a miss under a Gaussian, 0 where there is none.
inline double log_gaussian(double miss, double sd) {
  const double z = miss / sd;
  return -0.5 * (z * z);
}

/// The field `body`, which need not be given where there is one mover.
Parameter body_field(const Setting& setting, std::string summary);
/// Fills in `body` where the scene has one mover, and appends a fault where it has several and the table's
/// default would take one of them; to be a TermKind's `fit`.
std::function<void(nlohmann::json&, const Parameters&, std::string_view, std::vector<Fault>&)> fit_body(
    const Setting& setting);

/// A field that names a body which takes part in contacts, by default any.
Parameter partner_field(std::string name, std::string summary);

Parameter number_field(std::string name, double low, double high, std::string unit, std::string summary);
/// The softness and the tolerance of a miss [unit].
Parameter sd_field(std::string name, double value, std::string unit, std::string source);
Parameter tolerance_field(std::string name, double value, std::string unit, std::string source);

}  // namespace retake::terms
