// The rows of plays. Every query is answered by an index in a bounded number of steps, whatever the stock.
// Realises doc/design.md, section 5.
#include "db/sqlite/play_rows.h"

#include <algorithm>
#include <string>
#include <tuple>

#include "db/errors.h"
#include "db/sqlite/sample_rows.h"
#include "db/sqlite/scenario_rows.h"
#include "db/sqlite/seals.h"

namespace retake::database {
namespace {

// Below this many seen samples a search from the start is quick enough; chosen.
constexpr std::int64_t kFrontierFromSeen = 64;
// So many samples newer than a frontier are looked at one by one; with more, the search starts afresh.
// Chosen.
constexpr int kMostNewer = 256;
// So many damaged samples are set aside for one play; then it has none. Chosen: a tenth of a second.
constexpr int kMostSetAside = 256;

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

// Without a player: what comes up next, any sample as often as it weighs.
std::optional<Candidate> next_by_weight(Connection& connection, std::int64_t scenario) {
  Query query(connection,
              "SELECT shelf, plays, row FROM sample INDEXED BY sample_by_pass"
              " WHERE scenario = ? AND shelf <= 1 ORDER BY pass, row LIMIT 1",
              scenario);
  return read_candidate(query);
}

// It comes up again one interval later.
void come_up_later(Connection& connection, Stock& stock, std::int64_t sample) {
  double pass = 0, weight = 1;
  {
    Query query(connection, "SELECT pass, weight FROM sample WHERE row = ?", sample);
    query.next();
    pass = query.real();
    weight = query.real();
  }
  stock.time = std::max(stock.time, pass);
  static const std::string sql =
      "UPDATE sample SET " + set_sealed(sample_seal(), {"pass"}) + " WHERE row = ?2";
  run(connection, sql, pass + 1 / weight, sample);
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
  static const std::string sql = "SELECT " + unsound_in(player_seal()) +
                                 ", row, seen, seen_even, seen_learning FROM player"
                                 " WHERE scenario = ? AND name = ?";
  bool is_damaged = false;
  const auto find = [&]() -> std::optional<Player> {
    Query query(connection, sql, scenario, name);
    if (!query.next()) return std::nullopt;
    const auto column = read_unsound(player_seal(), query);
    is_damaged = column.has_value();
    if (column) connection.tell_damage(damage_of("player " + std::string(name), *column));
    return Player{query.integer(), query.integer(), query.integer(), query.integer()};
  };
  const auto player = find();
  if (player && is_damaged) {
    // What was seen can be counted.
    static const std::string rename =
        "UPDATE player SET " + set_sealed(player_seal(), {"scenario", "name"}) + " WHERE row = ?3";
    recount_players(connection, scenario, player->row);
    run(connection, rename, scenario, name, player->row);
    return find().value();
  }
  if (player) return *player;
  static const std::string insert = "INSERT " + insert_sealed(player_seal());
  run(connection, insert, scenario, name, 0, 0, 0);
  return find().value();
}

// The play that this key gave before.
std::optional<PlayRecord> earlier_play(Connection& connection, std::int64_t scenario, std::string_view player,
                                       std::string_view key) {
  static const std::string sql =
      "SELECT " + unsound_in(key_seal()) + ", " + unsound_in(play_seal()) +
      ", play.row, sample, player, repeat, remaining FROM idempotency"
      " LEFT JOIN play ON play.row = idempotency.play WHERE scenario = ? AND key = ?";
  Query query(connection, sql, scenario, key);
  if (!query.next()) return std::nullopt;
  const auto in_key = read_unsound(key_seal(), query);
  const auto in_play = read_unsound(play_seal(), query);
  PlayRecord record;
  record.id = play_id(query.integer());
  if (in_key) throw Damaged(damage_of("idempotency key " + std::string(key), *in_key));
  if (in_play) throw Damaged(damage_of("play " + record.id, *in_play));
  const auto sample = query.integer();
  if (const auto damage = find_damage(connection, sample)) throw Damaged(*damage);
  record.sample = load_sample_at(connection, sample);
  if (query.text() != player) throw IdempotencyConflict("the idempotency key was used with another player");
  record.repeat = query.integer() != 0;
  record.remaining = record.even_remaining = query.count();
  record.replayed = true;
  return record;
}

// What is handed out next.
struct Choice {
  std::optional<Player> player;
  std::optional<Candidate> sample;
  bool is_repeat = false;
};
Choice choose(Connection& connection, PlayerFrontiers& frontiers, const Stock& stock, const PlayWish& wish) {
  const bool counts = stock.counted > 0;
  const Shelves shelves = counts ? kThatCount : kOfLearning;
  const std::int64_t offered = counts ? stock.counted : stock.learning;
  Choice choice;
  if (wish.player.empty()) {
    choice.sample = counts ? next_by_weight(connection, stock.scenario)
                           : least_played(connection, stock.scenario, shelves.first);
    return choice;
  }
  choice.player = find_or_add_player(connection, stock.scenario, wish.player);
  if ((counts ? choice.player->seen : choice.player->seen_learning) < offered)
    choice.sample = choose_unseen(connection, frontiers, stock.scenario, *choice.player, shelves);
  choice.is_repeat = !choice.sample;
  if (choice.is_repeat) choice.sample = seen_longest_ago(connection, choice.player->row, shelves);
  return choice;
}

// As choose, after what is damaged of that has been set aside.
Choice choose_sound(Connection& connection, PlayerFrontiers& frontiers, Stock& stock, const PlayWish& wish) {
  bool is_surveyed = false;
  for (int attempt = 0; attempt < kMostSetAside && stock.counted + stock.learning > 0; ++attempt) {
    Choice choice = choose(connection, frontiers, stock, wish);
    if (choice.sample) {
      const auto damage = find_damage(connection, choice.sample->row);
      if (!damage) return choice;
      connection.tell_damage(*damage);
      set_aside(connection, stock, choice.sample->row);
    } else if (!is_surveyed) {
      // The counts say that there is one: they, or a place of a sample, are damaged.
      is_surveyed = true;
      survey_stock(connection, stock);
    } else {
      break;
    }
    frontiers.clear();
  }
  return {};
}

}  // namespace

std::optional<PlayRecord> write_play(Connection& connection, PlayerFrontiers& frontiers,
                                     const PlayWish& wish) {
  const auto scenario = scenario_row(connection, wish.scenario);
  if (!scenario) return std::nullopt;
  if (!wish.key.empty()) {
    if (auto earlier = earlier_play(connection, *scenario, wish.player, wish.key)) return earlier;
  }
  Stock stock = load_stock(connection, *scenario);

  // Choose.
  Choice choice = choose_sound(connection, frontiers, stock, wish);
  auto& [player, chosen, repeat] = choice;
  if (!chosen || (repeat && wish.repeats == Repeats::refused)) return std::nullopt;
  const bool counts = stock.counted > 0;
  const std::int64_t offered = counts ? stock.counted : stock.learning;
  if (!player && counts) come_up_later(connection, stock, chosen->row);

  // What that leaves.
  std::int64_t& unplayed = counts ? stock.unplayed : stock.unplayed_learning;
  if (!repeat) {
    unplayed -= chosen->plays == 0 ? 1 : 0;
    ++stock.plays;
    if (player) {
      (counts ? player->seen : player->seen_learning) += 1;
      player->seen_even += chosen->shelf == kEven ? 1 : 0;
    }
  }
  PlayRecord record;
  record.repeat = repeat;
  record.remaining = static_cast<std::uint64_t>(
      !player ? unplayed : offered - (counts ? player->seen : player->seen_learning));
  record.even_remaining = player && counts ? static_cast<std::uint64_t>(stock.even - player->seen_even)
                          : counts         ? record.remaining
                                           : 0;

  // Write it down.
  static const std::string insert_play = "INSERT " + insert_sealed(play_seal());
  run(connection, insert_play, chosen->row, wish.player, repeat ? 1 : 0, record.remaining, now());
  const auto play = connection.last_inserted_row();
  record.id = play_id(play);
  if (!repeat) {
    static const std::string set_plays =
        "UPDATE sample SET " + set_sealed(sample_seal(), {"plays"}) + " WHERE row = ?2";
    run(connection, set_plays, chosen->plays + 1, chosen->row);
    save_stock(connection, stock);
  }
  if (player) {
    static const std::string insert_seen =
        "INSERT " + insert_sealed(seen_seal()) +
        " ON CONFLICT (player, sample) DO UPDATE SET last_play = excluded.last_play, seal = excluded.seal";
    static const std::string set_player = "UPDATE player SET " +
                                          set_sealed(player_seal(), {"seen", "seen_even", "seen_learning"}) +
                                          " WHERE row = ?4";
    run(connection, insert_seen, player->row, chosen->row, play);
    run(connection, set_player, player->seen, player->seen_even, player->seen_learning, player->row);
  }
  if (!wish.key.empty()) {
    static const std::string insert_key = "INSERT " + insert_sealed(key_seal());
    run(connection, insert_key, *scenario, wish.key, play);
  }
  record.sample = load_sample_at(connection, chosen->row);
  return record;
}

}  // namespace retake::database
