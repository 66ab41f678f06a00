// See conditional.h.
#include "sampler/conditional.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

enum Kernels : std::size_t { kPrior, kLearned, kLocal, kTempering };

constexpr std::uint64_t kFirstHits = 5;       // to learn from
constexpr double kMoreHits = 1.5;             // times those learned from last
constexpr std::uint64_t kFruitless = 30'000;  // draws without a hit, after which a ladder looks for one
constexpr std::uint8_t kRedrawsPerLocal = 9;  // chosen: a redraw is worth more, a local move costs less
constexpr std::size_t kMostKept = 1000;       // hits; then they are thinned to half
constexpr std::size_t kFinalKernels = 400;
constexpr int kValidityDraws = 100'000;

}  // namespace

Conditional::Conditional(const Target& target, const ChainSettings& settings, ChainCounts& counts)
    : Walk(target, settings, counts),
      block_(*target.model, target.learned),
      local_(*target.model, block_.variables()) {
  counts_.is_learning = true;
  counts_.odds.basis = OddsBasis::rejection;
}

bool Conditional::step(Simulator& simulator) {
  switch (phase_) {
    case Phase::exploring:
      return explore(simulator);
    case Phase::tempering:
      return temper(simulator);
    case Phase::learned:
      start_sampling(simulator);
      break;
    case Phase::sampling:
      break;
  }
  return sample(simulator);
}

bool Conditional::draw_candidate(Simulator& simulator) {
  RandomStream draws = random(Purpose::proposal);
  ++counts_.kernels[redraw_.is_prior() ? kPrior : kLearned].proposed;
  redraw_.draw(block_, draws, candidate_);
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  return candidate_log_prior_ != kImpossible && simulate_candidate(simulator, nullptr, needed_to_satisfy()) &&
         candidate_score_.satisfied && candidate_score_.log_constraint != kImpossible;
}

// --- Exploring --------------------------------------------------------------------------------

bool Conditional::explore(Simulator& simulator) {
  const bool by_prior = redraw_.is_prior();
  plain_draws_ += redraw_.prior_share();
  const bool hit = draw_candidate(simulator);
  ++explored_;
  if (by_prior && candidate_log_prior_ != kImpossible) {
    ++counts_.odds.draws;
    if (hit) counts_.odds.add_hit(1);
  }
  if (hit) {
    ++counts_.kernels[by_prior ? kPrior : kLearned].accepted;
    ++counts_.accepted;
    const double weight = redraw_.log_weight(block_, candidate_);
    found_weight_ += std::exp(weight);
    ++found_;
    const double log_constraint = candidate_score_.log_constraint;
    if (log_constraint > hit_scale_) {
      for (WeighedState& other : hits_)
        other.weight *= std::exp(hit_scale_ - log_constraint);
      hit_scale_ = log_constraint;
    }
    hits_.push_back({.state = candidate_, .weight = std::exp(weight + log_constraint - hit_scale_)});
    if (hits_.size() > kMostKept) {
      RandomStream draws = random(Purpose::learning, 1);
      hits_ = thin(std::move(hits_), kMostKept / 2, draws);
    }
    move_to_candidate(walker_);
    // Enough of them are shown; what else is found only teaches.
    walker_.stay.is_sample = found_ <= settings_.learning.hits;
    walker_.stay.weight = 0;
    counts_.samples += walker_.stay.is_sample ? 1 : 0;
  }
  learn_if_due();
  if (hits_.empty() && explored_ >= kFruitless && by_prior) {
    phase_ = Phase::tempering;
    ladder_ =
        std::make_unique<Tempering>(target_, settings_, counts_, Tempering::Part::of_another, kTempering);
  }
  return hit;
}

bool Conditional::temper(Simulator& simulator) {
  if (!ladder_->step(simulator)) return false;
  const Stay& found = ladder_->walkers()[ladder_->walker()].stay;
  if (!found.score.satisfied) return false;
  walker_.stay = found;
  ++counts_.samples;
  hits_.push_back({.state = found.state, .weight = 1});
  if (ladder_->has_found_enough()) {
    // They come from few draws of the prior, so they only show where to look.
    learn(false);
    hits_.clear();
    ladder_.reset();
    phase_ = Phase::exploring;
  }
  return true;
}

void Conditional::learn_if_due() {
  const LearningLimits& limits = settings_.learning;
  if (found_ < kFirstHits) return;
  const bool enough =
      (found_ >= limits.hits && plain_hits() >= limits.plain_hits) || explored_ >= limits.draws;
  if (!enough && static_cast<double>(found_) < kMoreHits * static_cast<double>(learned_from_) + 1) return;
  learn(enough);
  if (enough) phase_ = Phase::learned;
}

/// What the prior alone would have found in as many draws as were its own.
double Conditional::plain_hits() const {
  return explored_ > 0 ? found_weight_ / static_cast<double>(explored_) * plain_draws_ : 0;
}

void Conditional::learn(bool for_good) {
  LearnedRedraw::Fit fit{.plain_hits = plain_hits()};
  if (for_good) {
    fit.most_kernels = kFinalKernels;
    fit.sweeps = 2;
  }
  RandomStream draws = random(Purpose::learning);
  redraw_ = LearnedRedraw::learn(block_, hits_, fit, draws);
  learned_from_ = found_;
}

