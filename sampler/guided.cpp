// See guided.h.
#include "sampler/guided.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

enum Counters : std::size_t { kBuilding, kFirstKernel };

// In sweeps; chosen.
constexpr std::uint64_t kBurnIn = 100;
constexpr std::uint64_t kLongestBurnIn = 1000;
constexpr std::uint64_t kBetweenLooks = 5;
constexpr std::uint64_t kBetweenSoft = 50;
// Satisfied States of a soft stretch, in fractions of a sweep: they cost several times as much.
constexpr std::uint64_t kSoftFraction = 2;
// Chosen: a start is forgotten after so many animations unlike the one before.
constexpr std::uint64_t kRenewals = 12;
// From sample to sample, in mean times between such changes. At twice 64 of 100 samples of three dice within
// 4 mm were like none before.
constexpr std::uint64_t kApart = 4;
// Looks; chosen: where animations hardly change, a sample shall still not take longer.
constexpr std::uint64_t kLongestInterval = 40;

/// Throws: std::out_of_range.
std::uint64_t read_interval(ByteReader& in) {
  const auto interval = in.get<std::uint64_t>();
  if (interval < 1 || interval > kLongestInterval) throw std::out_of_range("an interval that cannot be");
  return interval;
}

}  // namespace

Guided::Guided(const Target& target, const ChainSettings& settings, ChainCounts& counts)
    : Walk(target, settings, counts), guide_(*target.guide) {
  noted_.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
  counts_.is_learning = true;
}

std::vector<std::string> Guided::kernel_names(const Guide& guide) {
  std::vector<std::string> names = {"build"};
  for (const auto& row : guide.kernels().rows())
    names.push_back(row.name);
  for (const auto& row : guide.soft_kernels().rows())
    names.push_back("soft_" + row.name);
  return names;
}

void Guided::start(Simulator& simulator) {
  if (!place_) return start_building(simulator);
  walker_.stay.state = *std::exchange(place_, std::nullopt);
  walker_.stay.log_prior = target_.model->log_prior(walker_.stay.state);
  simulate_first(simulator, walker_);
  // On another kind of processor last digits may differ, and what just satisfied there may just not do so.
  if (!walker_.stay.score.satisfied || walker_.stay.log_prior == kImpossible) {
    phase_ = Phase::building;
    counts_.is_learning = true;
    return start_building(simulator);
  }
  noted_.stay = walker_.stay;
  noted_.stay.weight = 0;
}

void Guided::start_building(Simulator& simulator) {
  RandomStream draws = random(Purpose::initial);
  guide_.begin(*target_.model, walker_.stay.state, draws);
  walker_.stay.log_prior = target_.model->log_prior(walker_.stay.state);
  CHECK(walker_.stay.log_prior != kImpossible);
  walker_.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
  simulate_first(simulator, walker_);
  noted_.stay = walker_.stay;
  noted_.stay.weight = 0;
}

bool Guided::step(Simulator& simulator) {
  if (guide_.reads_runs() && !walker_.run) renew_run(simulator, walker_);
  switch (phase_) {
    case Phase::building:
      build(simulator);
      break;
    case Phase::burning_in:
    case Phase::sampling:
      move(guide_.kernels(), kFirstKernel, true, simulator);
      break;
    case Phase::soft_stretch:
      move(guide_.soft_kernels(), kFirstKernel + guide_.kernels().rows().size(), false, simulator);
      break;
  }
  return walker_.stay.score.satisfied && go_on(simulator);
}

void Guided::build(Simulator& simulator) {
  RandomStream draws = random(Purpose::proposal);
  KernelCounter& counter = counts_.kernels[kBuilding];
  ++counter.proposed;
  candidate_ = walker_.stay.state;
  guide_.extend(*target_.model, simulated(walker_), vain_tries_, candidate_, draws);
  candidate_log_prior_ = target_.model->log_prior(candidate_);
  ++vain_tries_;
  const std::unique_ptr<Watch> watch = guide_.watch(simulated(walker_), candidate_, draws);
  if (candidate_log_prior_ == kImpossible ||
      !simulate_candidate(simulator, &walker_, kImpossible, watch.get()) ||
      !guide_.keeps(simulated(walker_), simulated_candidate()))
    return;
  vain_tries_ = 0;
  ++counter.accepted;
  ++counts_.accepted;
  move_to_candidate(walker_);
  if (!guide_.places() || walker_.stay.score.satisfied) return;
  candidate_ = walker_.stay.state;
  if (guide_.place(simulated(walker_), candidate_, draws) &&
      simulate_candidate(simulator, &walker_, kImpossible))
    move_to_candidate(walker_);
}

void Guided::move(const ScoredKernelTable& kernels, std::size_t first_counter, bool conditional,
                  Simulator& simulator) {
  RandomStream draws = random(Purpose::proposal);
  const std::size_t row = kernels.choose(draws.uniform());
  step_by(*kernels.rows()[row].kernel, &guide_, counts_.kernels[first_counter + row], draws,
          std::log(random(Purpose::acceptance).uniform()), {.conditional = conditional}, simulator, walker_);
}

