// See chain.h.
#include "sampler/chain.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "sampler/bytes.h"
#include "sampler/check.h"

namespace retake {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();
constexpr std::uint32_t kCheckpointVersion = 1;
constexpr int kMostInitialDraws = 1'000'000;  // chosen: a support that is missed so often is a wrong model

/// Equal bit for bit, so that absent Variables compare too.
bool identical(const State& left, const State& right) {
  return left.size() == right.size() &&
         std::memcmp(left.data(), right.data(), static_cast<std::size_t>(left.size()) * sizeof(double)) == 0;
}

}  // namespace

std::string_view to_string(Method method) {
  switch (method) {
    case Method::metropolis:
      return "metropolis";
    case Method::rejection:
      return "rejection";
    case Method::conditional:
      return "conditional";
    case Method::tempering:
      return "tempering";
  }
  return "";
}

std::optional<Method> method_from(std::string_view name) {
  for (const Method method : {Method::metropolis, Method::rejection, Method::conditional, Method::tempering})
    if (to_string(method) == name) return method;
  return std::nullopt;
}

std::string_view to_string(Ratios ratios) {
  return ratios == Ratios::exact ? "exact" : "paper";
}

std::optional<Ratios> ratios_from(std::string_view name) {
  for (const Ratios ratios : {Ratios::exact, Ratios::paper})
    if (to_string(ratios) == name) return ratios;
  return std::nullopt;
}

Chain::Chain(std::shared_ptr<const Target> target, const ChainSettings& settings)
    : target_(std::move(target)), settings_(settings) {
  counts_.kernels.resize(settings_.method == Method::rejection ? 1 : target_->kernels.rows().size());
  stay_.score.measures.assign(target_->measure_names.size(), kAbsent);
  candidate_score_.measures = stay_.score.measures;
}

std::vector<std::string> Chain::kernel_names() const {
  if (settings_.method == Method::rejection) return {"prior"};
  std::vector<std::string> names;
  for (const WeightedKernel& row : target_->kernels.rows())
    names.push_back(row.name);
  return names;
}

RandomStream Chain::random(Purpose purpose) const {
  return RandomStream({.seed = settings_.seed,
                       .chain = settings_.index,
                       .replica = 0,
                       .purpose = purpose,
                       .iteration = counts_.iteration});
}

bool Chain::step(Simulator& simulator) {
  if (counts_.iteration == 0) start(simulator);
  ++counts_.iteration;
  check_context().iteration = counts_.iteration;
  return settings_.method == Method::metropolis ? step_metropolis(simulator) : step_rejection(simulator);
}

void Chain::start(Simulator& simulator) {
  // Line 1 of the paper's algorithm: the initial State is a draw from the prior, within its support.
  RandomStream draws = random(Purpose::initial);
  stay_.log_prior = kNothing;
  for (int tries = 0; stay_.log_prior == kNothing; ++tries) {
    if (tries == kMostInitialDraws)
      throw std::runtime_error("no draw from the prior lies within its support");
    target_->model->draw(draws, stay_.state);
    stay_.log_prior = target_->model->log_prior(stay_.state);
  }
  // Rejection needs no place to start from.
  if (settings_.method == Method::rejection) return;
  std::swap(candidate_, stay_.state);
  candidate_log_prior_ = stay_.log_prior;
  if (!simulate_candidate(simulator, kNothing)) candidate_score_.log_constraint = kNothing;
  move_to_candidate();
  stay_.is_sample = false;
}

bool Chain::step_metropolis(Simulator& simulator) {
  const std::uint64_t iteration = counts_.iteration;

  // Propose.
  RandomStream draws = random(Purpose::proposal);
  const std::size_t row = target_->kernels.choose(draws.uniform());
  KernelCounter& counter = counts_.kernels[row];
  candidate_ = stay_.state;
  const double log_hastings =
      target_->kernels.rows()[row].kernel->propose(*target_->model, stay_.state, candidate_, draws);
  ++counter.proposed;
  if (identical(candidate_, stay_.state)) {
    ++counter.accepted;
    ++counts_.accepted;
    ++stay_.weight;
    return false;
  }

  // What the candidate's log_constraint has to exceed, strictly, to be accepted; u is drawn before
  // simulating.
  candidate_log_prior_ = target_->model->log_prior(candidate_);
  const double log_u = std::log(random(Purpose::acceptance).uniform());
  const double needed =
      candidate_log_prior_ == kNothing
          ? std::numeric_limits<double>::infinity()
          : stay_.score.log_constraint + (log_u - (candidate_log_prior_ - stay_.log_prior) - log_hastings);
  CHECK(!std::isnan(needed), candidate_log_prior_, log_hastings, stay_.score.log_constraint);

  // Simulate, unless the answer is known already: outside the support, or log_constraint <= 0 cannot reach
  // it.
  const bool hopeless = needed >= 0;
  const bool simulate = settings_.early_rejection ? !hopeless : candidate_log_prior_ != kNothing;
  if (!simulate || !simulate_candidate(simulator, settings_.early_rejection ? needed : kNothing) ||
      !(candidate_score_.log_constraint > needed)) {
    ++stay_.weight;
    return false;
  }

  // Accept.
  ++counter.accepted;
  ++counts_.accepted;
  move_to_candidate();
  stay_.iteration = iteration;
  if (stay_.is_sample) ++counts_.samples;
  return true;
}

