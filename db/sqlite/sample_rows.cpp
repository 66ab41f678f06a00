// The rows of samples.
// Realises doc/design.md, section 5.
#include "db/sqlite/sample_rows.h"

#include <algorithm>
#include <charconv>
#include <limits>

#include "db/draw_spacing.h"
#include "db/sqlite/cursor.h"
#include "db/sqlite/scenario_rows.h"

namespace retake::database {
namespace {

#define SAMPLE_COLUMNS                                                                                  \
  "SELECT sample.row, log_target, scenario.id, chain.id, sample.iteration, replica, weight, log_prior," \
  " log_constraint, duration, measures, digest, plays, sample.created_at "
#define OF_ONE_SAMPLE "FROM chain CROSS JOIN sample ON sample.chain = chain.row "
#define WHERE_ONE_SAMPLE "WHERE chain.id = ? AND sample.iteration = ? AND replica = ?"
#define JOIN_NAMES \
  "CROSS JOIN chain ON chain.row = sample.chain CROSS JOIN scenario ON scenario.row = sample.scenario "

// Reads the columns that follow the row number and log_target.
SampleRecord read_sample(Query& query) {
  SampleRecord record;
  record.scenario = query.text();
  record.chain = query.text();
  record.iteration = query.count();
  record.replica = static_cast<std::uint32_t>(query.count());
  record.weight = query.count();
  record.log_prior = query.real();
  record.log_constraint = query.real();
  record.duration = query.real();
  record.measures = query.text();
  record.digest = query.text();
  record.plays = query.count();
  record.created_at = query.integer();
  record.id = sample_id(record.chain, record.iteration, record.replica);
  return record;
}

template <typename Number>
bool parse_number(std::string_view digits, Number& number) {
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc() && end == digits.data() + digits.size() && std::to_string(number) == digits;
}

std::optional<std::string> load_blob(Connection& connection, std::string_view sql, std::string_view id) {
  const auto place = parse_sample_id(id);
  if (!place) return std::nullopt;
  Query query(connection, sql, place->chain, place->iteration, place->replica);
  if (!query.next()) return std::nullopt;
  return query.text();
}

// Appends records to the page; once it is full, notes where the next one begins.
void read_page(Query& query, Cursor& last, std::size_t limit, Page<SampleRecord>& page) {
  while (query.next()) {
    if (page.records.size() == limit) {
      page.next_cursor = encode(last);
      return;
    }
    last.row = query.integer();
    last.log_target = query.real();
    page.records.push_back(read_sample(query));
  }
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
  Query query(connection,
              SAMPLE_COLUMNS OF_ONE_SAMPLE
              "CROSS JOIN scenario ON scenario.row = sample.scenario " WHERE_ONE_SAMPLE,
              place->chain, place->iteration, place->replica);
  if (!query.next()) return std::nullopt;
  query.integer();
  query.real();
  return read_sample(query);
}

SampleRecord load_sample_at(Connection& connection, std::int64_t row) {
  Query query(connection, SAMPLE_COLUMNS "FROM sample " JOIN_NAMES "WHERE sample.row = ?", row);
  query.next();
  query.integer();
  query.real();
  return read_sample(query);
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
    Query query(connection,
                SAMPLE_COLUMNS
                "FROM sample INDEXED BY sample_by_scenario " JOIN_NAMES
                "WHERE sample.scenario = ? AND sample.row < ? ORDER BY sample.row DESC LIMIT ?",
                from.scenario, from.row, limit + 1);
    read_page(query, from, limit, page);
  } else if (listing == Listing::oldest) {
    Query query(connection,
                SAMPLE_COLUMNS "FROM sample INDEXED BY sample_by_scenario " JOIN_NAMES
                               "WHERE sample.scenario = ? AND sample.row > ? ORDER BY sample.row LIMIT ?",
                from.scenario, from.row, limit + 1);
    read_page(query, from, limit, page);
  } else {
    // The rest of those as likely as the last one, then the less likely: two ranges, since SQLite would walk
    // through all that are as likely (often every one) if asked for both at once.
    const double log_target = from.log_target;
    Query tied(connection,
               SAMPLE_COLUMNS "FROM sample INDEXED BY sample_by_log_target " JOIN_NAMES
                              "WHERE sample.scenario = ? AND log_target = ? AND sample.row < ?"
                              " ORDER BY sample.row DESC LIMIT ?",
               from.scenario, log_target, from.row, limit + 1);
    read_page(tied, from, limit, page);
    if (!page.next_cursor.empty()) return page;
    Query less_likely(connection,
                      SAMPLE_COLUMNS "FROM sample INDEXED BY sample_by_log_target " JOIN_NAMES
                                     "WHERE sample.scenario = ? AND log_target < ?"
                                     " ORDER BY log_target DESC, sample.row DESC LIMIT ?",
                      from.scenario, log_target, limit + 1 - page.records.size());
    read_page(less_likely, from, limit, page);
  }
  return page;
}

std::optional<std::string> load_state(Connection& connection, std::string_view id) {
  return load_blob(connection,
                   "SELECT sample_blob.state " OF_ONE_SAMPLE
                   "CROSS JOIN sample_blob ON sample_blob.sample = sample.row " WHERE_ONE_SAMPLE,
                   id);
}

std::optional<std::string> load_animation(Connection& connection, std::string_view id) {
  return load_blob(connection,
                   "SELECT animation " OF_ONE_SAMPLE
                   "CROSS JOIN sample_blob ON sample_blob.sample = sample.row " WHERE_ONE_SAMPLE,
                   id);
}

std::vector<DrawRecord> load_draws(Connection& connection, std::string_view chain, std::size_t most,
                                   std::uint64_t from_iteration) {
  std::vector<DrawRecord> draws;
  Query chain_query(connection, "SELECT row FROM chain WHERE id = ?", chain);
  if (!chain_query.next() || most == 0) return draws;
  const auto chain_row = chain_query.integer();

  // How many satisfied iterations there are.
  std::uint64_t total = 0;
  {
    Query query(connection,
                "SELECT coalesce(sum(weight), 0) FROM sample INDEXED BY sample_by_weight"
                " WHERE chain = ? AND iteration > ?",
                chain_row, from_iteration);
    query.next();
    total = query.count();
  }
  DrawSpacing spacing(total, most);
  draws.reserve(spacing.parts());
  Query place(connection,
              "SELECT row, weight FROM sample INDEXED BY sample_by_weight WHERE chain = ? AND iteration > ?"
              " ORDER BY iteration, replica",
              chain_row, from_iteration);
  while (!spacing.is_done() && place.next()) {
    const auto sample = place.integer();
    const std::uint64_t times = spacing.take(place.count());
    if (times == 0) continue;
    Query query(connection,
                "SELECT iteration, log_prior, log_constraint, measures, state FROM sample"
                " CROSS JOIN sample_blob ON sample_blob.sample = sample.row WHERE sample.row = ?",
                sample);
    query.next();
    const DrawRecord draw{query.count(), query.real(), query.real(), query.text(), query.text()};
    draws.insert(draws.end(), times, draw);
  }
  return draws;
}

bool insert_sample(Connection& connection, Stock& stock, const ChainRow& chain, const NewSample& sample) {
  const auto& record = sample.record;
  const Placement place =
      placement(stock, sample_id(chain.id, record.iteration, record.replica), record.weight, chain.is_apart);
  const bool inserted =
      run(connection,
          "INSERT INTO sample (scenario, chain, iteration, replica, weight, log_prior, log_constraint,"
          " duration, measures, digest, created_at, shelf, chance, pass)"
          " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
          " ON CONFLICT (chain, iteration, replica) DO NOTHING",
          stock.scenario, chain.row, record.iteration, record.replica, record.weight, record.log_prior,
          record.log_constraint, record.duration, record.measures, record.digest,
          record.created_at != 0 ? record.created_at : now(), static_cast<std::int64_t>(place.shelf),
          place.chance, place.pass) > 0;
  if (!inserted)
    return update_weight(connection, stock, chain, {record.iteration, record.replica, record.weight});
  run(connection, "INSERT INTO sample_blob (sample, state, animation) VALUES (?, ?, ?)",
      connection.last_inserted_row(), Blob{sample.state}, Blob{sample.animation});
  ++stock.samples;
  count(stock, place.shelf, record.weight, false, 1);
  return false;
}

bool update_weight(Connection& connection, Stock& stock, const ChainRow& chain, const WeightUpdate& update) {
  std::int64_t row = 0;
  std::uint64_t before = 0;
  Shelf shelf = Shelf::even;
  double chance = 0;
  bool is_played = false;
  {
    Query query(connection,
                "SELECT row, weight, shelf, chance, plays FROM sample"
                " WHERE chain = ? AND iteration = ? AND replica = ?",
                chain.row, update.iteration, update.replica);
    if (!query.next())
      throw DatabaseError(DatabaseError::Kind::constraint, "the chain has no sample of iteration " +
                                                               std::to_string(update.iteration) +
                                                               ", replica " + std::to_string(update.replica));
    row = query.integer();
    before = query.count();
    shelf = static_cast<Shelf>(query.integer());
    chance = query.real();
    is_played = query.count() > 0;
  }
  if (before == update.weight) return false;
  const Shelf now_on = shelf == Shelf::apart ? Shelf::apart : shelf_of(stock, update.weight, chance);
  // What is left of the interval shrinks or grows with it.
  const auto interval = [](std::uint64_t weight) {
    return 1 / static_cast<double>(std::max<std::uint64_t>(weight, 1));
  };
  run(connection, "UPDATE sample SET weight = ?1, shelf = ?2, pass = ?3 + (pass - ?3) * ?4 WHERE row = ?5",
      update.weight, static_cast<std::int64_t>(now_on), stock.time,
      interval(update.weight) / interval(before), row);
  count(stock, shelf, before, is_played, -1);
  count(stock, now_on, update.weight, is_played, 1);
  if (now_on == shelf) return false;
  const auto more = [&](auto is_on) { return int{is_on(now_on)} - int{is_on(shelf)}; };
  run(connection,
      "UPDATE player SET seen = seen + ?, seen_even = seen_even + ?, seen_learning = seen_learning + ?"
      " WHERE row IN (SELECT player FROM seen WHERE sample = ?)",
      more([](Shelf on) { return on <= Shelf::rest; }), more([](Shelf on) { return on == Shelf::even; }),
      more([](Shelf on) { return on == Shelf::learning; }), row);
  return true;
}

}  // namespace retake::database
