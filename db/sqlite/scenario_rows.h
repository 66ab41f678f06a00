// The rows of scenarios: insert, delete, look up, list.
// Realises doc/design.md, section 5. Must be called within a transaction; knows nothing of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/page.h"
#include "db/records.h"
#include "db/sqlite/connection.h"

namespace retake::database {

/// The columns of a chain's tally, in the order in which read_odds reads them.
#define ODDS_COLUMNS "odds_basis, odds_draws, odds_hits, odds_sum, odds_squares, odds_largest"
OddsTally read_odds(Query& query);

/// Milliseconds since the Unix epoch.
std::int64_t now();

/// Each of these throws Damaged where one scenario is asked for, and leaves damaged ones out of lists.
std::optional<std::int64_t> scenario_row(Connection& connection, std::string_view id);
std::optional<ScenarioRecord> load_scenario(Connection& connection, std::string_view id);
Page<ScenarioRecord> load_scenarios(Connection& connection, std::size_t limit, std::string_view cursor);
/// See Store::world_of.
std::optional<WorldVersion> load_world_of(Connection& connection, std::string_view id);
std::uint64_t count_samples(Connection& connection, std::string_view scenario);

AddedScenario insert_scenario(Connection& connection, const ScenarioRecord& record);

std::vector<std::string> load_scenarios_without_pilot(Connection& connection);
/// False: there is no such scenario.
bool write_pilot(Connection& connection, std::string_view id, const PilotTally& pilot);

/// Takes the scenario and its chains out of sight; what hangs on them is left to purge. False: not there.
bool delete_scenario(Connection& connection, std::string_view id);
/// Removes a slice of what deleted scenarios have left. False: there was nothing to remove.
bool purge(Connection& connection);

/// Adds up what the scenarios hold.
StoreTotals load_totals(Connection& connection);

}  // namespace retake::database
