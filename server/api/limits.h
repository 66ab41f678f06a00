// ServiceLimits: what a client may ask for at most, with the defaults of what an operator may set.
// doc/api.md, "Limits". The one place where these numbers stand.
#pragma once

#include <cstdint>

namespace retake {

/// Shown at /v1/limits.
struct ServiceLimits {
  std::uint64_t most_listed = 500;
  std::uint64_t listed_by_default = 50;
  std::uint64_t most_chains_per_request = 64;
  std::uint64_t most_live_chains = 1024;
  std::uint64_t most_trace_points = 100'000;  ///< a trace never holds so many
  std::uint64_t most_frame_rate = 240;
  std::uint64_t most_keyframe_numbers = 16'000'000;  ///< of all frames of a document, some 130 MB of text
  std::uint64_t most_samples_per_scenario = 1'000'000;
  std::uint64_t low_water = 0;  ///< a play that leaves fewer unseen samples starts chains again; 0: never
  std::uint64_t refill = 100;   ///< samples that such a chain finds before it finishes

  static constexpr std::uint64_t kMostLowWater = 1'000'000;
  static constexpr std::uint64_t kLongestWait = 5000;  ///< [ms] of a play for a first animation
  static constexpr std::size_t kMostWaiting = 16;      ///< plays at once, a third of all connections
};

}  // namespace retake
