// See walk.h.
#include "sampler/walk.h"

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

constexpr int kMostInitialDraws = 1'000'000;  // chosen: a support that is missed so often is a wrong model

/// Equal bit for bit, so that absent Variables compare too.
bool identical(const State& left, const State& right) {
  return left.size() == right.size() &&
         std::memcmp(left.data(), right.data(), static_cast<std::size_t>(left.size()) * sizeof(double)) == 0;
}

}  // namespace

Walk::Walk(const Target& target, const ChainSettings& settings, ChainCounts& counts)
    : target_(target),
      settings_(settings),
      counts_(counts),
      // Independent draws have nothing to resume from.
      resumes_(settings.method != Method::rejection) {
  walker_.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
  candidate_score_.measures = walker_.stay.score.measures;
}

void Walk::start(Simulator&) {
  draw_first(walker_, 0);
}

RandomStream Walk::random(Purpose purpose, std::size_t replica) const {
  return RandomStream({.seed = settings_.seed,
                       .chain = settings_.index,
                       .replica = static_cast<std::uint16_t>(replica),
                       .purpose = purpose,
                       .iteration = counts_.iteration,
                       .method = static_cast<std::uint8_t>(settings_.method)});
}

void Walk::draw_first(Walker& walker, std::size_t replica) {
  RandomStream draws = random(Purpose::initial, replica);
  walker.stay.log_prior = kImpossible;
  for (int tries = 0; walker.stay.log_prior == kImpossible; ++tries) {
    if (tries == kMostInitialDraws)
      throw std::runtime_error("no draw from the prior lies within its support");
    target_.model->draw(draws, walker.stay.state);
    walker.stay.log_prior = target_.model->log_prior(walker.stay.state);
  }
  walker.stay.score.measures.assign(target_.measure_names.size(), kAbsent);
}

void Walk::simulate_first(Simulator& simulator, Walker& walker) {
  candidate_ = walker.stay.state;
  candidate_log_prior_ = walker.stay.log_prior;
  if (!simulate_candidate(simulator, nullptr, kImpossible)) {
    candidate_score_.log_constraint = kImpossible;
    candidate_score_.satisfied = false;
  }
  move_to_candidate(walker);
  walker.stay.iteration = 0;
  walker.stay.is_sample = false;
}

bool Walk::step_by(const Kernel& kernel, KernelCounter& counter, RandomStream& draws, double log_u,
                   const Aim& aim, Simulator& simulator, Walker& walker) {
  candidate_ = walker.stay.state;
  const double log_hastings = kernel.propose(*target_.model, walker.stay.state, candidate_, draws);
  if (!is_move(walker, counter)) return false;
  const double needed = needed_for(log_hastings, log_u, aim, walker.stay);
  if (!is_worth_it(needed) || !simulate_candidate(simulator, &walker, needed) || !is_reached(needed, aim))
    return false;
  accept(counter, walker);
  return true;
}

bool Walk::step_by(const ScoredKernel& kernel, const Guide* guide, KernelCounter& counter,
                   RandomStream& draws, double log_u, const Aim& aim, Simulator& simulator, Walker& walker) {
  candidate_ = walker.stay.state;
  const double bound = kernel.propose(*target_.model, simulated(walker), candidate_, draws);
  if (!is_move(walker, counter)) return false;
  const double needed = needed_for(bound, log_u, aim, walker.stay);
  if (!is_worth_it(needed)) return false;

  const bool places = guide && guide->places();
  const std::unique_ptr<Watch> watch = kernel.watch(walker.stay.state, candidate_, draws);
  if (!simulate_candidate(simulator, &walker, places ? kImpossible : needed, watch.get())) return false;
  if (places && !place_candidate(*guide, draws, simulator, needed)) return false;
  if (!is_reached(needed, aim)) return false;

  const double log_hastings = kernel.log_hastings(*target_.model, simulated(walker), simulated_candidate());
  CHECK(log_hastings <= bound + 1e-9, log_hastings, bound);
  if (!is_reached(needed_for(log_hastings, log_u, aim, walker.stay), aim)) return false;
  accept(counter, walker);
  return true;
}

bool Walk::is_move(const Walker& walker, KernelCounter& counter) {
  ++counter.proposed;
  if (!identical(candidate_, walker.stay.state)) {
    candidate_log_prior_ = target_.model->log_prior(candidate_);
    return true;
  }
  ++counter.accepted;
  ++counts_.accepted;
  return false;
}

double Walk::needed_for(double log_hastings, double log_u, const Aim& aim, const Stay& stay) const {
  if (candidate_log_prior_ == kImpossible) return std::numeric_limits<double>::infinity();
  const double log_missing = log_u - (candidate_log_prior_ - stay.log_prior) - log_hastings;
  double needed = std::numeric_limits<double>::infinity();
  if (aim.beta > 0 && stay.score.log_constraint == kImpossible)
    needed = kImpossible;  // away from where no chain has been, whatever the way back
  else if (aim.beta > 0)
    needed = stay.score.log_constraint + log_missing / aim.beta;
  else if (log_missing < 0)
    needed = kImpossible;
  if (aim.conditional) needed = std::max(needed, needed_to_satisfy());
  CHECK(!std::isnan(needed), candidate_log_prior_, log_hastings, stay.score.log_constraint);
  return needed;
}

bool Walk::is_worth_it(double needed) const {
  // Outside the support, or where log_constraint <= 0 cannot reach it, the answer is known.
  const bool hopeless = needed >= 0;
  return settings_.early_rejection ? !hopeless : candidate_log_prior_ != kImpossible;
}

