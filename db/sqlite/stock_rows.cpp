// See stock_rows.h.
#include "db/sqlite/stock_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "db/sqlite/seals.h"

namespace retake::database {
namespace {

// Of all weight so much may lie beyond the door, and is missing in what a player is given; chosen: a share of
// the plays is then wrong by less than what 2,000 plays can show.
constexpr double kMissing = 0.01;
// Until so many count the door is set with each commit.
constexpr std::int64_t kFew = 32;

/// The `which`-th number in (0, 1) that belongs to a text: FNV-1a, then the finalizer of SplitMix64.
double chance_of(std::string_view text, std::uint64_t which) {
  std::uint64_t hash = 0xcbf29ce484222325 + which;
  for (const char letter : text)
    hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3;
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9;
  hash = (hash ^ (hash >> 27)) * 0x94d049bb133111eb;
  hash ^= hash >> 31;
  return (static_cast<double>(hash >> 12) + 0.5) * 0x1p-52;
}

/// Doors are numbers of three binary digits, so that they are not moved for little.
std::int64_t door_from(std::int64_t weight) {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(weight, 1));
  const int dropped = std::max(0, static_cast<int>(std::bit_width(value)) - 3);
  const std::uint64_t step = std::uint64_t{1} << dropped;
  return static_cast<std::int64_t>((value + step - 1) / step * step);
}

/// The least door beyond which no more than kMissing of all weight lies. Requires: something counts.
std::int64_t find_door(Connection& connection, const Stock& stock) {
  const double allowed = kMissing * static_cast<double>(stock.weight);
  static const std::string sql =
      "SELECT " + unsound_in(sample_seal(), "weight", "weight") +
      ", weight FROM sample INDEXED BY sample_by_heft WHERE scenario = ? AND shelf <= 1"
      " ORDER BY weight DESC";
  Query heaviest(connection, sql, stock.scenario);
  // Of those looked at so far: with the door at d, not above any of them, sum - count * d lies beyond it.
  double sum = 0, count = 0;
  while (heaviest.next()) {
    if (read_unsound(sample_seal(), heaviest)) continue;
    const double weight = heaviest.real();
    if (sum - count * weight > allowed) break;
    sum += weight;
    ++count;
  }
  return count == 0 ? stock.door : door_from(static_cast<std::int64_t>(std::ceil((sum - allowed) / count)));
}

/// Sets every sample of a scenario aside that is damaged itself. Cells of the wrong type are given theirs,
/// as SQLite changes no row with such a cell; the seal still tells that they are damaged.
void set_damaged_aside(Connection& connection, std::int64_t scenario) {
  static const std::string sql =
      "UPDATE sample SET shelf = ?1, seal = reseal(seal, " + std::to_string(part_of(sample_seal(), "shelf")) +
      ", ?1),"
      // Of which chain it was nobody knows; any will do.
      " iteration = iif(sample.chain IN (SELECT row FROM chain), CAST(coalesce(iteration, 0) AS INTEGER), "
      "-row),"
      " chain = iif(sample.chain IN (SELECT row FROM chain), sample.chain,"
      " (SELECT max(row) FROM chain WHERE scenario = ?2)),"
      " replica = CAST(coalesce(replica, 0) AS INTEGER), weight = CAST(coalesce(weight, 0) AS INTEGER),"
      " log_prior = CAST(coalesce(log_prior, 0) AS REAL),"
      " log_constraint = CAST(coalesce(log_constraint, 0) AS REAL),"
      " duration = CAST(coalesce(duration, 0) AS REAL), measures = CAST(coalesce(measures, '') AS TEXT),"
      " digest = CAST(coalesce(digest, '') AS TEXT),"
      " created_at = CAST(coalesce(created_at, 0) AS INTEGER), plays = CAST(coalesce(plays, 0) AS INTEGER),"
      " chance = CAST(coalesce(chance, 0) AS REAL), pass = CAST(coalesce(pass, 0) AS REAL)"
      " WHERE scenario = ?2 AND shelf IS NOT ?1 AND " +
      unsound_in(sample_seal(), "scenario", "pass") + " IS NOT NULL";
  const auto aside = static_cast<std::int64_t>(Shelf::damaged);
  try {
    run(connection, sql, aside, scenario);
  } catch (const DatabaseError&) {
    // An index may not know what its row says now.
    run(connection, "REINDEX sample");
    run(connection, sql, aside, scenario);
  }
}

}  // namespace

Stock load_stock(Connection& connection, std::int64_t scenario) {
  static const std::string sql =
      "SELECT " + unsound_in(stock_seal()) +
      ", samples, counted, even, learning, unplayed, unplayed_learning, plays, weight, door, door_counted,"
      " time FROM stock WHERE scenario = ?";
  Stock stock;
  stock.scenario = scenario;
  {
    Query query(connection, sql, scenario);
    if (query.next() && !read_unsound(stock_seal(), query)) {
      for (std::int64_t* count :
           {&stock.samples, &stock.counted, &stock.even, &stock.learning, &stock.unplayed,
            &stock.unplayed_learning, &stock.plays, &stock.weight, &stock.door, &stock.door_counted})
        *count = query.integer();
      stock.time = query.real();
      return stock;
    }
  }
  survey_stock(connection, stock);
  return stock;
}

