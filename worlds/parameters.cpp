// See parameters.h.
#include "worlds/parameters.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "sampler/check.h"
#include "worlds/units.h"

namespace retake {
namespace {

using nlohmann::json;

/// Integers beyond this are not told apart by clients that keep every number in a double.
constexpr double kLargestInteger = 9007199254740991.0;

using Kind = Parameter::Kind;

json number_json(const Parameter& parameter, double value) {
  if (parameter.kind != Kind::number && parameter.kind != Kind::number_list)
    return static_cast<std::int64_t>(value);
  return value + 0.0;  // -0 is 0
}

/// An object without faults with its defaults, or the stand-ins of one with faults.
json canonical_object(const Parameter& parameter, const json& value) {
  std::vector<Fault> faults;
  return parameter.fields->read(value, "", faults).document();
}

/// A value without faults in the one form in which documents hold it.
json canonical(const Parameter& parameter, const json& value) {
  switch (parameter.kind) {
    case Kind::boolean:
    case Kind::choice:
    case Kind::text:
    case Kind::text_list:
      return value;
    case Kind::number_list: {
      json list = json::array();
      for (const json& member : value)
        list.push_back(number_json(parameter, member.get<double>()));
      return list;
    }
    case Kind::object:
      return canonical_object(parameter, value);
    case Kind::object_list: {
      json list = json::array();
      for (const json& member : value)
        list.push_back(canonical_object(parameter, member));
      return list;
    }
    case Kind::integer_set: {
      std::set<double> members;
      for (const json& member : value)
        members.insert(member.get<double>());
      json list = json::array();
      for (const double member : members)
        list.push_back(number_json(parameter, member));
      return list;
    }
    case Kind::number:
    case Kind::integer:
      break;
  }
  return number_json(parameter, value.get<double>());
}

/// What a field without a default holds while it is faulty.
json stand_in(const Parameter& parameter) {
  switch (parameter.kind) {
    case Kind::boolean:
      return false;
    case Kind::choice:
      return parameter.choices.front();
    case Kind::integer_set:
    case Kind::text_list:
    case Kind::number_list:
    case Kind::object_list:
      return json::array();
    case Kind::text:
      return "";
    case Kind::object:
      return canonical_object(parameter, json::object());
    case Kind::number:
    case Kind::integer:
      break;
  }
  return number_json(parameter, std::isfinite(parameter.minimum) ? parameter.minimum : 0);
}

std::string range(const Parameter& parameter) {
  const bool low = std::isfinite(parameter.minimum), high = std::isfinite(parameter.maximum);
  const std::string from =
      (parameter.above_minimum ? "above " : "at least ") + plain_number(parameter.minimum);
  const std::string to = "at most " + plain_number(parameter.maximum);
  return low && high ? from + " and " + to : low ? from : to;
}

// --- Numbers with units: {"cm": 12} in place of 0.12 --------------------------------------------------

bool is_in_range(const Parameter& parameter, double number) {
  return number >= parameter.minimum && number <= parameter.maximum &&
         !(parameter.above_minimum && number == parameter.minimum);
}

/// The unit of an object such as {"cm": 12}; null, and a fault, if it is not one of the field's alone.
const Unit* read_unit(const Parameter& parameter, const json& object, const std::string& pointer,
                      std::vector<Fault>& faults) {
  const bool is_one = object.size() == 1;
  const Unit* unit = is_one ? find_unit(parameter.unit, object.begin().key()) : nullptr;
  const std::string accepted = (parameter.kind == Kind::number_list ? "numbers in " : "a number in ") +
                               parameter.unit + ", or one of " + list_of_units(parameter.unit);
  if (!is_one)
    faults.push_back({pointer, "expected " + accepted + ", got object"});
  else if (!unit)
    faults.push_back(
        {append_pointer(pointer, object.begin().key()), "is not a unit of this field: expected " + accepted});
  return unit;
}

/// A number of a unit in SI; appends a fault if it is none, or out of range.
json plain_number_of(const Parameter& parameter, const Unit& unit, const json& number,
                     const std::string& place, std::vector<Fault>& faults) {
  if (!number.is_number()) {
    faults.push_back({place, "expected a number, got " + std::string(number.type_name())});
    return nullptr;
  }
  const double plain = in_si(unit, number.get<double>());
  if (!is_in_range(parameter, plain))
    faults.push_back(
        {place, "must be " + range(parameter) + " " + parameter.unit + ", got " + plain_number(plain)});
  return plain;
}

/// One number, with a unit or without, as a plain one; anything else as it is.
json plain_value(const Parameter& parameter, const json& value, const std::string& pointer,
                 std::vector<Fault>& faults) {
  if (!value.is_object()) return value;
  const Unit* unit = read_unit(parameter, value, pointer, faults);
  if (!unit) return nullptr;
  return plain_number_of(parameter, *unit, value.begin().value(),
                         append_pointer(pointer, value.begin().key()), faults);
}

/// The same for a list, whose members may have a unit each or one together: {"cm": [1, 2, 3]}.
json plain_list(const Parameter& parameter, const json& value, const std::string& pointer,
                std::vector<Fault>& faults) {
  if (!value.is_object() && !value.is_array()) return value;
  const Unit* unit = value.is_object() ? read_unit(parameter, value, pointer, faults) : nullptr;
  if (value.is_object() && !unit) return nullptr;
  const std::string place = unit ? append_pointer(pointer, value.begin().key()) : pointer;
  const json& members = unit ? value.begin().value() : value;
  if (!members.is_array()) {
    faults.push_back({place, "expected a list of numbers, got " + std::string(members.type_name())});
    return nullptr;
  }
  json list = json::array();
  for (std::size_t i = 0; i < members.size(); ++i) {
    const std::string member = append_pointer(place, i);
    list.push_back(i >= parameter.most ? members[i]  // too many: the list has a fault
                   : unit              ? plain_number_of(parameter, *unit, members[i], member, faults)
                                       : plain_value(parameter, members[i], member, faults));
  }
  return list;
}

json in_plain_numbers(const Parameter& parameter, const json& value, const std::string& pointer,
                      std::vector<Fault>& faults) {
  if (units_of(parameter.unit).empty()) return value;
  if (parameter.kind == Kind::number) return plain_value(parameter, value, pointer, faults);
  if (parameter.kind == Kind::number_list) return plain_list(parameter, value, pointer, faults);
  return value;
}

/// "; were these centimetres? Then say {"cm": 12}": what a number that is out of range may have meant, empty
/// if no other unit makes it fit.
std::string question_about_unit(const Parameter& parameter, double number) {
  for (const Unit& unit : units_of(parameter.unit))
    if (is_in_range(parameter, in_si(unit, number)))
      return "; were these " + std::string(unit.plural) + "? Then say " +
             with_unit(plain_number(number), unit);
  return "";
}

/// The same of a text such as "12 cm".
std::string question_about_text(const Parameter& parameter, const json& value) {
  if (!value.is_string()) return "";
  const auto quantity = quantity_of(value.get<std::string>(), parameter.unit);
  return quantity ? "; say " + with_unit(plain_number(quantity->value), *quantity->unit) : "";
}

/// What is wrong with a number, empty if nothing is.
std::string fault_of_number(const Parameter& parameter, const json& value) {
  const std::string unit = parameter.unit.empty() ? "" : " " + parameter.unit;
  if (!value.is_number())
    return "expected a number, got " + std::string(value.type_name()) + question_about_text(parameter, value);
  const double number = value.get<double>();
  const bool is_whole = number == std::floor(number) && std::abs(number) <= kLargestInteger;
  if (parameter.kind != Kind::number && parameter.kind != Kind::number_list && !is_whole)
    return "expected an integer";
  if (!is_in_range(parameter, number))
    return "must be " + range(parameter) + unit + ", got " + plain_number(number) +
           question_about_unit(parameter, number);
  return "";
}

/// Appends what is wrong with a set: of each member at its place, else of the whole list.
void find_faults_of_set(const Parameter& parameter, const json& value, const std::string& pointer,
                        std::vector<Fault>& faults) {
  if (!value.is_array()) {
    faults.push_back({pointer, "expected a list of integers, got " + std::string(value.type_name())});
    return;
  }
  // A list that is longer than the range has a fault before its end, so the rest need not be judged.
  const auto judged = static_cast<std::size_t>(
      std::min(static_cast<double>(value.size()), parameter.maximum - parameter.minimum + 2));
  std::set<double> members;
  for (std::size_t i = 0; i < judged; ++i) {
    std::string fault = fault_of_number(parameter, value[i]);
    if (fault.empty() && !members.insert(value[i].get<double>()).second)
      fault = "is given twice: " + plain_number(value[i].get<double>());
    if (!fault.empty()) faults.push_back({append_pointer(pointer, i), std::move(fault)});
  }
  if (value.size() < parameter.fewest)
    faults.push_back({pointer, "must have at least " + std::to_string(parameter.fewest) + " members, got " +
                                   std::to_string(value.size())});
}

/// What is wrong with a text, empty if nothing is.
std::string fault_of_text(const Parameter& parameter, const json& value) {
  if (!value.is_string()) return "expected a string, got " + std::string(value.type_name());
  const std::size_t length = value.get_ref<const std::string&>().size();
  if (length == 0) return "must not be empty";
  if (length > parameter.longest)
    return "must be at most " + std::to_string(parameter.longest) + " bytes long";
  return "";
}

/// Appends what is wrong with a list in order: of each member at its place, else of the whole list.
void find_faults_of_list(const Parameter& parameter, const json& value, const std::string& pointer,
                         std::vector<Fault>& faults) {
  const bool has_objects = parameter.kind == Kind::object_list, has_texts = parameter.kind == Kind::text_list;
  if (!value.is_array()) {
    const std::string members = has_objects ? "objects" : has_texts ? "strings" : "numbers";
    faults.push_back({pointer, "expected a list of " + members + ", got " + std::string(value.type_name())});
    return;
  }
  if (value.size() < parameter.fewest || value.size() > parameter.most)
    faults.push_back({pointer, "must have " + std::to_string(parameter.fewest) + " to " +
                                   std::to_string(parameter.most) + " members, got " +
                                   std::to_string(value.size())});
  for (std::size_t i = 0; i < std::min(value.size(), parameter.most); ++i) {
    const std::string place = append_pointer(pointer, i);
    std::string fault;
    if (has_objects)
      parameter.fields->read(value[i], place, faults);
    else
      fault = has_texts ? fault_of_text(parameter, value[i]) : fault_of_number(parameter, value[i]);
    if (!fault.empty()) faults.push_back({place, std::move(fault)});
  }
}

/// Appends everything that is wrong with a value.
void find_faults(const Parameter& parameter, const json& value, const std::string& pointer,
                 std::vector<Fault>& faults) {
  std::string fault;
  switch (parameter.kind) {
    case Kind::number:
    case Kind::integer:
      fault = fault_of_number(parameter, value);
      break;
    case Kind::boolean:
      if (!value.is_boolean()) fault = "expected true or false, got " + std::string(value.type_name());
      break;
    case Kind::choice:
      if (!value.is_string())
        fault = "expected a string, got " + std::string(value.type_name());
      else if (std::find(parameter.choices.begin(), parameter.choices.end(), value) ==
               parameter.choices.end())
        fault = "must be one of " + list_of_names(parameter.choices);
      break;
    case Kind::integer_set:
      find_faults_of_set(parameter, value, pointer, faults);
      break;
    case Kind::text:
      fault = fault_of_text(parameter, value);
      break;
    case Kind::text_list:
    case Kind::number_list:
    case Kind::object_list:
      find_faults_of_list(parameter, value, pointer, faults);
      break;
    case Kind::object:
      parameter.fields->read(value, pointer, faults);
      break;
  }
  if (!fault.empty()) faults.push_back({pointer, std::move(fault)});
}

/// Of a list in order.
Kind member_kind(Kind list) {
  return list == Kind::object_list ? Kind::object : list == Kind::text_list ? Kind::text : Kind::number;
}

/// The type and the bounds of a field's values.
json type_schema(const Parameter& parameter) {
  switch (parameter.kind) {
    case Kind::boolean:
      return {{"type", "boolean"}};
    case Kind::choice:
      return {{"type", "string"}, {"enum", parameter.choices}};
    case Kind::integer_set: {
      Parameter member = parameter;
      member.kind = Kind::integer;
      return {{"type", "array"},
              {"items", type_schema(member)},
              {"uniqueItems", true},
              {"minItems", parameter.fewest}};
    }
    case Kind::text:
      return {{"type", "string"}, {"minLength", 1}, {"maxLength", parameter.longest}};
    case Kind::object:
      return parameter.fields->schema();
    case Kind::text_list:
    case Kind::number_list:
    case Kind::object_list: {
      Parameter member = parameter;
      member.kind = member_kind(parameter.kind);
      return {{"type", "array"},
              {"items", type_schema(member)},
              {"minItems", parameter.fewest},
              {"maxItems", parameter.most}};
    }
    case Kind::number:
    case Kind::integer:
      break;
  }
  json schema = {{"type", parameter.kind == Kind::integer ? "integer" : "number"}};
  if (std::isfinite(parameter.minimum))
    schema[parameter.above_minimum ? "exclusiveMinimum" : "minimum"] =
        number_json(parameter, parameter.minimum);
  if (std::isfinite(parameter.maximum)) schema["maximum"] = number_json(parameter, parameter.maximum);
  return schema;
}

}  // namespace

std::string plain_number(double value) {
  std::ostringstream text;
  text.precision(10);
  text << value;
  return text.str();
}

std::string list_of_names(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names)
    text += (text.empty() ? "" : ", ") + name;
  return text;
}

