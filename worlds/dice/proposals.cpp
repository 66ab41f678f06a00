// See proposals.h.
#include "worlds/dice/proposals.h"

#include <cmath>
#include <utility>

#include "sampler/check.h"

namespace retake::dice {

RedrawControlPoint::RedrawControlPoint(std::size_t first_override, std::size_t count,
                                       const TableSettings& settings)
    : first_override_(first_override), count_(count), settings_(settings) {
  CHECK(count > 0);
}

double RedrawControlPoint::propose(const Model& model, const State&, State& candidate,
                                   RandomStream& random) const {
  const std::size_t first = first_override_ + 3 * random.index(count_);
  CHECK(first + 2 < model.size() && model.variables()[first].is_override, first);
  const ControlPoint point = draw_control_point(settings_, random);
  candidate.segment<3>(static_cast<Eigen::Index>(first)) =
      Eigen::Vector3d(point.height, point.restitution, point.friction);
  return 0;
}

PerturbOne::PerturbOne(const Model& model, std::vector<std::size_t> variables)
    : variables_(std::move(variables)) {
  CHECK(!variables_.empty());
  for (const std::size_t variable : variables_) {
    const Variable& moved = model.variables()[variable];
    CHECK(moved.prior.kind() != Distribution::Kind::on_off && !moved.is_override, moved.name);
  }
}

double PerturbOne::propose(const Model& model, const State& current, State& candidate,
                           RandomStream& random) const {
  const std::size_t chosen = variables_[random.index(variables_.size())];
  const Distribution& prior = model.variables()[chosen].prior;
  const double size = prior.kind() == Distribution::Kind::gaussian ? prior.standard_deviation()
                                                                   : (prior.high() - prior.low()) / 3;
  const double step = size * std::pow(10.0, -2 * random.uniform()) * random.gaussian();
  const auto index = static_cast<Eigen::Index>(chosen);
  candidate[index] = prior.wrap(current[index] + step);
  return 0;
}

}  // namespace retake::dice
