// Health: what the draws and counters of a scenario's chains say of it - odds, independence, time saved.
// doc/design.md, section 3, "Diagnostics". Pure functions of records: it must not know the store's methods or
// HTTP.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "db/records.h"
#include "sampler/diagnostics.h"
#include "worlds/scenario.h"

namespace retake {

/// How many iterations of a chain's run its draws leave out: the first quarter of a walk over p(A), which
/// begins anywhere. The other methods mark what is no draw by weight 0.
std::uint64_t warm_up_iterations(const ChainRecord& chain);

/// Gives draws of a chain as Store::draws does: at most `most`, after `from_iteration`.
using DrawsOf = std::function<std::vector<DrawRecord>(std::size_t most, std::uint64_t from_iteration)>;

/// Effective samples of one chain by itself: the least bulk effective sample size over the slowest() of its
/// variables and measures, those left out for which there is none, and no more than its samples; with
/// rejection its samples, which are independent. None if no quantity has one, or below 24 samples.
std::optional<double> effective_samples(const Scenario& scenario, const ChainRecord& chain,
                                        const DrawsOf& draws);

/// One variable or measure. NaN where there is no figure.
struct QuantityHealth {
  std::string name;
  std::string unit{};
  QuantityDiagnostics together;  ///< over the draws of all chains counted
  double ess_within;             ///< sum of each chain's own bulk effective sample size
  /// sampler/diagnostics.h, ess_across; NaN below 4 chains. What no chain can know by itself.
  double ess_across;
};

struct EffectiveHealth {
  /// The least over quantities of ess_bulk, but no more than the harmonic mean of ess_across, nor than the
  /// samples that the draws are of.
  double samples;
  std::string quantity;                  ///< that has the least
  double within;                         ///< what the chains by themselves claim for that quantity
  std::optional<double> per_cpu_minute;  ///< over the run_seconds of the chains counted
};

struct SwapHealth {
  std::string chain;
  double low;  ///< beta
  double high;
  std::uint64_t proposed;
  std::uint64_t accepted;
};

struct Health {
  std::vector<QuantityHealth> quantities;  ///< the slowest() of all
  std::size_t quantity_count = 0;          ///< of all
  std::size_t chains = 0;                  ///< counted for the quantities
  std::size_t draws_per_chain = 0;         ///< of them, on average
  std::optional<EffectiveHealth> effective;
  OddsTally odds;                              ///< pooled over the chains
  std::optional<double> first_sample_seconds;  ///< [s] of running, of the chain that was quickest
  /// See eta_of_first_sample.
  std::optional<double> eta_seconds;
  std::uint64_t iterations = 0;
  std::uint64_t simulations = 0;
  double simulated_seconds = 0;  ///< [s] of the world's time
  double skipped_seconds = 0;    ///< [s] of the world's time
  std::vector<SwapHealth> swaps;
};

/// [s] at the present speed of the running chains until a first sample, if the wish is as likely as the draws
/// of the chains and the pilot let expect, one more hit counted; none once there is a sample, and none while
/// a chain runs that its world guides.
std::optional<double> eta_of_first_sample(const Scenario& scenario, const std::vector<ChainRecord>& chains,
                                          const std::optional<PilotTally>& pilot);

/// `draws[i]` are those of `chains[i]`, empty if they were not looked at. All chains of at least 4 draws are
/// counted, each by as many as it has, so that none hides what others disagree about. Chains of the paper's
/// ratios are counted only where there are no others. Requires: draws.size() == chains.size().
Health health_of(const Scenario& scenario, const std::vector<ChainRecord>& chains,
                 const std::vector<std::vector<DrawRecord>>& draws, const std::optional<PilotTally>& pilot);

}  // namespace retake
