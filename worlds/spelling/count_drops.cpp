// See drop_table.h.
#include <cmath>
#include <optional>
#include <vector>

#include "worlds/impulse/resimulation.h"
#include "worlds/spelling/box.h"
#include "worlds/spelling/drop_table.h"

namespace retake::spelling {
namespace {

constexpr int kBins = 11;               // a side
constexpr int kTogether = 40;           // marbles: at last they fill a third of the bins
constexpr std::int64_t kBetween = 150;  // [steps]
constexpr std::int64_t kLatestStep = kTogether * kBetween + 8000;

void count(DropCounts& counts, double x, double z) {
  const auto cell = [](double from_centre) {
    return static_cast<int>(std::floor(from_centre / kTableCell)) + kTableSide / 2;
  };
  const int column = cell(x), row = cell(z);
  if (column >= 0 && column < kTableSide && row >= 0 && row < kTableSide)
    ++counts[static_cast<std::size_t>(row * kTableSide + column)];
}

/// Marbles dropped anywhere into the box, one by one.
std::vector<std::optional<impulse::Drop>> draw_drops(const Rectangle& area, RandomStream& random) {
  std::vector<std::optional<impulse::Drop>> drops;
  for (int ball = 0; ball < kTogether; ++ball) {
    const double x = area.min_x + random.uniform() * (area.max_x - area.min_x);
    const double z = area.min_z + random.uniform() * (area.max_z - area.min_z);
    drops.push_back(impulse::Drop{.step = ball * kBetween, .place = {x, kDropHeight, z}});
  }
  return drops;
}

/// Counts where a marble that rests in a bin came from, seen from every side.
void count_motion(const Box& box, const impulse::Motion& motion, DropCounts& counts) {
  const auto bin = box.bin_of(motion.states.back().position);
  if (!motion.rests || !bin) return;
  const Rectangle opening = box.opening(*bin);
  const Eigen::Vector3d& place = motion.states.front().position;
  const double dx = place.x() - 0.5 * (opening.min_x + opening.max_x);
  const double dz = place.z() - 0.5 * (opening.min_z + opening.max_z);
  for (const double a : {dx, -dx})
    for (const double b : {dz, -dz}) {
      count(counts, a, b);
      count(counts, b, a);
    }
}

}  // namespace

DropCounts count_drops(int drops) {
  const Box box(kBins, kBins, Tessellation::two);
  impulse::Resimulation engine({}, box.make_surface());
  impulse::Scene scene;
  scene.offsets.assign(box.group_count(), Eigen::Vector3d::Zero());
  scene.latest_step = kLatestStep;
  DropCounts counts{};
  for (int i = 0; i * kTogether < drops; ++i) {
    RandomStream random({.purpose = Purpose::initial, .iteration = static_cast<std::uint64_t>(i)});
    scene.bodies = draw_drops(box.drop_area(), random);
    impulse::Run run;
    engine.simulate(scene, nullptr, &run);
    for (const auto& motion : run.motions)
      count_motion(box, *motion, counts);
  }
  return counts;
}

}  // namespace retake::spelling
