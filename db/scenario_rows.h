// The rows of scenarios: insert, delete, look up, list.
// Realises DESIGN section 5. Must be called within a transaction; knows nothing of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "db/sqlite.h"
#include "db/store.h"

namespace retake::database {

/// Milliseconds since the Unix epoch.
std::int64_t now();

std::optional<std::int64_t> scenario_row(Connection& connection, std::string_view id);
std::optional<ScenarioRecord> load_scenario(Connection& connection, std::string_view id);
Page<ScenarioRecord> load_scenarios(Connection& connection, std::size_t limit, std::string_view cursor);
std::uint64_t count_samples(Connection& connection, std::string_view scenario);

Store::AddedScenario insert_scenario(Connection& connection, const ScenarioRecord& record);

/// Takes the scenario and its chains out of sight; what hangs on them is left to purge. False: not there.
bool delete_scenario(Connection& connection, std::string_view id);
/// Removes a slice of what deleted scenarios have left. False: there was nothing to remove.
bool purge(Connection& connection);

/// Adds up what the scenarios hold.
StoreTotals load_totals(Connection& connection);

}  // namespace retake::database
