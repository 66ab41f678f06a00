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
  if (!propose(simulator)) {
    ++walker_.stay.weight;
    return false;
  }
  if (walker_.stay.is_sample) ++counts_.samples;
  return true;
}

bool Metropolis::propose(Simulator& simulator) {
  constexpr double kScoredShare = 0.9;  // chosen: most, but the world's own proposals are to be seen
  RandomStream draws = random(Purpose::proposal);
  const double log_u = std::log(random(Purpose::acceptance).uniform());
  double u = draws.uniform();
  if (target_.scored_kernels && u < kScoredShare) {
    const std::size_t row = target_.scored_kernels->choose(u / kScoredShare);
    return step_by(*target_.scored_kernels->rows()[row].kernel, nullptr,
                   counts_.kernels[target_.kernels.rows().size() + row], draws, log_u, {}, simulator,
                   walker_);
  }
  if (target_.scored_kernels) u = (u - kScoredShare) / (1 - kScoredShare);
  const std::size_t row = target_.kernels.choose(u);
  return step_by(*target_.kernels.rows()[row].kernel, counts_.kernels[row], draws, log_u, {}, simulator,
                 walker_);
}

std::vector<std::string> Metropolis::kernel_names(const Target& target) {
  std::vector<std::string> names;
  for (const auto& row : target.kernels.rows())
    names.push_back(row.name);
  if (target.scored_kernels)
    for (const auto& row : target.scored_kernels->rows())
      names.push_back("soft_" + row.name);
  return names;
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
