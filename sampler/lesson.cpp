// See lesson.h.
#include "sampler/lesson.h"

#include <stdexcept>

namespace retake {

std::string_view to_string(LessonKind kind) {
  switch (kind) {
    case LessonKind::unfinished:
      return "unfinished";
    case LessonKind::proposal:
      return "proposal";
    case LessonKind::place:
      return "place";
  }
  return "";
}

LessonKind lesson_kind(std::string_view name) {
  for (const LessonKind kind : {LessonKind::unfinished, LessonKind::proposal, LessonKind::place})
    if (to_string(kind) == name) return kind;
  throw std::logic_error("not a kind of lesson: " + std::string(name));
}

}  // namespace retake
