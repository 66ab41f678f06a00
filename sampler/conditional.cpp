// See conditional.h.
#include "sampler/conditional.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

enum Kernels : std::size_t { kPrior, kLearned, kLocal, kTempering };

// Chosen: of strikes, one draw in 30, a learned redraw gives twice as many in the long run, after seconds of
// learning; of what is four times as likely it can hardly give more than the prior does.
constexpr double kCommon = 0.125;
constexpr std::uint64_t kFirstHits = 5;       // to learn from
constexpr double kMoreHits = 1.5;             // times those learned from last
constexpr std::uint64_t kFruitless = 30'000;  // draws without a hit, after which a ladder looks for one
constexpr std::uint8_t kHitsPerLocal = 9;     // chosen: a hit is worth more, a local move costs less
constexpr double kMeanCount = 2;              // chosen: rounding then costs 3 % of the effective samples
constexpr double kLargestCount = 1e12;        // far from any that a fit brings about
constexpr std::size_t kMostKept = 1000;       // hits; then they are thinned to half
constexpr std::size_t kFinalKernels = 400;
constexpr int kValidityDraws = 100'000;

}  // namespace

LearnedLocalMove::LearnedLocalMove(const Block& block, const LearnedRedraw& redraw)
    : block_(block), redraw_(redraw), move_(block.model(), block.variables()) {}

double LearnedLocalMove::propose(const Model& model, const State& current, State& candidate,
                                 RandomStream& random) const {
  const double log_hastings = move_.propose(model, current, candidate, random);
  if (model.log_prior(candidate) == kImpossible) return 0;  // rejected, whatever the ratio
  return log_hastings + redraw_.log_weight(block_, current) - redraw_.log_weight(block_, candidate);
}

Conditional::Conditional(const Target& target, const ChainSettings& settings, ChainCounts& counts)
    : Walk(target, settings, counts), block_(*target.model, target.learned), local_(block_, redraw_) {
  counts_.is_learning = true;
  counts_.odds.basis = OddsBasis::rejection;
  if (settings_.learning.plain_draws > 0) phase_ = Phase::plain;
}

bool Conditional::step(Simulator& simulator) {
  switch (phase_) {
    case Phase::plain:
    case Phase::exploring:
      return explore(simulator);
    case Phase::tempering:
      return temper(simulator);
    case Phase::sampling:
      break;
  }
  return turn_ > 0 ? sample(simulator) : move_locally(simulator);
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
    ++found_;
    if (counts_.is_learning) keep_hit();
    move_to_candidate(walker_);
    Stay& stay = walker_.stay;
    stay.weight = phase_ == Phase::plain ? plain_count() : 0;
    // Enough of what weighs nothing is shown; what else is found only teaches.
    stay.is_sample = stay.weight > 0 || found_ <= settings_.learning.hits;
    counts_.samples += stay.is_sample ? 1 : 0;
  }
  if (phase_ == Phase::plain) look_whether_common();
  if (phase_ == Phase::exploring) learn_if_due();
  if (phase_ == Phase::exploring && hits_.empty() && explored_ >= kFruitless && by_prior) {
    phase_ = Phase::tempering;
    ladder_ =
        std::make_unique<Tempering>(target_, settings_, counts_, Tempering::Part::of_another, kTempering);
  }
  return hit;
}

/// The candidate is a hit to learn from.
void Conditional::keep_hit() {
  const double weight = redraw_.log_weight(block_, candidate_);
  found_weight_ += std::exp(weight);
  const double log_constraint = candidate_score_.log_constraint;
  if (log_constraint > hit_scale_) {
    for (WeighedState& other : hits_)
      other.weight *= std::exp(hit_scale_ - log_constraint);
    hit_scale_ = log_constraint;
  }
  hits_.push_back({.state = candidate_, .weight = std::exp(weight + log_constraint - hit_scale_)});
  if (hits_.size() <= kMostKept) return;
  RandomStream draws = random(Purpose::learning, 1);
  hits_ = thin(std::move(hits_), kMostKept / 2, draws);
}

/// A draw of the prior counts once with probability p_c.
std::uint64_t Conditional::plain_count() {
  const double share = std::exp(walker_.stay.score.log_constraint);
  plain_worth_ += share;
  return random(Purpose::acceptance).uniform() < share ? 1 : 0;
}

