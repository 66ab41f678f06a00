// See recorder.h.
#include "worlds/recorder.h"

#include <cmath>

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

std::size_t frames_until(double seconds, double rate) {
  constexpr double kRounding = 1e-9;  // of a frame
  return static_cast<std::size_t>(std::ceil(seconds * rate - kRounding)) + 1;
}

}  // namespace retake
