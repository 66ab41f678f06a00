// The rows of scenarios.
// Realises doc/design.md, section 5.
#include "db/sqlite/scenario_rows.h"

#include <chrono>
#include <limits>

#include "db/errors.h"
#include "db/sqlite/cursor.h"
#include "db/sqlite/seals.h"
#include "db/sqlite/stock_rows.h"

namespace retake::database {
namespace {

// How much one purge removes; chosen so that plays wait a few milliseconds for it at most.
constexpr int kPurgedSamples = 50;
constexpr int kPurgedRows = 500;

/// A statement whose rows are a row number and what read_scenario reads.
std::string select_scenarios(std::string_view which) {
  return "SELECT scenario.row, scenario.id, " + unsound_in(scenario_seal()) +
         ", world, world_version, title, document, created_at, " + unsound_in(stock_seal()) +
         ", stock.samples,"
         " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state IN ('queued', "
         "'running')),"
         " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state = 'paused'),"
         " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state = 'finished'),"
         " (SELECT count(*) FROM chain WHERE chain.scenario = scenario.row AND state = 'failed'),"
         " pilot_draws, pilot_hits, pilot_seconds"
         " FROM scenario LEFT JOIN stock ON stock.scenario = scenario.row " +
         std::string(which);
}

std::uint64_t samples_held(Connection& connection, std::int64_t scenario) {
  Query query(connection, "SELECT count(*) FROM sample INDEXED BY sample_by_scenario WHERE scenario = ?",
              scenario);
  query.next();
  return query.count();
}

// Reads the columns that follow the row number.
// Throws: Damaged.
ScenarioRecord read_scenario(Connection& connection, std::int64_t row, Query& query) {
  ScenarioRecord record;
  record.id = query.text();
  if (const auto column = read_unsound(scenario_seal(), query))
    throw Damaged(damage_of("scenario " + record.id, *column));
  record.world = query.text();
  record.world_version = static_cast<int>(query.integer());
  record.title = query.text();
  record.document = query.text();
  record.created_at = query.integer();
  // The stock can be told from the samples.
  const auto in_stock = read_unsound(stock_seal(), query);
  record.samples = query.count();
  if (in_stock) {
    connection.tell_damage(damage_of("stock of scenario " + record.id, *in_stock));
    record.samples = samples_held(connection, row);
  }
  record.running = query.count();
  record.paused = query.count();
  record.finished = query.count();
  record.failed = query.count();
  if (!query.is_null()) record.pilot = PilotTally{query.count(), query.count(), query.real()};

  static const std::string sql =
      "SELECT chain.id, " + unsound_in(chain_seal(), "odds_basis", "odds_largest") +
      ", " ODDS_COLUMNS " FROM chain INDEXED BY chain_by_scenario WHERE chain.scenario = ?";
  Query tallies(connection, sql, row);
  OddsPool pool;
  while (tallies.next()) {
    const std::string chain = tallies.text();
    if (const auto column = read_unsound(chain_seal(), tallies)) {
      connection.tell_damage(damage_of("chain " + chain, *column));
    } else {
      pool.add(read_odds(tallies));
    }
  }
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
  static const std::string sql =
      "SELECT row, " + unsound_in(scenario_seal(), "id", "id") + " FROM scenario WHERE id = ?";
  Query query(connection, sql, id);
  if (!query.next()) return std::nullopt;
  const auto row = query.integer();
  if (const auto column = read_unsound(scenario_seal(), query))
    throw Damaged(damage_of("scenario " + std::string(id), *column));
  return row;
}

std::optional<ScenarioRecord> load_scenario(Connection& connection, std::string_view id) {
  static const std::string sql = select_scenarios("WHERE scenario.id = ?");
  Query query(connection, sql, id);
  if (!query.next()) return std::nullopt;
  const auto row = query.integer();
  return read_scenario(connection, row, query);
}

Page<ScenarioRecord> load_scenarios(Connection& connection, std::size_t limit, std::string_view cursor) {
  const auto before = cursor.empty() ? std::numeric_limits<std::int64_t>::max()
                                     : decode_cursor(cursor, Listing::scenarios, 0).row;
  Page<ScenarioRecord> page;
  if (limit == 0) return page;
  static const std::string sql =
      select_scenarios("WHERE scenario.row < ? AND scenario.id IS NOT NULL ORDER BY scenario.row DESC");
  Query query(connection, sql, before);
  std::int64_t last = 0;
  while (query.next()) {
    if (page.records.size() == limit) {
      page.next_cursor = encode({Listing::scenarios, 0, last, 0});
      break;
    }
    last = query.integer();
    try {
      page.records.push_back(read_scenario(connection, last, query));
    } catch (const Damaged& damage) {
      connection.tell_damage(damage.what());
    }
  }
  return page;
}

std::uint64_t count_samples(Connection& connection, std::string_view scenario) {
  static const std::string sql = "SELECT scenario.row, " + unsound_in(stock_seal()) +
                                 ", samples FROM scenario LEFT JOIN stock ON stock.scenario = scenario.row"
                                 " WHERE id = ?";
  Query query(connection, sql, scenario);
  if (!query.next()) return 0;
  const auto row = query.integer();
  return read_unsound(stock_seal(), query) ? samples_held(connection, row) : query.count();
}

std::optional<WorldVersion> load_world_of(Connection& connection, std::string_view id) {
  static const std::string sql = "SELECT " + unsound_in(scenario_seal(), "id", "world_version") +
                                 ", world, world_version FROM scenario WHERE id = ?";
  Query query(connection, sql, id);
  if (!query.next()) return std::nullopt;
  if (const auto column = read_unsound(scenario_seal(), query))
    throw Damaged(damage_of("scenario " + std::string(id), *column));
  WorldVersion world;
  world.name = query.text();
  world.version = static_cast<int>(query.integer());
  return world;
}

AddedScenario insert_scenario(Connection& connection, const ScenarioRecord& record) {
  if (auto present = load_scenario(connection, record.id)) return {*std::move(present), false};
  static const std::string sql = "INSERT " + insert_sealed(scenario_seal());
  constexpr std::optional<double> kNoPilot;
  run(connection, sql, record.id, record.world, record.world_version, record.title, record.document,
      record.created_at != 0 ? record.created_at : now(), kNoPilot, kNoPilot, kNoPilot);
  save_stock(connection, {.scenario = connection.last_inserted_row()});
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
  static const std::string sql = "UPDATE scenario SET " +
                                 set_sealed(scenario_seal(), {"pilot_draws", "pilot_hits", "pilot_seconds"}) +
                                 " WHERE id = ?4";
  return run(connection, sql, pilot.draws, pilot.hits, pilot.seconds, id) > 0;
}

bool delete_scenario(Connection& connection, std::string_view id) {
  const auto row = scenario_row(connection, id);
  if (!row) return false;
  // Sealed, so that damage does not look like it.
  constexpr std::optional<std::int64_t> kNone;
  static const std::string scenario_sql =
      "UPDATE scenario SET " + set_sealed(scenario_seal(), {"id"}) + " WHERE row = ?2";
  static const std::string chain_sql =
      "UPDATE chain SET " + set_sealed(chain_seal(), {"id"}) + " WHERE scenario = ?2";
  run(connection, scenario_sql, kNone, *row);
  run(connection, chain_sql, kNone, *row);
  run(connection, "DELETE FROM stock WHERE scenario = ?", *row);
  return true;
}

bool purge(Connection& connection) {
  const auto row = [&]() -> std::optional<std::int64_t> {
    static const std::string sql = "SELECT row FROM scenario WHERE id IS NULL AND " +
                                   unsound_in(scenario_seal(), "id", "id") + " IS NULL LIMIT 1";
    Query query(connection, sql);
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
  static const std::string sql =
      "SELECT count(*), coalesce(sum(samples), 0), coalesce(sum(plays), 0) FROM stock WHERE " +
      unsound_in(stock_seal()) + " IS NULL";
  Query query(connection, sql);
  query.next();
  StoreTotals totals;
  totals.scenarios = query.count();
  totals.samples = query.count();
  totals.plays = query.count();
  return totals;
}

}  // namespace retake::database
