// The rows of plays: which sample comes next, and what handing it out writes.
// Realises doc/design.md, section 5. Must be called within a transaction.
#pragma once

#include <optional>
#include <string_view>

#include "db/errors.h"
#include "db/records.h"
#include "db/sqlite/connection.h"
#include "db/sqlite/player_frontiers.h"

namespace retake::database {

/// What Store::play is asked for.
struct PlayWish {
  std::string_view scenario;
  std::string_view player{};
  std::string_view key{};
  Repeats repeats = Repeats::allowed;
};
/// See Store::play. Throws: IdempotencyConflict.
std::optional<PlayRecord> write_play(Connection& connection, PlayerFrontiers& frontiers,
                                     const PlayWish& wish);

}  // namespace retake::database
