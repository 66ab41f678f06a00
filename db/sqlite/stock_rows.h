// The stock of a scenario: which of its samples are handed out, so that plays follow p(A | satisfied).
// Realises doc/design.md, section 5, "Plays". Must be called within a transaction.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "db/sqlite/connection.h"

namespace retake::database {

/// Where a sample lies. Players are given the even shelf first, then the rest, and what was found while
/// learning only where there is nothing that counts.
enum class Shelf : std::int64_t {
  even = 0,  ///< thinned: any of them is as likely as its weight, so together they follow p(A | satisfied)
  rest = 1,  ///< the others that count
  learning = 2,  ///< weight 0
  apart = 3,     ///< of another law (the paper's ratios): never handed out
  damaged = 4,   ///< never handed out, and no part of the stock
};

/// A row of the table.
struct Stock {
  std::int64_t scenario = 0;
  std::int64_t samples = 0;  ///< on all shelves
  std::int64_t counted = 0;  ///< even and rest
  std::int64_t even = 0;
  std::int64_t learning = 0;
  std::int64_t unplayed = 0;  ///< of those that count
  std::int64_t unplayed_learning = 0;
  std::int64_t plays = 0;
  std::int64_t weight = 0;  ///< of those that count
  std::int64_t door = 1;    ///< a sample of weight w lies on the even shelf with probability min(1, w / door)
  std::int64_t door_counted = 0;  ///< how many counted when the door was set
  double time = 0;                ///< of plays without a player; see below
};
/// One that is damaged is counted anew. Requires: the scenario is there.
Stock load_stock(Connection& connection, std::int64_t scenario);
void save_stock(Connection& connection, const Stock& stock);

/// A sample's place: its shelf, by a chance of its own, and when it comes up without a player. Those plays
/// visit every sample that counts at intervals of 1 / weight, the first after a random part of one, so that
/// each moment's next one is any of them with a probability proportional to its weight (stride scheduling:
/// Waldspurger and Weihl, MIT/LCS/TM-528, 1995).
struct Placement {
  Shelf shelf = Shelf::even;
  double chance = 0;  ///< in (0, 1), by the sample's id
  double pass = 0;
};
Placement placement(const Stock& stock, std::string_view sample_id, std::uint64_t weight, bool is_apart);
Shelf shelf_of(const Stock& stock, std::uint64_t weight, double chance);

/// Counts a sample on a shelf, or (`times` -1) no more.
void count(Stock& stock, Shelf shelf, std::uint64_t weight, bool is_played, int times);

/// Counts everything of a scenario anew, after damaged samples have been set aside. Reads all of its samples.
void survey_stock(Connection& connection, Stock& stock);
/// Counts anew what one player has seen, or (none) all of a scenario.
void recount_players(Connection& connection, std::int64_t scenario, std::optional<std::int64_t> player);

/// Sets the door anew once a quarter more samples count than when it was set: at the least weight, of a
/// coarse scale, of which what is heavier holds no more than a hundredth of all weight beyond it. From
/// kSettled on it stays. True if samples changed their shelf.
bool settle_door(Connection& connection, Stock& stock);
inline constexpr std::int64_t kSettled = 100'000;  ///< chosen: moving so many takes about a second

}  // namespace retake::database
