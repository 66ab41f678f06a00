// See seals.h.
#include "db/sqlite/seals.h"

#include <algorithm>

#include "sampler/check.h"

namespace retake::database {
namespace {

std::string qualified(const SealedTable& table, std::string_view column) {
  const bool is_blob = table.name == "sample" && (column == "state" || column == "animation");
  return std::string(is_blob ? "sample_blob" : table.name).append(".").append(column);
}

}  // namespace

const SealedTable& scenario_seal() {
  static const SealedTable table{"scenario",
                                 {"id", "world", "world_version", "title", "document", "created_at",
                                  "pilot_draws", "pilot_hits", "pilot_seconds"}};
  return table;
}

const SealedTable& stock_seal() {
  static const SealedTable table{"stock",
                                 {"scenario", "samples", "counted", "even", "learning", "unplayed",
                                  "unplayed_learning", "plays", "weight", "door", "door_counted", "time"}};
  return table;
}

const SealedTable& chain_seal() {
  static const SealedTable table{"chain",
                                 {"id",
                                  "scenario",
                                  "position",
                                  "seed",
                                  "method",
                                  "ratios",
                                  "settings",
                                  "lesson",
                                  "created_at",
                                  "state",
                                  "ended_by",
                                  "error",
                                  "stop_samples",
                                  "stop_counted",
                                  "stop_iterations",
                                  "stop_seconds",
                                  "stop_ess",
                                  "attempts",
                                  "iteration",
                                  "accepted",
                                  "samples",
                                  "simulations",
                                  "failed_simulations",
                                  "simulated_seconds",
                                  "skipped_seconds",
                                  "counted",
                                  "run_seconds",
                                  "iterations_per_second",
                                  "first_sample_iteration",
                                  "first_sample_seconds",
                                  "effective_samples",
                                  "is_learning",
                                  "odds_basis",
                                  "odds_draws",
                                  "odds_hits",
                                  "odds_sum",
                                  "odds_squares",
                                  "odds_largest"}};
  return table;
}

const SealedTable& kernel_seal() {
  static const SealedTable table{"chain_kernel", {"chain", "position", "name", "proposed", "accepted"}};
  return table;
}

const SealedTable& rung_seal() {
  static const SealedTable table{"chain_rung", {"chain", "position", "beta", "proposed", "accepted"}};
  return table;
}

const SealedTable& checkpoint_seal() {
  static const SealedTable table{"checkpoint", {"chain", "bytes"}};
  return table;
}

const SealedTable& trace_seal() {
  static const SealedTable table{"trace_block", {"chain", "bytes"}};
  return table;
}

const SealedTable& lesson_seal() {
  static const SealedTable table{"lesson",
                                 {"scenario", "number", "method", "ratios", "chain", "version", "kind",
                                  "went_on", "bytes", "created_at"}};
  return table;
}

const SealedTable& sample_seal() {
  static const SealedTable table{
      "sample",
      {"scenario", "chain", "iteration", "replica", "weight", "log_prior", "log_constraint", "duration",
       "measures", "digest", "created_at", "plays", "shelf", "chance", "pass", "state", "animation"}};
  return table;
}

const SealedTable& player_seal() {
  static const SealedTable table{"player", {"scenario", "name", "seen", "seen_even", "seen_learning"}};
  return table;
}

const SealedTable& seen_seal() {
  static const SealedTable table{"seen", {"player", "sample", "last_play"}};
  return table;
}

const SealedTable& play_seal() {
  static const SealedTable table{"play", {"sample", "player", "repeat", "remaining", "created_at"}};
  return table;
}

const SealedTable& key_seal() {
  static const SealedTable table{"idempotency", {"scenario", "key", "play"}};
  return table;
}

std::string insert_sealed(const SealedTable& table) {
  std::string columns, values;
  int parameter = 0;
  for (const std::string_view column : table.columns) {
    columns.append(column).append(", ");
    values.append(values.empty() ? "?" : ", ?").append(std::to_string(++parameter));
  }
  return std::string("INTO ").append(table.name) + " (" + columns + "seal) VALUES (" + values + ", seal(" +
         values + "))";
}

std::string set_sealed(const SealedTable& table, const std::vector<std::string_view>& columns) {
  std::string cells, parts;
  int parameter = 0;
  for (const std::string_view column : columns) {
    const std::string value = "?" + std::to_string(++parameter);
    cells.append(column).append(" = ").append(value).append(", ");
    parts.append(", ").append(std::to_string(part_of(table, column))).append(", ").append(value);
  }
  return cells + "seal = reseal(seal" + parts + ")";
}

std::size_t part_of(const SealedTable& table, std::string_view column) {
  const auto place = std::find(table.columns.begin(), table.columns.end(), column);
  CHECK(place != table.columns.end(), table.name, column);
  return static_cast<std::size_t>(place - table.columns.begin());
}

std::string unsound_in(const SealedTable& table) {
  return unsound_in(table, table.columns.front(), table.columns.back());
}

std::string unsound_in(const SealedTable& table, std::string_view first, std::string_view last) {
  const std::size_t from = part_of(table, first), to = part_of(table, last);
  std::string expression = "unsound(" + std::string(table.name) + ".seal, " + std::to_string(from);
  for (std::size_t part = from; part <= to; ++part)
    expression += ", " + qualified(table, table.columns[part]);
  return expression + ")";
}

std::optional<std::string_view> read_unsound(const SealedTable& table, Query& query) {
  const auto part = query.optional<std::uint64_t>();
  if (!part) return std::nullopt;
  return *part < table.columns.size() ? table.columns[*part] : std::string_view("seal");
}

std::string damage_of(std::string_view thing, std::string_view column) {
  return std::string(thing).append(" is damaged: ").append(column).append(" is not what was written");
}

}  // namespace retake::database
