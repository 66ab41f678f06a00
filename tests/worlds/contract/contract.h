// The contract of a world, clause by clause: World, Scene, Physics, Term and Run as their headers promise.
// A clause says what a world does against it and must not know which world it is.
#pragma once

#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

#include "worlds/world.h"

namespace retake::tests {

/// What is found to be wrong, in sentences; the first few of them.
class Faults {
 public:
  template <typename... Said>
  bool expect(bool holds, const Said&... said) {
    if (holds || sentences_.size() == kMost) return holds;
    std::ostringstream sentence;
    (sentence << ... << said);
    sentences_.push_back(sentence.str());
    return holds;
  }
  const std::vector<std::string>& sentences() const { return sentences_; }

 private:
  static constexpr std::size_t kMost = 10;
  std::vector<std::string> sentences_;
};

struct Clause {
  std::string name;
  void (*check)(const World& world, int draws, Faults& faults);
  /// How many States, animations, steps or chains it looks at, each as dear as the world is: enough to find
  /// what is planted in the minimal world.
  int draws;
  int slow_draws = 0;  ///< in the slow tests; 0: it is none of them
};

/// For messages of tests.
inline void PrintTo(const Clause& clause, std::ostream* out) {
  *out << clause.name;
}

const std::vector<Clause>& contract();
/// What a world does against one clause, which is named.
std::vector<std::string> contract_faults(const World& world, const std::string& clause);

namespace clauses {

// Documents.
void describes_itself(const World& world, int, Faults& faults);
void reads_its_examples(const World& world, int, Faults& faults);

// Animations.
void names_bodies(const World& world, int draws, Faults& faults);
void sets_rests(const World& world, int draws, Faults& faults);
void records_consistently(const World& world, int draws, Faults& faults);
void shows_a_view(const World& world, int draws, Faults& faults);

// Simulations.
void scores_what_it_records(const World& world, int draws, Faults& faults);
void writes_measures(const World& world, int draws, Faults& faults);
void remembers_nothing(const World& world, int draws, Faults& faults);
void ends_complete(const World& world, int draws, Faults& faults);

// Densities.
void scores_at_most_zero(const World& world, int draws, Faults& faults);
void stops_what_cannot_matter(const World& world, int draws, Faults& faults);
void walks_the_same_early_or_not(const World& world, int steps, Faults& faults);

// Chains.
void prior_comes_back(const World& world, int chains, Faults& faults);
void satisfies_its_examples(const World& world, int, Faults& faults);

}  // namespace clauses

}  // namespace retake::tests
