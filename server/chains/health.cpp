// See health.h.
#include "server/chains/health.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sampler/check.h"
#include "sampler/spread.h"
#include "server/chains/quantities.h"

namespace retake {
namespace {

constexpr std::size_t kFewestDraws = 4;   // a chain; below, R-hat is not defined
constexpr std::size_t kFewestChains = 4;  // chosen: fewer means say too little of their spread
// Samples of a chain below which it has no effective size, as the estimate's floor does not look at them, and
// draws of all chains below which R-hat says nothing but noise. Chosen.
constexpr std::size_t kFewestSamples = 24;
constexpr std::size_t kJudgedDraws = 4000;  // chosen: four for each effective sample that may be wished
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// How many samples draws of one chain are of, which come several times where a sample weighs much. They are
/// worth no more than these, whatever a short or anti-correlated stretch lets the estimate say.
std::size_t distinct(const std::vector<DrawRecord>& draws) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < draws.size(); ++i)
    count += i == 0 || draws[i].state != draws[i - 1].state;
  return count;
}

double ess_within(const ChainDraws& draws) {
  double sum = 0;
  bool any = false;
  for (const Eigen::VectorXd& chain : draws) {
    const double ess = ess_bulk({chain});
    if (!std::isfinite(ess)) continue;
    sum += ess;
    any = true;
  }
  return any ? sum : kNaN;
}

/// The draws of the chains that are counted.
struct Counted {
  std::vector<const ChainRecord*> chains;
  std::vector<std::vector<DrawRecord>> draws;
};

/// Whether a chain follows p(A | satisfied), and not what the paper's ratios lead to.
bool is_exact(const ChainRecord& chain) {
  return chain.ratios != to_string(Ratios::paper);
}

/// The paper's ratios follow another law: their chains are looked at by themselves, where there are no
/// others.
Counted counted_chains(const std::vector<ChainRecord>& chains,
                       const std::vector<std::vector<DrawRecord>>& draws) {
  const bool any_exact = std::ranges::any_of(chains, is_exact);
  Counted counted;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    if (is_exact(chains[i]) != any_exact || draws[i].size() < kFewestDraws) continue;
    counted.chains.push_back(&chains[i]);
    counted.draws.push_back(draws[i]);
  }
  return counted;
}

std::optional<EffectiveHealth> effective_of(const Health& health, const Counted& counted) {
  const QuantityHealth* worst = nullptr;
  double least = std::numeric_limits<double>::infinity(), least_bulk = least;
  std::vector<double> across;
  for (const QuantityHealth& quantity : health.quantities) {
    const double bulk = quantity.together.ess_bulk;
    if (!std::isfinite(bulk)) continue;
    least_bulk = std::min(least_bulk, bulk);
    if (std::isfinite(quantity.ess_across)) across.push_back(quantity.ess_across);
    const double ess = std::isfinite(quantity.ess_across) ? std::min(bulk, quantity.ess_across) : bulk;
    if (ess >= least) continue;
    least = ess;
    worst = &quantity;
  }
  if (!worst) return std::nullopt;
  // The least of many spreads, each of few means, would be far too small; their harmonic mean is not.
  double samples = least_bulk;
  if (!across.empty())
    samples = std::min(samples, harmonic_mean(Eigen::Map<const Eigen::VectorXd>(
                                    across.data(), static_cast<Eigen::Index>(across.size()))));
  double run_seconds = 0;
  for (const ChainRecord* chain : counted.chains)
    run_seconds += chain->counters.run_seconds;
  EffectiveHealth effective;
  std::size_t most = 0;
  for (const auto& draws : counted.draws)
    most += distinct(draws);
  effective.samples = std::min(samples, static_cast<double>(most));
  effective.quantity = worst->name;
  effective.within = std::isfinite(worst->ess_within) ? worst->ess_within : 0;
  if (run_seconds > 0) effective.per_cpu_minute = effective.samples / (run_seconds / 60);
  return effective;
}

}  // namespace

