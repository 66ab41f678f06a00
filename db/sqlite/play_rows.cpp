// The rows of plays. Every query is answered by an index in a bounded number of steps, whatever the stock.
// Realises doc/design.md, section 5.
#include "db/sqlite/play_rows.h"

#include <algorithm>
#include <string>
#include <tuple>

#include "db/sqlite/sample_rows.h"
#include "db/sqlite/scenario_rows.h"

namespace retake::database {
namespace {

// Below this many seen samples a search from the start is quick enough; chosen.
constexpr std::int64_t kFrontierFromSeen = 64;
// So many samples newer than a frontier are looked at one by one; with more, the search starts afresh.
// Chosen.
constexpr int kMostNewer = 256;

// A sample in the order in which samples are handed out.
struct Candidate {
  std::int64_t shelf = 0;
  std::int64_t plays = 0;
  std::int64_t row = 0;
  auto key() const { return std::tie(shelf, plays, row); }
};

// The shelves from which is handed out, in their order.
struct Shelves {
  std::int64_t first, last;
};
constexpr std::int64_t kEven = static_cast<std::int64_t>(Shelf::even);
constexpr Shelves kThatCount{kEven, static_cast<std::int64_t>(Shelf::rest)};
constexpr Shelves kOfLearning{static_cast<std::int64_t>(Shelf::learning),
                              static_cast<std::int64_t>(Shelf::learning)};

struct Player {
  std::int64_t row = 0;
  std::int64_t seen = 0;
  std::int64_t seen_even = 0;
  std::int64_t seen_learning = 0;
};

std::string play_id(std::int64_t row) {
  return "p" + std::to_string(row);
}

std::optional<Candidate> read_candidate(Query& query) {
  if (!query.next()) return std::nullopt;
  return Candidate{query.integer(), query.integer(), query.integer()};
}

std::optional<Candidate> least_played(Connection& connection, std::int64_t scenario, std::int64_t shelf) {
  Query query(
      connection,
      "SELECT shelf, plays, row FROM sample INDEXED BY sample_by_shelf WHERE scenario = ? AND shelf = ?"
      " ORDER BY plays, row LIMIT 1",
      scenario, shelf);
  return read_candidate(query);
}

// From this place on in the order of a shelf. Two ranges, since SQLite would walk through all that were
// played as often as the first one if asked for both at once.
std::optional<Candidate> least_played_unseen(Connection& connection, std::int64_t scenario,
                                             std::int64_t player, const PlayerFrontier& from) {
  Query as_often(connection,
                 "SELECT shelf, plays, row FROM sample INDEXED BY sample_by_shelf"
                 " WHERE scenario = ? AND shelf = ? AND plays = ? AND row >= ?"
                 " AND NOT EXISTS (SELECT 1 FROM seen WHERE seen.player = ? AND seen.sample = sample.row)"
                 " ORDER BY row LIMIT 1",
                 scenario, from.shelf, from.plays, from.row, player);
  if (const auto candidate = read_candidate(as_often)) return candidate;
  Query more_often(connection,
                   "SELECT shelf, plays, row FROM sample INDEXED BY sample_by_shelf"
                   " WHERE scenario = ? AND shelf = ? AND plays > ?"
                   " AND NOT EXISTS (SELECT 1 FROM seen WHERE seen.player = ? AND seen.sample = sample.row)"
                   " ORDER BY plays, row LIMIT 1",
                   scenario, from.shelf, from.plays, player);
  return read_candidate(more_often);
}

std::optional<Candidate> first_unseen(Connection& connection, std::int64_t scenario, std::int64_t player,
                                      PlayerFrontier from, const Shelves& shelves) {
  for (; from.shelf <= shelves.last; from = {.shelf = from.shelf + 1})
    if (const auto candidate = least_played_unseen(connection, scenario, player, from)) return candidate;
  return std::nullopt;
}

std::int64_t newest_row(Connection& connection, std::int64_t scenario) {
  Query query(
      connection,
      "SELECT row FROM sample INDEXED BY sample_by_scenario WHERE scenario = ? ORDER BY row DESC LIMIT 1",
      scenario);
  return query.next() ? query.integer() : 0;
}

// The least played unseen sample among those added after the frontier was set, and whether there were so few
// that all have been looked at.
struct Newer {
  std::optional<Candidate> unseen;
  int count = 0;
};
Newer search_newer(Connection& connection, std::int64_t scenario, std::int64_t player, std::int64_t after,
                   const Shelves& shelves) {
  Query query(
      connection,
      "SELECT shelf, plays, row,"
      " EXISTS (SELECT 1 FROM seen WHERE seen.player = ? AND seen.sample = sample.row)"
      " FROM sample INDEXED BY sample_by_scenario WHERE scenario = ? AND row > ? ORDER BY row LIMIT ?",
      player, scenario, after, kMostNewer + 1);
  Newer newer;
  while (query.next()) {
    ++newer.count;
    const Candidate candidate{query.integer(), query.integer(), query.integer()};
    const bool seen = query.integer() != 0;
    const bool is_given = candidate.shelf >= shelves.first && candidate.shelf <= shelves.last;
    if (is_given && !seen && (!newer.unseen || candidate.key() < newer.unseen->key()))
      newer.unseen = candidate;
  }
  return newer;
}

std::optional<Candidate> choose_unseen(Connection& connection, PlayerFrontiers& frontiers,
                                       std::int64_t scenario, const Player& player, const Shelves& shelves) {
  // A sample that nobody has played is unseen, and comes first.
  const auto first = least_played(connection, scenario, shelves.first);
  if (first && first->plays == 0) return first;

  // Behind the frontier only newer samples can be unseen.
  const auto* known = frontiers.find(player.row);
  if (known && known->shelf >= shelves.first && known->shelf <= shelves.last) {
    const PlayerFrontier frontier = *known;
    const auto newer = search_newer(connection, scenario, player.row, frontier.newest_row, shelves);
    if (newer.count <= kMostNewer) {
      auto chosen = first_unseen(connection, scenario, player.row, frontier, shelves);
      if (chosen) frontiers.set(player.row, {chosen->shelf, chosen->plays, chosen->row, frontier.newest_row});
      if (newer.unseen && (!chosen || newer.unseen->key() < chosen->key())) chosen = newer.unseen;
      if (chosen) return chosen;
    }
    frontiers.forget(player.row);
  }

  const auto chosen = first_unseen(connection, scenario, player.row, {.shelf = shelves.first}, shelves);
  if (chosen && player.seen + player.seen_learning >= kFrontierFromSeen)
    frontiers.set(player.row, {chosen->shelf, chosen->plays, chosen->row, newest_row(connection, scenario)});
  return chosen;
}

// Without a player: what comes up next, any sample as often as it weighs. It comes up again one interval
// later.
std::optional<Candidate> next_by_weight(Connection& connection, Stock& stock) {
  std::optional<Candidate> chosen;
  double pass = 0, weight = 1;
  {
    Query query(connection,
                "SELECT shelf, plays, row, pass, weight FROM sample INDEXED BY sample_by_pass"
                " WHERE scenario = ? AND shelf <= 1 ORDER BY pass, row LIMIT 1",
                stock.scenario);
    chosen = read_candidate(query);
    if (!chosen) return std::nullopt;
    pass = query.real();
    weight = query.real();
  }
  stock.time = std::max(stock.time, pass);
  run(connection, "UPDATE sample SET pass = ? WHERE row = ?", pass + 1 / weight, chosen->row);
  return chosen;
}

std::optional<Candidate> seen_longest_ago(Connection& connection, std::int64_t player,
                                          const Shelves& shelves) {
  Query query(connection,
              "SELECT shelf, plays, sample.row FROM seen INDEXED BY seen_by_age"
              " CROSS JOIN sample ON sample.row = seen.sample"
              " WHERE seen.player = ? AND shelf BETWEEN ? AND ? ORDER BY seen.last_play LIMIT 1",
              player, shelves.first, shelves.last);
  return read_candidate(query);
}

Player find_or_add_player(Connection& connection, std::int64_t scenario, std::string_view name) {
  const auto find = [&]() -> std::optional<Player> {
    Query query(connection,
                "SELECT row, seen, seen_even, seen_learning FROM player WHERE scenario = ? AND name = ?",
                scenario, name);
    if (!query.next()) return std::nullopt;
    return Player{query.integer(), query.integer(), query.integer(), query.integer()};
  };
  if (const auto player = find()) return *player;
  run(connection, "INSERT INTO player (scenario, name) VALUES (?, ?)", scenario, name);
  return find().value();
}

// The play that this key gave before.
std::optional<PlayRecord> earlier_play(Connection& connection, std::int64_t scenario, std::string_view player,
                                       std::string_view key) {
  Query query(connection,
              "SELECT play.row, sample, player, repeat, remaining FROM idempotency"
              " CROSS JOIN play ON play.row = idempotency.play WHERE scenario = ? AND key = ?",
              scenario, key);
  if (!query.next()) return std::nullopt;
  PlayRecord record;
  record.id = play_id(query.integer());
  record.sample = load_sample_at(connection, query.integer());
  if (query.text() != player) throw IdempotencyConflict("the idempotency key was used with another player");
  record.repeat = query.integer() != 0;
  record.remaining = record.even_remaining = query.count();
  record.replayed = true;
  return record;
}

}  // namespace

std::optional<PlayRecord> write_play(Connection& connection, PlayerFrontiers& frontiers,
                                     const PlayWish& wish) {
  const auto scenario = scenario_row(connection, wish.scenario);
  if (!scenario) return std::nullopt;
  if (!wish.key.empty()) {
    if (auto earlier = earlier_play(connection, *scenario, wish.player, wish.key)) return earlier;
  }
  auto stock = load_stock(connection, *scenario);
  if (!stock) return std::nullopt;
  const bool counts = stock->counted > 0;
  const Shelves shelves = counts ? kThatCount : kOfLearning;
  const std::int64_t offered = counts ? stock->counted : stock->learning;
  if (offered == 0) return std::nullopt;

  // Choose.
  std::optional<Player> player;
  std::optional<Candidate> chosen;
  bool repeat = false;
  if (wish.player.empty()) {
    chosen = counts ? next_by_weight(connection, *stock) : least_played(connection, *scenario, shelves.first);
  } else {
    player = find_or_add_player(connection, *scenario, wish.player);
    if ((counts ? player->seen : player->seen_learning) < offered)
      chosen = choose_unseen(connection, frontiers, *scenario, *player, shelves);
    repeat = !chosen;
    if (repeat && wish.repeats == Repeats::refused) return std::nullopt;
    if (repeat) chosen = seen_longest_ago(connection, player->row, shelves);
  }
  if (!chosen) throw DatabaseError(DatabaseError::Kind::other, "the stock and the samples do not agree");

  // What that leaves.
  std::int64_t& unplayed = counts ? stock->unplayed : stock->unplayed_learning;
  if (!repeat) {
    unplayed -= chosen->plays == 0 ? 1 : 0;
    ++stock->plays;
    if (player) {
      (counts ? player->seen : player->seen_learning) += 1;
      player->seen_even += chosen->shelf == kEven ? 1 : 0;
    }
  }
  PlayRecord record;
  record.repeat = repeat;
  record.remaining = static_cast<std::uint64_t>(
      !player ? unplayed : offered - (counts ? player->seen : player->seen_learning));
  record.even_remaining = player && counts ? static_cast<std::uint64_t>(stock->even - player->seen_even)
                          : counts         ? record.remaining
                                           : 0;

  // Write it down.
  run(connection, "INSERT INTO play (sample, player, repeat, remaining, created_at) VALUES (?, ?, ?, ?, ?)",
      chosen->row, wish.player, repeat ? 1 : 0, record.remaining, now());
  const auto play = connection.last_inserted_row();
  record.id = play_id(play);
  if (!repeat) {
    run(connection, "UPDATE sample SET plays = plays + 1 WHERE row = ?", chosen->row);
    save_stock(connection, *stock);
  }
  if (player) {
    run(connection,
        "INSERT INTO seen (player, sample, last_play) VALUES (?, ?, ?)"
        " ON CONFLICT (player, sample) DO UPDATE SET last_play = excluded.last_play",
        player->row, chosen->row, play);
    run(connection, "UPDATE player SET seen = ?, seen_even = ?, seen_learning = ? WHERE row = ?",
        player->seen, player->seen_even, player->seen_learning, player->row);
  }
  if (!wish.key.empty())
    run(connection, "INSERT INTO idempotency (scenario, key, play) VALUES (?, ?, ?)", *scenario, wish.key,
        play);
  record.sample = load_sample_at(connection, chosen->row);
  return record;
}

}  // namespace retake::database
