// See parameters.h.
#include "worlds/parameters.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "sampler/check.h"

namespace retake {
namespace {

using nlohmann::json;

/// Integers beyond this are not told apart by clients that keep every number in a double.
constexpr double kLargestInteger = 9007199254740991.0;

json as_json(const Parameter& parameter, double value) {
  if (parameter.kind == Parameter::Kind::integer) return static_cast<std::int64_t>(value);
  return value + 0.0;  // -0 is 0
}

std::string range(const Parameter& parameter) {
  const bool low = std::isfinite(parameter.minimum), high = std::isfinite(parameter.maximum);
  const std::string from =
      (parameter.above_minimum ? "above " : "at least ") + plain_number(parameter.minimum);
  const std::string to = "at most " + plain_number(parameter.maximum);
  return low && high ? from + " and " + to : low ? from : to;
}

/// What is wrong with a value, empty if nothing is.
std::string fault_of(const Parameter& parameter, const json& value) {
  const std::string unit = parameter.unit.empty() ? "" : " " + parameter.unit;
  if (!value.is_number()) return "expected a number, got " + std::string(value.type_name());
  const double number = value.get<double>();
  if (parameter.kind == Parameter::Kind::integer &&
      (number != std::floor(number) || std::abs(number) > kLargestInteger))
    return "expected an integer";
  if (number < parameter.minimum || number > parameter.maximum ||
      (parameter.above_minimum && number == parameter.minimum))
    return "must be " + range(parameter) + unit + ", got " + plain_number(number);
  return "";
}

}  // namespace

std::string plain_number(double value) {
  std::ostringstream text;
  text.precision(10);
  text << value;
  return text.str();
}

double Parameters::number(std::string_view name) const {
  const auto found = document_.find(name);
  CHECK(found != document_.end(), name);
  return found->get<double>();
}

std::int64_t Parameters::integer(std::string_view name) const {
  return static_cast<std::int64_t>(number(name));
}

Parameters ParameterTable::read(const json& object, std::string_view pointer, std::vector<Fault>& faults,
                                const std::vector<std::string>& ignored) const {
  json filled = json::object();
  const bool is_object = object.is_object();
  if (!is_object)
    faults.push_back({std::string(pointer), "expected an object, got " + std::string(object.type_name())});
  for (const Parameter& parameter : parameters_) {
    const auto given = is_object ? object.find(parameter.name) : object.end();
    const double fallback =
        parameter.default_value.value_or(std::isfinite(parameter.minimum) ? parameter.minimum : 0);
    filled[parameter.name] = as_json(parameter, fallback);
    if (!is_object) continue;
    if (given == object.end()) {
      if (!parameter.default_value)
        faults.push_back({append_pointer(pointer, parameter.name), "is required: " + parameter.summary});
      continue;
    }
    if (std::string fault = fault_of(parameter, *given); !fault.empty())
      faults.push_back({append_pointer(pointer, parameter.name), std::move(fault)});
    else
      filled[parameter.name] = as_json(parameter, given->get<double>());
  }
  if (is_object)
    for (const auto& [name, value] : object.items()) {
      const bool known = std::any_of(parameters_.begin(), parameters_.end(),
                                     [&](const Parameter& parameter) { return parameter.name == name; }) ||
                         std::find(ignored.begin(), ignored.end(), name) != ignored.end();
      if (!known) faults.push_back({append_pointer(pointer, name), "there is no such field here"});
    }
  return Parameters(std::move(filled));
}

json ParameterTable::schema() const {
  json properties = json::object(), required = json::array();
  for (const Parameter& parameter : parameters_) {
    json property = {{"type", parameter.kind == Parameter::Kind::integer ? "integer" : "number"},
                     {"description", parameter.summary}};
    if (parameter.default_value) property["default"] = as_json(parameter, *parameter.default_value);
    if (std::isfinite(parameter.minimum))
      property[parameter.above_minimum ? "exclusiveMinimum" : "minimum"] =
          as_json(parameter, parameter.minimum);
    if (std::isfinite(parameter.maximum)) property["maximum"] = as_json(parameter, parameter.maximum);
    if (!parameter.unit.empty()) property["x-unit"] = parameter.unit;
    if (!parameter.source.empty()) property["x-source"] = parameter.source;
    if (!parameter.default_value) required.push_back(parameter.name);
    properties[parameter.name] = std::move(property);
  }
  json schema = {{"type", "object"}, {"additionalProperties", false}, {"properties", std::move(properties)}};
  if (!required.empty()) schema["required"] = std::move(required);
  return schema;
}

}  // namespace retake
