// Views: the JSON that clients see of scenarios, chains, samples and animations. doc/api.md names every key.
// It must not know HTTP or the store's methods.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "db/records.h"
#include "server/chains/health.h"
#include "server/chains/trace.h"
#include "worlds/measure.h"
#include "worlds/scenario.h"

namespace retake {

/// What measures mean: [{"name","kind","unit","summary"}]. A list of measures is told once, as of the kind
/// "list" and with the kind that its members have ("of").
nlohmann::json measures_json(const std::vector<Measure>& measures);

/// Every method of sampling by its name, the simplest first.
std::vector<std::string> method_names();
/// Stands for the world's default method where a method is asked for.
inline constexpr std::string_view kAutoMethod = "auto";
/// Every kind of ratios by its name, the default first.
std::vector<std::string> ratios_names();

nlohmann::json world_json(const World& world);
nlohmann::json scenario_json(const ScenarioRecord& record);
/// Without its scenario, which this build may not be able to run, it is not told whether a guide leads it.
nlohmann::json chain_json(const ChainRecord& record, const Scenario* scenario);
nlohmann::json lessons_json(const std::vector<LessonRecord>& records);
nlohmann::json sample_json(const SampleRecord& record);
/// P(satisfied) with its interval and what it is known by; null without draws.
nlohmann::json odds_json(const OddsTally& tally);
/// How hard the wish is, by what a pilot found; null without one.
nlohmann::json difficulty_json(const std::optional<PilotTally>& pilot);
nlohmann::json diagnostics_json(const Health& health);
/// {name: value}, null for absent Variables.
nlohmann::json variables_json(const Model& model, const State& state);
/// {name: unit} of the Variables that are no pure numbers. Those whose names differ in numbers alone are many
/// and agree: each number in their name is a "#".
nlohmann::json variable_units_json(const Model& model);
/// Equal-length arrays of at most `points` evenly chosen points.
nlohmann::json trace_json(const Trace& trace, const std::vector<Measure>& measures, std::size_t points);

/// RFC 3339 in UTC with milliseconds.
std::string timestamp(std::int64_t milliseconds);

}  // namespace retake
