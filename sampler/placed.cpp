// See placed.h.
#include "sampler/placed.h"

#include <algorithm>
#include <cmath>

namespace retake {
namespace {

constexpr double kCountsOfMost = 8;       // chosen: rounding then costs little, and few samples are stored
constexpr double kLargestCount = 1e12;    // far from any that a bound allows
constexpr std::uint64_t kLearned = 4000;  // draws; chosen: the study gained 4 % more from twice as many

/// Plays roulette at every checkpoint.
class Player final : public Watch {
 public:
  Player(const PlacedRedraw& placed, const Roulette& roulette, RandomStream& random,
         std::vector<Roulette::Visit>& visits, double& survival)
      : placed_(placed), roulette_(roulette), random_(random), visits_(visits), survival_(survival) {}

  bool goes_on(std::size_t checkpoint, double seconds, std::span<const double> features) override {
    const std::size_t bin = placed_.bin(features);
    visits_.push_back({.checkpoint = checkpoint, .bin = bin, .seconds = seconds});
    if (!roulette_.is_frozen()) return true;
    const double share = roulette_.survival(checkpoint, bin) / survival_;
    if (share >= 1) return true;
    survival_ *= share;
    return random_.uniform() < share;
  }

 private:
  const PlacedRedraw& placed_;
  const Roulette& roulette_;
  RandomStream& random_;
  std::vector<Roulette::Visit>& visits_;
  double& survival_;
};

}  // namespace

Placed::Placed(const Target& target, const ChainSettings& settings, ChainCounts& counts)
    : Walk(target, settings, counts), roulette_(target.placed->checkpoints(), target.placed->bins()) {
  counts_.odds.basis = OddsBasis::learned;
  drawn_.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
}

bool Placed::step(Simulator& simulator) {
  RandomStream draws = random(Purpose::proposal);
  ++counts_.kernels[0].proposed;
  if (!draw(draws, simulator)) return false;
  const bool is_hit = place(draws, simulator);
  if (!roulette_.is_frozen()) {
    roulette_.learn(visits_, is_hit ? std::exp(log_weight_) : 0, seconds_);
    if (++learned_from_ == kLearned) roulette_.freeze();
  }
  if (!is_hit) return false;
  ++counts_.kernels[0].accepted;
  ++counts_.accepted;
  counts_.odds.add_hit(std::exp(log_weight_));

  // How often it counts.
  const double of_most = log_weight_ - target_.placed->most_log_weight() + candidate_score_.log_constraint;
  const double mean = std::min(kCountsOfMost * std::exp(of_most), kLargestCount);
  const auto count = static_cast<std::uint64_t>(mean + random(Purpose::acceptance).uniform());
  if (count == 0) return false;
  move_to_candidate(walker_);
  walker_.stay.weight = count;
  ++counts_.samples;
  return true;
}

/// True if a draw of the prior was simulated to its end.
bool Placed::draw(RandomStream& draws, Simulator& simulator) {
  target_.model->draw(draws, candidate_);
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  if (candidate_log_prior_ == kImpossible) return false;
  ++counts_.odds.draws;
  visits_.clear();
  survival_ = 1;
  Player player(*target_.placed, roulette_, draws, visits_, survival_);
  const bool plays = target_.placed->checkpoints() > 0;
  const double seconds_before = counts_.simulated_seconds;
  const bool is_whole = simulate_candidate(simulator, nullptr, kImpossible, plays ? &player : nullptr);
  seconds_ = counts_.simulated_seconds - seconds_before;
  if (is_whole) move_to_candidate(drawn_);
  return is_whole;
}

/// True if what was drawn satisfies where it is placed.
bool Placed::place(RandomStream& draws, Simulator& simulator) {
  const Stay& drawn = drawn_.stay;
  candidate_ = drawn.state;
  log_weight_ = target_.placed->place(drawn.state, drawn.score, candidate_, draws) - std::log(survival_);
  if (log_weight_ == kImpossible) return false;
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  return candidate_log_prior_ != kImpossible && simulate_candidate(simulator, &drawn_, needed_to_satisfy()) &&
         candidate_score_.satisfied;
}

void Placed::write(ByteWriter& out) const {
  Walk::write(out);
  out.put(learned_from_);
  roulette_.write(out);
}

void Placed::read(ByteReader& in) {
  Walk::read(in);
  learned_from_ = in.get<std::uint64_t>();
  roulette_.read(in);
}

}  // namespace retake