void save_stock(Connection& connection, const Stock& stock) {
  static const std::string sql = "REPLACE " + insert_sealed(stock_seal());
  run(connection, sql, stock.scenario, stock.samples, stock.counted, stock.even, stock.learning,
      stock.unplayed, stock.unplayed_learning, stock.plays, stock.weight, stock.door, stock.door_counted,
      stock.time);
}

void survey_stock(Connection& connection, Stock& stock) {
  set_damaged_aside(connection, stock.scenario);
  stock.time = 0;
  {
    Query query(connection,
                "SELECT count(*), count(*) FILTER (WHERE shelf <= 1), count(*) FILTER (WHERE shelf = 0),"
                " count(*) FILTER (WHERE shelf = 2), count(*) FILTER (WHERE shelf <= 1 AND plays = 0),"
                " count(*) FILTER (WHERE shelf = 2 AND plays = 0), coalesce(sum(plays), 0),"
                " coalesce(sum(weight) FILTER (WHERE shelf <= 1), 0),"
                " coalesce(min(pass) FILTER (WHERE shelf <= 1), 0)"
                " FROM sample INDEXED BY sample_by_scenario WHERE scenario = ? AND shelf <= 3",
                stock.scenario);
    query.next();
    for (std::int64_t* count : {&stock.samples, &stock.counted, &stock.even, &stock.learning, &stock.unplayed,
                                &stock.unplayed_learning, &stock.plays, &stock.weight})
      *count = query.integer();
    stock.time = query.real();
  }
  stock.door_counted = 0;
  settle_door(connection, stock);
  save_stock(connection, stock);
  recount_players(connection, stock.scenario, std::nullopt);
}

void recount_players(Connection& connection, std::int64_t scenario, std::optional<std::int64_t> player) {
  run(connection,
      "UPDATE player SET (seen, seen_even, seen_learning, seal) = (SELECT count(*) FILTER (WHERE shelf <= 1),"
      " count(*) FILTER (WHERE shelf = 0), count(*) FILTER (WHERE shelf = 2),"
      " reseal(player.seal, 2, count(*) FILTER (WHERE shelf <= 1), 3, count(*) FILTER (WHERE shelf = 0),"
      " 4, count(*) FILTER (WHERE shelf = 2))"
      " FROM seen CROSS JOIN sample ON sample.row = seen.sample WHERE seen.player = player.row)"
      " WHERE scenario = ?1 AND coalesce(?2, row) = row AND typeof(name) = 'text'",
      scenario, player);
}

Shelf shelf_of(const Stock& stock, std::uint64_t weight, double chance) {
  if (weight == 0) return Shelf::learning;
  return chance * static_cast<double>(stock.door) < static_cast<double>(weight) ? Shelf::even : Shelf::rest;
}

Placement placement(const Stock& stock, std::string_view sample_id, std::uint64_t weight, bool is_apart) {
  Placement place;
  place.chance = chance_of(sample_id, 0);
  place.shelf = is_apart ? Shelf::apart : shelf_of(stock, weight, place.chance);
  place.pass = stock.time + chance_of(sample_id, 1) / static_cast<double>(std::max<std::uint64_t>(weight, 1));
  return place;
}

void count(Stock& stock, Shelf shelf, std::uint64_t weight, bool is_played, int times) {
  if (shelf == Shelf::learning) {
    stock.learning += times;
    stock.unplayed_learning += is_played ? 0 : times;
  }
  if (shelf > Shelf::rest) return;
  stock.counted += times;
  stock.unplayed += is_played ? 0 : times;
  stock.weight += times * static_cast<std::int64_t>(weight);
  stock.even += shelf == Shelf::even ? times : 0;
}

bool settle_door(Connection& connection, Stock& stock) {
  if (stock.counted == 0 || stock.door_counted >= kSettled) return false;
  if (stock.counted > kFew && 4 * stock.counted < 5 * stock.door_counted) return false;
  stock.door_counted = stock.counted;
  const std::int64_t door = find_door(connection, stock);
  if (door == stock.door) return false;
  stock.door = door;
  static const std::string sql =
      "UPDATE sample SET shelf = 1 - shelf, seal = reseal(seal, " +
      std::to_string(part_of(sample_seal(), "shelf")) +
      ", 1 - shelf) WHERE scenario = ? AND shelf <= 1 AND shelf <> (chance * ? >= weight) AND " +
      unsound_in(sample_seal(), "scenario", "pass") + " IS NULL";
  const bool moved = run(connection, sql, stock.scenario, door) > 0;
  if (!moved) return false;
  {
    Query query(connection,
                "SELECT count(*) FROM sample INDEXED BY sample_by_shelf WHERE scenario = ? AND shelf = 0",
                stock.scenario);
    query.next();
    stock.even = query.integer();
  }
  recount_players(connection, stock.scenario, std::nullopt);
  return true;
}

}  // namespace retake::database
