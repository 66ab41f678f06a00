// See term.h.
#include "worlds/term.h"

#include <cctype>

namespace retake {

std::string wish_in_words(const TermKind& kind, const Parameters& term, const Parameters& model) {
  if (kind.sentence) return kind.sentence(term, model);
  std::string clause = kind.summary;
  clause.front() = static_cast<char>(std::tolower(clause.front()));
  return clause;
}

}  // namespace retake
