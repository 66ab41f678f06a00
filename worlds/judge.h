// Judge: constraint terms over any Animation, stored or simulated; p_c is their product.
// Paper, section 3.2; doc/design.md, section 4. It must not know which world made the Animation, nor
// scenarios.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "worlds/animation.h"
#include "worlds/measure.h"
#include "worlds/parameters.h"
#include "worlds/term.h"

namespace retake {

/// Immutable once read. Thread safety: shared by all threads.
class Judge {
 public:
  static constexpr std::size_t kMostTerms = 32;  ///< chosen: more than any scene needs

  /// Who offers kinds of terms, for messages: a world's name.
  struct Offer {
    std::string_view name;
    std::span<const TermKind> kinds;
  };
  /// Reads an array of terms. Appends every fault with its pointer; what has a fault is no term.
  /// A null `model` is one with a fault: the terms' own fields are read, and none is made.
  static Judge read(const Offer& offer, const nlohmann::json& given, const Parameters* model,
                    std::string_view pointer, std::vector<Fault>& faults);

  const Terms& terms() const { return terms_; }
  /// The array with every default filled in; equal wishes have equal documents.
  const nlohmann::json& document() const { return document_; }
  /// Of every term, one after another; names may come twice.
  const std::vector<Measure>& measures() const { return measures_; }
  /// True if a term reads the frames of the tracks, not only rests and events.
  bool reads_frames() const { return reads_frames_; }
  /// The least log density of a satisfied animation; see Term.
  double least_when_satisfied() const { return least_when_satisfied_; }

  /// Scores a finished animation and writes measures(), of which there is a value each.
  TermScore score(const Animation& animation, std::span<double> values) const;
  /// Bodies that show a viewer what is wished; see Term.
  std::vector<Body> markers(const Animation& shown) const;

 private:
  Terms terms_;
  nlohmann::json document_ = nlohmann::json::array();
  std::vector<Measure> measures_;
  std::vector<std::size_t> measure_counts_;  ///< of each term
  bool reads_frames_ = false;
  double least_when_satisfied_ = 0;
};

}  // namespace retake
