// FaultyWorld: the minimal world with one fault planted, to show that its contract finds it.
#pragma once

#include <memory>

#include "worlds/world.h"

namespace retake::tests {

enum class Planted {
  none,
  still_bodies_swapped,    ///< the roster names what stands still in another order than the animation
  rest_not_set,            ///< Track::settled is promised and stays empty
  rest_set_without_pose,   ///< Track::settled is there, and the puck moves on
  rest_differs_scored,     ///< a run that is only scored rests a little further
  event_differs_scored,    ///< a run that is only scored has another event
  measure_not_written,     ///< what stood there before is left
  joint_proposal,          ///< a proposal draws two Variables as one and says that it drew each: margins stay
  wrong_ratio,             ///< a proposal towards the mean calls itself symmetric
  density_above_zero,      ///< of a term, where it is satisfied
  leaks_after_stop,        ///< who was stopped early rests the next time a little further
  leaks_frames,            ///< a scored run that follows a recorded one rests a little further
  bound_too_tight,         ///< of a term: below what comes of the animation
  bound_too_tight_midway,  ///< before the puck has settled
  stops_too_early,         ///< although what is needed is still within reach
};

/// Requires: for `none` it is the minimal world under another address.
std::unique_ptr<const World> make_faulty_world(Planted planted);

}  // namespace retake::tests
