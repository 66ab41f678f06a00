// See model.h.
#include "sampler/model.h"

#include <utility>

#include "sampler/check.h"

namespace retake {

Model::Model(std::vector<Variable> variables, std::function<bool(const State&)> in_support)
    : variables_(std::move(variables)), governed_(variables_.size()), in_support_(std::move(in_support)) {
  for (std::size_t i = 0; i < variables_.size(); ++i) {
    if (variables_[i].is_override)
      CHECK(!variables_[i].switch_index && variables_[i].prior.kind() != Distribution::Kind::on_off,
            variables_[i].name);
    else
      CHECK(i == 0 || !variables_[i - 1].is_override, variables_[i].name);
    if (!variables_[i].switch_index) continue;
    const std::size_t governor = *variables_[i].switch_index;
    CHECK(governor < i, variables_[i].name);
    CHECK(variables_[governor].prior.kind() == Distribution::Kind::on_off, variables_[i].name);
    CHECK(!variables_[governor].switch_index, variables_[i].name);
    governed_[governor].push_back(i);
  }
}

void Model::draw(RandomStream& random, State& state) const {
  state.setConstant(static_cast<Eigen::Index>(size()), kAbsent);
  for (std::size_t i = 0; i < size() && !variables_[i].is_override; ++i)
    state[static_cast<Eigen::Index>(i)] = draw_one(i, random, state);
}

double Model::log_prior(const State& state) const {
  double sum = 0;
  for (std::size_t i = 0; i < size() && !variables_[i].is_override; ++i)
    if (is_present(state, i)) sum += variables_[i].prior.log_density(state[static_cast<Eigen::Index>(i)]);
  if (in_support_ && !in_support_(state)) return -std::numeric_limits<double>::infinity();
  return sum;
}

}  // namespace retake
