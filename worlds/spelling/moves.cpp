// See moves.h.
#include "worlds/spelling/moves.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "sampler/check.h"

namespace retake::spelling {
namespace {

using Eigen::Vector2d;

constexpr double kAnywhere = 0.1;  // share of drops that the table has no say in

/// So many different numbers below `count`, in random order.
std::vector<std::size_t> choose(std::size_t many, std::size_t count, RandomStream& random) {
  std::vector<std::size_t> all(count);
  for (std::size_t i = 0; i < count; ++i)
    all[i] = i;
  many = std::min(many, count);
  for (std::size_t i = 0; i < many; ++i)
    std::swap(all[i], all[i + random.index(count - i)]);
  all.resize(many);
  return all;
}

/// The switch and the drop of a slot.
struct Slot {
  double is_on, x, z;
};
Slot slot_of(const Word& word, const State& state, std::size_t ball) {
  const std::size_t drop = word.marbles().drop_of(ball);
  return {at(state, word.marbles().switch_of(ball)), at(state, drop), at(state, drop + 1)};
}
void set_slot(const Word& word, State& state, std::size_t ball, const Slot& slot) {
  const std::size_t drop = word.marbles().drop_of(ball);
  at(state, word.marbles().switch_of(ball)) = slot.is_on;
  at(state, drop) = slot.x;
  at(state, drop + 1) = slot.z;
}

// --- Drops ----------------------------------------------------------------------------------------

/// Drops the ball of one slot anew, for the bin in which it lies. Between complete words alone: there every
/// ball that is on lies in a designated bin.
class RedropForItsBin final : public ScoredKernel {
 public:
  explicit RedropForItsBin(const Word& word) : word_(word) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const std::vector<std::size_t> active = word_.active(current.state);
    const std::size_t ball = active[random.index(active.size())];
    const std::vector<std::size_t> bin = {word_.bin_of(current.score, ball).value()};
    const Vector2d place = word_.draw_drop(bin, random);
    word_.set_place(candidate, ball, place);
    return word_.most_log_density(word_.place(current.state, ball)) - word_.log_density(place, bin);
  }
  double log_hastings(const Model&, const Simulated& current, const Simulated& candidate) const override {
    const std::size_t ball = moved_ball(current.state, candidate.state);
    return word_.log_density(word_.place(current.state, ball),
                             {word_.bin_of(candidate.score, ball).value()}) -
           word_.log_density(word_.place(candidate.state, ball), {word_.bin_of(current.score, ball).value()});
  }

 private:
  std::size_t moved_ball(const State& current, const State& candidate) const {
    std::size_t ball = 0;
    while (!word_.is_on(current, ball) || word_.place(current, ball) == word_.place(candidate, ball))
      ++ball;
    return ball;
  }
  const Word& word_;
};

/// Drops the ball of one slot anew, for a designated bin in which no other ball lies.
class RedropForAFreeBin final : public ScoredKernel {
 public:
  explicit RedropForAFreeBin(const Word& word) : word_(word) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const std::vector<std::size_t> active = word_.active(current.state);
    if (active.empty()) return 0;
    const std::size_t ball = active[random.index(active.size())];
    const std::vector<std::size_t> bins = word_.free_bins(current.state, current.score, ball);
    const Vector2d place = word_.draw_drop(bins, random);
    word_.set_place(candidate, ball, place);
    return word_.most_log_density(word_.place(current.state, ball)) - word_.log_density(place, bins);
  }
  double log_hastings(const Model&, const Simulated& current, const Simulated& candidate) const override {
    std::size_t ball = 0;
    while (!word_.is_on(current.state, ball) ||
           word_.place(current.state, ball) == word_.place(candidate.state, ball))
      ++ball;
    return word_.log_density(word_.place(current.state, ball),
                             word_.free_bins(candidate.state, candidate.score, ball)) -
           word_.log_density(word_.place(candidate.state, ball),
                             word_.free_bins(current.state, current.score, ball));
  }

 private:
  const Word& word_;
};

