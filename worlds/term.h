// Term: one constraint of a scenario; p_c is the product of its terms.
// Paper, section 3.2; doc/design.md, section 4. A term reads the Animation alone and must not know which
// world made it.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "worlds/animation.h"
#include "worlds/claim.h"
#include "worlds/measure.h"
#include "worlds/parameters.h"

namespace retake {

struct TermScore {
  double log_density = 0;  ///< <= 0, up to a constant
  bool satisfied = true;
};

/// Immutable. Thread safety: shared by all threads.
class Term {
 public:
  virtual ~Term() = default;
  /// What `score` measures, such as "miss".
  virtual std::vector<Measure> measures() const { return {}; }
  /// True if the term reads the frames of the tracks, not only rests and events.
  virtual bool reads_frames() const { return false; }
  /// Scores a finished animation and writes its measures into `values`, one for each of measures().
  virtual TermScore score(const Animation& animation, std::span<double> values) const = 0;
  /// The least log density of a satisfied animation; 0 for a term that is constant where it is satisfied,
  /// minus infinity if unknown: nothing can then be stopped early for want of satisfaction alone.
  virtual double least_when_satisfied() const { return -std::numeric_limits<double>::infinity(); }
  /// An upper bound of the log density of every way in which an unfinished animation may go on.
  virtual double upper_bound(const Animation& so_far) const {
    (void)so_far;
    return 0;
  }
  /// What every animation that satisfies the term is like, for whoever looks for terms that exclude each
  /// other. It may leave out anything; what it says has to hold.
  virtual Claims claims() const { return {}; }
  /// Pairs of movers that have to meet, by their names: who keeps them apart does not serve this term.
  virtual std::vector<std::pair<std::string, std::string>> meetings() const { return {}; }
  /// Bodies without a track that show a viewer what is wished, such as a mark on the table of `shown`, a
  /// recorded animation.
  virtual std::vector<Body> markers(const Animation& shown) const {
    (void)shown;
    return {};
  }
};

/// A kind of term that a world offers.
struct TermKind {
  std::string kind;
  std::string summary;
  ParameterTable parameters;
  /// Makes the term; appends faults, with pointers below `pointer`, for what only the whole document can
  /// tell. Called if neither the model nor the term's own fields have a fault.
  std::function<std::unique_ptr<const Term>(const Parameters& parameters, const Parameters& model,
                                            std::string_view pointer, std::vector<Fault>& faults)>
      make;
  /// Fits the document to the model before its fields are read: fills in defaults that depend on the model,
  /// and appends faults, with pointers below `pointer`, for what the model has no place for. Called with an
  /// object whose fields may be anything, unless the model has a fault. A field that it fills in has a
  /// default in `parameters` too, which the schema publishes: that of the default model.
  std::function<void(nlohmann::json& term, const Parameters& model, std::string_view pointer,
                     std::vector<Fault>& faults)>
      fit{};
  /// What a term without faults wishes, as a clause for people: "pins 6 and 7 stay up, and every other goes
  /// down". Empty: `summary` says it all.
  std::function<std::string(const Parameters& term, const Parameters& model)> sentence{};
};

/// What a term of a kind wishes, as a clause for people. Requires: both were read without a fault.
std::string wish_in_words(const TermKind& kind, const Parameters& term, const Parameters& model);

using Terms = std::vector<std::unique_ptr<const Term>>;

}  // namespace retake
