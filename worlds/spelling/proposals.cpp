// See proposals.h.
#include "worlds/spelling/proposals.h"

#include <cmath>
#include <utility>

#include "sampler/check.h"

namespace retake::spelling {
namespace {

/// log p_w of the Variables before `end` that are present.
double log_prior_before(const Model& model, const State& state, std::size_t end) {
  double sum = 0;
  for (std::size_t i = 0; i < end; ++i)
    if (model.is_present(state, i)) sum += model.variables()[i].prior.log_density(at(state, i));
  return sum;
}

/// log p_w of what these switches govern.
double log_prior_governed(const Model& model, const State& state, const std::vector<std::size_t>& switches) {
  double sum = 0;
  for (const std::size_t index : switches)
    for (const std::size_t variable : model.governed_by(index))
      if (model.is_present(state, variable))
        sum += model.variables()[variable].prior.log_density(at(state, variable));
  return sum;
}

}  // namespace

MoveOneBall::MoveOneBall(const Model& model, std::vector<std::size_t> switches, double step)
    : switches_(std::move(switches)), step_(step) {
  CHECK(step > 0, step);
  for (const std::size_t index : switches_)
    CHECK(model.governed_by(index).size() == 2, index);
}

double MoveOneBall::propose(const Model& model, const State& current, State& candidate,
                            RandomStream& random) const {
  // Choose a ball.
  std::vector<std::size_t> active;
  for (const std::size_t index : switches_)
    if (at(current, index) == 1) active.push_back(index);
  if (active.empty()) return 0;
  const std::size_t chosen = active[random.index(active.size())];

  // Move it: two Gaussian numbers give the direction.
  const double a = random.gaussian(), b = random.gaussian();
  const double scale = step_ * random.gaussian() / std::sqrt(a * a + b * b);
  const std::vector<std::size_t>& drop = model.governed_by(chosen);
  at(candidate, drop[0]) = model.variables()[drop[0]].prior.wrap(at(current, drop[0]) + scale * a);
  at(candidate, drop[1]) = model.variables()[drop[1]].prior.wrap(at(current, drop[1]) + scale * b);
  return 0;
}

PublishedChangeAll::PublishedChangeAll(const Model& model, std::size_t first_offset, double deviation)
    : first_offset_(first_offset), deviation_(deviation) {
  CHECK(first_offset <= model.size() && (model.size() - first_offset) % 3 == 0, first_offset);
}

double PublishedChangeAll::propose(const Model& model, const State& current, State& candidate,
                                   RandomStream& random) const {
  for (std::size_t i = 0; i < first_offset_; ++i)
    at(candidate, i) = model.is_present(candidate, i) ? model.variables()[i].prior.draw(random) : kAbsent;
  for (std::size_t i = first_offset_; i < model.size(); i += 3) {
    Eigen::Vector3d direction;
    for (double& component : direction)
      component = random.gaussian();
    candidate.segment<3>(static_cast<Eigen::Index>(i)) =
        direction * (deviation_ * random.gaussian() / direction.norm());
  }
  return log_prior_before(model, current, first_offset_) - log_prior_before(model, candidate, first_offset_);
}

PublishedToggle::PublishedToggle(const Model& model, std::vector<std::size_t> switches, double probability)
    : switches_(switches), toggle_(model, std::move(switches), probability, Ratios::exact) {}

double PublishedToggle::propose(const Model& model, const State& current, State& candidate,
                                RandomStream& random) const {
  toggle_.propose(model, current, candidate, random);
  return log_prior_governed(model, current, switches_) - log_prior_governed(model, candidate, switches_);
}

}  // namespace retake::spelling
