// Units: the names by which a person may give a length, a time or an angle in place of SI, and what each is
// in SI. doc/api.md, "Conventions". It must not know which field is read.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace retake {

struct Unit {
  std::string_view name;    ///< as in {"cm": 12}
  std::string_view plural;  ///< "centimetres"
  double times, over;       ///< one is times / over in SI
};

/// The units beside the SI one, itself among them, of what is in `si`; empty if it has no other.
std::span<const Unit> units_of(std::string_view si);
/// Null if `si` has no unit of that name.
const Unit* find_unit(std::string_view si, std::string_view name);

/// So many of a unit in SI: the double that its decimal digits mean, so that 12 cm is 0.12 m to the bit.
double in_si(const Unit& unit, double value);

/// {"cm": 12}, as a document has it.
std::string with_unit(const std::string& number, const Unit& unit);
/// "{"mm": ...}, {"cm": ...} or {"m": ...}", for messages.
std::string list_of_units(std::string_view si);

/// What a text such as "12 cm" means, if it is a number with a unit of `si`.
struct Quantity {
  double value;
  const Unit* unit;
};
std::optional<Quantity> quantity_of(const std::string& text, std::string_view si);

}  // namespace retake
