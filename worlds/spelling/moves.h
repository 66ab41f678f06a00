// Moves: how a pour that spells its word is turned into another one - the kernels between complete words, and
// those on p(A) that take balls away and bring them back. doc/design.md, section 3, "Informed proposals".
// It must not know how marbles move.
#pragma once

#include <memory>

#include "sampler/guide.h"
#include "worlds/spelling/box.h"
#include "worlds/spelling/drop_table.h"
#include "worlds/spelling/letters.h"
#include "worlds/spelling/marbles.h"

namespace retake::spelling {

/// What the moves of a scenario know: a wish in a box of marbles, and how its Score says where balls lie.
class Word {
 public:
  /// `first_bin_measure`: among Score::measures, the first ball's bin; those of the others follow.
  /// Requires: as many designated bins as balls, or fewer.
  Word(const Box& box, std::shared_ptr<const MarbleModel> marbles, const BinPattern& pattern,
       std::size_t first_bin_measure);

  const MarbleModel& marbles() const { return *marbles_; }
  std::size_t balls() const { return marbles_->marble_count(); }
  bool is_on(const State& state, std::size_t ball) const;
  std::vector<std::size_t> active(const State& state) const;
  Eigen::Vector2d place(const State& state, std::size_t ball) const;  ///< [m] of its drop, (x, z)
  void set_place(State& state, std::size_t ball, const Eigen::Vector2d& place) const;

  const std::vector<std::size_t>& bins() const { return bins_; }  ///< the designated ones
  /// Where a ball came to rest; none: on others, or it takes no part.
  std::optional<std::size_t> bin_of(const Score& score, std::size_t ball) const;
  /// The designated bins in which none of the balls but `but` lies.
  std::vector<std::size_t> free_bins(const State& state, const Score& score, std::size_t but) const;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// A drop for one of some bins: mostly by the table, each bin alike; by chance anywhere in the area.
  Eigen::Vector2d draw_drop(const std::vector<std::size_t>& bins, RandomStream& random) const;
  /// log of its density [1/m2].
  double log_density(const Eigen::Vector2d& place, const std::vector<std::size_t>& bins) const;
  /// An upper bound of log_density over every choice of designated bins.
  double most_log_density(const Eigen::Vector2d& place) const;

 private:
  double table_density(const Eigen::Vector2d& place, std::size_t bin) const;

  std::shared_ptr<const MarbleModel> marbles_;
  std::size_t first_bin_measure_;
  Rectangle area_;
  std::vector<Eigen::Vector2d> centres_;  ///< [m] of every bin, (x, z)
  std::vector<std::size_t> bins_;
};

/// The guide to a word: builds it ball by ball, over bins that are still free.
std::shared_ptr<const Guide> make_guide(const Box& box, std::shared_ptr<const MarbleModel> marbles,
                                        const BinPattern& pattern, std::size_t first_bin_measure);

}  // namespace retake::spelling
