// See recorder.h.
#include "worlds/recorder.h"

namespace retake {

void begin_animation(Animation& animation, double rate, std::size_t tracks) {
  animation.rate = rate;
  animation.frames = 0;
  animation.events.clear();
  animation.tracks.resize(tracks);
  for (Track& track : animation.tracks) {
    track.from = 0;
    track.fell.reset();
    track.settled.reset();
  }
}

bool is_out_of_reach(const Recording& recording, const Animation& so_far) {
  double bound = 0;
  for (const auto& term : recording.terms)
    bound += term->upper_bound(so_far);
  return bound <= recording.needed;
}

}  // namespace retake
