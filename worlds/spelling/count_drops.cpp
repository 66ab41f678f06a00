// See drop_table.h.
#include <cmath>

#include "worlds/impulse/resimulation.h"
#include "worlds/spelling/box.h"
#include "worlds/spelling/drop_table.h"

namespace retake::spelling {
namespace {

constexpr int kBins = 11;  // a side: too far for a marble to meet a wall
constexpr std::int64_t kLatestStep = 8000;

void count(DropCounts& counts, double x, double z) {
  const auto cell = [](double from_centre) {
    return static_cast<int>(std::floor(from_centre / kTableCell)) + kTableSide / 2;
  };
  const int column = cell(x), row = cell(z);
  if (column >= 0 && column < kTableSide && row >= 0 && row < kTableSide)
    ++counts[static_cast<std::size_t>(row * kTableSide + column)];
}

}  // namespace

DropCounts count_drops(int drops) {
  const Box box(kBins, kBins, Tessellation::two);
  impulse::Resimulation engine({}, box.make_surface());
  impulse::Scene scene;
  scene.offsets.assign(box.group_count(), Eigen::Vector3d::Zero());
  scene.latest_step = kLatestStep;
  DropCounts counts{};
  for (int i = 0; i < drops; ++i) {
    RandomStream random({.purpose = Purpose::initial, .iteration = static_cast<std::uint64_t>(i)});
    const double x = kPitch * (random.uniform() - 0.5), z = kPitch * (random.uniform() - 0.5);
    scene.bodies = {impulse::Drop{.step = 0, .place = {x, kDropHeight, z}}};
    impulse::Run run;
    if (engine.simulate(scene, nullptr, &run).end != impulse::RunEnd::rests) continue;
    const auto bin = box.bin_of(run.motions[0]->states.back().position);
    if (!bin) continue;
    const Rectangle opening = box.opening(*bin);
    const double dx = x - 0.5 * (opening.min_x + opening.max_x),
                 dz = z - 0.5 * (opening.min_z + opening.max_z);
    for (const double a : {dx, -dx})
      for (const double b : {dz, -dz}) {
        count(counts, a, b);
        count(counts, b, a);
      }
  }
  return counts;
}

}  // namespace retake::spelling