/// Brings a ball into play for a free bin, or takes one away.
class BirthOrDeath final : public ScoredKernel {
 public:
  explicit BirthOrDeath(const Word& word) : word_(word) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const std::vector<std::size_t> active = word_.active(current.state);
    const std::size_t off = word_.balls() - active.size();
    if (random.bernoulli(0.5)) {
      if (off == 0) return 0;
      const std::size_t ball = random_off(current.state, random.index(off));
      const std::vector<std::size_t> bins = word_.free_bins(current.state, current.score, Word::kNone);
      const Vector2d place = word_.draw_drop(bins, random);
      at(candidate, word_.marbles().switch_of(ball)) = 1;
      word_.set_place(candidate, ball, place);
      return birth(active.size()) - word_.log_density(place, bins);
    }
    if (active.empty()) return 0;
    const std::size_t ball = active[random.index(active.size())];
    set_slot(word_, candidate, ball, {.is_on = 0, .x = kAbsent, .z = kAbsent});
    return word_.most_log_density(word_.place(current.state, ball)) - birth(active.size() - 1);
  }
  double log_hastings(const Model&, const Simulated& current, const Simulated& candidate) const override {
    std::size_t ball = 0;
    while (word_.is_on(current.state, ball) == word_.is_on(candidate.state, ball))
      ++ball;
    const std::size_t active = word_.active(current.state).size();
    if (word_.is_on(candidate.state, ball))
      return birth(active) - word_.log_density(word_.place(candidate.state, ball),
                                               word_.free_bins(current.state, current.score, Word::kNone));
    return word_.log_density(word_.place(current.state, ball),
                             word_.free_bins(candidate.state, candidate.score, Word::kNone)) -
           birth(active - 1);
  }

 private:
  /// log of how many slots a ball can be brought to over how many it can then be taken from.
  double birth(std::size_t active) const {
    return std::log(static_cast<double>(word_.balls() - active) / static_cast<double>(active + 1));
  }
  std::size_t random_off(const State& state, std::size_t which) const {
    std::size_t ball = 0;
    for (;; ++ball)
      if (!word_.is_on(state, ball) && which-- == 0) return ball;
  }
  const Word& word_;
};

/// Moves the drop of one ball by a Gaussian distance of mixed scales, symmetrically.
class WalkDrop final : public ScoredKernel {
 public:
  explicit WalkDrop(const Word& word) : word_(word) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    constexpr double kLargest = 0.01;  // [m]
    const std::vector<std::size_t> active = word_.active(current.state);
    if (active.empty()) return 0;
    const std::size_t ball = active[random.index(active.size())];
    const double size = kLargest * std::pow(10, -2 * random.uniform());
    const double dx = size * random.gaussian(), dz = size * random.gaussian();
    word_.set_place(candidate, ball, word_.place(current.state, ball) + Vector2d(dx, dz));
    return 0;
  }

 private:
  const Word& word_;
};

// --- Slots ----------------------------------------------------------------------------------------

/// Trades the drops of so many slots in a random way, empty ones too.
class Permute final : public ScoredKernel {
 public:
  Permute(const Word& word, std::size_t fewest, std::size_t most)
      : word_(word), fewest_(fewest), most_(most) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const std::size_t many = fewest_ + random.index(most_ - fewest_ + 1);
    const std::vector<std::size_t> to = choose(many, word_.balls(), random);
    if (to.size() == 2) {  // the one way that is not to stay
      set_slot(word_, candidate, to[0], slot_of(word_, current.state, to[1]));
      set_slot(word_, candidate, to[1], slot_of(word_, current.state, to[0]));
      return 0;
    }
    std::vector<std::size_t> from = to;
    std::sort(from.begin(), from.end());
    for (std::size_t i = 0; i < to.size(); ++i)
      set_slot(word_, candidate, to[i], slot_of(word_, current.state, from[i]));
    return 0;
  }

 private:
  const Word& word_;
  std::size_t fewest_, most_;
};

/// Reverses some successive slots, or turns them on by one place, either way.
class Rearrange final : public ScoredKernel {
 public:
  explicit Rearrange(const Word& word) : word_(word) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    constexpr std::size_t kMost = 8;
    const std::size_t many = std::min(2 + random.index(kMost - 1), word_.balls());
    const std::size_t first = random.index(word_.balls() - many + 1);
    const std::size_t way = random.index(3);
    for (std::size_t i = 0; i < many; ++i) {
      const std::size_t from = way == 0 ? many - 1 - i : way == 1 ? (i + 1) % many : (i + many - 1) % many;
      set_slot(word_, candidate, first + i, slot_of(word_, current.state, first + from));
    }
    return 0;
  }

 private:
  const Word& word_;
};

// --- Vertices -------------------------------------------------------------------------------------

/// Draws the offsets of 1, 2, 4, 8 or 16 vertex groups from their prior.
class RedrawGroups final : public ScoredKernel {
 public:
  explicit RedrawGroups(const Word& word) : word_(word) {}
  double propose(const Model&, const Simulated& current, State& candidate,
                 RandomStream& random) const override {
    const std::size_t many = std::size_t{1} << random.index(5);
    double squares = 0;  // of the candidate less the current.state ones, in standard deviations
    for (const std::size_t group : choose(many, word_.marbles().group_count(), random))
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t variable = word_.marbles().offset_of(group) + i;
        const double fresh = random.gaussian(), old = at(current.state, variable) / kOffsetDeviation;
        at(candidate, variable) = kOffsetDeviation * fresh;
        squares += fresh * fresh - old * old;
      }
    return 0.5 * squares;  // what p_w loses
  }

  double log_hastings(const Model&, const Simulated& current, const Simulated& candidate) const override {
    const auto count = static_cast<Eigen::Index>(3 * word_.marbles().group_count());
    return 0.5 * (candidate.state.tail(count).squaredNorm() - current.state.tail(count).squaredNorm()) /
           (kOffsetDeviation * kOffsetDeviation);
  }

 private:
  const Word& word_;
};

