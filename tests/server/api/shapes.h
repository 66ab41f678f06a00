// How a JSON value differs from a shape of doc/api.md, both ways: a documented key that is missing, a key
// that is not documented, a wrong type. The shapes themselves stand there and nowhere else.
#pragma once

#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/server/api/api_document.h"

namespace retake::test {

/// Every documented key that a value had so far, as "Shape/key/key".
inline std::set<std::string>& keys_met() {
  static std::set<std::string> met;
  return met;
}

inline std::string differences(const nlohmann::json& value, const nlohmann::json& shape,
                               const std::string& at = "", const std::string& documented = "");

/// Where a value differs from a documented shape, one line a place; empty if nowhere.
inline std::string differences(const nlohmann::json& value, const char* shape, const std::string& at = "") {
  return differences(value, api_document().shapes.at(shape), at, shape);
}

/// Where a value is not of one type, such as "integer"; empty if it is.
inline std::string type_differences(const nlohmann::json& value, const std::string& type,
                                    const std::string& at) {
  const std::string wrong = at + " is not " + type + ": " + value.dump().substr(0, 200) + "\n";
  if (type.starts_with('@'))
    return value.is_object() ? differences(value, type.substr(1).c_str(), at) : wrong;
  if (type.starts_with('=')) {
    const std::string choices = ", " + type.substr(1) + ",";
    return value.is_string() && choices.find(", " + value.get<std::string>() + ",") != std::string::npos
               ? ""
               : wrong;
  }
  bool is_of_type = type == value.type_name();
  if (type == "any") is_of_type = true;
  if (type == "integer") is_of_type = value.is_number_integer();
  if (type == "number") is_of_type = value.is_number();
  if (type == "time")
    is_of_type =
        value.is_string() && value.get<std::string>().size() == 24 && value.get<std::string>().back() == 'Z';
  return is_of_type ? "" : wrong;
}

/// The same for a shape as ApiDocument holds it. `documented` is where it stands there.
inline std::string differences(const nlohmann::json& value, const nlohmann::json& shape,
                               const std::string& at, const std::string& documented) {
  if (shape.is_string()) {
    std::string rest = shape, found;
    while (true) {
      const std::size_t bar = rest.find('|');
      found = type_differences(value, rest.substr(0, bar), at);
      // What an object lacks is told, not that it is no null.
      if (found.empty() || (rest.starts_with('@') && value.is_object())) return found;
      if (bar == std::string::npos) break;
      rest.erase(0, bar + 1);
    }
    return at + " is not " + shape.get<std::string>() + ": " + value.dump().substr(0, 200) + "\n";
  }
  std::string found;
  if (shape.is_array()) {
    if (!value.is_array()) return at + " is not an array\n";
    for (std::size_t i = 0; i < value.size(); ++i)
      found += differences(value[i], shape[0], at + "/" + std::to_string(i), documented);
    return found;
  }
  if (!value.is_object()) return at + " is not an object\n";
  for (const auto& [name, each] : value.items()) {
    std::string key = name;
    if (!shape.contains(key)) key = shape.contains(name + "?") ? name + "?" : "*";
    if (!shape.contains(key)) {
      found += at + "/" + name + " is not documented\n";
      continue;
    }
    const std::string place = documented + "/" + key;
    keys_met().insert(place);
    found += differences(each, shape[key], at + "/" + name, place);
  }
  for (const auto& [key, inner] : shape.items())
    if (key != "*" && !key.ends_with('?') && !value.contains(key)) found += at + "/" + key + " is missing\n";
  return found;
}

}  // namespace retake::test
