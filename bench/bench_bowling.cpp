// The speed of the world `bowling`: throws, the same throws built naively, early rejection, first samples.
// Things that are compared run in alternating rounds of one run, on the same draws; times are CPU time.
// Prints one JSON object a line for scripts/bench. Usage: bench_bowling [--quick]
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "bench/figure.h"
#include "bench/naive_bowling.h"
#include "sampler/chain.h"
#include "sampler/check.h"
#include "worlds/formats/recorded.h"
#include "worlds/scenario.h"

namespace {

using namespace retake;

/// How much is measured.
struct Extent {
  std::uint64_t draws;         ///< from the prior
  std::uint64_t naive_rounds;  ///< of kNaiveDraws
  int rejection_steps;         ///< with and without early rejection
  int metropolis_steps;        ///< the first thousand or so lead to the wish, where little can be rejected
  std::size_t first_sample_seeds;
  int recordings;
};
constexpr Extent kFull{.draws = 3000,
                       .naive_rounds = 7,
                       .rejection_steps = 1000,
                       .metropolis_steps = 4000,
                       .first_sample_seeds = 20,
                       .recordings = 50};
constexpr Extent kQuick{.draws = 600,
                        .naive_rounds = 1,
                        .rejection_steps = 300,
                        .metropolis_steps = 300,
                        .first_sample_seeds = 5,
                        .recordings = 10};
constexpr std::uint64_t kNaiveDraws = 20;
constexpr int kRoundSteps = 100;  // of a chain, before it is the other one's turn

constexpr std::uint64_t kSeed = 1;

std::shared_ptr<const Scenario> prior_of_full_rack() {
  return Scenario::read({{"world", "bowling"}, {"constraints", nlohmann::json::array()}});
}

std::shared_ptr<const Scenario> example(std::size_t which) {
  return Scenario::read(find_world("bowling")->examples().at(which));
}
constexpr std::size_t kStrike = 0, kLeaveSixSeven = 1;

/// A draw from the prior; false if it lies outside the support, where nothing is to be simulated.
bool draw(const Scenario& scenario, std::uint64_t iteration, State& state) {
  RandomStream random({.seed = kSeed, .purpose = Purpose::proposal, .iteration = iteration});
  scenario.model().draw(random, state);
  return scenario.model().log_prior(state) > -std::numeric_limits<double>::infinity();
}

/// What many throws gave and took.
struct Tally {
  std::uint64_t draws = 0;
  std::uint64_t strikes = 0;
  int pins_down = 0;
  double seconds = 0;
  double per_second() const { return static_cast<double>(draws) / seconds; }

  /// Throws the draws from `first` on; `throw_ball` gives the number of pins down.
  template <typename ThrowBall>
  void add(const Scenario& scenario, std::uint64_t first, std::uint64_t count, const ThrowBall& throw_ball) {
    State state;
    const double begin = cpu_seconds();
    for (std::uint64_t i = first; i < first + count; ++i) {
      if (!draw(scenario, i, state)) continue;
      const int down = throw_ball(state);
      pins_down += down;
      strikes += down == bowling::kPinCount ? 1 : 0;
    }
    seconds += cpu_seconds() - begin;
    draws += count;
  }
  void print_outcomes(const std::string& name) const {
    const auto all = static_cast<double>(draws);
    const std::string sample = " of " + std::to_string(draws) + " draws, " + name;
    print_figure("mean pins down" + sample, pins_down / all, "pins");
    print_figure("strikes" + sample, 100 * static_cast<double>(strikes) / all, "%");
  }
};

/// The world's own throws.
class OwnBowling {
 public:
  explicit OwnBowling(const Scenario& scenario) : performer_(scenario.make_performer()) {
    const std::vector<Measure>& measures = scenario.measures();
    const auto found = std::find_if(measures.begin(), measures.end(),
                                    [](const Measure& measure) { return measure.name == "down_count"; });
    CHECK(found != measures.end());
    down_count_ = static_cast<std::size_t>(found - measures.begin());
    score_.measures.resize(measures.size());
  }
  int pins_down(const State& state) {
    const SimulationOutcome outcome = performer_->simulate(state, {}, score_);
    return outcome.end == SimulationEnd::complete ? static_cast<int>(score_.measures[down_count_]) : 0;
  }

