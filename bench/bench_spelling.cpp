// The speed of the impulse engine: full simulations of marbles in the box, the same on Bullet, and local
// re-simulation after one change. Things that are compared run in alternating rounds of one run, on the same
// draws; times are CPU time. Prints one JSON object a line for scripts/bench. Usage: bench_spelling [--quick]
#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "bench/figure.h"
#include "bench/naive_marbles.h"
#include "sampler/random.h"
#include "worlds/impulse/resimulation.h"

namespace {

using namespace retake;
using spelling::Box;
using spelling::Tessellation;

/// How much is measured.
struct Extent {
  int rounds;       ///< of both engines
  int simulations;  ///< a round, on our own engine
  int naive;        ///< a round, on Bullet
  int moves;        ///< of each kind
};
constexpr Extent kFull{.rounds = 5, .simulations = 60, .naive = 6, .moves = 1000};
constexpr Extent kQuick{.rounds = 2, .simulations = 20, .naive = 2, .moves = 150};

constexpr std::uint64_t kSeed = 1;
constexpr std::int64_t kInterval = 150;  // [steps] between two drops
constexpr double kOffset = 1e-4;         // [m], appendix B.1

/// A box and how many marbles fall into it.
struct Case {
  std::string name;
  Box box;
  std::size_t marbles;
};

impulse::Drop draw_drop(const Case& what, std::size_t slot, RandomStream& random) {
  const spelling::Rectangle area = what.box.drop_area();
  const double x = area.min_x + random.uniform() * (area.max_x - area.min_x);
  const double z = area.min_z + random.uniform() * (area.max_z - area.min_z);
  return {static_cast<std::int64_t>(slot) * kInterval, {x, spelling::kDropHeight, z}};
}

Eigen::Vector3d draw_offset(RandomStream& random) {
  Eigen::Vector3d offset;
  for (double& component : offset)
    component = std::clamp(kOffset * random.gaussian(), -1e-3, 1e-3);
  return offset;
}

impulse::Scene draw_scene(const Case& what, std::uint64_t iteration) {
  RandomStream random({.seed = kSeed, .purpose = Purpose::initial, .iteration = iteration});
  impulse::Scene scene;
  for (std::size_t slot = 0; slot < what.marbles; ++slot)
    scene.bodies.push_back(draw_drop(what, slot, random));
  for (std::size_t group = 0; group < what.box.group_count(); ++group)
    scene.offsets.push_back(draw_offset(random));
  scene.latest_step = static_cast<std::int64_t>(what.marbles) * kInterval + 6000;
  return scene;
}

void bench_full(const Case& what, const Extent& extent) {
  impulse::Resimulation own({}, what.box.make_surface());
  spelling::NaiveMarbles naive(what.box);
  double own_seconds = 0, naive_seconds = 0;
  int own_in_bins = 0, naive_in_bins = 0;
  std::int64_t steps = 0;
  std::uint64_t next = 0;
  for (int round = 0; round < extent.rounds; ++round) {
    std::vector<impulse::Scene> scenes;
    for (int i = 0; i < extent.simulations; ++i)
      scenes.push_back(draw_scene(what, next++));
    impulse::Run run;
    double begin = cpu_seconds();
    for (const impulse::Scene& scene : scenes) {
      steps += own.simulate(scene, nullptr, &run).body_steps;
      for (const auto& motion : run.motions)
        own_in_bins += motion->rests && what.box.bin_of(motion->states.back().position) ? 1 : 0;
    }
    own_seconds += cpu_seconds() - begin;
    begin = cpu_seconds();
    for (int i = 0; i < extent.naive; ++i)
      naive_in_bins += naive.in_bins(own.settings(), scenes[static_cast<std::size_t>(i)]);
    naive_seconds += cpu_seconds() - begin;
  }
  const double own_count = extent.rounds * extent.simulations, naive_count = extent.rounds * extent.naive;
  const double rate = own_count / own_seconds, naive_rate = naive_count / naive_seconds;
  const std::string name = "marbles, " + what.name + ": ";
  print_figure(name + "full simulations", rate, "simulations/s");
  print_figure(name + "on Bullet at 240 Hz", naive_rate, "simulations/s");
  print_figure(name + "ours / Bullet", rate / naive_rate, "ratio");
  print_figure(name + "a step of one marble", own_seconds / static_cast<double>(steps) * 1e9, "ns");
  const double all = static_cast<double>(what.marbles) / 100;
  print_figure(name + "at rest in a bin, ours", own_in_bins / own_count / all, "%");
  print_figure(name + "at rest in a bin, Bullet", naive_in_bins / naive_count / all, "%");
}

/// What a chain does to one scene.
struct Move {
  std::string name;
  void (*change)(const Case& what, impulse::Scene& scene, RandomStream& random);
};
const std::array kMoves = {
    Move{"redraw a drop",
         [](const Case& what, impulse::Scene& scene, RandomStream& random) {
           const std::size_t slot = random.index(what.marbles);
           scene.bodies[slot] = draw_drop(what, slot, random);
         }},
    Move{"swap two drops",
         [](const Case& what, impulse::Scene& scene, RandomStream& random) {
           const std::size_t a = random.index(what.marbles), b = random.index(what.marbles);
           std::swap(scene.bodies[a]->place, scene.bodies[b]->place);
         }},
    Move{"offset a vertex group",
         [](const Case&, impulse::Scene& scene, RandomStream& random) {
           scene.offsets[random.index(scene.offsets.size())] = draw_offset(random);
         }},
};

/// Walks by moves of every kind in turn, without stopping early.
void bench_local(const Case& what, const Extent& extent) {
  impulse::Resimulation resimulation({}, what.box.make_surface());
  impulse::Scene scene = draw_scene(what, 0);
  impulse::Run current, changed;
  resimulation.simulate(scene, nullptr, &current);
  std::array<double, kMoves.size()> seconds{}, steps{};
  RandomStream random({.seed = kSeed, .purpose = Purpose::proposal});
  for (int i = 0; i < extent.moves; ++i)
    for (std::size_t kind = 0; kind < kMoves.size(); ++kind) {
      kMoves[kind].change(what, scene, random);
      const double begin = cpu_seconds();
      steps[kind] += static_cast<double>(resimulation.simulate(scene, &current, &changed).body_steps);
      std::swap(current, changed);
      seconds[kind] += cpu_seconds() - begin;
    }
  const std::string name = "marbles, " + what.name + ": ";
  double all = 0;
  for (std::size_t kind = 0; kind < kMoves.size(); ++kind) {
    print_figure(name + kMoves[kind].name, seconds[kind] / extent.moves * 1e3, "ms");
    print_figure(name + kMoves[kind].name + ", steps of one marble", steps[kind] / extent.moves, "steps");
    all += seconds[kind] / extent.moves / static_cast<double>(kMoves.size());
  }
  print_figure(name + "local re-simulation, mean of the three", all * 1e3, "ms");
}

}  // namespace

int main(int count, char** arguments) {
  const Extent& extent = count > 1 && std::string(arguments[1]) == "--quick" ? kQuick : kFull;
  const Case hi{"HI", Box(7, 5, Tessellation::two), 10};
  const Case acm{"ACM", Box(15, 7, Tessellation::two), 30};
  const Case long_word{"81 in 40 x 7", Box(40, 7, Tessellation::two), 81};
  bench_full(hi, extent);
  bench_full(acm, extent);
  bench_local(hi, extent);
  bench_local(acm, extent);
  bench_local(long_word, extent);
  return 0;
}