std::optional<double> eta_of_first_sample(const Scenario& scenario, const std::vector<ChainRecord>& chains,
                                          const std::optional<PilotTally>& pilot) {
  double tries = 0, per_second = 0;
  const bool is_guided = scenario.target(Ratios::exact)->guide != nullptr;
  for (const ChainRecord& chain : chains) {
    if (chain.counters.samples > 0) return std::nullopt;
    // What is built up piece by piece does not wait for chance.
    if (is_guided && chain.method == to_string(Method::conditional) && chain.state == ChainState::running)
      return std::nullopt;
    tries += static_cast<double>(chain.counters.iteration);
    if (chain.state == ChainState::running) per_second += chain.counters.iterations_per_second;
  }
  if (per_second <= 0) return std::nullopt;
  const PilotTally first = pilot.value_or(PilotTally{});
  tries += static_cast<double>(first.draws);
  return (tries + 1) / (static_cast<double>(first.hits) + 1) / per_second;
}

std::uint64_t warm_up_iterations(const ChainRecord& chain) {
  return chain.method == to_string(Method::metropolis) ? chain.counters.iteration / 4 : 0;
}

std::optional<double> effective_samples(const Scenario& scenario, const ChainRecord& chain,
                                        const DrawsOf& draws) {
  if (chain.method == to_string(Method::rejection)) return static_cast<double>(chain.counters.samples);
  const std::vector<DrawRecord> judged = draws(kJudgedDraws, warm_up_iterations(chain));
  const std::size_t samples = distinct(judged);
  if (samples < kFewestSamples) return std::nullopt;
  std::optional<double> least;
  for (const Quantity& quantity : slowest(quantities(scenario, {judged}))) {
    const double ess = ess_bulk(quantity.draws);
    if (std::isfinite(ess) && (!least || ess < *least)) least = std::min(ess, static_cast<double>(samples));
  }
  return least;
}

Health health_of(const Scenario& scenario, const std::vector<ChainRecord>& chains,
                 const std::vector<std::vector<DrawRecord>>& draws, const std::optional<PilotTally>& pilot) {
  CHECK(draws.size() == chains.size(), draws.size(), chains.size());
  Health health;

  // Independence, over every quantity.
  const Counted counted = counted_chains(chains, draws);
  health.chains = counted.chains.size();
  if (health.chains > 0) {
    std::vector<Quantity> all = quantities(scenario, counted.draws);
    health.quantity_count = all.size();
    std::size_t count = 0;
    for (const auto& each : counted.draws)
      count += each.size();
    health.draws_per_chain = count / health.chains;
    for (const Quantity& quantity : slowest(std::move(all))) {
      QuantityDiagnostics together = diagnose(quantity.draws);
      if (count < kFewestSamples) together.rhat = kNaN;
      health.quantities.push_back(
          {.name = quantity.name,
           .unit = quantity.unit,
           .together = together,
           .ess_within = ess_within(quantity.draws),
           .ess_across = health.chains < kFewestChains ? kNaN : ess_across(quantity.draws)});
    }
  }
  health.effective = effective_of(health, counted);

  // Odds, time and swaps, over every chain.
  OddsPool pool;
  for (const ChainRecord& chain : chains) {
    const ChainCounters& counters = chain.counters;
    pool.add(counters.odds);
    if (counters.first_sample_seconds)
      health.first_sample_seconds =
          std::min(*counters.first_sample_seconds,
                   health.first_sample_seconds.value_or(std::numeric_limits<double>::infinity()));
    health.iterations += counters.iteration;
    health.simulations += counters.simulations;
    health.simulated_seconds += counters.simulated_seconds;
    health.skipped_seconds += counters.skipped_seconds;
    for (std::size_t rung = 0; rung + 1 < counters.rungs.size(); ++rung)
      health.swaps.push_back({.chain = chain.id,
                              .low = counters.rungs[rung].beta,
                              .high = counters.rungs[rung + 1].beta,
                              .proposed = counters.rungs[rung].proposed,
                              .accepted = counters.rungs[rung].accepted});
  }
  health.odds = pool.tally();
  health.eta_seconds = eta_of_first_sample(scenario, chains, pilot);
  return health;
}

}  // namespace retake