// --- Sampling ---------------------------------------------------------------------------------

void Conditional::start_sampling(Simulator& simulator) {
  RandomStream draws = random(Purpose::learning);
  if (target_.model->restricts_support()) {
    int valid = 1;  // a hit was
    State drawn;
    for (int i = 0; i < kValidityDraws; ++i) {
      target_.model->draw(draws, drawn);
      valid += target_.model->log_prior(drawn) != kImpossible ? 1 : 0;
    }
    valid_share_ = static_cast<double>(valid) / (kValidityDraws + 1);
  }
  // Start from one of the hits, drawn by their weights: nearly a draw of the target already.
  double sum = 0;
  for (const WeighedState& hit : hits_)
    sum += hit.weight;
  double mark = draws.uniform() * sum;
  std::size_t chosen = 0;
  while (chosen + 1 < hits_.size() && (mark -= hits_[chosen].weight) >= 0)
    ++chosen;
  candidate_ = hits_[chosen].state;
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  const bool complete = simulate_candidate(simulator, nullptr, kImpossible);
  CHECK(complete && candidate_score_.satisfied, chosen);
  move_to_candidate(walker_);
  walker_.stay.is_sample = false;
  hits_ = {};
  phase_ = Phase::sampling;
  counts_.is_learning = false;
  counts_.odds = {.basis = OddsBasis::learned};
}

bool Conditional::sample(Simulator& simulator) {
  if (turn_ != 0) return sample_redraw(simulator);
  turn_ = kRedrawsPerLocal;
  RandomStream draws = random(Purpose::proposal);
  const double log_u = std::log(random(Purpose::acceptance).uniform());
  if (!step_by(local_, counts_.kernels[kLocal], draws, log_u, {.conditional = true}, simulator, walker_)) {
    ++walker_.stay.weight;
    return false;
  }
  ++counts_.samples;
  return true;
}

bool Conditional::sample_redraw(Simulator& simulator) {
  const bool hit = draw_candidate(simulator);
  ++counts_.odds.draws;
  if (!hit) return false;  // the turn goes on with the next draw
  --turn_;
  const double log_candidate = log_weight(candidate_, candidate_score_);
  counts_.odds.add_hit(std::exp(log_candidate - candidate_score_.log_constraint) / valid_share_);
  const double log_u = std::log(random(Purpose::acceptance).uniform());
  if (!(log_u < log_candidate - log_weight(walker_.stay.state, walker_.stay.score))) {
    ++walker_.stay.weight;
    return false;
  }
  ++counts_.kernels[kLearned].accepted;
  ++counts_.accepted;
  move_to_candidate(walker_);
  ++counts_.samples;
  return true;
}

// --- Checkpoint -------------------------------------------------------------------------------

void Conditional::write(ByteWriter& out) const {
  Walk::write(out);
  out.put(static_cast<std::uint8_t>(phase_));
  out.put(turn_);
  out.put(explored_);
  out.put(found_);
  out.put(found_weight_);
  out.put(plain_draws_);
  out.put(learned_from_);
  out.put(valid_share_);
  out.put(hit_scale_);
  redraw_.write(out);
  out.put(static_cast<std::uint32_t>(hits_.size()));
  for (const WeighedState& hit : hits_) {
    out.put(hit.weight);
    out.put_numbers(hit.state.data(), static_cast<std::size_t>(hit.state.size()));
  }
  if (phase_ == Phase::tempering) ladder_->write(out);
}

void Conditional::read(ByteReader& in) {
  Walk::read(in);
  const auto phase = in.get<std::uint8_t>();
  const auto turn = in.get<std::uint8_t>();
  if (phase > static_cast<std::uint8_t>(Phase::sampling) || turn > kRedrawsPerLocal)
    throw std::out_of_range("a phase that cannot be");
  phase_ = static_cast<Phase>(phase);
  turn_ = turn;
  explored_ = in.get<std::uint64_t>();
  found_ = in.get<std::uint64_t>();
  found_weight_ = in.get<double>();
  plain_draws_ = in.get<double>();
  learned_from_ = in.get<std::uint64_t>();
  valid_share_ = in.get<double>();
  hit_scale_ = in.get<double>();
  redraw_ = LearnedRedraw::read(in, block_);
  hits_.clear();
  for (auto count = in.get<std::uint32_t>(); count > 0; --count) {
    WeighedState hit;
    hit.weight = in.get<double>();
    in.get_numbers(hit.state);
    if (static_cast<std::size_t>(hit.state.size()) != target_.model->size())
      throw std::out_of_range("other variables");
    hits_.push_back(std::move(hit));
  }
  if ((phase_ == Phase::learned && hits_.empty()) ||
      (phase_ == Phase::sampling && (!walker_.was_simulated || redraw_.is_prior())))
    throw std::out_of_range("a phase without what it needs");
  if (phase_ != Phase::tempering) return;
  ladder_ = std::make_unique<Tempering>(target_, settings_, counts_, Tempering::Part::of_another, kTempering);
  ladder_->read(in);
}

}  // namespace retake
