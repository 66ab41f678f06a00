// Lesson: what a chain has learned, for other chains to begin from. doc/design.md, section 3, "Lessons".
// It must not know where lessons are kept.
#pragma once

#include <cstdint>
#include <string>

namespace retake {

/// Raised when what lessons hold changes; one of another version is no longer begun from.
inline constexpr std::uint32_t kLessonVersion = 1;

/// Immutable. Bytes belong to one target and one method.
struct Lesson {
  std::uint32_t version = kLessonVersion;
  /// It says where a walk stood. Walks that begin from the same place are near-copies at first, so one goes
  /// on from there; what is no place, such as a learned proposal, serves any number of chains alike.
  bool is_place = false;
  std::string bytes;
};

}  // namespace retake
