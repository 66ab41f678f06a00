// See contract.h.
#include "tests/worlds/contract/contract.h"

#include <algorithm>

#include "sampler/check.h"

namespace retake::tests {

const std::vector<Clause>& contract() {
  using namespace clauses;
  static const std::vector<Clause> all = {
      {.name = "DescribesItself", .check = describes_itself, .draws = 1},
      {.name = "ReadsItsExamples", .check = reads_its_examples, .draws = 1},
      {.name = "NamesBodies", .check = names_bodies, .draws = 3},
      {.name = "SetsRests", .check = sets_rests, .draws = 10},
      {.name = "RecordsConsistently", .check = records_consistently, .draws = 20},
      {.name = "ShowsAView", .check = shows_a_view, .draws = 1},
      {.name = "ScoresWhatItRecords", .check = scores_what_it_records, .draws = 40, .slow_draws = 2000},
      {.name = "WritesMeasures", .check = writes_measures, .draws = 3},
      {.name = "RemembersNothing", .check = remembers_nothing, .draws = 3, .slow_draws = 30},
      {.name = "EndsComplete", .check = ends_complete, .draws = 30},
      {.name = "ScoresAtMostZero", .check = scores_at_most_zero, .draws = 10},
      {.name = "StopsWhatCannotMatter", .check = stops_what_cannot_matter, .draws = 5, .slow_draws = 50},
      {.name = "WalksTheSameEarlyOrNot",
       .check = walks_the_same_early_or_not,
       .draws = 20,
       .slow_draws = 200},
      {.name = "PriorComesBack", .check = prior_comes_back, .draws = 3000},
      // A wish of 1 in 2,500 draws fails once in 10^10.
      {.name = "SatisfiesItsExamples", .check = satisfies_its_examples, .draws = 60000}};
  return all;
}

std::vector<std::string> contract_faults(const World& world, const std::string& clause) {
  const auto found = std::find_if(contract().begin(), contract().end(),
                                  [&](const Clause& each) { return each.name == clause; });
  CHECK(found != contract().end(), clause);
  Faults faults;
  found->check(world, found->draws, faults);
  return faults.sentences();
}

}  // namespace retake::tests
