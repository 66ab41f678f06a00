// The rows of chains.
// Realises doc/design.md, section 5.
#include "db/sqlite/chain_rows.h"

#include <limits>
#include <string>
#include <string_view>

#include "db/errors.h"
#include "db/sqlite/cursor.h"
#include "db/sqlite/lesson_rows.h"
#include "db/sqlite/sample_rows.h"
#include "db/sqlite/scenario_rows.h"
#include "db/sqlite/seals.h"
#include "sampler/target.h"

namespace retake::database {
namespace {

/// The columns of a chain from one to another.
std::vector<std::string_view> columns_between(std::string_view first, std::string_view last) {
  const auto& all = chain_seal().columns;
  const auto from = all.begin() + static_cast<std::ptrdiff_t>(part_of(chain_seal(), first));
  return {from, all.begin() + static_cast<std::ptrdiff_t>(part_of(chain_seal(), last)) + 1};
}

/// "a, b, ..."
std::string listed(const std::vector<std::string_view>& columns) {
  std::string list;
  for (const std::string_view column : columns)
    list.append(list.empty() ? "" : ", ").append("chain.").append(column);
  return list;
}

/// A statement whose rows read_chain reads.
std::string select_chains(std::string_view from) {
  return "SELECT chain.row, " + unsound_in(chain_seal()) + ", chain.id, scenario.id, " +
         listed(columns_between("position", "odds_largest")) + " " + std::string(from);
}

/// Calls `read` for the rows of a query that are sound.
template <typename Read>
void each_sound(Connection& connection, Query& query, const SealedTable& table, const std::string& thing,
                Read read) {
  while (query.next()) {
    if (const auto column = read_unsound(table, query)) {
      connection.tell_damage(damage_of(thing, *column));
    } else {
      read();
    }
  }
}

/// Sets `row` to the chain's, also where it is damaged. Throws: Damaged.
ChainRecord read_chain(Connection& connection, Query& query, std::int64_t& row) {
  ChainRecord record;
  row = query.integer();
  const auto damaged = read_unsound(chain_seal(), query);
  record.id = query.text();
  if (damaged) throw Damaged(damage_of("chain " + record.id, *damaged));
  record.scenario = query.text();
  record.index = static_cast<std::uint32_t>(query.count());
  record.seed = query.count();
  record.method = query.text();
  record.ratios = query.text();
  record.settings = query.text();
  record.lesson = query.count();
  record.created_at = query.integer();
  record.state = chain_state(query.text());
  record.ended_by = query.text();
  record.error = query.text();
  visit_limits(
      [&]<typename Limit>(std::string_view, std::optional<Limit>& limit) { limit = query.optional<Limit>(); },
      record.stop);
  record.attempts = query.count();
  ChainCounters& counters = record.counters;
  visit_counters(counters, [&]<typename Value>(const char*, Value& value) { value = query.number<Value>(); });
  counters.counted = query.count();
  counters.run_seconds = query.real();
  counters.iterations_per_second = query.real();
  counters.first_sample_iteration = query.optional<std::uint64_t>();
  counters.first_sample_seconds = query.optional<double>();
  counters.effective_samples = query.optional<double>();
  counters.is_learning = query.integer() != 0;
  counters.odds = read_odds(query);

  static const std::string kernel_sql = "SELECT " + unsound_in(kernel_seal()) +
                                        ", name, proposed, accepted FROM chain_kernel WHERE chain = ?"
                                        " ORDER BY position";
  Query kernels(connection, kernel_sql, row);
  each_sound(connection, kernels, kernel_seal(), "a kernel of chain " + record.id, [&] {
    counters.kernels.push_back({kernels.text(), kernels.count(), kernels.count()});
  });
  static const std::string rung_sql = "SELECT " + unsound_in(rung_seal()) +
                                      ", beta, proposed, accepted FROM chain_rung WHERE chain = ?"
                                      " ORDER BY position";
  Query rungs(connection, rung_sql, row);
  each_sound(connection, rungs, rung_seal(), "a rung of chain " + record.id, [&] {
    counters.rungs.push_back({rungs.real(), rungs.count(), rungs.count()});
  });
  return record;
}

ChainRecord read_chain(Connection& connection, Query& query) {
  std::int64_t row = 0;
  return read_chain(connection, query, row);
}

/// Those that are sound, up to a limit: `row` is that of the last one looked at. True: there are more.
bool read_sound_chains(Connection& connection, Query& query, std::size_t limit, std::int64_t& row,
                       std::vector<ChainRecord>& records) {
  while (query.next()) {
    if (records.size() == limit) return true;
    try {
      records.push_back(read_chain(connection, query, row));
    } catch (const Damaged& damage) {
      connection.tell_damage(damage.what());
    }
  }
  return false;
}

std::vector<ChainRecord> read_chains(Connection& connection, Query& query) {
  std::vector<ChainRecord> records;
  std::int64_t row = 0;
  read_sound_chains(connection, query, std::numeric_limits<std::size_t>::max(), row, records);
  return records;
}

void write_kernels(Connection& connection, std::int64_t chain, const std::vector<KernelCounter>& kernels) {
  std::int64_t position = 0;
  for (const auto& kernel : kernels) {
    static const std::string sql = "REPLACE " + insert_sealed(kernel_seal());
    run(connection, sql, chain, position, kernel.name, kernel.proposed, kernel.accepted);
    ++position;
  }
  run(connection, "DELETE FROM chain_kernel WHERE chain = ? AND position >= ?", chain, position);
}

void write_rungs(Connection& connection, std::int64_t chain, const std::vector<RungCounter>& rungs) {
  std::int64_t position = 0;
  for (const auto& rung : rungs) {
    static const std::string sql = "REPLACE " + insert_sealed(rung_seal());
    run(connection, sql, chain, position, rung.beta, rung.proposed, rung.accepted);
    ++position;
  }
  run(connection, "DELETE FROM chain_rung WHERE chain = ? AND position >= ?", chain, position);
}

/// " WHERE row = ?n" after so many values.
std::string at_row_after(const std::vector<std::string_view>& columns) {
  return " WHERE row = ?" + std::to_string(columns.size() + 1);
}

void bind_stop(Query& query, const StopRule& stop) {
  visit_limits([&](std::string_view, const auto& limit) { query.bind(limit); }, stop);
}

void bind_counters(Query& query, const ChainCounters& counters) {
  visit_counters(counters, [&](const char*, auto value) { query.bind(value); });
  query.bind_all(counters.counted, counters.run_seconds, counters.iterations_per_second,
                 counters.first_sample_iteration, counters.first_sample_seconds, counters.effective_samples,
                 counters.is_learning ? 1 : 0, to_string(counters.odds.basis), counters.odds.draws,
                 counters.odds.hits, counters.odds.sum, counters.odds.squares, counters.odds.largest);
}

void write_stop(Connection& connection, std::int64_t chain, const StopRule& stop) {
  static const auto columns = columns_between("stop_samples", "stop_ess");
  static const std::string sql =
      "UPDATE chain SET " + set_sealed(chain_seal(), columns) + at_row_after(columns);
  Query query(connection, sql);
  bind_stop(query, stop);
  query.bind(chain);
  query.next();
}

/// With them the attempts without progress are over.
void write_counters(Connection& connection, std::int64_t chain, const ChainCounters& counters) {
  static const auto columns = columns_between("attempts", "odds_largest");
  static const std::string sql =
      "UPDATE chain SET " + set_sealed(chain_seal(), columns) + at_row_after(columns);
  Query query(connection, sql);
  query.bind(0);
  bind_counters(query, counters);
  query.bind(chain);
  query.next();
  write_kernels(connection, chain, counters.kernels);
  write_rungs(connection, chain, counters.rungs);
}

/// A count that is damaged stays as it is.
void count_attempt(Connection& connection, std::string_view id) {
  static const std::string sql = "UPDATE chain SET attempts = attempts + 1, seal = reseal(seal, " +
                                 std::to_string(part_of(chain_seal(), "attempts")) +
                                 ", attempts + 1) WHERE id = ? AND " +
                                 unsound_in(chain_seal(), "attempts", "attempts") + " IS NULL";
  run(connection, sql, id);
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
  std::vector<ChainRecord> same = read_chains(connection, query);
  return same.empty() ? std::nullopt : std::optional(std::move(same.front()));
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
      " WHERE chain.scenario = ? AND chain.row > ? ORDER BY chain.row");
  Query query(connection, sql, from.scenario, from.row);
  if (read_sound_chains(connection, query, limit, from.row, page.records)) page.next_cursor = encode(from);
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
  static const std::string sql =
      "SELECT " + unsound_in(checkpoint_seal()) +
      ", bytes FROM chain CROSS JOIN checkpoint ON checkpoint.chain = chain.row WHERE chain.id = ?";
  Query query(connection, sql, chain);
  if (!query.next()) return {};
  if (read_unsound(checkpoint_seal(), query))
    throw Damaged(damage_of("chain " + std::string(chain), "its checkpoint"));
  return query.text();
}

std::vector<std::string> load_trace(Connection& connection, std::string_view chain) {
  static const std::string sql = "SELECT " + unsound_in(trace_seal()) +
                                 ", bytes FROM chain CROSS JOIN trace_block INDEXED BY trace_block_by_chain"
                                 " ON trace_block.chain = chain.row WHERE chain.id = ? ORDER BY"
                                 " trace_block.row";
  Query query(connection, sql, chain);
  std::vector<std::string> blocks;
  each_sound(connection, query, trace_seal(), "a stretch of the trace of chain " + std::string(chain),
             [&] { blocks.push_back(query.text()); });
  return blocks;
}

bool insert_chain(Connection& connection, const ChainRecord& record) {
  const auto scenario = scenario_row(connection, record.scenario);
  if (!scenario) return false;
  static const std::string sql = "INSERT " + insert_sealed(chain_seal());
  {
    Query query(connection, sql);
    query.bind_all(record.id, *scenario, record.index, record.seed, record.method, record.ratios,
                   record.settings, record.lesson, record.created_at != 0 ? record.created_at : now(),
                   to_string(record.state), record.ended_by, record.error);
    bind_stop(query, record.stop);
    query.bind(0);  // attempts
    bind_counters(query, record.counters);
    query.next();
  }
  const std::int64_t row = connection.last_inserted_row();
  write_kernels(connection, row, record.counters.kernels);
  write_rungs(connection, row, record.counters.rungs);
  if (record.lesson > 0) take_lesson(connection, *scenario, record.lesson);
  return true;
}

void update_chain_state(Connection& connection, std::string_view id, ChainState state,
                        std::string_view ended_by, std::string_view error) {
  static const std::string sql =
      "UPDATE chain SET " + set_sealed(chain_seal(), {"state", "ended_by", "error"}) + " WHERE id = ?4";
  run(connection, sql, to_string(state), ended_by, error, id);
  if (state == ChainState::running) count_attempt(connection, id);
  if (state == ChainState::finished) return_lesson_if_unused(connection, id);
}

void update_chain_stop(Connection& connection, std::string_view id, const StopRule& stop) {
  Query query(connection, "SELECT row FROM chain WHERE id = ?", id);
  if (query.next()) write_stop(connection, query.integer(), stop);
}

void set_damaged_chains_aside(Connection& connection) {
  static const std::string find =
      "SELECT row, id, " + unsound_in(chain_seal()) +
      " FROM chain INDEXED BY chain_by_state WHERE state NOT IN ('paused', 'finished', 'failed')"
      " AND id IS NOT NULL";
  std::vector<std::pair<std::int64_t, std::string>> damaged;
  {
    Query query(connection, find);
    while (query.next()) {
      const auto row = query.integer();
      const std::string id = query.text();
      if (const auto column = read_unsound(chain_seal(), query))
        damaged.emplace_back(row, damage_of("chain " + id, *column));
    }
  }
  // SQLite changes no row with a cell of the wrong type.
  std::string sql = "UPDATE chain SET " + set_sealed(chain_seal(), {"state", "error"});
  for (const char* column :
       {"position", "seed", "lesson", "created_at", "attempts", "iteration", "accepted", "samples",
        "simulations", "failed_simulations", "counted", "is_learning", "odds_draws", "odds_hits"})
    sql += std::string(", ") + column + " = CAST(coalesce(" + column + ", 0) AS INTEGER)";
  for (const char* column : {"simulated_seconds", "skipped_seconds", "run_seconds", "iterations_per_second",
                             "odds_sum", "odds_squares", "odds_largest"})
    sql += std::string(", ") + column + " = CAST(coalesce(" + column + ", 0) AS REAL)";
  for (const char* column :
       {"stop_samples", "stop_counted", "stop_iterations", "stop_ess", "first_sample_iteration"})
    sql += std::string(", ") + column + " = CAST(" + column + " AS INTEGER)";
  for (const char* column : {"stop_seconds", "first_sample_seconds", "effective_samples"})
    sql += std::string(", ") + column + " = CAST(" + column + " AS REAL)";
  for (const char* column : {"method", "ratios", "settings", "ended_by", "odds_basis"})
    sql += std::string(", ") + column + " = CAST(coalesce(" + column + ", '') AS TEXT)";
  static const std::string set = sql + " WHERE row = ?3";
  for (const auto& [row, damage] : damaged) {
    connection.tell_damage(damage);
    run(connection, set, to_string(ChainState::failed), damage, row);
  }
}

Written write_progress(Connection& connection, const ChainProgress& progress) {
  ChainRow chain{.id = progress.chain};
  std::int64_t scenario = 0;
  {
    static const std::string sql = "SELECT " + unsound_in(chain_seal(), "id", "ratios") +
                                   ", row, scenario, ratios FROM chain WHERE id = ?";
    Query query(connection, sql, progress.chain);
    if (!query.next()) return {};
    if (const auto column = read_unsound(chain_seal(), query))
      throw Damaged(damage_of("chain " + progress.chain, *column));
    chain.row = query.integer();
    scenario = query.integer();
    chain.is_apart = query.text() == to_string(Ratios::paper);
  }

  // Samples and weights.
  Stock stock = load_stock(connection, scenario);
  bool shelves_moved = false;
  for (const auto& sample : progress.samples)
    shelves_moved |= insert_sample(connection, stock, chain, sample);
  for (const auto& weight : progress.weights)
    shelves_moved |= update_weight(connection, stock, chain, weight);
  shelves_moved |= settle_door(connection, stock);
  save_stock(connection, stock);

  // Counters and state.
  write_counters(connection, chain.row, progress.counters);
  if (progress.state) {
    update_chain_state(connection, progress.chain, *progress.state, progress.ended_by, progress.error);
  }

  // Checkpoint, trace and lesson.
  if (progress.lesson) insert_lesson(connection, scenario, chain.row, *progress.lesson);
  static const std::string set_checkpoint = "REPLACE " + insert_sealed(checkpoint_seal());
  run(connection, set_checkpoint, chain.row, Blob{progress.checkpoint});
  if (progress.replace_trace) run(connection, "DELETE FROM trace_block WHERE chain = ?", chain.row);
  if (!progress.trace_block.empty()) {
    static const std::string add_block = "INSERT " + insert_sealed(trace_seal());
    run(connection, add_block, chain.row, Blob{progress.trace_block});
  }

  return {.samples = static_cast<std::uint64_t>(stock.samples), .shelves_moved = shelves_moved};
}

}  // namespace retake::database