/// Looked at whenever there are twice as many draws, so that a first look that was wrong is mended.
void Conditional::look_whether_common() {
  const std::uint64_t first = settings_.learning.plain_draws;
  if (explored_ % first != 0 || !std::has_single_bit(explored_ / first)) return;
  if (plain_worth_ >= kCommon * static_cast<double>(explored_)) {
    counts_.is_learning = false;
    hits_ = {};
    return;
  }
  phase_ = Phase::exploring;
  if (counts_.is_learning) return;
  // It has kept no hits since, so it begins anew to learn.
  counts_.is_learning = true;
  explored_ = found_ = 0;
  found_weight_ = plain_draws_ = 0;
  hit_scale_ = kImpossible;
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
  if (enough) start_sampling();
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

void Conditional::start_sampling() {
  if (target_.model->restricts_support()) {
    RandomStream draws = random(Purpose::learning, 2);
    int valid = 1;  // a hit was
    State drawn;
    for (int i = 0; i < kValidityDraws; ++i) {
      target_.model->draw(draws, drawn);
      valid += target_.model->log_prior(drawn) != kImpossible ? 1 : 0;
    }
    valid_share_ = static_cast<double>(valid) / (kValidityDraws + 1);
  }
  hits_ = {};
  enter_sampling();
}

void Conditional::enter_sampling() {
  phase_ = Phase::sampling;
  turn_ = kHitsPerLocal;  // the first of them are draws of q, so the walk needs no burning in
  counts_.is_learning = false;
  counts_.odds = {.basis = OddsBasis::learned};
}

bool Conditional::sample(Simulator& simulator) {
  const bool hit = draw_candidate(simulator);
  ++counts_.odds.draws;
  if (!hit) return false;
  --turn_;
  ++counts_.kernels[kLearned].accepted;
  ++counts_.accepted;
  move_to_candidate(walker_);
  counts_.odds.add_hit(std::exp(redraw_.log_weight(block_, walker_.stay.state)) / valid_share_);
  RandomStream draws = random(Purpose::acceptance);
  walker_.stay.weight = draw_count(draws);
  walker_.stay.is_sample = walker_.stay.weight > 0;
  counts_.samples += walker_.stay.is_sample ? 1 : 0;
  return true;
}

bool Conditional::move_locally(Simulator& simulator) {
  turn_ = kHitsPerLocal;
  RandomStream proposals = random(Purpose::proposal), draws = random(Purpose::acceptance);
  const double log_u = std::log(draws.uniform());
  // beta = 0: what it leaves as it is holds no p_c, which the count holds instead.
  const bool moved = step_by(local_, counts_.kernels[kLocal], proposals, log_u,
                             {.beta = 0, .conditional = true}, simulator, walker_);
  Stay& stay = walker_.stay;
  const std::uint64_t count = draw_count(draws);
  const bool was_sample = !moved && stay.is_sample;
  stay.weight = was_sample ? stay.weight + count : count;
  stay.is_sample = stay.weight > 0;
  const bool found = stay.is_sample && !was_sample;
  if (!moved && found) {
    // It counted nothing so far, and becomes a sample where it is.
    stay.iteration = counts_.iteration;
    ended_weight_ = 0;
  }
  counts_.samples += found ? 1 : 0;
  return moved || found;
}

std::uint64_t Conditional::draw_count(RandomStream& random) const {
  const Stay& stay = walker_.stay;
  const double log_weight = redraw_.log_weight(block_, stay.state) + stay.score.log_constraint - hit_scale_;
  const double mean = kMeanCount / redraw_.drawn_weight() * std::exp(log_weight);
  return static_cast<std::uint64_t>(std::min(mean, kLargestCount) + random.uniform());
}

// --- Lesson -----------------------------------------------------------------------------------
// Whether it samples, and what it has learned.

std::optional<LessonKind> Conditional::teach(ByteWriter& out) const {
  const bool samples = phase_ == Phase::sampling;
  const bool knows = !hits_.empty() || !redraw_.is_prior();
  if (!samples && (phase_ == Phase::plain || phase_ == Phase::tempering || !knows)) return std::nullopt;
  out.put(static_cast<std::uint8_t>(samples));
  write_learned(out);
  return samples ? LessonKind::proposal : LessonKind::unfinished;
}

void Conditional::begin_from(ByteReader& lesson) {
  const auto samples = lesson.get<std::uint8_t>();
  read_learned(lesson);
  if (samples > 1 || (samples == 1 && (redraw_.is_prior() || !std::isfinite(hit_scale_))))
    throw std::out_of_range("a redraw that cannot be");
  phase_ = Phase::exploring;
  if (samples == 1) enter_sampling();
}

void Conditional::write_learned(ByteWriter& out) const {
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
    write_state(out, hit.state);
  }
}

void Conditional::read_learned(ByteReader& in) {
  explored_ = in.get<std::uint64_t>();
  found_ = in.get<std::uint64_t>();
  found_weight_ = in.get<double>();
  plain_draws_ = in.get<double>();
  learned_from_ = in.get<std::uint64_t>();
  valid_share_ = in.get<double>();
  hit_scale_ = in.get<double>();
  if (!(valid_share_ > 0 && valid_share_ <= 1)) throw std::out_of_range("a share that cannot be");
  redraw_ = LearnedRedraw::read(in, block_);
  hits_.clear();
  for (auto count = in.get<std::uint32_t>(); count > 0; --count) {
    const auto weight = in.get<double>();
    hits_.push_back({.state = read_state(in, target_), .weight = weight});
  }
}

// --- Checkpoint -------------------------------------------------------------------------------

void Conditional::write(ByteWriter& out) const {
  Walk::write(out);
  out.put(static_cast<std::uint8_t>(phase_));
  out.put(turn_);
  out.put(plain_worth_);
  write_learned(out);
  if (phase_ == Phase::tempering) ladder_->write(out);
}

void Conditional::read(ByteReader& in) {
  Walk::read(in);
  const auto phase = in.get<std::uint8_t>();
  const auto turn = in.get<std::uint8_t>();
  plain_worth_ = in.get<double>();
  if (phase > static_cast<std::uint8_t>(Phase::sampling) || turn > kHitsPerLocal)
    throw std::out_of_range("a phase that cannot be");
  phase_ = static_cast<Phase>(phase);
  turn_ = turn;
  read_learned(in);
  const bool has_moved = walker_.was_simulated || turn_ == kHitsPerLocal;
  if (phase_ == Phase::sampling && (!has_moved || redraw_.is_prior()))
    throw std::out_of_range("a phase without what it needs");
  if (phase_ != Phase::tempering) return;
  ladder_ = std::make_unique<Tempering>(target_, settings_, counts_, Tempering::Part::of_another, kTempering);
  ladder_->read(in);
}

}  // namespace retake
