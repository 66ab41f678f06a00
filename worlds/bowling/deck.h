// Deck: ball and pins as rigid bodies, from the moment before the hit until the outcome is decided, and on
// until everything rests if somebody watches. Paper, section 5.2. It must not know wishes, frames or JSON.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "worlds/animation.h"
#include "worlds/bowling/hit_log.h"
#include "worlds/bowling/roll.h"
#include "worlds/bowling/stage.h"

namespace retake::bowling {

struct DeckSettings {
  std::vector<int> rack;             ///< pins set, 1 to 10, ascending
  double ball_lane_friction = 0.12;  ///< where the pins stand
  bool pit_cushion = false;          ///< pins rebound from the end of the pit
  double cushion_restitution = 0.6;
  int impact_rate = 480;  ///< [steps/s] while the ball is on the deck
  int settle_rate = 120;  ///< [steps/s] afterwards; divides impact_rate
};

/// Simulates one throw at a time and is reused for many.
/// Contract: what happens is a pure function of `set`'s arguments, bit for bit, whatever was simulated
/// before. Whether it is watched changes nothing before it is decided. Thread safety: one thread at a time.
class Deck {
 public:
  explicit Deck(const DeckSettings& settings);
  ~Deck();
  Deck(const Deck&) = delete;
  Deck& operator=(const Deck&) = delete;

  struct Throw {
    Ball ball;
    Motion motion;           ///< of the ball at the start
    std::int64_t start = 0;  ///< in steps of 1/impact_rate
    /// Where each pin of the rack stands, as an offset from its spot (x and z) [m].
    std::vector<Eigen::Vector3d> offsets;
    bool watched = false;  ///< keep what leaves the deck, and the hits
    /// The pins are known not to be touched; nothing can happen to them.
    bool pins_fixed = false;
  };
  void set(const Throw& thrown);
  /// Advances by one step; a long one once the ball has left the deck.
  void step();

  double time() const;         ///< [s]
  std::int64_t ticks() const;  ///< the same in steps of 1/impact_rate
  /// Something moves faster than anything could, or is nowhere.
  bool exploded() const;
  /// The pins that are up will stay up: the ball has left, and nothing that moves can reach them.
  bool decided() const;
  /// From now on standing pins do not move any more, so that the rest shows what was decided, and everything
  /// else comes to rest. Requires: decided.
  void play_out();
  /// Everything has come to rest, in the pit too.
  bool at_rest() const;

  /// A pin that counts as fallen has landed on its base and stands, once in thousands of throws.
  bool stands_again() const;

  bool is_down(std::size_t pin) const;  ///< by its place in the rack; for good
  int down_count() const;
  /// When the ball first touched a pin [s]; infinity if it has not.
  double first_contact() const;
  Pose pose(std::size_t body) const;
  Motion motion(std::size_t body) const;
  /// The hits of a watched throw, in order of time. Ends those under way.
  std::vector<Hit> hits();
  /// Kinetic and potential, of everything on the deck [J].
  double mechanical_energy() const;
  /// Wakes every pin, as a test of their stand.
  void wake();

 private:
  void latch_fallen();
  void take_leavers();
  void move_to_pit(std::size_t body);
  void slow_down();
  const Stage& stage_of(std::size_t body) const;
  double seconds(std::int64_t ticks) const { return static_cast<double>(ticks) / settings_.impact_rate; }
  std::size_t bodies() const { return 1 + down_.size(); }

  DeckSettings settings_;
  double standing_height_;  ///< [m] of a standing pin's centre of mass
  Stage stage_;
  std::unique_ptr<Stage> pit_;  ///< where what has left is watched
  Throw thrown_;
  std::int64_t ticks_ = 0;
  bool ball_left_ = false;
  std::vector<bool> down_;
  double first_contact_ = 0;
  bool playing_out_ = false;
  std::int64_t played_out_from_ = 0;
};

}  // namespace retake::bowling
