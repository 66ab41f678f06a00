// The rows of samples.
// Realises doc/design.md, section 5.
#include "db/sqlite/sample_rows.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <set>

#include "db/draw_spacing.h"
#include "db/errors.h"
#include "db/sqlite/cursor.h"
#include "db/sqlite/scenario_rows.h"
#include "db/sqlite/seals.h"

namespace retake::database {
namespace {

// Draws are looked for again without the samples that turned out to be damaged, so often; chosen. A chain
// with more of them has no draws.
constexpr int kMostAttempts = 100;
// A weight above this is not added up before it is looked at; chosen such that a million below it add up.
constexpr std::int64_t kHeavy = std::int64_t{1} << 40;

#define OF_ONE_SAMPLE "FROM chain CROSS JOIN sample ON sample.chain = chain.row "
#define WHERE_ONE_SAMPLE "WHERE chain.id = ? AND sample.iteration = ? AND replica = ?"
#define JOIN_NAMES \
  "LEFT JOIN chain ON chain.row = sample.chain CROSS JOIN scenario ON scenario.row = sample.scenario "

/// A statement whose rows are a row number, log_target and what read_sample reads.
std::string select_samples(std::string_view from) {
  return "SELECT sample.row, log_target, scenario.id, chain.id, " + unsound_in(chain_seal(), "id", "id") +
         ", " + unsound_in(sample_seal(), "scenario", "pass") +
         ", sample.iteration, replica, weight, log_prior, log_constraint, duration, measures, digest, plays,"
         " shelf, sample.created_at " +
         std::string(from);
}

/// What is damaged of a sample.
struct Harm {
  std::string_view column;
  std::int64_t row;
  std::string text(const SampleRecord& record) const {
    const bool has_name = column != "chain" && column != "iteration" && column != "replica" && column != "id";
    return damage_of("sample " + (has_name ? record.id : "in row " + std::to_string(row)), column);
  }
};

// Reads the columns that follow the row number and log_target. Throws: Damaged; Apart.
SampleRecord read_sample(Query& query, std::int64_t row) {
  SampleRecord record;
  record.scenario = query.text();
  record.chain = query.text();
  const auto in_name = read_unsound(chain_seal(), query);
  const auto in_row = read_unsound(sample_seal(), query);
  record.iteration = query.count();
  record.replica = static_cast<std::uint32_t>(query.count());
  record.id = sample_id(record.chain, record.iteration, record.replica);
  if (in_row) throw Damaged(Harm{*in_row, row}.text(record));
  if (in_name) throw Damaged(Harm{"id", row}.text(record));
  record.weight = query.count();
  record.log_prior = query.real();
  record.log_constraint = query.real();
  record.duration = query.real();
  record.measures = query.text();
  record.digest = query.text();
  record.plays = query.count();
  if (query.integer() == static_cast<std::int64_t>(Shelf::damaged))
    throw Damaged("sample " + record.id + " is damaged: its state or its animation is not what was written");
  record.created_at = query.integer();
  return record;
}

template <typename Number>
bool parse_number(std::string_view digits, Number& number) {
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc() && end == digits.data() + digits.size() && std::to_string(number) == digits;
}

/// The first of two columns says whether the second one is damaged.
std::optional<std::string> load_blob(Connection& connection, std::string_view sql, std::string_view id) {
  const auto place = parse_sample_id(id);
  if (!place) return std::nullopt;
  Query query(connection, sql, place->chain, place->iteration, place->replica);
  if (!query.next()) return std::nullopt;
  if (const auto column = read_unsound(sample_seal(), query))
    throw Damaged(damage_of("sample " + std::string(id), *column));
  return query.text();
}

// Appends records to the page, damaged ones left out; once it is full, notes where the next one begins.
void read_page(Connection& connection, Query& query, Cursor& last, std::size_t limit,
               Page<SampleRecord>& page) {
  while (query.next()) {
    if (page.records.size() == limit) {
      page.next_cursor = encode(last);
      return;
    }
    last.row = query.integer();
    last.log_target = query.real();
    try {
      page.records.push_back(read_sample(query, last.row));
    } catch (const Damaged& damage) {
      connection.tell_damage(damage.what());
    }
  }
}

/// Counts anew what players have seen of a sample that changes its shelf. Damaged players are left out: they
/// are counted when they are met.
void move_seen(Connection& connection, std::int64_t sample, Shelf before, Shelf after) {
  const auto more = [&](auto is_on) { return int{is_on(after)} - int{is_on(before)}; };
  static const std::string sql =
      "UPDATE player SET seen = seen + ?1, seen_even = seen_even + ?2, seen_learning = seen_learning + ?3,"
      " seal = reseal(seal, 2, seen + ?1, 3, seen_even + ?2, 4, seen_learning + ?3)"
      " WHERE row IN (SELECT player FROM seen WHERE sample = ?4) AND " +
      unsound_in(player_seal()) + " IS NULL";
  run(connection, sql, more([](Shelf on) { return on <= Shelf::rest; }),
      more([](Shelf on) { return on == Shelf::even; }), more([](Shelf on) { return on == Shelf::learning; }),
      sample);
}

}  // namespace

std::optional<SamplePlace> parse_sample_id(std::string_view id) {
  SamplePlace place;
  const auto first = id.find('-');
  if (first == std::string_view::npos || first == 0) return std::nullopt;
  place.chain = id.substr(0, first);
  std::string_view iteration = id.substr(first + 1);
  if (const auto second = iteration.find('-'); second != std::string_view::npos) {
    if (!parse_number(iteration.substr(second + 1), place.replica) || place.replica == 0) return std::nullopt;
    iteration = iteration.substr(0, second);
  }
  if (!parse_number(iteration, place.iteration)) return std::nullopt;
  if (place.iteration > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
    return std::nullopt;
  return place;
}

std::optional<SampleRecord> load_sample(Connection& connection, std::string_view id) {
  const auto place = parse_sample_id(id);
  if (!place) return std::nullopt;
  static const std::string sql =
      select_samples(OF_ONE_SAMPLE "CROSS JOIN scenario ON scenario.row = sample.scenario " WHERE_ONE_SAMPLE);
  Query query(connection, sql, place->chain, place->iteration, place->replica);
  if (!query.next()) return std::nullopt;
  const auto row = query.integer();
  query.real();
  return read_sample(query, row);
}

SampleRecord load_sample_at(Connection& connection, std::int64_t row) {
  static const std::string sql = select_samples("FROM sample " JOIN_NAMES "WHERE sample.row = ?");
  Query query(connection, sql, row);
  if (!query.next()) throw Damaged(damage_of("sample in row " + std::to_string(row), "scenario"));
  query.integer();
  query.real();
  return read_sample(query, row);
}

Page<SampleRecord> load_samples(Connection& connection, std::string_view scenario, SampleOrder order,
                                std::size_t limit, std::string_view cursor) {
  const auto listing = order == SampleOrder::newest   ? Listing::newest
                       : order == SampleOrder::oldest ? Listing::oldest
                                                      : Listing::likely;
  const auto row = scenario_row(connection, scenario);
  if (!row && cursor.empty()) return {};

  // Where the page before ended; without one, before everything.
  constexpr auto highest = std::numeric_limits<std::int64_t>::max();
  Cursor from{listing, row.value_or(0), listing == Listing::oldest ? 0 : highest,
              std::numeric_limits<double>::infinity()};
  if (!cursor.empty()) from = decode_cursor(cursor, listing, from.scenario);
  if (limit == 0) return {};

  Page<SampleRecord> page;
  if (listing == Listing::newest) {
    static const std::string sql =
        select_samples("FROM sample INDEXED BY sample_by_scenario " JOIN_NAMES
                       "WHERE sample.scenario = ? AND sample.row < ? ORDER BY sample.row DESC");
    Query query(connection, sql, from.scenario, from.row);
    read_page(connection, query, from, limit, page);
  } else if (listing == Listing::oldest) {
    static const std::string sql =
        select_samples("FROM sample INDEXED BY sample_by_scenario " JOIN_NAMES
                       "WHERE sample.scenario = ? AND sample.row > ? ORDER BY sample.row");
    Query query(connection, sql, from.scenario, from.row);
    read_page(connection, query, from, limit, page);
  } else {
    // The rest of those as likely as the last one, then the less likely: two ranges, since SQLite would walk
    // through all that are as likely (often every one) if asked for both at once.
    const double log_target = from.log_target;
    static const std::string tied_sql =
        select_samples("FROM sample INDEXED BY sample_by_log_target " JOIN_NAMES
                       "WHERE sample.scenario = ? AND log_target = ? AND sample.row < ?"
                       " ORDER BY sample.row DESC");
    static const std::string less_sql =
        select_samples("FROM sample INDEXED BY sample_by_log_target " JOIN_NAMES
                       "WHERE sample.scenario = ? AND log_target < ?"
                       " ORDER BY log_target DESC, sample.row DESC");
    Query tied(connection, tied_sql, from.scenario, log_target, from.row);
    read_page(connection, tied, from, limit, page);
    if (!page.next_cursor.empty()) return page;
    Query less_likely(connection, less_sql, from.scenario, log_target);
    read_page(connection, less_likely, from, limit, page);
  }
  return page;
}

std::optional<std::string> load_state(Connection& connection, std::string_view id) {
  static const std::string sql =
      "SELECT " + unsound_in(sample_seal(), "state", "state") +
      ", sample_blob.state " OF_ONE_SAMPLE
      "CROSS JOIN sample_blob ON sample_blob.sample = sample.row " WHERE_ONE_SAMPLE;
  return load_blob(connection, sql, id);
}

std::optional<std::string> load_animation(Connection& connection, std::string_view id) {
  static const std::string sql =
      "SELECT " + unsound_in(sample_seal(), "animation", "animation") +
      ", animation " OF_ONE_SAMPLE
      "CROSS JOIN sample_blob ON sample_blob.sample = sample.row " WHERE_ONE_SAMPLE;
  return load_blob(connection, sql, id);
}

namespace {

bool has_sound_weight(Connection& connection, std::int64_t row) {
  static const std::string sql =
      "SELECT " + unsound_in(sample_seal(), "weight", "weight") + " FROM sample WHERE row = ?";
  Query query(connection, sql, row);
  return query.next() && query.is_null();
}

/// The draws of a chain as if the samples of these rows were not there; one that turns out to be damaged is
/// added to them, and there are no draws.
std::optional<std::vector<DrawRecord>> try_draws(Connection& connection, std::int64_t chain, std::size_t most,
                                                 std::uint64_t from_iteration,
                                                 std::set<std::int64_t>& damaged) {
  // How many satisfied iterations there are.
  std::uint64_t total = 0;
  {
    Query query(
        connection,
        "SELECT row, weight FROM sample INDEXED BY sample_by_weight WHERE chain = ? AND iteration > ?", chain,
        from_iteration);
    while (query.next()) {
      const auto row = query.integer();
      const auto weight = query.integer();
      if (weight < 0 || (weight > kHeavy && !has_sound_weight(connection, row))) damaged.insert(row);
      if (!damaged.contains(row)) total += static_cast<std::uint64_t>(weight);
    }
  }
  DrawSpacing spacing(total, most);
  std::vector<DrawRecord> draws;
  draws.reserve(spacing.parts());
  static const std::string one =
      "SELECT " + unsound_in(sample_seal(), "scenario", "state") +
      ", iteration, log_prior, log_constraint, measures, state FROM sample"
      " LEFT JOIN sample_blob ON sample_blob.sample = sample.row WHERE sample.row = ?";
  Query place(connection,
              "SELECT row, weight FROM sample INDEXED BY sample_by_weight WHERE chain = ? AND iteration > ?"
              " ORDER BY iteration, replica",
              chain, from_iteration);
  while (!spacing.is_done() && place.next()) {
    const auto sample = place.integer();
    if (damaged.contains(sample)) continue;
    const std::uint64_t times = spacing.take(place.count());
    if (times == 0) continue;
    Query query(connection, one, sample);
    query.next();
    if (const auto column = read_unsound(sample_seal(), query)) {
      connection.tell_damage(damage_of("sample in row " + std::to_string(sample), *column));
      damaged.insert(sample);
      return std::nullopt;
    }
    const DrawRecord draw{query.count(), query.real(), query.real(), query.text(), query.text()};
    draws.insert(draws.end(), times, draw);
  }
  return draws;
}

}  // namespace

std::vector<DrawRecord> load_draws(Connection& connection, std::string_view chain, std::size_t most,
                                   std::uint64_t from_iteration) {
  Query chain_query(connection, "SELECT row FROM chain WHERE id = ?", chain);
  if (!chain_query.next() || most == 0) return {};
  const auto row = chain_query.integer();
  std::set<std::int64_t> damaged;
  for (int attempt = 0; attempt < kMostAttempts; ++attempt)
    if (auto draws = try_draws(connection, row, most, from_iteration, damaged)) return *std::move(draws);
  return {};
}

bool insert_sample(Connection& connection, Stock& stock, const ChainRow& chain, const NewSample& sample) {
  const auto& record = sample.record;
  const Placement place =
      placement(stock, sample_id(chain.id, record.iteration, record.replica), record.weight, chain.is_apart);
  static const std::string sql = [] {
    std::string columns, row, all;
    int parameter = 0;
    for (const std::string_view column : sample_seal().columns) {
      const std::string value = "?" + std::to_string(++parameter) + ", ";
      all += value;
      if (column == "state" || column == "animation") continue;
      columns.append(column).append(", ");
      row += value;
    }
    all.resize(all.size() - 2);
    return "INSERT INTO sample (" + columns + "seal) VALUES (" + row + "seal(" + all +
           ")) ON CONFLICT (chain, iteration, replica) DO NOTHING";
  }();
  const bool inserted =
      run(connection, sql, stock.scenario, chain.row, record.iteration, record.replica, record.weight,
          record.log_prior, record.log_constraint, record.duration, record.measures, record.digest,
          record.created_at != 0 ? record.created_at : now(), 0, static_cast<std::int64_t>(place.shelf),
          place.chance, place.pass, Blob{sample.state}, Blob{sample.animation}) > 0;
  if (!inserted)
    return update_weight(connection, stock, chain, {record.iteration, record.replica, record.weight});
  run(connection, "INSERT INTO sample_blob (sample, state, animation) VALUES (?, ?, ?)",
      connection.last_inserted_row(), Blob{sample.state}, Blob{sample.animation});
  ++stock.samples;
  count(stock, place.shelf, record.weight, false, 1);
  return false;
}

bool update_weight(Connection& connection, Stock& stock, const ChainRow& chain, const WeightUpdate& update) {
  static const std::string find = "SELECT row, " + unsound_in(sample_seal(), "scenario", "pass") +
                                  ", weight, shelf, chance, plays, pass FROM sample"
                                  " WHERE chain = ? AND iteration = ? AND replica = ?";
  std::int64_t row = 0;
  std::uint64_t before = 0;
  Shelf shelf = Shelf::even;
  double chance = 0, pass = 0;
  bool is_played = false;
  {
    Query query(connection, find, chain.row, update.iteration, update.replica);
    if (!query.next())
      throw DatabaseError(DatabaseError::Kind::constraint, "the chain has no sample of iteration " +
                                                               std::to_string(update.iteration) +
                                                               ", replica " + std::to_string(update.replica));
    row = query.integer();
    if (const auto column = read_unsound(sample_seal(), query)) {
      // It plays no part any more.
      connection.tell_damage(
          damage_of("sample " + sample_id(chain.id, update.iteration, update.replica), *column));
      return false;
    }
    before = query.count();
    shelf = static_cast<Shelf>(query.integer());
    chance = query.real();
    is_played = query.count() > 0;
    pass = query.real();
  }
  if (before == update.weight) return false;
  const Shelf now_on = shelf >= Shelf::apart ? shelf : shelf_of(stock, update.weight, chance);
  // What is left of the interval shrinks or grows with it.
  const auto interval = [](std::uint64_t weight) {
    return 1 / static_cast<double>(std::max<std::uint64_t>(weight, 1));
  };
  static const std::string set =
      "UPDATE sample SET " + set_sealed(sample_seal(), {"weight", "shelf", "pass"}) + " WHERE row = ?4";
  run(connection, set, update.weight, static_cast<std::int64_t>(now_on),
      stock.time + (pass - stock.time) * (interval(update.weight) / interval(before)), row);
  count(stock, shelf, before, is_played, -1);
  count(stock, now_on, update.weight, is_played, 1);
  if (now_on == shelf) return false;
  move_seen(connection, row, shelf, now_on);
  return true;
}

std::optional<std::string> find_damage(Connection& connection, std::int64_t row) {
  static const std::string sql = "SELECT chain.id, sample.iteration, replica, " +
                                 unsound_in(chain_seal(), "id", "id") + ", " + unsound_in(sample_seal()) +
                                 " FROM sample LEFT JOIN sample_blob ON sample_blob.sample = sample.row"
                                 " LEFT JOIN chain ON chain.row = sample.chain WHERE sample.row = ?";
  Query query(connection, sql, row);
  SampleRecord record;
  if (!query.next()) return Harm{"row", row}.text(record);
  record.chain = query.text();
  record.iteration = query.count();
  record.replica = static_cast<std::uint32_t>(query.count());
  record.id = sample_id(record.chain, record.iteration, record.replica);
  const auto in_name = read_unsound(chain_seal(), query);
  auto column = read_unsound(sample_seal(), query);
  if (in_name) column = "id";
  return column ? std::optional(Harm{*column, row}.text(record)) : std::nullopt;
}

void set_aside(Connection& connection, Stock& stock, std::int64_t row) {
  static const std::string find = "SELECT " + unsound_in(sample_seal(), "scenario", "pass") +
                                  ", weight, shelf, plays FROM sample WHERE row = ?";
  std::uint64_t weight = 0;
  Shelf before = Shelf::damaged;
  bool is_played = false;
  {
    Query query(connection, find, row);
    if (!query.next() || read_unsound(sample_seal(), query)) {
      survey_stock(connection, stock);
      return;
    }
    weight = query.count();
    before = static_cast<Shelf>(query.integer());
    is_played = query.count() > 0;
  }
  if (before == Shelf::damaged) return;
  static const std::string set =
      "UPDATE sample SET " + set_sealed(sample_seal(), {"shelf"}) + " WHERE row = ?2";
  run(connection, set, static_cast<std::int64_t>(Shelf::damaged), row);
  count(stock, before, weight, is_played, -1);
  --stock.samples;
  move_seen(connection, row, before, Shelf::damaged);
  save_stock(connection, stock);
}

}  // namespace retake::database
