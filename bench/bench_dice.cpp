// The speed of thrown dice: full simulations, the same on Bullet, and what a chain's proposals cost with
// resuming. Things that are compared run in alternating rounds of one run, on the same draws; times are CPU
// time. Prints one JSON object a line for scripts/bench. Usage: bench_dice [--quick]
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "bench/figure.h"
#include "bench/naive_dice.h"
#include "worlds/dice/dice_model.h"
#include "worlds/dice/placement.h"

namespace {

using namespace retake;
using dice::DiceModel;
using dice::DieShape;

/// How much is measured.
struct Extent {
  int rounds;       ///< of both engines
  int simulations;  ///< a round, on our own engine
  int naive;        ///< a round, on Bullet
  int proposals;    ///< of a chain
};
constexpr Extent kFull{.rounds = 5, .simulations = 2000, .naive = 12, .proposals = 20000};
constexpr Extent kQuick{.rounds = 2, .simulations = 500, .naive = 3, .proposals = 2000};

constexpr std::uint64_t kSeed = 1;

DieShape die_shape() {
  return DieShape(Eigen::Vector3d::Constant(0.016), 0.0012, 1180);
}

State draw(const DiceModel& model, std::uint64_t iteration) {
  RandomStream random({.seed = kSeed, .purpose = Purpose::initial, .iteration = iteration});
  State state;
  do
    model.model()->draw(random, state);
  while (!std::isfinite(model.model()->log_prior(state)));
  return state;
}

void bench_full(const Extent& extent) {
  const dice::EngineSettings engine;
  const DieShape shape = die_shape();
  const DiceModel model({}, engine, shape);
  dice::Tumbler tumbler(engine, shape, model.settings().table);
  dice::Table table(model.settings().table);
  dice::NaiveDice naive(shape);
  double own_seconds = 0, naive_seconds = 0, steps = 0, touched = 0, own_flat = 0, naive_flat = 0, sleeps = 0;
  std::uint64_t next = 0;
  for (int round = 0; round < extent.rounds; ++round) {
    std::vector<State> states;
    for (int i = 0; i < extent.simulations; ++i)
      states.push_back(draw(model, next++));
    double begin = cpu_seconds();
    for (const State& state : states) {
      steps += static_cast<double>(tumbler.simulate(model.read(state).scene, nullptr, nullptr).step_count);
      touched += static_cast<double>(tumbler.touch_count(0));
      own_flat += dice::top_face(tumbler.states()[0].rotation) > 0 ? 1 : 0;
    }
    own_seconds += cpu_seconds() - begin;
    begin = cpu_seconds();
    for (int i = 0; i < extent.naive; ++i) {
      const dice::TumbleScene scene = model.read(states[static_cast<std::size_t>(i)]).scene;
      table.reset(scene.table);
      const auto rest = naive.play(table, scene.dice[0].state);
      sleeps += rest.sleeps ? 1 : 0;
      naive_flat += dice::top_face(rest.pose.rotation) > 0 ? 1 : 0;
    }
    naive_seconds += cpu_seconds() - begin;
  }
  const double own_count = extent.rounds * extent.simulations, naive_count = extent.rounds * extent.naive;
  const double rate = own_count / own_seconds, naive_rate = naive_count / naive_seconds;
  print_figure("dice: full simulations", rate, "simulations/s");
  print_figure("dice: on Bullet at 480 Hz", naive_rate, "simulations/s");
  print_figure("dice: ours / Bullet", rate / naive_rate, "ratio");
  print_figure("dice: a step", own_seconds / steps * 1e9, "ns");
  print_figure("dice: control points touched", touched / own_count, "points");
  print_figure("dice: flat on a face, ours", 100 * own_flat / own_count, "%");
  print_figure("dice: flat on a face, Bullet", 100 * naive_flat / naive_count, "%");
  print_figure("dice: asleep within 4 s, Bullet", 100 * sleeps / naive_count, "%");
}

/// Several dice on one table.
void bench_several(const Extent& extent, std::size_t count) {
  const dice::EngineSettings engine;
  const DieShape shape = die_shape();
  const DiceModel model({.dice = count}, engine, shape);
  dice::Tumbler tumbler(engine, shape, model.settings().table);
  dice::Tumble run;
  double seconds = 0, met = 0;
  for (int i = 0; i < extent.simulations; ++i) {
    const State state = draw(model, static_cast<std::uint64_t>(i));
    const double begin = cpu_seconds();
    tumbler.simulate(model.read(state).scene, nullptr, &run);
    seconds += cpu_seconds() - begin;
    met += run.meetings.empty() ? 0 : 1;
  }
  const std::string name = "dice: " + std::to_string(count) + " on one table, ";
  print_figure(name + "full simulations", extent.simulations / seconds, "simulations/s");
  print_figure(name + "some met", 100 * met / extent.simulations, "%");
}

/// A walk by the paper's proposals on the prior: every candidate is moved to.
void bench_proposals(const Extent& extent) {
  const dice::EngineSettings engine;
  const DieShape shape = die_shape();
  const DiceModel model({}, engine, shape);
  dice::Tumbler tumbler(engine, shape, model.settings().table);
  const KernelTable kernels = model.kernels(Ratios::exact);
  State current = draw(model, 0), candidate;
  dice::Tumble run, other;
  tumbler.simulate(model.read(current).scene, nullptr, &run);
  double stepped = 0, all = 0, free = 0;
  const double begin = cpu_seconds();
  for (int i = 0; i < extent.proposals; ++i) {
    RandomStream random(
        {.seed = kSeed, .purpose = Purpose::proposal, .iteration = static_cast<std::uint64_t>(i)});
    candidate = current;
    kernels.rows()[kernels.choose(random.uniform())].kernel->propose(*model.model(), current, candidate,
                                                                     random);
    if (!model.model()->in_support(candidate)) continue;
    const auto outcome = tumbler.simulate(model.read(candidate).scene, run.complete ? &run : nullptr, &other);
    stepped += static_cast<double>(outcome.stepped);
    all += static_cast<double>(outcome.step_count);
    free += outcome.stepped == 0 ? 1 : 0;
    std::swap(current, candidate);
    std::swap(run, other);
  }
  const double seconds = cpu_seconds() - begin;
  print_figure("dice: the paper's proposals, resumed", extent.proposals / seconds, "simulations/s");
  print_figure("dice: steps saved by resuming", 100 * (1 - stepped / all), "%");
  print_figure("dice: proposals that need no step", 100 * free / extent.proposals, "%");
}

}  // namespace

int main(int count, char** arguments) {
  const Extent& extent = count > 1 && std::string(arguments[1]) == "--quick" ? kQuick : kFull;
  bench_full(extent);
  for (const std::size_t dice : {3u, 6u})
    bench_several(extent, dice);
  bench_proposals(extent);
  return 0;
}
