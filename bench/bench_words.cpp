// How soon marbles spell a word, and how fast the walk over complete words mixes. Times are CPU time of one
// thread. Prints one JSON object a line for scripts/bench. Usage: bench_words [--quick]
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "bench/figure.h"
#include "sampler/chain.h"
#include "sampler/diagnostics.h"
#include "worlds/scenario.h"

namespace {

using namespace retake;

constexpr std::uint64_t kSeeds = 10;

/// The first scenarios of the world are HI, ACM and a word of 85 marbles.
nlohmann::json example(std::size_t which) {
  return find_world("spelling")->examples().at(which);
}

/// Every bin of 15 x 7.
nlohmann::json all_bins() {
  return {{"world", "spelling"},
          {"model", {{"columns", 15}, {"rows", 7}}},
          {"constraints", {{{"kind", "bins"}, {"rows", std::vector<std::string>(7, std::string(15, '#'))}}}}};
}

/// CPU time from nothing to the first satisfied animation, worst and median of ten seeds.
void bench_first(const std::string& name, const nlohmann::json& document, Method method) {
  const auto scenario = Scenario::read(document);
  std::vector<double> seconds;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const double begin = cpu_seconds();
    const auto performer = scenario->make_performer();
    Chain chain(scenario->target(Ratios::exact), {.seed = seed, .method = method});
    while (chain.counts().samples == 0)
      chain.step(*performer);
    seconds.push_back(cpu_seconds() - begin);
  }
  std::sort(seconds.begin(), seconds.end());
  const std::string label = name + ", " + std::string(to_string(method)) + ": first complete, ";
  print_figure(label + "median of 10 seeds", 0.5 * (seconds[4] + seconds[5]), "CPU s");
  print_figure(label + "worst of 10 seeds", seconds.back(), "CPU s");
}

/// Where a walk stands, seen from the simulator that it asks.
class Watcher final : public Simulator {
 public:
  explicit Watcher(Simulator& simulator) : simulator_(simulator) {}
  std::unique_ptr<Run> make_run() const override { return simulator_.make_run(); }
  SimulationOutcome simulate(const State& candidate, const SimulationRequest& request,
                             Score& score) override {
    if (request.current_state && is_whole_ && *request.current_state == candidate_) {
      stands_ = score_;
      state_ = candidate_;
    }
    const SimulationOutcome outcome = simulator_.simulate(candidate, request, score);
    is_whole_ = outcome.end == SimulationEnd::complete;
    if (is_whole_) {
      candidate_ = candidate;
      score_ = score;
    }
    return outcome;
  }
  const Score& stands() const { return stands_; }
  const State& state() const { return state_; }

 private:
  Simulator& simulator_;
  bool is_whole_ = false;
  State candidate_, state_;
  Score score_, stands_;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Effective draws of each column of a trace.
std::vector<double> effective(const std::vector<std::vector<double>>& trace) {
  std::vector<double> result;
  for (std::size_t column = 0; column < trace.front().size(); ++column) {
    Eigen::VectorXd draws(static_cast<Eigen::Index>(trace.size()));
    for (std::size_t row = 0; row < trace.size(); ++row)
      draws[static_cast<Eigen::Index>(row)] = trace[row][column];
    result.push_back(ess_mean({draws}));
  }
  return result;
}

void bench_mixing(const std::string& name, const nlohmann::json& document, double seconds) {
  const auto scenario = Scenario::read(document);
  const auto balls = scenario->document().at("model").at("balls").get<std::size_t>();
  const auto& measures = scenario->measures();
  const auto index_of = [&](const std::string& measure) {
    const auto found =
        std::find_if(measures.begin(), measures.end(), [&](const Measure& m) { return m.name == measure; });
    return static_cast<std::size_t>(found - measures.begin());
  };
  const std::size_t direct = index_of("direct_balls"), first_bin = index_of("bin_of_ball_1");
  const auto performer = scenario->make_performer();
  Watcher watcher(*performer);
  Chain chain(scenario->target(Ratios::exact), {.seed = 1, .method = Method::conditional});
  double begin = cpu_seconds();
  while (chain.counts().iteration == 0 || chain.counts().is_learning)
    chain.step(watcher);
  print_figure(name + ": built and burned in", cpu_seconds() - begin, "CPU s");

  std::set<std::vector<double>> orders;
  std::vector<std::vector<double>> bins, offsets, directs;
  begin = cpu_seconds();
  const std::uint64_t from = chain.counts().iteration;
  double now = begin;
  while (now - begin < seconds) {
    for (int i = 0; i < 10; ++i) {
      chain.step(watcher);
      if (!watcher.stands().satisfied) continue;
      const auto bin = watcher.stands().measures.begin() + static_cast<std::ptrdiff_t>(first_bin);
      orders.emplace(bin, bin + static_cast<std::ptrdiff_t>(balls));
    }
    now = cpu_seconds();
    if (!watcher.stands().satisfied) continue;
    const auto bin = watcher.stands().measures.begin() + static_cast<std::ptrdiff_t>(first_bin);
    bins.emplace_back(bin, bin + static_cast<std::ptrdiff_t>(balls));
    offsets.emplace_back(watcher.state().begin() + static_cast<std::ptrdiff_t>(3 * balls),
                         watcher.state().end());
    directs.push_back({watcher.stands().measures[direct]});
  }
  const double minutes = (now - begin) / 60;
  print_figure(name + ": moves", static_cast<double>(chain.counts().iteration - from) / (60 * minutes),
               "/CPU s");
  print_figure(name + ": distinct orders", static_cast<double>(orders.size()) / minutes, "/CPU-min");
  const std::vector<double> slots = effective(bins), vertices = effective(offsets);
  print_figure(name + ": effective samples, bin of the median slot", median(slots) / minutes, "/CPU-min");
  print_figure(name + ": effective samples, bin of the worst slot",
               *std::min_element(slots.begin(), slots.end()) / minutes, "/CPU-min");
  print_figure(name + ": effective samples, median offset", median(vertices) / minutes, "/CPU-min");
  print_figure(name + ": effective samples, direct balls", effective(directs)[0] / minutes, "/CPU-min");
  const std::size_t tenth = directs.size() / 10;
  for (const bool last : {false, true}) {
    double sum = 0;
    for (std::size_t i = 0; i < tenth; ++i)
      sum += directs[last ? directs.size() - 1 - i : i][0];
    print_figure(name + ": direct balls, " + (last ? "last" : "first") + " tenth",
                 sum / static_cast<double>(tenth), "balls");
  }
}

}  // namespace

int main(int count, char** arguments) {
  const bool quick = count > 1 && std::string(arguments[1]) == "--quick";
  bench_first("HI", example(0), Method::conditional);
  bench_first("ACM", example(1), Method::conditional);
  bench_first("85 balls in 40 x 7", example(2), Method::conditional);
  bench_first("all bins of 15 x 7", all_bins(), Method::conditional);
  bench_first("HI", example(0), Method::metropolis);
  if (!quick) bench_first("ACM", example(1), Method::metropolis);
  bench_mixing("HI", example(0), quick ? 2 : 20);
  bench_mixing("ACM", example(1), quick ? 4 : 60);
  if (!quick) bench_mixing("85 balls in 40 x 7", example(2), 60);
  return 0;
}
