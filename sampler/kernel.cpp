// See kernel.h.
#include "sampler/kernel.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

double log_density(const Model& model, const State& state, std::size_t variable) {
  return model.variables()[variable].prior.log_density(at(state, variable));
}

}  // namespace

// --- Redraw -----------------------------------------------------------------------------------

Redraw::Redraw(const Model& model, std::vector<std::size_t> block, Ratios ratios)
    : block_(std::move(block)), ratios_(ratios) {
  std::sort(block_.begin(), block_.end());  // a switch before what it governs
  std::vector<bool> in_block(model.size(), false);
  for (const std::size_t variable : block_) {
    CHECK(variable < model.size(), variable);
    CHECK(!in_block[variable], variable);
    in_block[variable] = true;
  }
  for (const std::size_t variable : block_)
    for (const std::size_t governed : model.governed_by(variable))
      CHECK(in_block[governed], governed);
}

Redraw Redraw::all(const Model& model, Ratios ratios) {
  std::vector<std::size_t> block(model.size());
  std::iota(block.begin(), block.end(), std::size_t{0});
  return Redraw(model, std::move(block), ratios);
}

double Redraw::propose(const Model& model, const State& current, State& candidate,
                       RandomStream& random) const {
  double log_forward = 0, log_backward = 0;
  for (const std::size_t variable : block_) {
    const bool counts = !model.variables()[variable].is_override;  // in log_prior
    if (counts && model.is_present(current, variable)) log_backward += log_density(model, current, variable);
    at(candidate, variable) = model.draw_one(variable, random, candidate);
    if (counts && model.is_present(candidate, variable))
      log_forward += log_density(model, candidate, variable);
  }
  // The paper calls this proposal symmetric.
  return ratios_ == Ratios::exact ? log_backward - log_forward : 0;
}

// --- Perturb ----------------------------------------------------------------------------------

Perturb::Perturb(std::vector<Group> groups) : groups_(std::move(groups)) {
  for (const Group& group : groups_) {
    CHECK(!group.variables.empty() && group.size > 0, group.size);
    CHECK(group.probability > 0 && group.probability <= 1, group.probability);
    CHECK(group.shape != Shape::radial || (group.variables.size() >= 2 && group.variables.size() <= 3));
  }
}

double Perturb::propose(const Model& model, const State& current, State& candidate,
                        RandomStream& random) const {
  for (const Group& group : groups_) {
    if (group.probability < 1 && !random.bernoulli(group.probability)) continue;
    std::array<double, 3> direction{1, 1, 1};
    double distance = group.size;
    if (group.shape == Shape::radial) {
      double squared_length = 0;
      for (std::size_t i = 0; i < group.variables.size(); ++i) {
        direction[i] = random.gaussian();
        squared_length += direction[i] * direction[i];
      }
      distance *= random.gaussian() / std::sqrt(squared_length);
    }
    for (std::size_t i = 0; i < group.variables.size(); ++i) {
      const std::size_t variable = group.variables[i];
      double step = 0;
      switch (group.shape) {
        case Shape::uniform:
          step = group.size * (2 * random.uniform() - 1);
          break;
        case Shape::gaussian:
          step = group.size * random.gaussian();
          break;
        case Shape::radial:
          step = distance * direction[i];
          break;
      }
      if (model.is_present(current, variable))
        at(candidate, variable) = model.variables()[variable].prior.wrap(at(current, variable) + step);
    }
  }
  return 0;
}

// --- Toggle -----------------------------------------------------------------------------------

Toggle::Toggle(const Model& model, std::vector<std::size_t> switches, double probability, Ratios ratios)
    : switches_(std::move(switches)), probability_(probability), ratios_(ratios) {
  CHECK(probability > 0 && probability < 1, probability);
  for (const std::size_t index : switches_) {
    CHECK(index < model.size(), index);
    CHECK(model.variables()[index].prior.kind() == Distribution::Kind::on_off, index);
  }
}

double Toggle::propose(const Model& model, const State& current, State& candidate,
                       RandomStream& random) const {
  const bool turn_on = random.bernoulli(0.5);
  const double before = turn_on ? 0 : 1;
  double eligible = 0, turned = 0, log_governed = 0;
  for (const std::size_t index : switches_) {
    if (at(current, index) != before) continue;
    ++eligible;
    if (!random.bernoulli(probability_)) continue;
    ++turned;
    at(candidate, index) = 1 - before;
    for (const std::size_t variable : model.governed_by(index)) {
      at(candidate, variable) = turn_on ? model.variables()[variable].prior.draw(random) : kAbsent;
      log_governed += log_density(model, turn_on ? candidate : current, variable);
    }
  }
  // Choosing these `turned` of `eligible`: t^j (1-t)^(eligible-j); the way back chooses the same ones of
  // those that stand on the other side then. What is drawn anew has the prior's density.
  const double eligible_back = static_cast<double>(switches_.size()) - eligible + turned;
  const double log_choice = ((eligible_back - turned) - (eligible - turned)) * std::log1p(-probability_);
  if (ratios_ == Ratios::exact) return log_choice + (turn_on ? -log_governed : log_governed);
  return turn_on ? log_governed : -log_governed;  // as printed in B.2
}

// --- LocalMove --------------------------------------------------------------------------------

LocalMove::LocalMove(const Model& model, std::vector<std::size_t> block) : block_(std::move(block)) {
  CHECK(!block_.empty());
  for (std::size_t i = 0; i < model.size(); ++i) {
    const bool is_switch = model.variables()[i].prior.kind() == Distribution::Kind::on_off;
    const bool in_block = std::find(block_.begin(), block_.end(), i) != block_.end();
    CHECK(!(is_switch && in_block), i);
    const bool is_override = model.variables()[i].is_override;
    CHECK(!(is_override && in_block), i);
    if (!is_switch && !is_override && !in_block) rest_.push_back(i);
  }
}

double LocalMove::propose(const Model& model, const State& current, State& candidate,
                          RandomStream& random) const {
  const double scale = std::pow(10.0, -2 * random.uniform());
  double log_hastings = 0;
  const auto move = [&](std::size_t variable) {
    if (!model.is_present(current, variable)) return;
    const Distribution& prior = model.variables()[variable].prior;
    const double value = at(current, variable);
    if (prior.kind() == Distribution::Kind::uniform) {
      at(candidate, variable) =
          prior.wrap(value + scale * (random.uniform() - 0.5) * (prior.high() - prior.low()));
      return;
    }
    const double z = (value - prior.mean()) / prior.standard_deviation();
    const double moved = std::sqrt(1 - scale * scale) * z + scale * random.gaussian();
    at(candidate, variable) = prior.mean() + prior.standard_deviation() * moved;
    log_hastings += prior.log_density(value) - prior.log_density(at(candidate, variable));
  };
  const auto move_part = [&](const std::vector<std::size_t>& variables) {
    const bool all = random.bernoulli(0.5);
    for (const std::size_t variable : variables)
      if (all || random.bernoulli(0.4)) move(variable);
  };
  const double u = random.uniform();
  if (u < 0.2) {
    move(block_[random.index(block_.size())]);
  } else if (u < 0.7 || rest_.empty()) {
    move_part(block_);
    if (random.bernoulli(0.3)) move_part(rest_);
  } else if (u < 0.9) {
    if (random.bernoulli(0.5))
      move(rest_[random.index(rest_.size())]);
    else
      move_part(rest_);
  } else {
    for (const auto* part : {&block_, &rest_})
      for (const std::size_t variable : *part)
        move(variable);
  }
  return log_hastings;
}

}  // namespace retake
