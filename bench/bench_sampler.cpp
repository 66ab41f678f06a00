// What the methods of a chain are worth: effective independent satisfying samples a CPU-minute, by the spread
// of the means of 8 seeds, harmonic mean over all variables and measures; and the odds that they report.
// Prints one JSON object a line. Usage: bench_sampler [--quick] [SCENARIO [METHOD [SECONDS
// [LEARNING_SECONDS]]]]
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "bench/figure.h"
#include "sampler/chain.h"
#include "sampler/spread.h"
#include "worlds/scenario.h"

namespace {

using namespace retake;
using nlohmann::json;

constexpr std::uint64_t kSeeds = 8;
constexpr double kBurnIn = 0.25;  // of the time of the paper's chain

struct Wish {
  const char* name;
  const char* world;
  std::size_t example;
  double seconds;           ///< of sampling, a seed
  double learning_seconds;  ///< after which learning is cut short; 0: as long as it likes
};
constexpr Wish kWishes[] = {{"ball2d", "ball2d", 0, 4, 0},
                            {"strike", "bowling", 0, 8, 0},
                            {"spare 6-7", "bowling", 2, 8, 0},
                            {"leave 6-7, 10 s of learning", "bowling", 1, 12, 10},
                            {"leave 6-7, 60 s of learning", "bowling", 1, 12, 60},
                            {"seven-ten, 10 s of learning", "bowling", 3, 12, 10},
                            {"seven-ten, 60 s of learning", "bowling", 3, 12, 60}};

struct Result {
  std::vector<RunMoments> runs;
  double seconds = 0;           ///< of sampling, all seeds
  double learning_seconds = 0;  ///< all seeds
  double samples = 0;
  std::vector<Odds> odds;
  OddsTally tally;
};

/// The scenario of a wish. The paper's chain on ball2d is the printed one, which never redraws (5.1.2).
std::shared_ptr<const Scenario> scenario_of(const Wish& wish, Method method) {
  nlohmann::json document = find_world(wish.world)->examples().at(wish.example);
  if (method == Method::metropolis && std::string_view(wish.world) == "ball2d")
    document["model"]["redraw_share"] = 0;
  return Scenario::read(document);
}

/// The numbers that a sample is judged by.
Eigen::VectorXd numbers_of(const Scenario& scenario, const Stay& stay) {
  std::vector<double> values(stay.state.begin(), stay.state.end());
  for (std::size_t i = 0; i < scenario.measures().size(); ++i)
    if (scenario.measures()[i].kind != Measure::Kind::integer_set && scenario.measures()[i].list.empty())
      values.push_back(stay.score.measures[i]);
  return Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// So many draws a chain explores in this time.
std::uint64_t draws_in(const Scenario& scenario, double seconds) {
  const auto performer = scenario.make_performer();
  Chain chain(scenario.target(Ratios::exact),
              {.seed = 1, .method = Method::conditional, .learning = {.hits = 1'000'000}});
  const double begin = cpu_seconds();
  while (cpu_seconds() - begin < seconds)
    chain.step(*performer);
  return chain.counts().iteration;
}

void run_seed(const Scenario& scenario, Method method, std::uint64_t seed, double budget,
              const LearningLimits& learning, Result& result, std::mutex& mutex) {
  const auto performer = scenario.make_performer();
  Chain chain(scenario.target(Ratios::exact), {.seed = seed, .method = method, .learning = learning});
  double begin = cpu_seconds(), learned = 0, samples = 0;
  const double start = begin;
  RunMoments moments(0);
  bool is_empty = true;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> seen;  // iteration and weight of each walker's stay
  double now = begin;
  for (std::uint64_t steps = 0;; ++steps) {
    if (steps % 64 == 0 || scenario.world().name() == "bowling") {
      now = cpu_seconds();
      if (chain.counts().is_learning) begin = now;
      if (learned == 0 && !chain.counts().is_learning) learned = now - start;
      if (now - begin > budget || now - start > 200) break;
    }
    const bool moved = chain.step(*performer);
    const Stay& stay = chain.stay();
    if (method == Method::metropolis && now - begin < kBurnIn * budget) continue;
    if (method == Method::rejection && !moved) continue;
    if (!stay.is_sample || stay.weight == 0 || chain.counts().is_learning) continue;
    seen.resize(std::max(seen.size(), chain.walkers()));
    auto& [iteration, weight] = seen[chain.walker()];
    const std::uint64_t more = iteration == stay.iteration ? stay.weight - weight : stay.weight;
    samples += iteration != stay.iteration ? 1 : 0;
    iteration = stay.iteration;
    weight = stay.weight;
    if (more == 0) continue;
    const Eigen::VectorXd values = numbers_of(scenario, stay);
    if (is_empty) moments = RunMoments(values.size());
    is_empty = false;
    moments.add(values, static_cast<double>(more));
  }
  const std::lock_guard lock(mutex);
  if (!is_empty) result.runs.push_back(moments);
  result.samples += samples;
  result.seconds += (now - begin) * (method == Method::metropolis ? 1 - kBurnIn : 1);
  result.learning_seconds += learned;
  if (const auto said = odds(chain.counts().odds)) result.odds.push_back(*said);
  result.tally.add(chain.counts().odds);
}

Result run(const Scenario& scenario, Method method, double seconds, double learning_seconds) {
  LearningLimits learning;
  if (method == Method::conditional && learning_seconds > 0)
    learning.draws = draws_in(scenario, learning_seconds);
  Result result;
  std::mutex mutex;
  std::uint64_t next = 1;
  const auto work = [&] {
    for (;;) {
      std::uint64_t seed = 0;
      {
        const std::lock_guard lock(mutex);
        if (next > kSeeds) return;
        seed = next++;
      }
      run_seed(scenario, method, seed, seconds, learning, result, mutex);
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < std::min(2u, std::thread::hardware_concurrency()); ++i)
    threads.emplace_back(work);
  threads.clear();
  return result;
}

}  // namespace

int main(int count, char** arguments) {
  std::vector<std::string> wanted(arguments + 1, arguments + count);
  const bool quick = !wanted.empty() && wanted[0] == "--quick";
  if (quick) wanted.erase(wanted.begin());
  for (const Wish& wish : kWishes) {
    const std::string name = wish.name;
    if (!wanted.empty() && name.rfind(wanted[0], 0) != 0) continue;
    if (quick && wish.learning_seconds > 0) continue;
    double rejection = 0;
    for (const Method method :
         {Method::rejection, Method::metropolis, Method::tempering, Method::conditional}) {
      const auto scenario = scenario_of(wish, method);
      const std::string label = name + ", " + std::string(to_string(method));
      if (wanted.size() > 1 && to_string(method) != wanted[1]) continue;
      const double seconds = wanted.size() > 2 ? std::atof(wanted[2].c_str()) : quick ? 0.5 : wish.seconds;
      const double learning = wanted.size() > 3 ? std::atof(wanted[3].c_str()) : wish.learning_seconds;
      const Result result = run(*scenario, method, seconds, learning);
      const double minutes = result.seconds / 60 / static_cast<double>(kSeeds);
      if (result.runs.size() >= 2) {
        const double effective = harmonic_mean(ess_by_spread(result.runs)) / minutes;
        print_figure(label + ": effective samples", effective, "/CPU-min");
        if (method == Method::rejection) rejection = result.samples / (result.seconds / 60);
        if (rejection > 0)
          print_figure(label + ": effective samples / rejection's samples", effective / rejection, "ratio");
      }
      print_figure(label + ": samples", result.samples / (result.seconds / 60), "/CPU-min");
      if (result.learning_seconds > 0)
        print_figure(label + ": learning", result.learning_seconds / static_cast<double>(kSeeds), "CPU s");
      if (const auto pooled = odds(result.tally)) {
        double spread = 0;
        for (const Odds& each : result.odds)
          spread += std::pow(each.probability / pooled->probability - 1, 2) /
                    static_cast<double>(result.odds.size());
        print_figure(label + ": one in", 1 / pooled->probability, "tries");
        print_figure(label + ": spread of a seed's odds", 100 * std::sqrt(spread), "%");
        if (result.tally.basis == OddsBasis::learned || result.tally.squares > 0)
          print_figure(label + ": weight ESS",
                       result.tally.sum * result.tally.sum / result.tally.squares / (result.seconds / 60),
                       "/CPU-min");
      }
    }
  }
}
