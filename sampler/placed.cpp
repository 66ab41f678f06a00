// See placed.h.
#include "sampler/placed.h"

#include <algorithm>
#include <cmath>

#include "sampler/roulette.h"

namespace retake {
namespace {

constexpr double kCountsOfMost = 8;    // chosen: rounding then costs little, and few samples are stored
constexpr double kLargestMean = 1e12;  // far from any that a bound allows

}  // namespace

Placed::Placed(const Target& target, const ChainSettings& settings, ChainCounts& counts)
    : Walk(target, settings, counts) {
  counts_.odds.basis = OddsBasis::learned;
  drawn_.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
}

bool Placed::step(Simulator& simulator) {
  RandomStream draws = random(Purpose::proposal);
  ++counts_.kernels[0].proposed;
  if (!draw(draws, simulator)) return false;
  if (!place(draws, simulator)) return false;
  ++counts_.kernels[0].accepted;
  ++counts_.accepted;
  counts_.odds.add_hit(std::exp(log_weight_));

  // How often it counts.
  const double of_most = log_weight_ - target_.placed->most_log_weight() + candidate_score_.log_constraint;
  const double mean = std::min(kCountsOfMost * std::exp(of_most), kLargestMean);
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
  Roulette roulette(
      [this](std::size_t checkpoint, std::span<const double> features) {
        return target_.placed->survival(checkpoint, features);
      },
      draws);
  const bool plays = target_.placed->plays_roulette();
  const bool is_whole = simulate_candidate(simulator, nullptr, kImpossible, plays ? &roulette : nullptr);
  survival_ = roulette.survival();
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

}  // namespace retake
