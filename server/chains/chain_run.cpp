// See chain_run.h.
#include "server/chains/chain_run.h"

#include <cmath>
#include <utility>

#include "sampler/check.h"
#include "server/chains/measures.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::duration<double> kBetweenClocks{
    0.0005};                         // chosen: reading the clock then costs nothing
constexpr double kRateMemory = 1.0;  // [s] over which the shown iterations per second are averaged

Chain make_chain(const Scenario& scenario, const ChainRecord& record, const ChainRun::Stored& stored) {
  const auto ratios = ratios_from(record.ratios);
  CHECK(ratios.has_value(), record.ratios);
  auto target = scenario.target(*ratios);
  ChainSettings settings = settings_of(record);
  settings.lesson = stored.lesson;
  return stored.checkpoint.empty() ? Chain(std::move(target), settings)
                                   : Chain(std::move(target), settings, stored.checkpoint);
}

/// Whether the stop rule by effective samples is looked at when there are so many samples.
bool is_judged_at(std::uint64_t samples) {
  std::uint64_t place = 8;  // chosen; effective_samples() says from where on there is a size
  while (place < samples)
    place += (place + 3) / 4;  // a quarter more, rounded up
  return place == samples;
}

}  // namespace

ChainSettings settings_of(const ChainRecord& record) {
  const auto method = method_from(record.method);
  CHECK(method.has_value(), record.method);
  return {.seed = record.seed, .index = record.index, .method = *method};
}

ChainRun::ChainRun(std::shared_ptr<const Scenario> scenario, ChainRecord record, const Stored& stored)
    : scenario_(std::move(scenario)),
      record_(std::move(record)),
      chain_(make_chain(*scenario_, record_, stored)),
      trace_(scenario_->measures(), stored.trace_blocks),
      was_learning_(chain_.counts().is_learning) {
  standings_.resize(chain_.walkers());
  for (std::size_t walker = 0; walker < standings_.size(); ++walker) {
    const Stay& stay = chain_.stay(walker);
    if (!stay.is_sample) continue;
    if (stay.weight > 0)
      standings_[walker] = {
          .place = Standing::Place::on_handed_over, .iteration = stay.iteration, .told = stay.weight};
    // The last step found the sample, so the chain has not gone on since.
    awaits_judgement_ =
        awaits_judgement_ || (record_.stop.ess && stay.iteration == chain_.counts().iteration &&
                              is_judged_at(chain_.counts().samples));
  }
  update_counters();
}

void ChainRun::step_for(Scenario::Performer& performer, std::chrono::duration<double> time,
                        std::size_t most_samples) {
  check_context() = {
      .scenario = record_.scenario, .chain = record_.id, .iteration = chain_.counts().iteration};
  const Clock::time_point begin = Clock::now();
  const double seconds_before = record_.counters.run_seconds;
  const std::uint64_t iteration_before = chain_.counts().iteration;
  std::chrono::duration<double> elapsed{0};
  const auto may_go_on = [&] {
    return ended_by().empty() && !awaits_judgement_ && samples_.size() < most_samples;
  };
  while (may_go_on() && elapsed < time) {
    const Clock::time_point round = Clock::now();
    for (std::uint64_t i = 0; i < steps_between_clocks_; ++i) {
      step(performer);
      if (!may_go_on()) break;
    }
    const Clock::time_point now = Clock::now();
    elapsed = now - begin;
    record_.counters.run_seconds = seconds_before + elapsed.count();
    // A round that was cut short says nothing of how many steps fit.
    if (now - round < kBetweenClocks / 2 && may_go_on())
      steps_between_clocks_ *= 2;
    else if (now - round > kBetweenClocks && steps_between_clocks_ > 1)
      steps_between_clocks_ /= 2;
  }

  // The rate, as an exponential average over the running time.
  if (elapsed.count() > 0) {
    const double rate = static_cast<double>(chain_.counts().iteration - iteration_before) / elapsed.count();
    const double keep = iteration_before == 0 ? 0 : std::exp(-elapsed.count() / kRateMemory);
    double& shown = record_.counters.iterations_per_second;
    shown = keep * shown + (1 - keep) * rate;
  }
  update_counters();
  check_context() = {};
}

std::string_view limit_reached(const StopRule& stop, const ChainCounts& counts,
                               const ChainCounters& counters) {
  if (stop.samples && counts.samples >= *stop.samples) return "samples";
  if (stop.counted && counters.counted >= *stop.counted) return "counted";
  if (stop.iterations && counts.iteration >= *stop.iterations) return "iterations";
  if (stop.seconds && counters.run_seconds >= *stop.seconds) return "seconds";
  return {};
}

std::string_view ChainRun::ended_by() const {
  if (reached_ess_) return "ess";
  return limit_reached(record_.stop, chain_.counts(), record_.counters);
}

