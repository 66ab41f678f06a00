// DieKernels: proposals that lead from one throw of dice to another and leave p(A | satisfied) as it is; see
// moves.h. It must not know how a first throw is found.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sampler/guide.h"
#include "worlds/dice/dice_model.h"
#include "worlds/dice/end_wish.h"
#include "worlds/dice/tumble.h"

namespace retake::dice {

/// What all moves know.
struct Known {
  std::shared_ptr<const DiceModel> model;
  EngineSettings engine;
  std::vector<EndWish> wishes;  ///< of each die
  EndMeasures measures;

  std::size_t dice() const { return wishes.size(); }
  std::int64_t steps(double seconds) const { return std::llround(seconds / engine.time_step); }
};

/// Requires: it has a run.
const Tumble& tumble(const Simulated& simulated);

/// Moves the launch of a die by a step of so much of its prior's deviations, which leaves the prior as it is
/// (Neal 1998; "pCN"); a step of 1 draws it anew.
void walk_launch(const DiceModel& model, std::size_t die, double size, State& state, RandomStream& random);
/// The first die whose launch is another one.
std::optional<std::size_t> die_thrown_anew(const DiceModel& model, const State& a, const State& b);
/// Whether a die meets another one in this step or later.
bool meets_since(const Tumble& run, std::size_t die, std::int64_t step);
/// None: it lies beyond DiceModel::kPatch.
std::optional<std::size_t> index_in_patch(GridPlace place);
void set_point(const DiceModel& model, std::size_t index_in_patch, const ControlPoint& point, State& state);

/// Who gives up a die that is thrown anew, by chance if it will miss its place, and for sure if it meets
/// another one although it may not.
std::unique_ptr<Watch> watch_throw(const Known& known, std::size_t die, bool may_meet, const State& candidate,
                                   RandomStream& random);
/// Who gives up what makes this die meet another one, and nothing else.
std::unique_ptr<Watch> watch_meetings(std::size_t die, RandomStream& random);

/// Requires: `known` outlives it.
ScoredKernelTable make_die_kernels(const Known& known);

}  // namespace retake::dice
