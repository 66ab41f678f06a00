// See simple_walks.h.
#include "sampler/simple_walks.h"

#include <cmath>

namespace retake {

void Metropolis::start(Simulator& simulator) {
  // Line 1 of the paper's algorithm: the initial State is a draw from the prior.
  Walk::start(simulator);
  simulate_first(simulator, walker_);
}

bool Metropolis::step(Simulator& simulator) {
  RandomStream draws = random(Purpose::proposal);
  const std::size_t row = target_.kernels.choose(draws.uniform());
  const double log_u = std::log(random(Purpose::acceptance).uniform());
  if (!step_by(*target_.kernels.rows()[row].kernel, counts_.kernels[row], draws, log_u, {}, simulator,
               walker_)) {
    ++walker_.stay.weight;
    return false;
  }
  if (walker_.stay.is_sample) ++counts_.samples;
  return true;
}

bool Rejection::step(Simulator& simulator) {
  // Draw from the prior.
  RandomStream draws = random(Purpose::proposal);
  KernelCounter& counter = counts_.kernels[0];
  ++counter.proposed;
  target_.model->draw(draws, candidate_);
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  if (candidate_log_prior_ == kImpossible) return false;
  ++counts_.odds.draws;

  // Keep with probability p_c.
  const double needed = std::log(random(Purpose::acceptance).uniform());
  if (!simulate_candidate(simulator, nullptr, needed) || !(candidate_score_.log_constraint > needed))
    return false;
  ++counter.accepted;
  ++counts_.accepted;
  move_to_candidate(walker_);
  if (walker_.stay.is_sample) {
    ++counts_.samples;
    // As many are satisfied as are kept, over the probability of being kept.
    counts_.odds.add_hit(std::exp(-walker_.stay.score.log_constraint));
  }
  return true;
}

}  // namespace retake
