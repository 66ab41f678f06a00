// See marbles.h. The tables here are meant to be read beside appendices B.1 and B.2 of the paper.
#include "worlds/spelling/marbles.h"

#include <cmath>
#include <string>
#include <utility>

#include "sampler/check.h"
#include "worlds/spelling/proposals.h"

namespace retake::spelling {
namespace {

std::vector<Variable> variables(const Box& box, std::size_t marbles) {
  std::vector<Variable> all;
  const Rectangle area = box.drop_area();
  for (std::size_t marble = 0; marble < marbles; ++marble) {
    const std::string name = "ball_" + std::to_string(marble + 1);
    const std::size_t index = all.size();
    all.push_back({.name = name, .unit = "", .prior = Distribution::on_off(0.5)});
    all.push_back({.name = name + "_x",
                   .unit = "m",
                   .prior = Distribution::uniform(area.min_x, area.max_x),
                   .switch_index = index});
    all.push_back({.name = name + "_z",
                   .unit = "m",
                   .prior = Distribution::uniform(area.min_z, area.max_z),
                   .switch_index = index});
  }
  for (std::size_t group = 0; group < box.group_count(); ++group)
    for (const char* component : {"_x", "_y", "_z"})
      all.push_back({.name = "vertex_" + std::to_string(group + 1) + component,
                     .unit = "m",
                     .prior = Distribution::gaussian(0, kOffsetDeviation)});
  return all;
}

}  // namespace

MarbleModel::MarbleModel(const Box& box, std::size_t marbles)
    : marbles_(marbles), groups_(box.group_count()) {
  CHECK(marbles > 0);
  const auto first_offset = static_cast<Eigen::Index>(offset_of(0));
  model_ = std::make_shared<const Model>(variables(box, marbles), [first_offset](const State& state) {
    return (state.tail(state.size() - first_offset).array().abs() <= impulse::TriangleIndex::kMaxOffset)
        .all();
  });
}

Drops MarbleModel::read(const State& state) const {
  Drops drops;
  drops.places.resize(marbles_);
  for (std::size_t marble = 0; marble < marbles_; ++marble)
    if (at(state, switch_of(marble)) == 1)
      drops.places[marble] = Eigen::Vector2d(at(state, drop_of(marble)), at(state, drop_of(marble) + 1));
  for (std::size_t group = 0; group < groups_; ++group)
    drops.offsets.push_back(state.segment<3>(static_cast<Eigen::Index>(offset_of(group))));
  return drops;
}

KernelTable MarbleModel::kernels(Ratios ratios) const {
  constexpr double kMovedShare = 0.02;         // of the vertices
  constexpr double kVertexStep = 0.00005;      // [m]
  constexpr double kBallStep = kOpening;       // "s is the bin size"
  constexpr double kSwitchProbability = 0.25;  // of each ball that may be switched

  std::vector<std::size_t> switches;
  for (std::size_t marble = 0; marble < marbles_; ++marble)
    switches.push_back(switch_of(marble));
  std::vector<Perturb::Group> vertices;
  for (std::size_t group = 0; group < groups_; ++group)
    vertices.push_back({.variables = {offset_of(group), offset_of(group) + 1, offset_of(group) + 2},
                        .shape = Perturb::Shape::radial,
                        .size = kVertexStep,
                        .probability = kMovedShare});

  std::shared_ptr<const Kernel> change_all, on_off;
  if (ratios == Ratios::exact) {
    change_all = std::make_shared<const Redraw>(Redraw::all(*model_, ratios));
    on_off = std::make_shared<const Toggle>(*model_, switches, kSwitchProbability, ratios);
  } else {
    change_all = std::make_shared<const PublishedChangeAll>(*model_, offset_of(0), kOffsetDeviation);
    on_off = std::make_shared<const PublishedToggle>(*model_, switches, kSwitchProbability);
  }
  return KernelTable({
      {"change_all", 0.04, change_all},
      {"vertices", 0.32, std::make_shared<const Perturb>(std::move(vertices))},
      {"ball", 0.32, std::make_shared<const MoveOneBall>(*model_, switches, kBallStep)},
      {"on_off", 0.32, on_off},
  });
}

}  // namespace retake::spelling
