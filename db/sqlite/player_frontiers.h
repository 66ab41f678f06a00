// PlayerFrontiers: how far down the order of plays a player has seen everything, so that the next unseen
// sample is found without walking past all that were seen before. Realises doc/design.md, section 5. Lives in
// the writer's memory; forgetting it costs time, never correctness.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

namespace retake::database {

/// A player is given samples by (shelf, plays, row), least first. Everything before this key, among the
/// samples up to `newest_row`, was seen by the player. Plays only grow, so a sample once behind the frontier
/// that is unseen cannot exist: only samples added later have to be looked at apart. When samples change
/// their shelf every frontier is forgotten.
struct PlayerFrontier {
  std::int64_t shelf = 0;
  std::int64_t plays = 0;
  std::int64_t row = 0;
  std::int64_t newest_row = 0;
};

/// Frontiers by the player's row. Must be cleared when a transaction with plays is rolled back.
class PlayerFrontiers {
 public:
  const PlayerFrontier* find(std::int64_t player) const {
    const auto found = frontiers_.find(player);
    return found == frontiers_.end() ? nullptr : &found->second;
  }
  void set(std::int64_t player, const PlayerFrontier& frontier) {
    if (frontiers_.size() >= kMostPlayers) frontiers_.clear();
    frontiers_[player] = frontier;
  }
  void forget(std::int64_t player) { frontiers_.erase(player); }
  void clear() { frontiers_.clear(); }

 private:
  static constexpr std::size_t kMostPlayers = 10'000;  // chosen: about 1 MB
  std::map<std::int64_t, PlayerFrontier> frontiers_;
};

}  // namespace retake::database