bool Walk::is_reached(double needed, const Aim& aim) const {
  return candidate_score_.log_constraint > needed && (!aim.conditional || candidate_score_.satisfied);
}

void Walk::accept(KernelCounter& counter, Walker& walker) {
  ++counter.accepted;
  ++counts_.accepted;
  move_to_candidate(walker);
}

bool Walk::simulate_candidate(Simulator& simulator, const Walker* walker, double needed, Watch* watch) {
  if (!candidate_run_ && resumes_) {
    candidate_run_ = simulator.make_run();
    resumes_ = candidate_run_ != nullptr;
  }
  SimulationRequest request{.needed = settings_.early_rejection ? needed : kImpossible,
                            .current_state = nullptr,
                            .current_run = nullptr,
                            .record = candidate_run_.get(),
                            .watch = watch};
  if (walker && walker->run) {
    request.current_state = &walker->stay.state;
    request.current_run = walker->run.get();
  }
  const SimulationOutcome outcome = simulator.simulate(candidate_, request, candidate_score_);
  ++counts_.simulations;
  counts_.simulated_seconds += outcome.simulated_seconds;
  counts_.skipped_seconds += outcome.skipped_seconds;
  if (outcome.end == SimulationEnd::failed) ++counts_.failed_simulations;
  if (outcome.end != SimulationEnd::complete) return false;
  CHECK(candidate_score_.log_constraint <= 0, candidate_score_.log_constraint);
  return true;
}

void Walk::move_to_candidate(Walker& walker) {
  Stay& stay = walker.stay;
  ended_weight_ = stay.weight;
  std::swap(stay.state, candidate_);
  std::swap(stay.score, candidate_score_);
  std::swap(walker.run, candidate_run_);
  stay.log_prior = candidate_log_prior_;
  stay.iteration = counts_.iteration;
  stay.weight = 1;
  stay.is_sample = stay.score.satisfied;
  walker.was_simulated = true;
}

bool Walk::place_candidate(const Guide& guide, RandomStream& draws, Simulator& simulator, double needed) {
  std::swap(drawn_.stay.state, candidate_);
  std::swap(drawn_.stay.score, candidate_score_);
  std::swap(drawn_.run, candidate_run_);
  candidate_ = drawn_.stay.state;
  candidate_score_.measures.resize(drawn_.stay.score.measures.size());
  return guide.place(simulated(drawn_), candidate_, draws) && simulate_candidate(simulator, &drawn_, needed);
}

void Walk::renew_run(Simulator& simulator, Walker& walker) {
  candidate_ = walker.stay.state;
  const std::uint64_t simulations = counts_.simulations, failed = counts_.failed_simulations;
  simulate_candidate(simulator, nullptr, kImpossible);
  counts_.simulations = simulations;
  counts_.failed_simulations = failed;
  std::swap(walker.run, candidate_run_);
}

double Walk::needed_to_satisfy() const {
  // A little below the least, so that rounding never discards a hit.
  const double least = target_.least_satisfied;
  return std::isfinite(least) ? least - 1e-9 * (1 + std::abs(least)) : kImpossible;
}

// --- Checkpoint -------------------------------------------------------------------------------
// All draws are addressed by the iteration, so walkers are nearly all there is.

void Walk::write(ByteWriter& out) const {
  write_walker(out, walker_);
}

void Walk::read(ByteReader& in) {
  read_walker(in, target_, walker_);
  if (counts_.iteration > 0 && walker_.stay.state.size() == 0)
    throw std::out_of_range("a walker that stands nowhere");
}

void Walk::begin_from(ByteReader&) {
  throw std::out_of_range("this method learns nothing");
}

void write_state(ByteWriter& out, const State& state) {
  out.put_numbers(state.data(), static_cast<std::size_t>(state.size()));
}

State read_state(ByteReader& in, const Target& target) {
  State state;
  in.get_numbers(state);
  if (static_cast<std::size_t>(state.size()) != target.model->size())
    throw std::out_of_range("other variables");
  return state;
}

void write_walker(ByteWriter& out, const Walker& walker) {
  const Stay& stay = walker.stay;
  out.put(static_cast<std::uint8_t>(walker.was_simulated));
  out.put(stay.iteration);
  out.put(stay.weight);
  out.put(static_cast<std::uint8_t>(stay.is_sample));
  out.put(stay.log_prior);
  out.put(stay.score.log_constraint);
  out.put(static_cast<std::uint8_t>(stay.score.satisfied));
  write_state(out, stay.state);
  out.put_numbers(stay.score.measures.data(), stay.score.measures.size());
}

void read_walker(ByteReader& in, const Target& target, Walker& walker) {
  Stay& stay = walker.stay;
  walker.was_simulated = in.get<std::uint8_t>() != 0;
  stay.iteration = in.get<std::uint64_t>();
  stay.weight = in.get<std::uint64_t>();
  stay.is_sample = in.get<std::uint8_t>() != 0;
  stay.log_prior = in.get<double>();
  stay.score.log_constraint = in.get<double>();
  stay.score.satisfied = in.get<std::uint8_t>() != 0;
  in.get_numbers(stay.state);
  in.get_numbers(stay.score.measures);
  const auto variables = static_cast<std::size_t>(stay.state.size());
  const bool may_be_none = !walker.was_simulated;
  if (!(variables == target.model->size() || (variables == 0 && may_be_none)) ||
      stay.score.measures.size() != target.measure_names.size())
    throw std::out_of_range("other variables or measures");
}

}  // namespace retake