/// Moves one vertex group by a Gaussian distance of mixed scales, symmetrically.
class WalkGroup final : public ScoredKernel {
 public:
  explicit WalkGroup(const Word& word) : word_(word) {}
  double propose(const Model&, const Simulated&, State& candidate, RandomStream& random) const override {
    const std::size_t group = random.index(word_.marbles().group_count());
    const double size = kOffsetDeviation * std::pow(10, -1.5 * random.uniform());
    for (std::size_t i = 0; i < 3; ++i)
      at(candidate, word_.marbles().offset_of(group) + i) += size * random.gaussian();
    return 0;
  }

 private:
  const Word& word_;
};

// --- The guide ------------------------------------------------------------------------------------

class WordGuide final : public Guide {
 public:
  WordGuide(const Box& box, std::shared_ptr<const MarbleModel> marbles, const BinPattern& pattern,
            std::size_t first_bin_measure)
      : word_(box, std::move(marbles), pattern, first_bin_measure) {
    const auto swap = std::make_shared<const Permute>(word_, 2, 2);
    const auto permute = std::make_shared<const Permute>(word_, 3, 6);
    const auto rearrange = std::make_shared<const Rearrange>(word_);
    const auto walk = std::make_shared<const WalkDrop>(word_);
    const auto redraw_groups = std::make_shared<const RedrawGroups>(word_);
    const auto walk_group = std::make_shared<const WalkGroup>(word_);
    kernels_ = ScoredKernelTable({{"redrop", 0.33, std::make_shared<const RedropForItsBin>(word_)},
                                  {"walk_drop", 0.08, walk},
                                  {"swap", 0.23, swap},
                                  {"permute", 0.08, permute},
                                  {"rearrange", 0.06, rearrange},
                                  {"redraw_vertices", 0.17, redraw_groups},
                                  {"walk_vertices", 0.05, walk_group}});
    soft_kernels_ = ScoredKernelTable({{"redrop", 0.27, std::make_shared<const RedropForAFreeBin>(word_)},
                                       {"birth_or_death", 0.18, std::make_shared<const BirthOrDeath>(word_)},
                                       {"walk_drop", 0.07, walk},
                                       {"swap", 0.19, swap},
                                       {"permute", 0.07, permute},
                                       {"rearrange", 0.05, rearrange},
                                       {"redraw_vertices", 0.13, redraw_groups},
                                       {"walk_vertices", 0.04, walk_group}});
  }

  void begin(const Model& model, State& state, RandomStream& random) const override {
    state.resize(static_cast<Eigen::Index>(model.size()));
    do {
      for (std::size_t ball = 0; ball < word_.balls(); ++ball)
        set_slot(word_, state, ball, {.is_on = 0, .x = kAbsent, .z = kAbsent});
      for (std::size_t i = word_.marbles().offset_of(0); i < model.size(); ++i)
        at(state, i) = model.variables()[i].prior.draw(random);
    } while (!model.in_support(state));
  }

  void extend(const Model&, const Simulated& kept, std::uint64_t vain_tries, State& candidate,
              RandomStream& random) const override {
    constexpr std::uint64_t kPatience = 150;
    constexpr std::size_t kRetreat = 4;
    const std::vector<std::size_t> active = word_.active(kept.state);
    const std::vector<std::size_t> bins = word_.free_bins(kept.state, kept.score, Word::kNone);
    std::size_t ball = 0;
    while (ball < word_.balls() && word_.is_on(kept.state, ball))
      ++ball;
    // A whole word that is not enough for what else is wished is taken back to any of its balls.
    const bool is_whole = ball == word_.balls() || bins.empty();
    const bool is_vain = vain_tries > 0 && vain_tries % kPatience == 0;
    if ((is_whole || is_vain) && !active.empty()) {
      const std::size_t back = is_whole ? 1 + random.index(active.size()) : std::min(kRetreat, active.size());
      for (std::size_t i = active.size() - back; i < active.size(); ++i)
        set_slot(word_, candidate, active[i], {.is_on = 0, .x = kAbsent, .z = kAbsent});
      return;
    }
    if (is_whole) return;
    at(candidate, word_.marbles().switch_of(ball)) = 1;
    word_.set_place(candidate, ball, word_.draw_drop({bins[random.index(bins.size())]}, random));
  }

