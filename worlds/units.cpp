// See units.h.
#include "worlds/units.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

namespace retake {
namespace {

constexpr double kPi = std::numbers::pi;

// The commonest first: it is asked about first where a number looks like another unit's.
constexpr Unit kLengths[] = {{"cm", "centimetres", 1, 100},
                             {"mm", "millimetres", 1, 1000},
                             {"m", "metres", 1, 1},
                             {"in", "inches", 254, 10000},
                             {"ft", "feet", 3048, 10000}};
constexpr Unit kTimes[] = {
    {"ms", "milliseconds", 1, 1000}, {"s", "seconds", 1, 1}, {"min", "minutes", 60, 1}};
constexpr Unit kAngles[] = {{"deg", "degrees", kPi, 180}, {"rad", "radians", 1, 1}};
constexpr Unit kSpeeds[] = {{"cm/s", "centimetres a second", 1, 100},
                            {"m/s", "metres a second", 1, 1},
                            {"km/h", "kilometres an hour", 10, 36},
                            {"mph", "miles an hour", 44704, 100000}};
constexpr Unit kTurnRates[] = {{"deg/s", "degrees a second", kPi, 180},
                               {"rad/s", "radians a second", 1, 1},
                               {"rpm", "turns a minute", kPi, 30}};
constexpr Unit kAccelerations[] = {{"cm/s^2", "centimetres a second squared", 1, 100},
                                   {"m/s^2", "metres a second squared", 1, 1}};

struct Dimension {
  std::string_view si;
  std::span<const Unit> units;
};
constexpr Dimension kDimensions[] = {{"m", kLengths},  {"s", kTimes},         {"rad", kAngles},
                                     {"m/s", kSpeeds}, {"rad/s", kTurnRates}, {"m/s^2", kAccelerations}};

}  // namespace

std::span<const Unit> units_of(std::string_view si) {
  for (const Dimension& dimension : kDimensions)
    if (dimension.si == si) return dimension.units;
  return {};
}

const Unit* find_unit(std::string_view si, std::string_view name) {
  for (const Unit& unit : units_of(si))
    if (unit.name == name) return &unit;
  return nullptr;
}

double in_si(const Unit& unit, double value) {
  if (unit.times == unit.over) return value;
  // Fifteen digits are what a double keeps of any decimal number.
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), "%.15g", value * unit.times / unit.over);
  return std::strtod(digits.data(), nullptr);
}

std::string with_unit(const std::string& number, const Unit& unit) {
  return "{\"" + std::string(unit.name) + "\": " + number + "}";
}

std::string list_of_units(std::string_view si) {
  std::string text;
  const auto units = units_of(si);
  for (std::size_t i = 0; i < units.size(); ++i)
    text += (i == 0                  ? ""
             : i + 1 == units.size() ? " or "
                                     : ", ") +
            ("{\"" + std::string(units[i].name) + "\": …}");
  return text;
}

std::optional<Quantity> quantity_of(const std::string& text, std::string_view si) {
  char* rest = nullptr;
  const double value = std::strtod(text.c_str(), &rest);
  if (rest == text.c_str() || !std::isfinite(value)) return std::nullopt;
  std::string_view name = rest;
  while (!name.empty() && name.front() == ' ')
    name.remove_prefix(1);
  while (!name.empty() && name.back() == ' ')
    name.remove_suffix(1);
  const Unit* unit = find_unit(si, name);
  return unit ? std::optional(Quantity{.value = value, .unit = unit}) : std::nullopt;
}

}  // namespace retake