 private:
  std::unique_ptr<Scenario::Performer> performer_;
  std::size_t down_count_;
  Score score_;
};

void bench_prior_draws(const Extent& extent) {
  const auto scenario = prior_of_full_rack();
  OwnBowling own(*scenario);
  Tally tally;
  tally.add(*scenario, 0, extent.draws, [&](const State& state) { return own.pins_down(state); });
  print_figure("bowling, prior draws", tally.per_second(), "simulations/s");
}

void bench_naive(const Extent& extent) {
  const auto scenario = prior_of_full_rack();
  std::vector<int> rack(bowling::kPinCount);
  std::iota(rack.begin(), rack.end(), 1);
  const bowling::ReleaseModel releases(bowling::ReleaseStyle::paper, rack);
  OwnBowling own(*scenario);
  bowling::NaiveBowling naive;
  Tally own_tally, naive_tally;
  for (std::uint64_t round = 0; round < extent.naive_rounds; ++round) {
    const std::uint64_t first = round * kNaiveDraws;
    own_tally.add(*scenario, first, kNaiveDraws, [&](const State& state) { return own.pins_down(state); });
    naive_tally.add(*scenario, first, kNaiveDraws,
                    [&](const State& state) { return naive.pins_down(releases.read(state)); });
  }
  print_figure("bowling, the same scene built naively", naive_tally.per_second(), "simulations/s");
  print_figure("bowling, ours / naive", own_tally.per_second() / naive_tally.per_second(), "ratio");
  own_tally.print_outcomes("ours");
  naive_tally.print_outcomes("naive");
}

/// Two chains that differ in early rejection alone; both must go the same way.
void bench_early_rejection(const Extent& extent) {
  const auto scenario = example(kLeaveSixSeven);
  const auto performer = scenario->make_performer();
  for (const Method method : {Method::rejection, Method::metropolis}) {
    const auto make_chain = [&](bool early_rejection) {
      return Chain(scenario->target(Ratios::exact),
                   {.seed = kSeed, .index = 0, .method = method, .early_rejection = early_rejection});
    };
    const int steps = method == Method::rejection ? extent.rejection_steps : extent.metropolis_steps;
    Chain on = make_chain(true), off = make_chain(false);
    const auto run = [&](Chain& chain) {
      const double begin = cpu_seconds();
      for (int i = 0; i < kRoundSteps; ++i)
        chain.step(*performer);
      return cpu_seconds() - begin;
    };
    double on_seconds = 0, off_seconds = 0;
    for (int step = 0; step < steps; step += kRoundSteps) {
      on_seconds += run(on);
      off_seconds += run(off);
    }
    CHECK(on.counts().accepted == off.counts().accepted, on.counts().accepted, off.counts().accepted);
    CHECK(on.counts().samples == off.counts().samples, on.counts().samples, off.counts().samples);
    CHECK(on.stay().iteration == off.stay().iteration, on.stay().iteration, off.stay().iteration);
    CHECK(on.stay().state == off.stay().state, on.stay().state.transpose(), off.stay().state.transpose());
    print_figure("leave the 6-7, " + std::string(to_string(method)) + ": early rejection on / off, " +
                     std::to_string(steps) + " steps",
                 off_seconds / on_seconds, "ratio");
  }
}

/// CPU time from nothing to the first sample, by the method that the world starts with.
void bench_first_samples(const Extent& extent) {
  const Method method = find_world("bowling")->default_method();
  const std::size_t seeds = extent.first_sample_seeds;
  const std::vector<std::string> names = {"strike", "leave 6-7", "spare 6-7", "seven-ten"};
  CHECK(names.size() == find_world("bowling")->examples().size());
  for (std::size_t which = 0; which < names.size(); ++which) {
    const auto scenario = example(which);
    std::vector<double> times;
    for (std::uint64_t seed = 0; seed < seeds; ++seed) {
      const double begin = cpu_seconds();
      const auto performer = scenario->make_performer();
      Chain chain(scenario->target(Ratios::exact), {.seed = seed, .index = 0, .method = method});
      while (chain.counts().samples == 0)
        chain.step(*performer);
      times.push_back(cpu_seconds() - begin);
    }
    std::sort(times.begin(), times.end());
    const std::size_t rank = (9 * seeds + 9) / 10;  // of the smallest time that 90 % do not exceed
    print_figure(names[which] + ": first sample, 90th percentile over " + std::to_string(seeds) + " seeds",
                 times[rank - 1], "CPU s");
  }
}

/// What one strike costs that is kept: it is played again, to rest, and encoded.
void bench_recording(const Extent& extent) {
  const auto scenario = example(kStrike);
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = kSeed, .index = 0, .method = Method::rejection});
  while (!chain.stay().is_sample)
    chain.step(*performer);
  std::size_t bytes = 0;
  const double begin = cpu_seconds();
  for (int i = 0; i < extent.recordings; ++i)
    bytes = encode_animation(performer->perform(chain.stay().state).animation).size();
  print_figure("record and encode one bowling animation", (cpu_seconds() - begin) / extent.recordings * 1e3,
               "ms");
  print_figure("bytes of one recorded bowling animation", static_cast<double>(bytes), "bytes");
}

}  // namespace

int main(int count, char** arguments) {
  const Extent& extent = count > 1 && std::string(arguments[1]) == "--quick" ? kQuick : kFull;
  bench_prior_draws(extent);
  bench_naive(extent);
  bench_early_rejection(extent);
  bench_first_samples(extent);
  bench_recording(extent);
  return 0;
}
