// The rows of scenarios.
// Realises doc/design.md, section 5.
#include "db/sqlite/scenario_rows.h"

#include <chrono>
#include <limits>

#include "db/sqlite/cursor.h"

namespace retake::database {
namespace {

// How much one purge removes; chosen so that plays wait a few milliseconds for it at most.
constexpr int kPurgedSamples = 50;
constexpr int kPurgedRows = 500;

#define SCENARIO_COLUMNS                                                                                  \
  "SELECT scenario.row, id, world, world_version, title, document, created_at, stock.samples,"            \
  " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state IN ('queued', 'running'))," \
  " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state = 'paused'),"               \
  " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state = 'finished'),"             \
  " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state = 'failed'),"               \
  " pilot_draws, pilot_hits, pilot_seconds"                                                               \
  " FROM scenario CROSS JOIN stock ON stock.scenario = scenario.row "

// Reads the columns that follow the row number.
ScenarioRecord read_scenario(Connection& connection, std::int64_t row, Query& query) {
  ScenarioRecord record;
  record.id = query.text();
  record.world = query.text();
  record.world_version = static_cast<int>(query.integer());
  record.title = query.text();
  record.document = query.text();
  record.created_at = query.integer();
  record.samples = query.count();
  record.running = query.count();
  record.paused = query.count();
  record.finished = query.count();
  record.failed = query.count();
  if (!query.is_null()) record.pilot = PilotTally{query.count(), query.count(), query.real()};

  Query tallies(connection,
                "SELECT " ODDS_COLUMNS " FROM chain INDEXED BY chain_by_scenario WHERE chain.scenario = ?",
                row);
  OddsPool pool;
  while (tallies.next())
    pool.add(read_odds(tallies));
  record.odds = pool.tally();
  return record;
}

}  // namespace

OddsTally read_odds(Query& query) {
  OddsTally tally;
  tally.basis = odds_basis_from(query.text());
  tally.draws = query.count();
  tally.hits = query.count();
  tally.sum = query.real();
  tally.squares = query.real();
  tally.largest = query.real();
  return tally;
}

std::int64_t now() {
  const auto time = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
}

std::optional<std::int64_t> scenario_row(Connection& connection, std::string_view id) {
  Query query(connection, "SELECT row FROM scenario WHERE id = ?", id);
  if (!query.next()) return std::nullopt;
  return query.integer();
}

std::optional<ScenarioRecord> load_scenario(Connection& connection, std::string_view id) {
  Query query(connection, SCENARIO_COLUMNS "WHERE id = ?", id);
  if (!query.next()) return std::nullopt;
  const auto row = query.integer();
  return read_scenario(connection, row, query);
}

Page<ScenarioRecord> load_scenarios(Connection& connection, std::size_t limit, std::string_view cursor) {
  const auto before = cursor.empty() ? std::numeric_limits<std::int64_t>::max()
                                     : decode_cursor(cursor, Listing::scenarios, 0).row;
  Page<ScenarioRecord> page;
  if (limit == 0) return page;
  Query query(connection,
              SCENARIO_COLUMNS "WHERE scenario.row < ? AND id IS NOT NULL ORDER BY scenario.row DESC LIMIT ?",
              before, limit + 1);
  std::int64_t last = 0;
  while (query.next()) {
    if (page.records.size() == limit) {
      page.next_cursor = encode({Listing::scenarios, 0, last, 0});
      break;
    }
    last = query.integer();
    page.records.push_back(read_scenario(connection, last, query));
  }
  return page;
}

std::uint64_t count_samples(Connection& connection, std::string_view scenario) {
  Query query(connection,
              "SELECT samples FROM scenario CROSS JOIN stock ON stock.scenario = scenario.row WHERE id = ?",
              scenario);
  return query.next() ? query.count() : 0;
}

AddedScenario insert_scenario(Connection& connection, const ScenarioRecord& record) {
  if (auto present = load_scenario(connection, record.id)) return {*std::move(present), false};
  run(connection,
      "INSERT INTO scenario (id, world, world_version, title, document, created_at) VALUES (?, ?, ?, ?, ?, "
      "?)",
      record.id, record.world, record.world_version, record.title, record.document,
      record.created_at != 0 ? record.created_at : now());
  run(connection, "INSERT INTO stock (scenario) VALUES (?)", connection.last_inserted_row());
  return {load_scenario(connection, record.id).value(), true};
}

std::vector<std::string> load_scenarios_without_pilot(Connection& connection) {
  std::vector<std::string> ids;
  Query query(connection,
              "SELECT id FROM scenario INDEXED BY scenario_by_pilot"
              " WHERE pilot_draws IS NULL AND id IS NOT NULL ORDER BY row");
  while (query.next())
    ids.push_back(query.text());
  return ids;
}

bool write_pilot(Connection& connection, std::string_view id, const PilotTally& pilot) {
  return run(connection,
             "UPDATE scenario SET pilot_draws = ?, pilot_hits = ?, pilot_seconds = ? WHERE id = ?",
             pilot.draws, pilot.hits, pilot.seconds, id) > 0;
}

bool delete_scenario(Connection& connection, std::string_view id) {
  const auto row = scenario_row(connection, id);
  if (!row) return false;
  run(connection, "UPDATE scenario SET id = NULL WHERE row = ?", *row);
  run(connection, "UPDATE chain SET id = NULL WHERE scenario = ?", *row);
  run(connection, "DELETE FROM stock WHERE scenario = ?", *row);
  return true;
}

bool purge(Connection& connection) {
  const auto row = [&]() -> std::optional<std::int64_t> {
    Query query(connection, "SELECT row FROM scenario WHERE id IS NULL LIMIT 1");
    return query.next() ? std::optional(query.integer()) : std::nullopt;
  }();
  if (!row) return false;
    // The large tables by slices, from the leaves up; the rest goes with the scenario's own row.
#define NEXT_SAMPLES "(SELECT row FROM sample INDEXED BY sample_by_scenario WHERE scenario = ? LIMIT ?)"
  const bool more =
      run(connection,
          "DELETE FROM play WHERE row IN (SELECT row FROM play WHERE sample IN " NEXT_SAMPLES " LIMIT ?)",
          *row, kPurgedSamples, kPurgedRows) > 0 ||
      run(connection,
          "DELETE FROM seen WHERE (player, sample) IN"
          " (SELECT player, sample FROM seen WHERE sample IN " NEXT_SAMPLES " LIMIT ?)",
          *row, kPurgedSamples, kPurgedRows) > 0 ||
      run(connection, "DELETE FROM sample WHERE row IN " NEXT_SAMPLES, *row, kPurgedSamples) > 0 ||
      run(connection,
          "DELETE FROM trace_block WHERE row IN (SELECT trace_block.row FROM chain CROSS JOIN trace_block"
          " ON trace_block.chain = chain.row WHERE chain.scenario = ? LIMIT ?)",
          *row, kPurgedRows) > 0 ||
      run(connection, "DELETE FROM player WHERE row IN (SELECT row FROM player WHERE scenario = ? LIMIT ?)",
          *row, kPurgedRows) > 0;
#undef NEXT_SAMPLES
  if (!more) run(connection, "DELETE FROM scenario WHERE row = ?", *row);
  return true;
}

StoreTotals load_totals(Connection& connection) {
  Query query(connection, "SELECT count(*), coalesce(sum(samples), 0), coalesce(sum(plays), 0) FROM stock");
  query.next();
  StoreTotals totals;
  totals.scenarios = query.count();
  totals.samples = query.count();
  totals.plays = query.count();
  return totals;
}

}  // namespace retake::database
