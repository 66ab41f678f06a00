// The rows of chains.
// Realises doc/design.md, section 5.
#include "db/sqlite/chain_rows.h"

#include <string>
#include <string_view>

#include "db/sqlite/cursor.h"
#include "db/sqlite/lesson_rows.h"
#include "db/sqlite/sample_rows.h"
#include "db/sqlite/scenario_rows.h"
#include "sampler/target.h"

namespace retake::database {
namespace {

/// "name<after>, name<after>, ..." of the counters that are one number each.
std::string counter_columns(std::string_view after = "") {
  std::string columns;
  visit_counters(ChainCounts{}, [&](std::string_view name, auto) {
    columns.append(columns.empty() ? "" : ", ").append(name).append(after);
  });
  return columns;
}

/// "stop_<name><after>, ..." of the limits of a stop rule.
std::string stop_columns(std::string_view after = "") {
  std::string columns;
  StopRule none;
  visit_limits(
      [&](std::string_view name, const auto&) {
        columns.append(columns.empty() ? "stop_" : ", stop_").append(name).append(after);
      },
      none);
  return columns;
}

/// A statement whose rows read_chain reads.
std::string select_chains(std::string_view from) {
  return "SELECT chain.row, chain.id, scenario.id, position, seed, method, ratios, settings, lesson, state,"
         " " +
         stop_columns() + ", " + counter_columns() +
         ", counted, run_seconds, iterations_per_second, first_sample_iteration, first_sample_seconds,"
         " effective_samples, is_learning, ended_by, error, attempts, chain.created_at, " ODDS_COLUMNS " " +
         std::string(from);
}

/// Sets `row` to the chain's.
ChainRecord read_chain(Connection& connection, Query& query, std::int64_t& row) {
  ChainRecord record;
  row = query.integer();
  record.id = query.text();
  record.scenario = query.text();
  record.index = static_cast<std::uint32_t>(query.count());
  record.seed = query.count();
  record.method = query.text();
  record.ratios = query.text();
  record.settings = query.text();
  record.lesson = query.count();
  record.state = chain_state(query.text());
  visit_limits(
      [&]<typename Limit>(std::string_view, std::optional<Limit>& limit) { limit = query.optional<Limit>(); },
      record.stop);
  ChainCounters& counters = record.counters;
  visit_counters(counters, [&]<typename Value>(const char*, Value& value) { value = query.number<Value>(); });
  counters.counted = query.count();
  counters.run_seconds = query.real();
  counters.iterations_per_second = query.real();
  counters.first_sample_iteration = query.optional<std::uint64_t>();
  counters.first_sample_seconds = query.optional<double>();
  counters.effective_samples = query.optional<double>();
  counters.is_learning = query.integer() != 0;
  record.ended_by = query.text();
  record.error = query.text();
  record.attempts = query.count();
  record.created_at = query.integer();
  counters.odds = read_odds(query);

  Query kernels(connection,
                "SELECT name, proposed, accepted FROM chain_kernel WHERE chain = ? ORDER BY position", row);
  while (kernels.next())
    counters.kernels.push_back({kernels.text(), kernels.count(), kernels.count()});
  Query rungs(connection, "SELECT beta, proposed, accepted FROM chain_rung WHERE chain = ? ORDER BY position",
              row);
  while (rungs.next())
    counters.rungs.push_back({rungs.real(), rungs.count(), rungs.count()});
  return record;
}

ChainRecord read_chain(Connection& connection, Query& query) {
  std::int64_t row = 0;
  return read_chain(connection, query, row);
}

std::vector<ChainRecord> read_chains(Connection& connection, Query& query) {
  std::vector<ChainRecord> records;
  while (query.next())
    records.push_back(read_chain(connection, query));
  return records;
}

void write_kernels(Connection& connection, std::int64_t chain, const std::vector<KernelCounter>& kernels) {
  std::int64_t position = 0;
  for (const auto& kernel : kernels) {
    run(connection,
        "REPLACE INTO chain_kernel (chain, position, name, proposed, accepted) VALUES (?, ?, ?, ?, ?)", chain,
        position, kernel.name, kernel.proposed, kernel.accepted);
    ++position;
  }
  run(connection, "DELETE FROM chain_kernel WHERE chain = ? AND position >= ?", chain, position);
}

void write_rungs(Connection& connection, std::int64_t chain, const std::vector<RungCounter>& rungs) {
  std::int64_t position = 0;
  for (const auto& rung : rungs) {
    run(connection,
        "REPLACE INTO chain_rung (chain, position, beta, proposed, accepted) VALUES (?, ?, ?, ?, ?)", chain,
        position, rung.beta, rung.proposed, rung.accepted);
    ++position;
  }
  run(connection, "DELETE FROM chain_rung WHERE chain = ? AND position >= ?", chain, position);
}

void write_stop(Connection& connection, std::int64_t chain, const StopRule& stop) {
  static const std::string sql = "UPDATE chain SET " + stop_columns(" = ?") + " WHERE row = ?";
  Query query(connection, sql);
  visit_limits([&](std::string_view, const auto& limit) { query.bind(limit); }, stop);
  query.bind(chain);
  query.next();
}

void write_counters(Connection& connection, std::int64_t chain, const ChainCounters& counters) {
  static const std::string sql =
      "UPDATE chain SET " + counter_columns(" = ?") +
      ", counted = ?, run_seconds = ?, iterations_per_second = ?, first_sample_iteration = ?, "
      "first_sample_seconds = ?,"
      " effective_samples = ?, is_learning = ?, odds_basis = ?, odds_draws = ?, odds_hits = ?, odds_sum = ?,"
      " odds_squares = ?, odds_largest = ? WHERE row = ?";
  Query query(connection, sql);
  visit_counters(counters, [&](const char*, auto value) { query.bind(value); });
  query.bind_all(counters.counted, counters.run_seconds, counters.iterations_per_second,
                 counters.first_sample_iteration, counters.first_sample_seconds, counters.effective_samples,
                 counters.is_learning ? 1 : 0, to_string(counters.odds.basis), counters.odds.draws,
                 counters.odds.hits, counters.odds.sum, counters.odds.squares, counters.odds.largest, chain);
  query.next();
  write_kernels(connection, chain, counters.kernels);
  write_rungs(connection, chain, counters.rungs);
}

}  // namespace

std::optional<ChainRecord> load_chain(Connection& connection, std::string_view id) {
  static const std::string sql =
      select_chains("FROM chain CROSS JOIN scenario ON scenario.row = chain.scenario WHERE chain.id = ?");
  Query query(connection, sql, id);
  if (!query.next()) return std::nullopt;
  return read_chain(connection, query);
}

std::optional<ChainRecord> load_same_chain(Connection& connection, const ChainRecord& like,
                                           std::optional<std::uint64_t> lesson) {
  static const std::string sql = select_chains(
      "FROM scenario CROSS JOIN chain INDEXED BY chain_by_seed ON chain.scenario = scenario.row"
      " WHERE scenario.id = ?1 AND seed = ?2 AND position = ?3 AND method = ?4 AND ratios = ?5"
      " AND coalesce(?6, lesson) = lesson ORDER BY chain.row LIMIT 1");
  Query query(connection, sql, like.scenario, like.seed, like.index, like.method, like.ratios, lesson);
  if (!query.next()) return std::nullopt;
  return read_chain(connection, query);
}

std::vector<ChainRecord> load_chains(Connection& connection, std::string_view scenario) {
  static const std::string sql = select_chains(
      "FROM scenario CROSS JOIN chain INDEXED BY chain_by_scenario ON chain.scenario = scenario.row"
      " WHERE scenario.id = ? ORDER BY chain.row");
  Query query(connection, sql, scenario);
  return read_chains(connection, query);
}

Page<ChainRecord> load_chains(Connection& connection, std::string_view scenario, std::size_t limit,
                              std::string_view cursor) {
  const auto row = scenario_row(connection, scenario);
  if (!row && cursor.empty()) return {};
  Cursor from{.listing = Listing::chains, .scenario = row.value_or(0), .row = 0};
  if (!cursor.empty()) from = decode_cursor(cursor, Listing::chains, from.scenario);
  Page<ChainRecord> page;
  if (limit == 0) return page;
  static const std::string sql = select_chains(
      "FROM chain INDEXED BY chain_by_scenario CROSS JOIN scenario ON scenario.row = chain.scenario"
      " WHERE chain.scenario = ? AND chain.row > ? ORDER BY chain.row LIMIT ?");
  Query query(connection, sql, from.scenario, from.row, limit + 1);
  while (query.next()) {
    if (page.records.size() == limit) {
      page.next_cursor = encode(from);
      break;
    }
    page.records.push_back(read_chain(connection, query, from.row));
  }
  return page;
}

std::vector<ChainRecord> load_chains_in_states(Connection& connection,
                                               const std::vector<ChainState>& states) {
  const auto name = [&](std::size_t index) {
    return index < states.size() ? std::optional(to_string(states[index])) : std::nullopt;
  };
  static const std::string sql = select_chains(
      "FROM chain INDEXED BY chain_by_state CROSS JOIN scenario ON scenario.row = chain.scenario"
      " WHERE state IN (?, ?, ?, ?, ?) AND chain.id IS NOT NULL ORDER BY chain.row");
  Query query(connection, sql, name(0), name(1), name(2), name(3), name(4));
  return read_chains(connection, query);
}

std::string load_checkpoint(Connection& connection, std::string_view chain) {
  Query query(
      connection,
      "SELECT bytes FROM chain CROSS JOIN checkpoint ON checkpoint.chain = chain.row WHERE chain.id = ?",
      chain);
  return query.next() ? query.text() : std::string();
}

std::vector<std::string> load_trace(Connection& connection, std::string_view chain) {
  Query query(connection,
              "SELECT bytes FROM chain CROSS JOIN trace_block INDEXED BY trace_block_by_chain"
              " ON trace_block.chain = chain.row WHERE chain.id = ? ORDER BY trace_block.row",
              chain);
  std::vector<std::string> blocks;
  while (query.next())
    blocks.push_back(query.text());
  return blocks;
}

bool insert_chain(Connection& connection, const ChainRecord& record) {
  const auto scenario = scenario_row(connection, record.scenario);
  if (!scenario) return false;
  // The counters follow; what must not be null is 0 until then.
  run(connection,
      "INSERT INTO chain (id, scenario, position, seed, method, ratios, settings, lesson, state, iteration,"
      " accepted, samples, simulations, failed_simulations, simulated_seconds, run_seconds,"
      " iterations_per_second, ended_by, error, created_at)"
      " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, 0, 0, 0, 0, 0, 0, 0, 0, ?, ?, ?)",
      record.id, *scenario, record.index, record.seed, record.method, record.ratios, record.settings,
      record.lesson, to_string(record.state), record.ended_by, record.error,
      record.created_at != 0 ? record.created_at : now());
  const std::int64_t row = connection.last_inserted_row();
  write_stop(connection, row, record.stop);
  write_counters(connection, row, record.counters);
  if (record.lesson > 0) take_lesson(connection, *scenario, record.lesson);
  return true;
}

void update_chain_state(Connection& connection, std::string_view id, ChainState state,
                        std::string_view ended_by, std::string_view error) {
  run(connection,
      "UPDATE chain SET state = ?1, ended_by = ?2, error = ?3, attempts = attempts + (?1 = 'running')"
      " WHERE id = ?4",
      to_string(state), ended_by, error, id);
  if (state == ChainState::finished) return_lesson_if_unused(connection, id);
}

void update_chain_stop(Connection& connection, std::string_view id, const StopRule& stop) {
  Query query(connection, "SELECT row FROM chain WHERE id = ?", id);
  if (query.next()) write_stop(connection, query.integer(), stop);
}

Written write_progress(Connection& connection, const ChainProgress& progress) {
  ChainRow chain{.id = progress.chain};
  std::int64_t scenario = 0;
  {
    Query query(connection, "SELECT row, scenario, ratios FROM chain WHERE id = ?", progress.chain);
    if (!query.next()) return {};
    chain.row = query.integer();
    scenario = query.integer();
    chain.is_apart = query.text() == to_string(Ratios::paper);
  }

  // Samples and weights.
  Stock stock = load_stock(connection, scenario).value();
  bool shelves_moved = false;
  for (const auto& sample : progress.samples)
    shelves_moved |= insert_sample(connection, stock, chain, sample);
  for (const auto& weight : progress.weights)
    shelves_moved |= update_weight(connection, stock, chain, weight);
  shelves_moved |= settle_door(connection, stock);
  save_stock(connection, stock);

  // Counters and state.
  write_counters(connection, chain.row, progress.counters);
  run(connection, "UPDATE chain SET attempts = 0 WHERE row = ? AND attempts > 0", chain.row);
  if (progress.state) {
    update_chain_state(connection, progress.chain, *progress.state, progress.ended_by, progress.error);
  }

  // Checkpoint, trace and lesson.
  if (progress.lesson) insert_lesson(connection, scenario, chain.row, *progress.lesson);
  run(connection, "REPLACE INTO checkpoint (chain, bytes) VALUES (?, ?)", chain.row,
      Blob{progress.checkpoint});
  if (progress.replace_trace) run(connection, "DELETE FROM trace_block WHERE chain = ?", chain.row);
  if (!progress.trace_block.empty()) {
    run(connection, "INSERT INTO trace_block (chain, bytes) VALUES (?, ?)", chain.row,
        Blob{progress.trace_block});
  }

  return {.samples = static_cast<std::uint64_t>(stock.samples), .shelves_moved = shelves_moved};
}

}  // namespace retake::database
