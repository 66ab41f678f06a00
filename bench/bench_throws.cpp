// Dice that end where it is wished: what one die's draws are worth a CPU-minute, placed, with and without
// roulette, beside rejection and the paper's chain with tempering; and the time to the first throw that
// satisfies. Prints one JSON object a line. Usage: bench_throws [--quick]
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bench/figure.h"
#include "sampler/chain.h"
#include "tests/sampler/without_roulette.h"
#include "worlds/scenario.h"

namespace {

using namespace retake;
using nlohmann::json;

struct Extent {
  double seconds;  ///< CPU time a method
  std::uint64_t seeds;
  double longest;  ///< [s] that a first throw is waited for
};
constexpr Extent kFull{20, 10, 60}, kQuick{1, 2, 5};

/// Places and faces of as many dice, 2.4 cm apart: in a row, or six in two rows, the first three behind.
std::shared_ptr<const Scenario> wish(int dice, const char* pose, double tolerance) {
  json wishes = json::array();
  for (int die = 0; die < dice; ++die) {
    const bool two_rows = dice == 6;
    const double x = two_rows ? 0.132 - 0.024 * (die / 3) : 0.12;
    const double z = dice == 1 ? 0.03 : two_rows ? 0.024 * (die % 3 - 1) : 0.024 * (die - 0.5 * (dice - 1));
    const std::string body = "die_" + std::to_string(die + 1);
    wishes.push_back({{"kind", "rest_position"},
                      {"body", body},
                      {"x", x},
                      {"z", z},
                      {"sd", tolerance},
                      {"tolerance", tolerance}});
    wishes.push_back({{"kind", "face_up"}, {"body", body}, {"face", die + 1}});
  }
  return Scenario::read(
      {{"world", "dice"}, {"model", {{"dice", dice}, {"pose", pose}}}, {"constraints", wishes}});
}

std::string millimetres(double length) {
  char text[16];
  std::snprintf(text, sizeof text, "%g mm", 1000 * length);
  return text;
}

/// Kish's effective number of weighted independent draws a CPU-minute.
double effective_draws(const Scenario& scenario, bool roulette, double seconds, std::uint64_t seed) {
  auto target = std::make_shared<Target>(*scenario.target(Ratios::exact));
  if (!roulette) target->placed = std::make_shared<const tests::WithoutRoulette>(target->placed);
  const auto performer = scenario.make_performer();
  Chain chain(target, {.seed = seed, .method = Method::conditional});
  const double begin = cpu_seconds();
  while (cpu_seconds() - begin < seconds)
    chain.step(*performer);
  const OddsTally& odds = chain.counts().odds;
  return odds.squares > 0 ? odds.sum * odds.sum / odds.squares * 60 / (cpu_seconds() - begin) : 0;
}

/// What a chain is worth a CPU-minute, by the spread of 20 batch means of the settling time of what
/// satisfies; 0 if too little was met, or only one throw.
double effective_walk(const Scenario& scenario, Method method, double seconds) {
  std::size_t settling = 0;
  while (scenario.measures()[settling].name != "settling_time")
    ++settling;
  const auto performer = scenario.make_performer();
  Chain chain(scenario.target(Ratios::exact), {.seed = 1, .method = method});
  std::vector<double> values;
  const double begin = cpu_seconds();
  while (cpu_seconds() - begin < seconds) {
    chain.step(*performer);
    if (chain.stay().score.satisfied) values.push_back(chain.stay().score.measures[settling]);
  }
  constexpr std::size_t kBatches = 20;
  const std::size_t length = values.size() / kBatches;
  if (length < 2) return 0;
  const auto moments = [](auto first, auto last) {
    const auto count = static_cast<double>(last - first);
    double mean = 0, square = 0;
    for (auto each = first; each != last; ++each) {
      mean += *each / count;
      square += *each * *each / count;
    }
    return std::pair(mean, square - mean * mean);
  };
  std::vector<double> means;
  for (std::size_t batch = 0; batch < kBatches; ++batch) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(batch * length);
    means.push_back(moments(first, first + static_cast<std::ptrdiff_t>(length)).first);
  }
  const double spread = moments(means.begin(), means.end()).second;
  const double variance = moments(values.begin(), values.end()).second;
  return spread > 0 && variance > 0 ? variance / spread * kBatches * 60 / seconds : 0;
}