void ChainRun::judge(std::optional<double> effective_samples) {
  CHECK(awaits_judgement_, record_.counters.samples);
  awaits_judgement_ = false;
  record_.counters.effective_samples = effective_samples;
  reached_ess_ = effective_samples && *effective_samples >= static_cast<double>(*record_.stop.ess);
}

void ChainRun::step(Scenario::Performer& performer) {
  if (chain_.step(performer)) {
    standings_.resize(chain_.walkers());
    close_stay(standings_[chain_.walker()], chain_.ended_weight());
    if (chain_.stay().is_sample) record_sample(performer);
  }
  trace_.record(chain_);
}

void ChainRun::record_sample(Scenario::Performer& performer) {
  const Stay& stay = chain_.stay();
  const auto replica = static_cast<std::uint32_t>(chain_.walker());
  const Scenario::Performer::Take take = performer.perform(stay.state);
  // The score is a pure function of the State, recorded or not.
  CHECK(take.complete && take.score.log_constraint == stay.score.log_constraint, take.score.log_constraint,
        stay.score.log_constraint);
  NewSample sample;
  sample.record.id = sample_id(record_.id, stay.iteration, replica);
  sample.record.scenario = record_.scenario;
  sample.record.chain = record_.id;
  sample.record.iteration = stay.iteration;
  sample.record.replica = replica;
  sample.record.weight = stay.weight;
  sample.record.log_prior = stay.log_prior;
  sample.record.log_constraint = stay.score.log_constraint;
  sample.record.duration = take.animation.duration();
  sample.record.measures = measures_json(scenario_->measures(), take.score.measures).dump();
  sample.record.digest = digest(stay.state, take.animation);
  sample.state = encode_state(stay.state);
  sample.animation = encode_animation(take.animation);
  samples_.push_back(std::move(sample));
  // What was found while learning keeps weight 0: nothing more is to be said of it.
  if (stay.weight > 0) {
    ++record_.counters.counted;
    standings_[replica] = {
        .place = Standing::Place::on_gathered, .gathered = samples_.size() - 1, .iteration = stay.iteration};
  }
  awaits_judgement_ = record_.stop.ess && is_judged_at(chain_.counts().samples);
  if (chain_.counts().samples == 1) {
    record_.counters.first_sample_iteration = stay.iteration;
    record_.counters.first_sample_seconds = record_.counters.run_seconds;
  }
}

/// Notes the weight that the sample on which a walker stood has reached.
void ChainRun::close_stay(Standing& standing, std::uint64_t weight) {
  if (standing.place == Standing::Place::on_gathered) samples_[standing.gathered].record.weight = weight;
  if (standing.place == Standing::Place::on_handed_over && weight != standing.told)
    weights_.push_back({.iteration = standing.iteration,
                        .replica = static_cast<std::uint32_t>(&standing - standings_.data()),
                        .weight = weight});
  standing.place = Standing::Place::on_no_sample;
}

void ChainRun::update_counters() {
  const ChainCounts& counts = chain_.counts();
  ChainCounters& counters = record_.counters;
  static_cast<ChainCounts&>(counters) = counts;
  // Independent samples need no judgement.
  if (chain_.settings().method == Method::rejection)
    counters.effective_samples = static_cast<double>(counts.samples);
}

std::optional<Lesson> ChainRun::take_lesson(bool is_last) {
  const bool is_learning = chain_.counts().is_learning;
  const bool has_just_learned = was_learning_ && !is_learning;
  was_learning_ = is_learning;
  if (!has_just_learned && !is_last) return std::nullopt;
  std::optional<Lesson> lesson = chain_.lesson();
  if (!lesson.has_value()) return lesson;
  const bool is_due = lesson->kind == LessonKind::proposal ? has_just_learned : is_last;
  return is_due ? std::move(lesson) : std::nullopt;
}

ChainProgress ChainRun::take_progress(bool is_last) {
  for (std::size_t walker = 0; walker < standings_.size(); ++walker) {
    Standing& standing = standings_[walker];
    if (standing.place == Standing::Place::on_no_sample) continue;
    const std::uint64_t weight = chain_.stay(walker).weight;
    close_stay(standing, weight);
    standing.place = Standing::Place::on_handed_over;
    standing.told = weight;
  }
  ChainProgress progress;
  progress.chain = record_.id;
  progress.scenario = record_.scenario;
  progress.samples = std::exchange(samples_, {});
  progress.weights = std::exchange(weights_, {});
  progress.counters = record_.counters;
  progress.checkpoint = chain_.checkpoint();
  progress.lesson = take_lesson(is_last);
  Trace::Block block = trace_.take_block();
  progress.trace_block = std::move(block.bytes);
  progress.replace_trace = block.replace;
  return progress;
}

}  // namespace retake