const json& Parameters::field(std::string_view name) const {
  const auto found = document_.find(name);
  CHECK(found != document_.end(), name);
  return *found;
}

double Parameters::number(std::string_view name) const {
  return field(name).get<double>();
}

std::int64_t Parameters::integer(std::string_view name) const {
  return field(name).get<std::int64_t>();
}

bool Parameters::boolean(std::string_view name) const {
  return field(name).get<bool>();
}

std::string Parameters::choice(std::string_view name) const {
  return field(name).get<std::string>();
}

std::vector<int> Parameters::integer_set(std::string_view name) const {
  return field(name).get<std::vector<int>>();
}

std::string Parameters::text(std::string_view name) const {
  return field(name).get<std::string>();
}

std::vector<std::string> Parameters::text_list(std::string_view name) const {
  return field(name).get<std::vector<std::string>>();
}

std::vector<double> Parameters::number_list(std::string_view name) const {
  return field(name).get<std::vector<double>>();
}

Parameters Parameters::object(std::string_view name) const {
  return Parameters(field(name));
}

std::vector<Parameters> Parameters::object_list(std::string_view name) const {
  std::vector<Parameters> all;
  for (const json& member : field(name))
    all.emplace_back(member);
  return all;
}

ParameterTable::ParameterTable(std::vector<Parameter> parameters) : parameters_(std::move(parameters)) {
  constexpr double kLeast = std::numeric_limits<int>::min(), kMost = std::numeric_limits<int>::max();
  for (const Parameter& parameter : parameters_) {
    CHECK(parameter.choices.empty() != (parameter.kind == Kind::choice), parameter.name);
    CHECK((parameter.longest == 0) != (parameter.kind == Kind::text || parameter.kind == Kind::text_list),
          parameter.name);
    const bool is_list = parameter.kind == Kind::text_list || parameter.kind == Kind::number_list ||
                         parameter.kind == Kind::object_list;
    CHECK((parameter.most == 0) != is_list, parameter.name);
    const bool has_fields = parameter.kind == Kind::object || parameter.kind == Kind::object_list;
    CHECK((parameter.fields == nullptr) != has_fields, parameter.name);
    if (parameter.kind == Kind::integer_set)
      CHECK(parameter.minimum >= kLeast && parameter.maximum <= kMost, parameter.name);
    if (parameter.default_value.is_null()) continue;
    std::vector<Fault> faults;
    find_faults(parameter, parameter.default_value, parameter.name, faults);
    CHECK(faults.empty(), parameter.name, faults[0].detail);
  }
}