/// Independent hits a CPU-minute.
double rejection_hits(const Scenario& scenario, double seconds) {
  const auto performer = scenario.make_performer();
  Chain chain(scenario.target(Ratios::exact), {.seed = 1, .method = Method::rejection});
  double hits = 0;
  const double begin = cpu_seconds();
  while (cpu_seconds() - begin < seconds)
    hits += chain.step(*performer) && chain.stay().score.satisfied ? 1 : 0;
  return hits * 60 / seconds;
}

void bench_one_die(const Extent& extent) {
  for (const double tolerance : {0.004, 0.001, 0.0001}) {
    const auto scenario = wish(1, "random", tolerance);
    const std::string name = "dice: one with its face within " + millimetres(tolerance) + ", ";
    constexpr std::uint64_t kSeeds = 3;
    for (const bool roulette : {false, true}) {
      double least = 1e300, sum = 0;
      for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const double worth = effective_draws(*scenario, roulette, extent.seconds / kSeeds, seed);
        least = std::min(least, worth);
        sum += worth / kSeeds;
      }
      const std::string kind = roulette ? "placed with roulette" : "placed";
      print_figure(name + kind, sum, "effective/CPU-min");
      print_figure(name + kind + ", worst of 3 seeds", least, "effective/CPU-min");
    }
    print_figure(name + "rejection", rejection_hits(*scenario, extent.seconds), "effective/CPU-min");
    print_figure(name + "tempering", effective_walk(*scenario, Method::tempering, extent.seconds),
                 "effective/CPU-min");
    print_figure(name + "paper's chain", effective_walk(*scenario, Method::metropolis, extent.seconds),
                 "effective/CPU-min");
  }
}

void bench_first(const Extent& extent, int dice, const char* pose, double tolerance) {
  const auto scenario = wish(dice, pose, tolerance);
  std::vector<double> times;
  for (std::uint64_t seed = 1; seed <= extent.seeds; ++seed) {
    const auto performer = scenario->make_performer();
    Chain chain(scenario->target(Ratios::exact), {.seed = seed, .method = Method::conditional});
    const double begin = cpu_seconds();
    while (chain.counts().samples == 0 && cpu_seconds() - begin < extent.longest)
      chain.step(*performer);
    times.push_back(cpu_seconds() - begin);
  }
  std::sort(times.begin(), times.end());
  const std::string name =
      "dice: first of " + std::to_string(dice) + ", pose " + pose + ", within " + millimetres(tolerance);
  print_figure(name + ", median", times[times.size() / 2], "s");
  print_figure(name + ", worst", times.back(), "s");
}

/// How often a walk throws a die anew: counted by its start's height, which nothing else changes.
void bench_walk(const Extent& extent, int dice, double tolerance) {
  const auto scenario = wish(dice, "random", tolerance);
  const auto& variables = scenario->model().variables();
  std::vector<Eigen::Index> heights;
  for (std::size_t i = 0; i < variables.size(); ++i)
    if (variables[i].name.starts_with("die_") && variables[i].name.ends_with("_height"))
      heights.push_back(static_cast<Eigen::Index>(i));
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 1, .method = Method::conditional});
  double begin = cpu_seconds();
  while (chain.counts().samples == 0 && cpu_seconds() - begin < extent.longest)
    chain.step(*performer);
  State before = chain.stay().state;
  double thrown = 0;
  begin = cpu_seconds();
  while (cpu_seconds() - begin < extent.seconds) {
    if (!chain.step(*performer)) continue;
    const State& now = chain.stay().state;
    thrown += static_cast<double>(std::count_if(
        heights.begin(), heights.end(), [&](Eigen::Index height) { return now[height] != before[height]; }));
    before = now;
  }
  print_figure("dice: " + std::to_string(dice) + " within " + millimetres(tolerance) + ", thrown anew",
               thrown * 60 / (cpu_seconds() - begin), "dice/CPU-min");
}

}  // namespace

int main(int count, char** arguments) {
  const Extent& extent = count > 1 && std::string(arguments[1]) == "--quick" ? kQuick : kFull;
  bench_one_die(extent);
  for (const double tolerance : {0.004, 0.001, 0.0001})
    bench_first(extent, 1, "random", tolerance);
  for (const double tolerance : {0.004, 0.001}) {
    bench_first(extent, 1, "fixed", tolerance);
    for (const int dice : {2, 3, 6})
      bench_first(extent, dice, "random", tolerance);
  }
  for (const double tolerance : {0.004, 0.001})
    for (const int dice : {2, 3, 6})
      bench_walk(extent, dice, tolerance);
  return 0;
}
