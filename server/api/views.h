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
#include "worlds/world.h"

namespace retake {

/// Every method of sampling by its name, the simplest first.
std::vector<std::string> method_names();
/// Every kind of ratios by its name, the default first.
std::vector<std::string> ratios_names();

nlohmann::json world_json(const World& world);
nlohmann::json scenario_json(const ScenarioRecord& record);
nlohmann::json chain_json(const ChainRecord& record);
nlohmann::json sample_json(const SampleRecord& record);
/// P(satisfied) with its interval and what it is known by; null without draws.
nlohmann::json odds_json(const OddsTally& tally);
/// How hard the wish is, by what a pilot found; null without one.
nlohmann::json difficulty_json(const std::optional<PilotTally>& pilot);
nlohmann::json diagnostics_json(const Health& health);
/// {name: value}, null for absent Variables.
nlohmann::json variables_json(const Model& model, const State& state);
/// Equal-length arrays of at most `points` evenly chosen points.
nlohmann::json trace_json(const Trace& trace, const std::vector<Measure>& measures, std::size_t points);

/// RFC 3339 in UTC with milliseconds.
std::string timestamp(std::int64_t milliseconds);

}  // namespace retake
