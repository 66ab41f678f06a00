// See placed.h.
#include "sampler/placed.h"

#include <algorithm>
#include <cmath>

namespace retake {
namespace {

constexpr double kCountsOfMost = 8;  // chosen: rounding then costs little, and few samples are stored twice
constexpr double kLargestCount = 1e12;  // far from any that a bound allows

}  // namespace

Placed::Placed(const Target& target, const ChainSettings& settings, ChainCounts& counts)
    : Walk(target, settings, counts) {
  counts_.odds.basis = OddsBasis::learned;
  drawn_.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
}

bool Placed::step(Simulator& simulator) {
  // Draw from the prior.
  RandomStream draws = random(Purpose::proposal);
  KernelCounter& counter = counts_.kernels[0];
  ++counter.proposed;
  target_.model->draw(draws, candidate_);
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  if (candidate_log_prior_ == kImpossible) return false;
  ++counts_.odds.draws;
  if (!simulate_candidate(simulator, nullptr, kImpossible)) return false;
  move_to_candidate(drawn_);

  // Place it.
  const Stay& drawn = drawn_.stay;
  candidate_ = drawn.state;
  const double log_weight = target_.placed->place(drawn.state, drawn.score, candidate_, draws);
  if (log_weight == kImpossible) return false;
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  if (candidate_log_prior_ == kImpossible || !simulate_candidate(simulator, &drawn_, needed_to_satisfy()) ||
      !candidate_score_.satisfied)
    return false;
  ++counter.accepted;
  ++counts_.accepted;
  counts_.odds.add_hit(std::exp(log_weight));

  // Count it.
  const double of_most = log_weight - target_.placed->most_log_weight() + candidate_score_.log_constraint;
  const double mean = std::min(kCountsOfMost * std::exp(of_most), kLargestCount);
  const auto count = static_cast<std::uint64_t>(mean + random(Purpose::acceptance).uniform());
  if (count == 0) return false;
  move_to_candidate(walker_);
  walker_.stay.weight = count;
  ++counts_.samples;
  return true;
}

}  // namespace retake
