// Dice that end where it is wished: what one die's draws are worth a CPU-minute, placed, with and without
// roulette, beside rejection and the paper's chain with tempering; and the time to the first throw that
// satisfies. Prints one JSON object a line. Usage: bench_throws [--quick]
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bench/figure.h"
#include "sampler/chain.h"
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

/// The same without a look before the end.
class WithoutRoulette final : public PlacedRedraw {
 public:
  explicit WithoutRoulette(std::shared_ptr<const PlacedRedraw> placed) : placed_(std::move(placed)) {}
  double place(const State& drawn, const Score& score, State& candidate,
               RandomStream& random) const override {
    return placed_->place(drawn, score, candidate, random);
  }
  double most_log_weight() const override { return placed_->most_log_weight(); }

 private:
  std::shared_ptr<const PlacedRedraw> placed_;
};

/// Kish's effective number of weighted independent draws a CPU-minute, once it has learned.
double effective_draws(const Scenario& scenario, bool roulette, double seconds, std::uint64_t seed) {
  auto target = std::make_shared<Target>(*scenario.target(Ratios::exact));
  if (!roulette) target->placed = std::make_shared<const WithoutRoulette>(target->placed);
  const auto performer = scenario.make_performer();
  Chain chain(target, {.seed = seed, .method = Method::conditional});
  constexpr std::uint64_t kLearns = 4500;  // iterations, a little more than it does
  while (chain.counts().iteration < kLearns)
    chain.step(*performer);
  const OddsTally learned = chain.counts().odds;
  const double begin = cpu_seconds();
  while (cpu_seconds() - begin < seconds)
    chain.step(*performer);
  const double sum = chain.counts().odds.sum - learned.sum,
               squares = chain.counts().odds.squares - learned.squares;
  return squares > 0 ? sum * sum / squares * 60 / (cpu_seconds() - begin) : 0;
}

/// Samples a CPU-minute that are other throws than those before; of a chain they are not independent.
double samples(const Scenario& scenario, Method method, double seconds) {
  const auto performer = scenario.make_performer();
  Chain chain(scenario.target(Ratios::exact), {.seed = 1, .method = method});
  const double begin = cpu_seconds();
  while (cpu_seconds() - begin < seconds)
    chain.step(*performer);
  return static_cast<double>(chain.counts().samples) * 60 / seconds;
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
    print_figure(name + "rejection", samples(*scenario, Method::rejection, extent.seconds),
                 "samples/CPU-min");
    print_figure(name + "tempering", samples(*scenario, Method::tempering, extent.seconds),
                 "samples/CPU-min");
    print_figure(name + "paper's chain", samples(*scenario, Method::metropolis, extent.seconds),
                 "samples/CPU-min");
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
  return 0;
}
