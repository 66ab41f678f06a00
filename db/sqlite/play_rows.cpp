// The rows of plays. Every query is answered by an index in a bounded number of steps, whatever the stock.
// Realises doc/design.md, section 5.
#include "db/sqlite/play_rows.h"

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
  std::int64_t plays = 0;
  std::int64_t row = 0;
  auto key() const { return std::tie(plays, row); }
};

struct Player {
  std::int64_t row = 0;
  std::int64_t seen = 0;
};

std::string play_id(std::int64_t row) {
  return "p" + std::to_string(row);
}

std::optional<Candidate> read_candidate(Query& query) {
  if (!query.next()) return std::nullopt;
  return Candidate{query.integer(), query.integer()};
}

std::optional<Candidate> least_played(Connection& connection, std::int64_t scenario) {
  Query query(connection,
              "SELECT plays, row FROM sample INDEXED BY sample_by_plays WHERE scenario = ?"
              " ORDER BY plays, row LIMIT 1",
              scenario);
  return read_candidate(query);
}

// From this place on in the order of plays. Two ranges, since SQLite would walk through all that were played
// as often as the first one if asked for both at once.
std::optional<Candidate> least_played_unseen(Connection& connection, std::int64_t scenario,
                                             std::int64_t player, const PlayerFrontier& from) {
  Query as_often(connection,
                 "SELECT plays, row FROM sample INDEXED BY sample_by_plays"
                 " WHERE scenario = ? AND plays = ? AND row >= ?"
                 " AND NOT EXISTS (SELECT 1 FROM seen WHERE seen.player = ? AND seen.sample = sample.row)"
                 " ORDER BY row LIMIT 1",
                 scenario, from.plays, from.row, player);
  if (const auto candidate = read_candidate(as_often)) return candidate;
  Query more_often(connection,
                   "SELECT plays, row FROM sample INDEXED BY sample_by_plays WHERE scenario = ? AND plays > ?"
                   " AND NOT EXISTS (SELECT 1 FROM seen WHERE seen.player = ? AND seen.sample = sample.row)"
                   " ORDER BY plays, row LIMIT 1",
                   scenario, from.plays, player);
  return read_candidate(more_often);
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
Newer search_newer(Connection& connection, std::int64_t scenario, std::int64_t player, std::int64_t after) {
  Query query(
      connection,
      "SELECT plays, row, EXISTS (SELECT 1 FROM seen WHERE seen.player = ? AND seen.sample = sample.row)"
      " FROM sample INDEXED BY sample_by_scenario WHERE scenario = ? AND row > ? ORDER BY row LIMIT ?",
      player, scenario, after, kMostNewer + 1);
  Newer newer;
  while (query.next()) {
    ++newer.count;
    const Candidate candidate{query.integer(), query.integer()};
    const bool seen = query.integer() != 0;
    if (!seen && (!newer.unseen || candidate.key() < newer.unseen->key())) newer.unseen = candidate;
  }
  return newer;
}

std::optional<Candidate> choose_unseen(Connection& connection, PlayerFrontiers& frontiers,
                                       std::int64_t scenario, const Player& player) {
  // A sample that nobody has played is unseen, and comes first.
  const auto first = least_played(connection, scenario);
  if (!first || first->plays == 0) return first;

  // Behind the frontier only newer samples can be unseen.
  if (const auto* known = frontiers.find(player.row)) {
    const PlayerFrontier frontier = *known;
    const auto newer = search_newer(connection, scenario, player.row, frontier.newest_row);
    if (newer.count <= kMostNewer) {
      auto chosen = least_played_unseen(connection, scenario, player.row, frontier);
      if (chosen) frontiers.set(player.row, {chosen->plays, chosen->row, frontier.newest_row});
      if (newer.unseen && (!chosen || newer.unseen->key() < chosen->key())) chosen = newer.unseen;
      if (chosen) return chosen;
    }
    frontiers.forget(player.row);
  }

  const auto chosen = least_played_unseen(connection, scenario, player.row, {});
  if (chosen && player.seen >= kFrontierFromSeen) {
    frontiers.set(player.row, {chosen->plays, chosen->row, newest_row(connection, scenario)});
  }
  return chosen;
}

std::optional<Candidate> seen_longest_ago(Connection& connection, std::int64_t player) {
  Query query(connection,
              "SELECT plays, sample.row FROM seen INDEXED BY seen_by_age"
              " CROSS JOIN sample ON sample.row = seen.sample WHERE seen.player = ?"
              " ORDER BY seen.last_play LIMIT 1",
              player);
  return read_candidate(query);
}

Player find_or_add_player(Connection& connection, std::int64_t scenario, std::string_view name) {
  const auto find = [&]() -> std::optional<Player> {
    Query query(connection, "SELECT row, seen FROM player WHERE scenario = ? AND name = ?", scenario, name);
    if (!query.next()) return std::nullopt;
    return Player{query.integer(), query.integer()};
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
  record.remaining = query.count();
  record.replayed = true;
  return record;
}

}  // namespace

std::optional<PlayRecord> write_play(Connection& connection, PlayerFrontiers& frontiers,
                                     std::string_view scenario_id, std::string_view player_name,
                                     std::string_view idempotency_key) {
  const auto scenario = scenario_row(connection, scenario_id);
  if (!scenario) return std::nullopt;
  if (!idempotency_key.empty()) {
    if (auto earlier = earlier_play(connection, *scenario, player_name, idempotency_key)) return earlier;
  }
  std::int64_t samples = 0;
  std::int64_t unplayed = 0;
  {
    Query query(connection, "SELECT samples, unplayed FROM stock WHERE scenario = ?", *scenario);
    if (query.next()) {
      samples = query.integer();
      unplayed = query.integer();
    }
  }
  if (samples == 0) return std::nullopt;

  // Choose.
  std::optional<Player> player;
  std::optional<Candidate> chosen;
  bool repeat = false;
  if (player_name.empty()) {
    chosen = least_played(connection, *scenario);
  } else {
    player = find_or_add_player(connection, *scenario, player_name);
    if (player->seen < samples) chosen = choose_unseen(connection, frontiers, *scenario, *player);
    repeat = !chosen;
    if (repeat) chosen = seen_longest_ago(connection, player->row);
  }
  if (!chosen) throw DatabaseError(DatabaseError::Kind::other, "the stock and the samples do not agree");

  // Write it down.
  const bool first_play = chosen->plays == 0;
  const auto remaining = player ? samples - player->seen - (repeat ? 0 : 1) : unplayed - (first_play ? 1 : 0);
  run(connection, "INSERT INTO play (sample, player, repeat, remaining, created_at) VALUES (?, ?, ?, ?, ?)",
      chosen->row, player_name, repeat ? 1 : 0, remaining, now());
  const auto play = connection.last_inserted_row();
  run(connection, "UPDATE sample SET plays = plays + 1 WHERE row = ?", chosen->row);
  run(connection, "UPDATE stock SET plays = plays + 1, unplayed = unplayed - ? WHERE scenario = ?",
      first_play ? 1 : 0, *scenario);
  if (player) {
    run(connection,
        "INSERT INTO seen (player, sample, last_play) VALUES (?, ?, ?)"
        " ON CONFLICT (player, sample) DO UPDATE SET last_play = excluded.last_play",
        player->row, chosen->row, play);
    if (!repeat) run(connection, "UPDATE player SET seen = seen + 1 WHERE row = ?", player->row);
  }
  if (!idempotency_key.empty()) {
    run(connection, "INSERT INTO idempotency (scenario, key, play) VALUES (?, ?, ?)", *scenario,
        idempotency_key, play);
  }

  PlayRecord record;
  record.id = play_id(play);
  record.sample = load_sample_at(connection, chosen->row);
  record.repeat = repeat;
  record.remaining = static_cast<std::uint64_t>(remaining);
  return record;
}

}  // namespace retake::database
