// The JSON shapes of API.md, written once: every documented key with its type. Further keys may appear.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace retake::test {

/// Types are "string", "integer", "number", "boolean", "object", "array", "time" or "null", several joined by
/// '|'; [shape] is an array whose elements all have the shape; "key?" may be absent; {"*": shape} is a map.
inline const nlohmann::json& shapes() {
  static const nlohmann::json table = nlohmann::json::parse(R"json({
    "World": {"name": "string", "version": "integer", "summary": "string", "default_method": "string", "methods": ["string"], "saves": {"stops_early": "boolean", "resumes": "boolean"},
      "model": {"type": "string", "properties": {"*": {"default": "number|boolean|string|array",
        "description": "string", "type": "string", "x-source?": "string", "x-unit?": "string"}}},
      "constraints": [{"kind": "string", "summary": "string", "schema": {"type": "string", "properties": "object"}}],
      "examples": [{"world": "string", "constraints": "array"}]},
    "Scenario": {"id": "string", "world": "string", "world_version": "integer", "title": "string",
      "model": {"*": "number|boolean|string|array"}, "constraints": [{"kind": "string"}], "created_at": "time",
      "samples": "integer", "chains": {"running": "integer", "paused": "integer", "finished": "integer", "failed": "integer"},
      "odds": "null|object", "difficulty": "null|object"},
    "Odds": {"probability": "number", "low": "number", "high": "number", "basis": "string", "draws": "integer",
      "hits": "integer"},
    "Difficulty": {"verdict": "string", "one_in": "number|null", "at_least": "number", "draws": "integer",
      "hits": "integer", "seconds": "number"},
    "Chain": {"id": "string", "scenario": "string", "index": "integer", "seed": "integer", "method": "string",
      "ratios": "string", "state": "string", "iteration": "integer", "accepted": "integer", "samples": "integer",
      "simulations": "integer", "simulated_seconds": "number", "iterations_per_second": "number",
      "run_seconds": "number", "skipped_seconds": "number", "phase": "string", "stop": "object",
      "effective_samples": "number|null", "ended_by": "null|string", "created_at": "time",
      "kernels": [{"name": "string", "proposed": "integer", "accepted": "integer"}],
      "first_sample": "null|object", "error": "null|string"},
    "FinishedChain": {"state": "string", "first_sample": {"iteration": "integer", "seconds": "number"},
      "ended_by": "string"},
    "Sample": {"id": "string", "scenario": "string", "chain": "string", "iteration": "integer", "weight": "integer",
      "replica": "integer", "learning": "boolean",
      "log_prior": "number", "log_constraint": "number", "duration": "number",
      "measures": {"*": "number|boolean|array|null"}, "digest": "string", "plays": "integer", "created_at": "time"},
    "WholeSample": {"id": "string", "variables": {"*": "number|null"}},
    "Trace": {"iteration": ["integer"], "log_prior": ["number"], "log_constraint": ["number"],
      "satisfied": ["boolean"]},
    "Diagnostics": {"quantities": [{"name": "string", "rhat": "number|null", "ess_bulk": "number|null",
      "ess_tail": "number|null", "ess_within": "number|null", "ess_across": "number|null", "mean": "number|null",
      "sd": "number|null"}], "quantity_count": "integer", "chains": "integer", "draws_per_chain": "integer", "effective": "null|object",
      "odds": "null|object", "first_sample": "null|object", "eta_seconds": "number|null",
      "saved": {"iterations": "integer", "simulations": "integer", "simulated_seconds": "number",
        "skipped_seconds": "number", "share": "number|null"},
      "swaps": [{"chain": "string", "low": "number", "high": "number", "proposed": "integer",
        "accepted": "integer"}]},
    "Effective": {"samples": "number", "quantity": "string", "within": "number",
      "per_cpu_minute": "number|null"},
    "Keyframes": {"format": "string", "sample": "string", "world": "string", "world_version": "integer",
      "units": {"length": "string", "time": "string", "angle": "string"}, "up": "string", "handedness": "string",
      "quaternion": "string", "rate": "number", "frames": "integer", "duration": "number",
      "bodies": [{"name": "string", "shape": {"type": "string"}, "color": "string", "track?": "integer",
                  "position?": ["number"], "rotation?": ["number"]}],
      "tracks": [{"position": ["number"], "rotation": ["number"]}],
      "events": [{"time": "number", "kind": "string", "bodies": ["string"], "impulse": "number"}],
      "view?": {"center": ["number"], "half_extents": ["number"], "azimuth": "number", "elevation": "number"}},
    "Verified": {"identical": "boolean", "digest": "string", "stored_digest": "string"},
    "Play": {"play": "string", "sample": {"id": "string"}, "repeat": "boolean", "remaining": "integer"},
    "Problem": {"type": "string", "title": "string", "status": "integer", "detail": "string",
      "errors": [{"pointer": "string", "detail": "string"}]},
    "Limits": {"limit": {"default": "integer", "maximum": "integer"}, "chains_per_request": "integer",
      "samples_per_scenario": "integer", "low_water": "integer", "body_bytes": "integer"}
  })json");
  return table;
}

inline bool has_type(const nlohmann::json& value, const std::string& type) {
  if (type == "time")
    return value.is_string() && value.get<std::string>().size() == 24 &&
           value.get<std::string>().back() == 'Z';
  if (type == "integer") return value.is_number_integer();
  if (type == "number") return value.is_number();
  return type == value.type_name();
}

/// Where a value differs from a shape, one line a place; empty if nowhere.
inline std::string differences(const nlohmann::json& value, const nlohmann::json& shape,
                               const std::string& at = "") {
  if (shape.is_string()) {
    std::string rest = shape;
    for (std::size_t bar = rest.find('|'); bar != std::string::npos; bar = rest.find('|')) {
      if (has_type(value, rest.substr(0, bar))) return "";
      rest.erase(0, bar + 1);
    }
    return has_type(value, rest) ? ""
                                 : at + " is not " + shape.get<std::string>() + ": " + value.dump() + "\n";
  }
  std::string found;
  if (shape.is_array()) {
    if (!value.is_array()) return at + " is not an array\n";
    for (std::size_t i = 0; i < value.size(); ++i)
      found += differences(value[i], shape[0], at + "/" + std::to_string(i));
    return found;
  }
  if (!value.is_object()) return at + " is not an object\n";
  for (const auto& [key, inner] : shape.items()) {
    if (key == "*") {
      for (const auto& [name, each] : value.items())
        found += differences(each, inner, at + "/" + name);
      continue;
    }
    const bool is_optional = key.back() == '?';
    const std::string name = is_optional ? key.substr(0, key.size() - 1) : key;
    if (value.contains(name))
      found += differences(value[name], inner, at + "/" + name);
    else if (!is_optional)
      found += at + "/" + name + " is missing\n";
  }
  return found;
}

inline std::string differences(const nlohmann::json& value, const char* shape) {
  return differences(value, shapes().at(shape));
}

}  // namespace retake::test