bool Chain::step_rejection(Simulator& simulator) {
  // Draw from the prior.
  RandomStream draws = random(Purpose::proposal);
  KernelCounter& counter = counts_.kernels[0];
  ++counter.proposed;
  target_->model->draw(draws, candidate_);
  candidate_log_prior_ = target_->model->log_prior(candidate_);
  if (candidate_log_prior_ == kNothing) return false;

  // Keep with probability p_c.
  const double needed = std::log(random(Purpose::acceptance).uniform());
  if (!simulate_candidate(simulator, settings_.early_rejection ? needed : kNothing) ||
      !(candidate_score_.log_constraint > needed))
    return false;
  ++counter.accepted;
  ++counts_.accepted;
  move_to_candidate();
  stay_.iteration = counts_.iteration;
  if (stay_.is_sample) ++counts_.samples;
  return true;
}

bool Chain::simulate_candidate(Simulator& simulator, double needed) {
  // Independent draws have nothing to resume from.
  if (!candidate_run_ && resumes_) {
    if (settings_.method == Method::metropolis) candidate_run_ = simulator.make_run();
    resumes_ = candidate_run_ != nullptr;
  }
  SimulationRequest request{
      .needed = needed, .current_state = nullptr, .current_run = nullptr, .record = candidate_run_.get()};
  if (stay_run_) {
    request.current_state = &stay_.state;
    request.current_run = stay_run_.get();
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

void Chain::move_to_candidate() {
  std::swap(stay_.state, candidate_);
  std::swap(stay_.score, candidate_score_);
  std::swap(stay_run_, candidate_run_);
  stay_.log_prior = candidate_log_prior_;
  stay_.weight = 1;
  stay_.is_sample = stay_.score.satisfied;
}

// --- Checkpoint -------------------------------------------------------------------------------
// version, seed, index, method; counts; the stay. All draws are addressed by the iteration, so there is
// nothing else.

std::string Chain::checkpoint() const {
  ByteWriter out;
  out.put(kCheckpointVersion);
  out.put(settings_.seed);
  out.put(settings_.index);
  out.put(static_cast<std::uint8_t>(settings_.method));
  out.put(counts_.iteration);
  out.put(counts_.accepted);
  out.put(counts_.samples);
  out.put(counts_.simulations);
  out.put(counts_.failed_simulations);
  out.put(counts_.simulated_seconds);
  out.put(counts_.skipped_seconds);
  out.put(static_cast<std::uint32_t>(counts_.kernels.size()));
  for (const KernelCounter& kernel : counts_.kernels) {
    out.put(kernel.proposed);
    out.put(kernel.accepted);
  }
  out.put(stay_.iteration);
  out.put(stay_.weight);
  out.put(static_cast<std::uint8_t>(stay_.is_sample));
  out.put(stay_.log_prior);
  out.put(stay_.score.log_constraint);
  out.put(static_cast<std::uint8_t>(stay_.score.satisfied));
  out.put_numbers(stay_.state.data(), static_cast<std::size_t>(stay_.state.size()));
  out.put_numbers(stay_.score.measures.data(), stay_.score.measures.size());
  return out.take();
}

Chain::Chain(std::shared_ptr<const Target> target, const ChainSettings& settings, std::string_view checkpoint)
    : Chain(std::move(target), settings) {
  try {
    ByteReader in(checkpoint);
    if (in.get<std::uint32_t>() != kCheckpointVersion) throw std::out_of_range("unknown version");
    if (in.get<std::uint64_t>() != settings.seed || in.get<std::uint32_t>() != settings.index ||
        in.get<std::uint8_t>() != static_cast<std::uint8_t>(settings.method))
      throw std::out_of_range("it belongs to a chain with other settings");
    counts_.iteration = in.get<std::uint64_t>();
    counts_.accepted = in.get<std::uint64_t>();
    counts_.samples = in.get<std::uint64_t>();
    counts_.simulations = in.get<std::uint64_t>();
    counts_.failed_simulations = in.get<std::uint64_t>();
    counts_.simulated_seconds = in.get<double>();
    counts_.skipped_seconds = in.get<double>();
    if (in.get<std::uint32_t>() != counts_.kernels.size()) throw std::out_of_range("other kernels");
    for (KernelCounter& kernel : counts_.kernels) {
      kernel.proposed = in.get<std::uint64_t>();
      kernel.accepted = in.get<std::uint64_t>();
    }
    stay_.iteration = in.get<std::uint64_t>();
    stay_.weight = in.get<std::uint64_t>();
    stay_.is_sample = in.get<std::uint8_t>() != 0;
    stay_.log_prior = in.get<double>();
    stay_.score.log_constraint = in.get<double>();
    stay_.score.satisfied = in.get<std::uint8_t>() != 0;
    in.get_numbers(stay_.state);
    in.get_numbers(stay_.score.measures);
    const auto variables = counts_.iteration == 0 ? 0 : target_->model->size();
    if (static_cast<std::size_t>(stay_.state.size()) != variables ||
        stay_.score.measures.size() != target_->measure_names.size() || !in.at_end())
      throw std::out_of_range("other variables or measures");
  } catch (const std::out_of_range& fault) {
    throw std::runtime_error(std::string("chain checkpoint cannot be read: ") + fault.what());
  }
}

}  // namespace retake