  bool keeps(const Simulated& kept, const Simulated& candidate) const override {
    const std::size_t active = word_.active(candidate.state).size();
    const std::size_t filled =
        word_.bins().size() - word_.free_bins(candidate.state, candidate.score, Word::kNone).size();
    return active < word_.active(kept.state).size() || filled == active;
  }

  const ScoredKernelTable& kernels() const override { return kernels_; }
  const ScoredKernelTable& soft_kernels() const override { return soft_kernels_; }
  std::uint64_t sweep() const override { return word_.balls(); }

 private:
  Word word_;
  ScoredKernelTable kernels_, soft_kernels_;
};

}  // namespace

// --- Word -----------------------------------------------------------------------------------------

Word::Word(const Box& box, std::shared_ptr<const MarbleModel> marbles, const BinPattern& pattern,
           std::size_t first_bin_measure)
    : marbles_(std::move(marbles)), first_bin_measure_(first_bin_measure), area_(box.drop_area()) {
  for (std::size_t bin = 0; bin < box.bin_count(); ++bin) {
    const Rectangle opening = box.opening(bin);
    centres_.emplace_back(0.5 * (opening.min_x + opening.max_x), 0.5 * (opening.min_z + opening.max_z));
    if (pattern.designated[bin]) bins_.push_back(bin);
  }
  CHECK(bins_.size() <= marbles_->marble_count(), bins_.size());
}

bool Word::is_on(const State& state, std::size_t ball) const {
  return at(state, marbles_->switch_of(ball)) == 1;
}

std::vector<std::size_t> Word::active(const State& state) const {
  std::vector<std::size_t> active;
  for (std::size_t ball = 0; ball < balls(); ++ball)
    if (is_on(state, ball)) active.push_back(ball);
  return active;
}

Vector2d Word::place(const State& state, std::size_t ball) const {
  return {at(state, marbles_->drop_of(ball)), at(state, marbles_->drop_of(ball) + 1)};
}

void Word::set_place(State& state, std::size_t ball, const Vector2d& place) const {
  at(state, marbles_->drop_of(ball)) = place.x();
  at(state, marbles_->drop_of(ball) + 1) = place.y();
}

std::optional<std::size_t> Word::bin_of(const Score& score, std::size_t ball) const {
  const double bin = score.measures[first_bin_measure_ + ball];
  return std::isnan(bin) ? std::nullopt : std::optional(static_cast<std::size_t>(bin));
}

std::vector<std::size_t> Word::free_bins(const State& state, const Score& score, std::size_t but) const {
  std::vector<bool> held(centres_.size(), false);
  for (std::size_t ball = 0; ball < balls(); ++ball)
    if (ball != but && is_on(state, ball))
      if (const auto bin = bin_of(score, ball)) held[*bin] = true;
  std::vector<std::size_t> free;
  for (const std::size_t bin : bins_)
    if (!held[bin]) free.push_back(bin);
  return free;
}

Vector2d Word::draw_drop(const std::vector<std::size_t>& bins, RandomStream& random) const {
  if (bins.empty() || random.bernoulli(kAnywhere)) {
    const double x = area_.min_x + (area_.max_x - area_.min_x) * random.uniform();
    return {x, area_.min_z + (area_.max_z - area_.min_z) * random.uniform()};
  }
  return centres_[bins[random.index(bins.size())]] + DropTable::standard().draw(random);
}

double Word::table_density(const Vector2d& place, std::size_t bin) const {
  return DropTable::standard().density(place - centres_[bin]);
}

double Word::log_density(const Vector2d& place, const std::vector<std::size_t>& bins) const {
  const double anywhere = 1 / area_.area();
  if (bins.empty()) return std::log(anywhere);
  double sum = 0;
  for (const std::size_t bin : bins)
    sum += table_density(place, bin);
  return std::log(kAnywhere * anywhere + (1 - kAnywhere) * sum / static_cast<double>(bins.size()));
}

double Word::most_log_density(const Vector2d& place) const {
  const double anywhere = 1 / area_.area();
  double most = 0;
  for (const std::size_t bin : bins_)
    most = std::max(most, table_density(place, bin));
  return std::log(std::max(anywhere, kAnywhere * anywhere + (1 - kAnywhere) * most));
}

std::shared_ptr<const Guide> make_guide(const Box& box, std::shared_ptr<const MarbleModel> marbles,
                                        const BinPattern& pattern, std::size_t first_bin_measure) {
  return std::make_shared<const WordGuide>(box, std::move(marbles), pattern, first_bin_measure);
}

}  // namespace retake::spelling
