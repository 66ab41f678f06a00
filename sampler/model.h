// Model: everything that is uncertain in a world, as a table of random Variables; p_w of the paper.
// Paper, section 3.1. It must not know what the numbers mean to a simulator.
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sampler/distribution.h"
#include "sampler/random.h"

namespace retake {

/// One number for each Variable of a Model, in the order of its table. A Variable whose switch is off is
/// absent.
using State = Eigen::VectorXd;

/// The value of the Variable that stands at `variable` in the Model's table.
inline double& at(State& state, std::size_t variable) {
  return state[static_cast<Eigen::Index>(variable)];
}
inline double at(const State& state, std::size_t variable) {
  return state[static_cast<Eigen::Index>(variable)];
}

/// The value of an absent Variable; it never compares equal, so using it by mistake shows.
inline constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

struct Variable {
  std::string name;
  std::string unit;  ///< "" for a pure number
  Distribution prior;
  std::optional<std::size_t>
      switch_index{};  ///< the Switch that governs its presence; always present if none
  /// Overrides what other Variables decide already, such as one value of a random field that a key gives
  /// whole: present only where a kernel has set it. Draws of the prior leave it absent. log_prior leaves it
  /// out: whatever sets one draws it from `prior`, which on the field as a whole cancels.
  bool is_override = false;
};

/// Immutable once made. Thread safety: shared by all threads.
class Model {
 public:
  /// `in_support` refuses states that no single prior can refuse (a ball that starts inside the lane).
  /// Requires: a governing switch is an on_off Variable without a switch of its own and stands before what it
  /// governs; overrides have no switch, are none, and stand after everything else.
  explicit Model(std::vector<Variable> variables, std::function<bool(const State&)> in_support = {});

  const std::vector<Variable>& variables() const { return variables_; }
  std::size_t size() const { return variables_.size(); }
  bool is_present(const State& state, std::size_t variable) const {
    if (variables_[variable].is_override) return !std::isnan(at(state, variable));
    const auto& governor = variables_[variable].switch_index;
    return !governor || at(state, *governor) == 1;
  }
  /// What no single prior can refuse; log_prior is minus infinity where it is false.
  bool in_support(const State& state) const { return !in_support_ || in_support_(state); }
  /// True if there are draws of the prior outside its support.
  bool restricts_support() const { return static_cast<bool>(in_support_); }
  /// The Variables that a Switch governs.
  const std::vector<std::size_t>& governed_by(std::size_t switch_index) const {
    return governed_[switch_index];
  }

  /// Draws every Variable from its prior, without regard to in_support: draws outside it are misses, so that
  /// densities stay closed-form.
  void draw(RandomStream& random, State& state) const;
  /// A draw of one Variable's prior, given its switch in `state`; kAbsent where it is absent.
  double draw_one(std::size_t variable, RandomStream& random, const State& state) const {
    const Variable& drawn = variables_[variable];
    return !drawn.is_override && is_present(state, variable) ? drawn.prior.draw(random) : kAbsent;
  }

  /// log p_w: the sum over present Variables, overrides apart; minus infinity outside the support. Requires:
  /// state.size() == size().
  double log_prior(const State& state) const;

 private:
  std::vector<Variable> variables_;
  std::vector<std::vector<std::size_t>> governed_;
  std::function<bool(const State&)> in_support_;
};

}  // namespace retake
