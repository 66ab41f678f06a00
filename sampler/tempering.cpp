// See tempering.h.
#include "sampler/tempering.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sampler/check.h"

namespace retake {
namespace {

constexpr std::size_t kPilotDraws = 32;
constexpr double kFirstBeta = 1;  // over the typical depth of the prior below the target; at most kWarmest
constexpr double kWarmest = 0.5;  //
constexpr double kStep = 2.5;     // ratio of neighbouring betas before tuning
constexpr std::size_t kFewestRungs = 3, kMostRungs = 12;
constexpr double kBottomless = 1e6;                             // stands for an infinite depth
constexpr double kRedrawShare = 0.2;                            // of the steps above the prior
constexpr std::uint64_t kFirstStage = 16, kLongestStage = 512;  // [rounds] between tunings
constexpr std::uint32_t kFewestTunings = 3;
// With less a ladder was seen to freeze with gaps.
constexpr std::uint64_t kEnoughHits = 20;
constexpr std::size_t kEnoughLineages = 5;
constexpr std::size_t kBatches = 16;
constexpr double kCaution = 2;  // measured: replicas are not independent, so batch variances say too little

/// beta * log_constraint, where 0 * infinity is 0.
double tempered(double beta, double log_constraint) {
  return beta == 0 ? 0 : beta * log_constraint;
}

}  // namespace

Tempering::Tempering(const Target& target, const ChainSettings& settings, ChainCounts& counts, Part part,
                     std::size_t first_kernel)
    : Walk(target, settings, counts),
      part_(part),
      first_kernel_(first_kernel),
      redraw_(Redraw::all(*target.model, Ratios::exact)),
      local_(*target.model, Block(*target.model, target.learned).variables()),
      walkers_(1),
      stage_rounds_(kFirstStage) {
  walkers_[0].stay.score.measures.assign(target_.measure_names.size(), kAbsent);
  if (part_ == Part::whole) counts_.is_learning = true;
}

bool Tempering::has_found_enough() const {
  return hits_ >= kEnoughHits && found_lineages_.size() >= kEnoughLineages;
}

bool Tempering::step(Simulator& simulator) {
  return stage_ == Stage::pilot ? step_pilot(simulator) : step_rung(simulator);
}

// --- The pilot --------------------------------------------------------------------------------

bool Tempering::step_pilot(Simulator& simulator) {
  if (pilot_.size() == kPilotDraws) {
    build_ladder();
    return step_rung(simulator);
  }
  RandomStream draws = random(Purpose::proposal);
  ++counter(0).proposed;
  target_.model->draw(draws, candidate_);
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  if (candidate_log_prior_ == kImpossible || !simulate_candidate(simulator, nullptr, kImpossible))
    return false;
  ++counter(0).accepted;
  ++counts_.accepted;
  pilot_.push_back(std::min(-candidate_score_.log_constraint, kBottomless));
  move_to_candidate(walkers_[0]);
  walkers_[0].stay.weight = 0;
  if (walkers_[0].stay.is_sample && part_ == Part::whole) ++counts_.samples;
  return true;
}

void Tempering::build_ladder() {
  std::nth_element(pilot_.begin(), pilot_.begin() + kPilotDraws / 2, pilot_.end());
  const double depth = pilot_[kPilotDraws / 2];
  const double first = depth > 0 ? std::min(kWarmest, kFirstBeta / depth) : kWarmest;
  const auto wanted = static_cast<std::size_t>(std::ceil(std::log(1 / first) / std::log(kStep))) + 2;
  const std::size_t count = std::clamp(wanted, kFewestRungs, kMostRungs);
  place_on_ladder(count);
  for (std::size_t r = 1; r < count; ++r)
    rungs_[r].beta = std::pow(first, 1 - static_cast<double>(r - 1) / static_cast<double>(count - 2));
  stage_ = Stage::tuning;
  publish_rungs();
}

/// As many rungs of beta 0, and a walker on each that stands nowhere yet.
void Tempering::place_on_ladder(std::size_t count) {
  rungs_.assign(count, {});
  for (std::size_t r = 0; r < count; ++r)
    rungs_[r].walker = r;
  walkers_ = std::vector<Walker>(count);
  lineages_.assign(count, 0);
  for (Walker& walker : walkers_)
    walker.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
}

// --- The ladder -------------------------------------------------------------------------------

bool Tempering::step_rung(Simulator& simulator) {
  const Rung& rung = rungs_[turn_];
  walker_index_ = rung.walker;
  Walker& walker = walkers_[walker_index_];
  bool moved = false;
  if (!walker.was_simulated) {
    if (walker.stay.state.size() == 0) draw_first(walker, walker_index_ + 1);
    simulate_first(simulator, walker);
    lineages_[walker_index_] = counts_.iteration;
  } else {
    RandomStream draws = random(Purpose::proposal);
    const double log_u = std::log(random(Purpose::acceptance).uniform());
    const bool anew = turn_ == 0 || draws.bernoulli(kRedrawShare);
    const Kernel& kernel = anew ? static_cast<const Kernel&>(redraw_) : local_;
    const std::uint64_t whole = counter(0).accepted;
    moved = step_by(kernel, counter(anew ? 0 : 1), draws, log_u, {.beta = rung.beta}, simulator, walker);
    if (moved && anew) lineages_[walker_index_] = counts_.iteration;
    if (turn_ == 0 && stage_ == Stage::sampling && candidate_log_prior_ != kImpossible) {
      ++prior_draws_;
      whole_draws_ += counter(0).accepted - whole;
    }
  }
  const bool is_last = turn_ + 1 == rungs_.size();
  const bool told = note_stay(walker, moved, is_last || target_.least_satisfied == 0);
  if (++turn_ == rungs_.size()) finish_round();
  return told;
}

/// Weighs the stay. True if the walker moved, or became a sample where it is.
bool Tempering::note_stay(Walker& walker, bool moved, bool counts) {
  Stay& stay = walker.stay;
  if (moved && stay.score.satisfied && !has_found_enough()) {
    ++hits_;
    found_lineages_.insert(lineages_[walker_index_]);
  } else if (moved && stay.score.satisfied) {
    ++hits_;
  }
  if (stage_ != Stage::sampling) {
    if (!moved) return false;
    stay.weight = 0;
    if (stay.is_sample && part_ == Part::whole) ++counts_.samples;
    return true;
  }
  if (!moved && stay.iteration == 0) return false;  // it stands there since before the ladder was frozen
  const bool is_draw = counts && stay.score.satisfied;
  if (!moved && stay.is_sample) {
    stay.weight += is_draw ? 1 : 0;
    return false;
  }
  stay.is_sample = is_draw;
  if (!is_draw) return moved;
  stay.iteration = counts_.iteration;
  stay.weight = 1;
  ++counts_.samples;
  return true;
}

void Tempering::finish_round() {
  turn_ = 0;
  swap_neighbours();
  ++round_;
  if (stage_ == Stage::sampling) {
    add_to_batches();
  } else if (round_ - tuned_at_ == stage_rounds_) {
    tune();
    if (tunings_ >= kFewestTunings && has_found_enough() && part_ == Part::whole) freeze();
  }
  publish_rungs();
}

void Tempering::swap_neighbours() {
  RandomStream draws = random(Purpose::swap);
  for (std::size_t r = round_ % 2; r + 1 < rungs_.size(); r += 2) {
    Rung &low = rungs_[r], &high = rungs_[r + 1];
    const double below = walkers_[low.walker].stay.score.log_constraint;
    const double above = walkers_[high.walker].stay.score.log_constraint;
    const double log_u = std::log(draws.uniform());
    // Where neither has any probability there is nothing to choose.
    const double log_ratio = below == above ? 0 : (high.beta - low.beta) * (below - above);
    low.rejected += 1 - std::exp(std::min(log_ratio, 0.0));
    ++low.attempts;
    const bool accepted = log_u < log_ratio;
    if (accepted) std::swap(low.walker, high.walker);
    if (part_ == Part::whole) {
      ++counts_.rungs[r].proposed;
      counts_.rungs[r].accepted += accepted ? 1 : 0;
    }
  }
}

/// Moves the inner rungs to where every swap is rejected as often as any other.
void Tempering::tune() {
  std::vector<double> barrier{0};  // cumulative, up to each rung
  for (std::size_t r = 0; r + 1 < rungs_.size(); ++r) {
    const double share =
        rungs_[r].attempts > 0 ? rungs_[r].rejected / static_cast<double>(rungs_[r].attempts) : 0;
    barrier.push_back(barrier.back() + share + 1e-3);  // never flat, so that it can be inverted
  }
  std::vector<double> betas{0};
  for (std::size_t r = 1, from = 0; r + 1 < rungs_.size(); ++r) {
    const double mark = barrier.back() * static_cast<double>(r) / static_cast<double>(rungs_.size() - 1);
    while (barrier[from + 1] < mark)
      ++from;
    const double part = (mark - barrier[from]) / (barrier[from + 1] - barrier[from]);
    betas.push_back(rungs_[from].beta + part * (rungs_[from + 1].beta - rungs_[from].beta));
  }
  for (std::size_t r = 1; r < betas.size(); ++r)
    rungs_[r].beta = betas[r];
  for (Rung& rung : rungs_) {
    rung.rejected = 0;
    rung.attempts = 0;
  }
  counts_.rungs.clear();
  tuned_at_ = round_;
  stage_rounds_ = std::min(2 * stage_rounds_, kLongestStage);
  ++tunings_;
}

void Tempering::freeze() {
  stage_ = Stage::sampling;
  counts_.is_learning = false;
  for (Walker& walker : walkers_) {
    walker.stay.iteration = 0;
    walker.stay.is_sample = false;
  }
}

void Tempering::publish_rungs() {
  if (part_ != Part::whole) return;
  counts_.rungs.resize(rungs_.size());
  for (std::size_t r = 0; r < rungs_.size(); ++r)
    counts_.rungs[r].beta = rungs_[r].beta;
}

// --- Odds -------------------------------------------------------------------------------------

void Tempering::add_to_batches() {
  if (batches_.empty() || batches_.back().rounds == batch_rounds_) {
    if (batches_.size() == kBatches) {
      for (std::size_t b = 0; b < kBatches / 2; ++b) {
        Batch merged = std::move(batches_[2 * b]);
        merged.rounds += batches_[2 * b + 1].rounds;
        for (std::size_t r = 0; r < rungs_.size(); ++r)
          merged.sums[r] += batches_[2 * b + 1].sums[r];
        batches_[b] = std::move(merged);
      }
      batches_.resize(kBatches / 2);
      batch_rounds_ *= 2;
    }
    batches_.push_back({.rounds = 0, .sums = std::vector<double>(rungs_.size(), 0.0)});
  }
  Batch& batch = batches_.back();
  ++batch.rounds;
  for (std::size_t r = 0; r < rungs_.size(); ++r) {
    const Score& score = walkers_[rungs_[r].walker].stay.score;
    if (r + 1 < rungs_.size())
      batch.sums[r] += std::exp(tempered(rungs_[r + 1].beta - rungs_[r].beta, score.log_constraint));
    else if (score.satisfied)
      batch.sums[r] += std::exp(-score.log_constraint);
  }
  if (batches_.size() >= kBatches / 2 && batch.rounds == batch_rounds_) estimate_odds();
}

void Tempering::estimate_odds() {
  // The product of the rungs' means, and the sum of their relative variances from the batches' spread.
  if (whole_draws_ == 0) return;
  const double count = static_cast<double>(batches_.size()), whole = static_cast<double>(whole_draws_);
  const double share = whole / static_cast<double>(prior_draws_);
  double probability = share, relative_variance = 0;
  for (std::size_t r = 0; r < rungs_.size(); ++r) {
    double mean = 0, squares = 0;
    for (const Batch& batch : batches_) {
      const double value = batch.sums[r] / static_cast<double>(batch.rounds);
      mean += value / count;
      squares += value * value / count;
    }
    if (!(mean > 0 && std::isfinite(mean))) return;  // p_c is too small for numbers, or nothing was found
    probability *= mean;
    relative_variance += std::max(squares - mean * mean, 0.0) / (mean * mean) / (count - 1);
  }
  relative_variance = std::max(kCaution * relative_variance + (1 - share) / whole, 1e-12);
  OddsTally& odds = counts_.odds;
  odds.basis = OddsBasis::ladder;
  odds.draws = counts_.iteration;
  odds.hits = hits_;
  odds.sum = std::min(probability, 1.0) * static_cast<double>(odds.draws);
  odds.squares = relative_variance * odds.sum * odds.sum;
  odds.largest = relative_variance * odds.sum;
}

// --- Lesson -----------------------------------------------------------------------------------
// The ladder, and who stands on it.

std::optional<LessonKind> Tempering::teach(ByteWriter& out) const {
  if (stage_ != Stage::sampling) return std::nullopt;
  out.put(static_cast<std::uint32_t>(rungs_.size()));
  for (const Rung& rung : rungs_) {
    out.put(rung.beta);
    write_state(out, walkers_[rung.walker].stay.state);
  }
  return LessonKind::place;
}

void Tempering::begin_from(ByteReader& lesson) {
  const auto count = lesson.get<std::uint32_t>();
  if (count < kFewestRungs || count > kMostRungs) throw std::out_of_range("a ladder that cannot be");
  place_on_ladder(count);
  for (std::size_t r = 0; r < count; ++r) {
    rungs_[r].beta = lesson.get<double>();
    if (!(rungs_[r].beta >= (r == 0 ? 0 : rungs_[r - 1].beta) && rungs_[r].beta <= 1))
      throw std::out_of_range("a ladder that cannot be");
    Stay& stay = walkers_[r].stay;
    stay.state = read_state(lesson, target_);
    stay.log_prior = target_.model->log_prior(stay.state);
    if (stay.log_prior == kImpossible) throw std::out_of_range("a replica where there is nothing");
  }
  stage_ = Stage::sampling;
  counts_.is_learning = false;
  publish_rungs();
}

// --- Checkpoint -------------------------------------------------------------------------------

void Tempering::write(ByteWriter& out) const {
  out.put(static_cast<std::uint8_t>(stage_));
  out.put_numbers(pilot_.data(), pilot_.size());
  out.put(static_cast<std::uint32_t>(walkers_.size()));
  for (const Walker& walker : walkers_)
    write_walker(out, walker);
  for (const std::uint64_t lineage : lineages_)
    out.put(lineage);
  out.put(static_cast<std::uint32_t>(rungs_.size()));
  for (const Rung& rung : rungs_) {
    out.put(rung.beta);
    out.put(static_cast<std::uint32_t>(rung.walker));
    out.put(rung.rejected);
    out.put(rung.attempts);
  }
  out.put(static_cast<std::uint32_t>(walker_index_));
  out.put(static_cast<std::uint32_t>(turn_));
  for (const std::uint64_t number :
       {round_, tuned_at_, stage_rounds_, hits_, batch_rounds_, prior_draws_, whole_draws_})
    out.put(number);
  out.put(tunings_);
  out.put(static_cast<std::uint32_t>(found_lineages_.size()));
  for (const std::uint64_t lineage : found_lineages_)
    out.put(lineage);
  out.put(static_cast<std::uint32_t>(batches_.size()));
  for (const Batch& batch : batches_) {
    out.put(batch.rounds);
    out.put_numbers(batch.sums.data(), batch.sums.size());
  }
}

void Tempering::read(ByteReader& in) {
  const auto refuse_unless = [](bool sound) {
    if (!sound) throw std::out_of_range("a ladder that cannot be");
  };
  const auto stage = in.get<std::uint8_t>();
  refuse_unless(stage <= static_cast<std::uint8_t>(Stage::sampling));
  stage_ = static_cast<Stage>(stage);
  in.get_numbers(pilot_);
  refuse_unless(pilot_.size() <= kPilotDraws);
  const auto walkers = in.get<std::uint32_t>();
  refuse_unless(walkers >= 1 && walkers <= kMostRungs);
  walkers_ = std::vector<Walker>(walkers);
  for (Walker& walker : walkers_)
    read_walker(in, target_, walker);
  lineages_.assign(stage_ == Stage::pilot ? 0 : walkers, 0);
  for (std::uint64_t& lineage : lineages_)
    lineage = in.get<std::uint64_t>();
  const auto rungs = in.get<std::uint32_t>();
  refuse_unless(rungs == lineages_.size());
  rungs_.resize(rungs);
  for (Rung& rung : rungs_) {
    rung.beta = in.get<double>();
    rung.walker = in.get<std::uint32_t>();
    rung.rejected = in.get<double>();
    rung.attempts = in.get<std::uint64_t>();
    refuse_unless(rung.walker < walkers && rung.beta >= 0 && rung.beta <= 1 && rung.rejected >= 0);
  }
  refuse_unless(part_ == Part::of_another || counts_.rungs.size() == rungs);
  walker_index_ = in.get<std::uint32_t>();
  turn_ = in.get<std::uint32_t>();
  refuse_unless(walker_index_ < walkers && (rungs == 0 ? turn_ == 0 : turn_ < rungs));
  for (std::uint64_t* number :
       {&round_, &tuned_at_, &stage_rounds_, &hits_, &batch_rounds_, &prior_draws_, &whole_draws_})
    *number = in.get<std::uint64_t>();
  tunings_ = in.get<std::uint32_t>();
  found_lineages_.clear();
  for (auto count = in.get<std::uint32_t>(); count > 0; --count)
    found_lineages_.insert(in.get<std::uint64_t>());
  const auto batches = in.get<std::uint32_t>();
  refuse_unless(batches <= kBatches);
  batches_.assign(batches, {});
  for (Batch& batch : batches_) {
    batch.rounds = in.get<std::uint64_t>();
    in.get_numbers(batch.sums);
    refuse_unless(batch.sums.size() == rungs && batch.rounds > 0);
  }
}

}  // namespace retake
