// See judge.h.
#include "worlds/judge.h"

#include <string>
#include <utility>

#include "sampler/check.h"
#include "worlds/contradictions.h"

namespace retake {
namespace {

using nlohmann::json;

/// The kind of term that a constraint names; null, and a fault, if it names none.
const TermKind* read_kind(const Judge::Offer& offer, const json& constraint, const std::string& pointer,
                          std::vector<Fault>& faults) {
  if (!constraint.is_object()) {
    faults.push_back({pointer, "expected an object, got " + std::string(constraint.type_name())});
    return nullptr;
  }
  std::vector<std::string> offered;
  const auto given = constraint.find("kind");
  for (const TermKind& kind : offer.kinds) {
    if (given != constraint.end() && *given == kind.kind) return &kind;
    offered.push_back(kind.kind);
  }
  faults.push_back({append_pointer(pointer, "kind"),
                    std::string(given == constraint.end() ? "is required" : "is not a kind of this world") +
                        "; " + std::string(offer.name) + " offers " + list_of_names(offered)});
  return nullptr;
}

}  // namespace

Judge Judge::read(const Offer& offer, const json& given, const Parameters* model, std::string_view pointer,
                  std::vector<Fault>& faults) {
  Judge judge;
  if (!given.is_array()) {
    faults.push_back({std::string(pointer), "expected an array, got " + std::string(given.type_name())});
    return judge;
  }
  if (given.size() > kMostTerms) {
    faults.push_back({std::string(pointer), "at most " + std::to_string(kMostTerms) + " are allowed"});
    return judge;
  }
  std::vector<Claimant> claimants;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const std::string place = append_pointer(pointer, i);
    json fields = given[i];
    const TermKind* kind = read_kind(offer, fields, place, faults);
    if (!kind) continue;
    const std::size_t faults_before = faults.size();
    if (kind->fit && model) kind->fit(fields, *model, place, faults);
    const Parameters parameters = kind->parameters.read(fields, place, faults, {"kind"});
    if (model && faults.size() == faults_before) {
      judge.terms_.push_back(kind->make(parameters, *model, place, faults));
      if (faults.size() == faults_before)
        claimants.push_back({place, wish_in_words(*kind, parameters, *model), judge.terms_.back()->claims()});
    }
    json filled = parameters.document();
    filled["kind"] = kind->kind;
    judge.document_.push_back(std::move(filled));
  }

  // What the terms say together.
  find_contradictions(claimants, faults);
  for (const auto& term : judge.terms_) {
    if (!term) continue;  // it has a fault
    const std::vector<Measure> measures = term->measures();
    judge.measure_counts_.push_back(measures.size());
    judge.measures_.insert(judge.measures_.end(), measures.begin(), measures.end());
    judge.reads_frames_ |= term->reads_frames();
    judge.least_when_satisfied_ += term->least_when_satisfied();
  }
  return judge;
}

TermScore Judge::score(const Animation& animation, std::span<double> values) const {
  TermScore all;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const std::size_t measures = measure_counts_[i];
    const TermScore said = terms_[i]->score(animation, values.first(measures));
    CHECK(said.log_density <= 0, said.log_density);
    all.log_density += said.log_density;
    all.satisfied &= said.satisfied;
    values = values.subspan(measures);
  }
  return all;
}

std::vector<Body> Judge::markers(const Animation& shown) const {
  std::vector<Body> all;
  for (const auto& term : terms_)
    for (Body& marker : term->markers(shown))
      all.push_back(std::move(marker));
  return all;
}

}  // namespace retake
