// The speed of ball2d's chains, bare and behind the Runner and the Store, in alternating rounds of one run.
// Prints one JSON object a line for scripts/bench. Usage: bench_chain [seconds a round] [rounds]
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <sys/resource.h>
#include <thread>
#include <vector>

#include "bench/figure.h"
#include "db/open_store.h"
#include "sampler/chain.h"
#include "server/api/api.h"
#include "server/chains/identifiers.h"
#include "server/chains/runner.h"
#include "worlds/formats/recorded.h"

namespace {

using namespace retake;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

std::shared_ptr<const Scenario> ball(double sd) {
  return Scenario::read(
      {{"world", "ball2d"},
       {"constraints", {{{"kind", "rest_position"}, {"x", 1.0}, {"sd", sd}, {"tolerance", sd}}}}});
}

/// Iterations of a bare chain in about `seconds`, and the time they took.
struct Rate {
  double iterations = 0;
  double seconds = 0;
  double per_second() const { return iterations / seconds; }
};

void run_bare(Chain& chain, Scenario::Performer& performer, double seconds, Rate& rate) {
  const Clock::time_point begin = Clock::now();
  const std::uint64_t before = chain.counts().iteration;
  Seconds elapsed{0};
  while (elapsed.count() < seconds) {
    for (int i = 0; i < 10'000; ++i)
      chain.step(performer);
    elapsed = Clock::now() - begin;
  }
  rate.iterations += static_cast<double>(chain.counts().iteration - before);
  rate.seconds += elapsed.count();
}

void bench_bare(double seconds) {
  for (const Method method : {Method::metropolis, Method::rejection}) {
    const auto scenario = ball(0.1);
    const auto performer = scenario->make_performer();
    Chain chain(scenario->target(Ratios::exact), {.seed = 1, .index = 0, .method = method});
    Rate rate;
    run_bare(chain, *performer, seconds, rate);
    print_figure("bare chain, " + std::string(to_string(method)), rate.per_second(), "iterations/s");
  }
}

/// One chain thread, one stored sample in about 1,000 iterations; bare and served in turn.
void bench_server_path(double seconds, int rounds) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("retake-bench-" + random_identifier());
  std::filesystem::create_directories(folder);
  {
    const auto scenario = ball(0.0125);
    const auto performer = scenario->make_performer();
    Chain bare_chain(scenario->target(Ratios::exact), {.seed = 2, .index = 0, .method = Method::rejection});
    const auto opened = open_store((folder / "bench.db").string());
    Store& store = *opened;
    ScenarioLibrary library(store);
    EventHub events;
    Runner runner(store, library, events, {.threads = 1, .most_samples_per_scenario = 100'000'000});
    const ScenarioRecord record = new_scenario_record(*scenario);
    store.add_scenario(record);
    ChainStarter starter(store, runner);
    const std::string chain = starter.start(record.id, default_wish(*scenario), 1).chains.front().id;
    runner.pause(chain);

    Rate bare, served;
    const Runner::Counters counters_before = runner.counters();
    for (int round = 0; round < rounds; ++round) {
      run_bare(bare_chain, *performer, seconds, bare);
      runner.resume(chain);
      std::this_thread::sleep_for(Seconds(0.1));
      const std::uint64_t before = runner.counters().iterations;
      const Clock::time_point begin = Clock::now();
      std::this_thread::sleep_for(Seconds(seconds));
      served.iterations += static_cast<double>(runner.counters().iterations - before);
      served.seconds += Seconds(Clock::now() - begin).count();
      runner.pause(chain);
    }
    const Runner::Counters counters = runner.counters();
    print_figure("bare chain at 1 sample in 1,000", bare.per_second(), "iterations/s");
    print_figure("chain + store at 1 sample in 1,000", served.per_second(), "iterations/s");
    print_figure("chain + store / bare chain", served.per_second() / bare.per_second(), "ratio");
    print_figure("iterations a stored sample",
                 static_cast<double>(counters.iterations - counters_before.iterations) /
                     static_cast<double>(counters.samples - counters_before.samples),
                 "iterations");
  }
  std::filesystem::remove_all(folder);
}

/// What one sample costs beyond its iteration.
void bench_recording() {
  const auto scenario = ball(0.1);
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 3, .index = 0, .method = Method::rejection});
  while (!chain.stay().is_sample)
    chain.step(*performer);
  constexpr int kRepeats = 2000;
  double bytes = 0;
  const Clock::time_point begin = Clock::now();
  for (int i = 0; i < kRepeats; ++i)
    bytes += static_cast<double>(encode_animation(performer->perform(chain.stay().state).animation).size());
  print_figure("record and encode one animation", Seconds(Clock::now() - begin).count() / kRepeats * 1e6,
               "microseconds");
  print_figure("bytes of one recorded animation", bytes / kRepeats, "bytes");
}

}  // namespace

int main(int count, char** arguments) {
  // As the Runner's threads: otherwise a busy machine would give the bare chain more than its share.
  setpriority(PRIO_PROCESS, 0, Runner::kNiceness);
  const double seconds = count > 1 ? std::atof(arguments[1]) : 1.0;
  const int rounds = count > 2 ? std::atoi(arguments[2]) : 6;
  bench_bare(seconds);
  bench_recording();
  bench_server_path(seconds, rounds);
  return 0;
}