/// The walk stands on a satisfied State, where it met one more. True if it notes a sample.
bool Guided::go_on(Simulator& simulator) {
  const std::uint64_t sweep = guide_.sweep();
  ++met_;
  ++since_note_;
  const auto enter = [&](Phase phase) {
    phase_ = phase;
    met_ = 0;
  };
  switch (phase_) {
    case Phase::building:
      enter(Phase::burning_in);
      since_note_ = 0;
      left_.stay = walker_.stay;
      return note();  // nobody shall wait until it has burned in
    case Phase::burning_in:
      if (since_note_ < kBetweenLooks * sweep) return false;
      since_note_ = 0;
      if (met_ < kLongestBurnIn * sweep && (met_ < kBurnIn * sweep || renewals_ < kRenewals))
        return look_back(simulator) && std::has_single_bit(renewals_) && note();
      end_burning_in();
      enter(Phase::sampling);
      return note();
    case Phase::sampling:
      if (met_ == kBetweenSoft * sweep && !guide_.soft_kernels().rows().empty()) enter(Phase::soft_stretch);
      break;
    case Phase::soft_stretch:
      if (met_ > sweep / kSoftFraction) enter(Phase::sampling);
      break;
  }
  if (since_note_ < interval_ * kBetweenLooks * sweep) return false;
  since_note_ = 0;
  return note();
}

/// True if the animation has become another one since it did so last.
bool Guided::look_back(Simulator& simulator) {
  ++looks_;
  if (guide_.reads_runs() && !left_.run) renew_run(simulator, left_);
  if (!guide_.differ(*target_.model, simulated(left_), simulated(walker_))) return false;
  ++renewals_;
  left_.stay = walker_.stay;
  left_.run.reset();
  return true;
}

/// Where every look finds another animation, so does every sample; else there is time for several changes
/// between two, so that most samples are like none before.
void Guided::end_burning_in() {
  counts_.is_learning = false;
  const std::uint64_t looks = kApart * (looks_ - renewals_) + renewals_;
  interval_ = std::clamp<std::uint64_t>(looks / std::max<std::uint64_t>(renewals_, 1), 1, kLongestInterval);
  left_ = Walker();
}

/// True if the walk has moved since it was noted last.
bool Guided::note() {
  Stay& noted = noted_.stay;
  // What weighed nothing while it burned in is noted anew.
  const bool counts = !counts_.is_learning;
  const bool is_new =
      walker_.stay.iteration != moved_at_ || !noted.is_sample || (counts && noted.weight == 0);
  if (!is_new) {
    noted.weight += counts ? 1 : 0;
    return false;
  }
  ended_weight_ = noted.weight;
  moved_at_ = walker_.stay.iteration;
  noted = walker_.stay;
  noted.iteration = counts_.iteration;
  noted.weight = counts ? 1 : 0;
  noted.is_sample = true;
  ++counts_.samples;
  return true;
}

// --- Lesson -----------------------------------------------------------------------------------
// The State that was noted last, and the interval between samples.

std::optional<LessonKind> Guided::teach(ByteWriter& out) const {
  if (counts_.is_learning || !noted_.stay.is_sample) return std::nullopt;
  write_state(out, noted_.stay.state);
  out.put(interval_);
  return LessonKind::place;
}

void Guided::begin_from(ByteReader& lesson) {
  place_ = read_state(lesson, target_);
  interval_ = read_interval(lesson);
  phase_ = Phase::sampling;
  counts_.is_learning = false;
}

// --- Checkpoint -------------------------------------------------------------------------------

void Guided::write(ByteWriter& out) const {
  Walk::write(out);
  write_walker(out, noted_);
  out.put(static_cast<std::uint8_t>(phase_));
  out.put(vain_tries_);
  out.put(met_);
  out.put(since_note_);
  out.put(moved_at_);
  out.put(interval_);
  if (phase_ != Phase::burning_in) return;
  write_walker(out, left_);
  out.put(looks_);
  out.put(renewals_);
}

void Guided::read(ByteReader& in) {
  Walk::read(in);
  read_walker(in, target_, noted_);
  const auto phase = in.get<std::uint8_t>();
  if (phase > static_cast<std::uint8_t>(Phase::soft_stretch))
    throw std::out_of_range("a phase that cannot be");
  phase_ = static_cast<Phase>(phase);
  vain_tries_ = in.get<std::uint64_t>();
  met_ = in.get<std::uint64_t>();
  since_note_ = in.get<std::uint64_t>();
  moved_at_ = in.get<std::uint64_t>();
  interval_ = read_interval(in);
  if (phase_ == Phase::burning_in) {
    read_walker(in, target_, left_);
    looks_ = in.get<std::uint64_t>();
    renewals_ = in.get<std::uint64_t>();
  }
  if (counts_.iteration > 0 && (!walker_.was_simulated || noted_.stay.state.size() == 0))
    throw std::out_of_range("a walk that stands nowhere");
}

}  // namespace retake
