// Lesson: what a chain has learned, for other chains to begin from. doc/design.md, section 3, "Lessons".
// It must not know where lessons are kept.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace retake {

/// Raised when what lessons hold changes; one of another version is no longer begun from.
inline constexpr std::uint32_t kLessonVersion = 2;

enum class LessonKind : std::uint8_t {
  unfinished,  ///< the chain ended before it had learned enough; others go on learning from there
  proposal,    ///< a learned proposal, which serves any number of chains alike
  place,  ///< where a walk stood: walks that begin there are near-copies at first, so one goes on from it
};
std::string_view to_string(LessonKind kind);
/// Requires: one of the names that to_string gives.
LessonKind lesson_kind(std::string_view name);

/// Immutable. Bytes belong to one target and one method.
struct Lesson {
  LessonKind kind = LessonKind::proposal;
  std::uint32_t version = kLessonVersion;
  std::string bytes;
};

}  // namespace retake