Parameters ParameterTable::read(const json& object, std::string_view pointer, std::vector<Fault>& faults,
                                const std::vector<std::string>& ignored) const {
  json filled = json::object();
  const bool is_object = object.is_object();
  if (!is_object)
    faults.push_back({std::string(pointer), "expected an object, got " + std::string(object.type_name())});
  for (const Parameter& parameter : parameters_) {
    const auto given = is_object ? object.find(parameter.name) : object.end();
    const bool is_required = parameter.default_value.is_null();
    filled[parameter.name] =
        is_required ? stand_in(parameter) : canonical(parameter, parameter.default_value);
    if (!is_object) continue;
    const std::string place = append_pointer(pointer, parameter.name);
    if (given == object.end()) {
      if (is_required) faults.push_back({place, "is required: " + parameter.summary});
      continue;
    }
    const std::size_t faults_before = faults.size();
    const json value = in_plain_numbers(parameter, *given, place, faults);
    if (faults.size() == faults_before) find_faults(parameter, value, place, faults);
    if (faults.size() == faults_before) filled[parameter.name] = canonical(parameter, value);
  }
  const auto is_known = [&](const std::string& name) {
    return std::ranges::find(parameters_, name, &Parameter::name) != parameters_.end() ||
           std::ranges::find(ignored, name) != ignored.end();
  };
  if (is_object) refuse_unknown_fields(object, pointer, is_known, "there is no such field here", faults);
  return Parameters(std::move(filled));
}

json ParameterTable::schema() const {
  json properties = json::object(), required = json::array();
  for (const Parameter& parameter : parameters_) {
    const bool is_required = parameter.default_value.is_null();
    json property = type_schema(parameter);
    property["description"] = parameter.summary;
    if (!is_required) property["default"] = canonical(parameter, parameter.default_value);
    if (!parameter.unit.empty()) property["x-unit"] = parameter.unit;
    for (const Unit& unit : units_of(parameter.unit))
      property["x-units"].push_back(unit.name);
    if (!parameter.source.empty()) property["x-source"] = parameter.source;
    if (is_required) required.push_back(parameter.name);
    properties[parameter.name] = std::move(property);
  }
  json schema = {{"type", "object"}, {"additionalProperties", false}, {"properties", std::move(properties)}};
  if (!required.empty()) schema["required"] = std::move(required);
  return schema;
}

}  // namespace retake
