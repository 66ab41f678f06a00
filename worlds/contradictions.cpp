// See contradictions.h.
#include "worlds/contradictions.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "worlds/words.h"

namespace retake {
namespace {

constexpr std::size_t kMostContradictions = 8;  // chosen: each names two places or more
constexpr double kRoundingOfPlaces = 1e-6;      // [m], [m/s]: what meets within it is not told apart
constexpr double kRoundingOfTimes = 1e-6;       // [s]

/// A claim, and whose it is.
template <typename Demand>
struct Said {
  const Claimant* term;
  const Claim* claim;
  const Demand* demand;
};

/// Who has a part in a contradiction, and of what kind it is, "" if their wishes say it.
struct Contradiction {
  std::vector<std::pair<const Claimant*, const Claim*>> parts;
  std::string how{};
};

/// Every claim of a kind, in the order of the terms.
template <typename Demand>
std::vector<Said<Demand>> all_of(const std::vector<Claimant>& terms) {
  std::vector<Said<Demand>> all;
  for (const Claimant& term : terms)
    for (const Claim& claim : term.claims)
      if (const auto* demand = std::get_if<Demand>(&claim.demand)) all.push_back({&term, &claim, demand});
  return all;
}

template <typename... Demands>
Contradiction between(const Said<Demands>&... said) {
  return {.parts = {{said.term, said.claim}...}};
}

// --- Numbers -----------------------------------------------------------------------------------------

using Numbers = std::vector<Said<NumberClaim>>;

std::set<int> common(const std::set<int>& one, const std::set<int>& other) {
  std::set<int> both;
  std::set_intersection(one.begin(), one.end(), other.begin(), other.end(), std::inserter(both, both.end()));
  return both;
}

std::map<std::string, Numbers> by_what(const std::vector<Claimant>& terms) {
  std::map<std::string, Numbers> all;
  for (const auto& said : all_of<NumberClaim>(terms))
    all[said.demand->what].push_back(said);
  return all;
}

/// Of claims on one number the first that leaves nothing of it, with those that it contradicts.
std::optional<Contradiction> contradiction_of_number(const Numbers& claims) {
  std::set<int> left = claims.front().demand->values;
  for (std::size_t i = 1; i < claims.size(); ++i) {
    left = common(left, claims[i].demand->values);
    if (!left.empty()) continue;
    for (std::size_t k = 0; k < i; ++k)
      if (common(claims[k].demand->values, claims[i].demand->values).empty())
        return between(claims[k], claims[i]);
    Contradiction all;
    for (std::size_t k = 0; k <= i; ++k)
      all.parts.emplace_back(claims[k].term, claims[k].claim);
    return all;
  }
  return std::nullopt;
}

/// Whether numbers that these claims leave can add up to the sum.
bool can_add_up(const SumClaim& sum, const Numbers& claims) {
  std::set<int> sums = {0};
  for (const std::string& what : sum.whats) {
    std::set<int> values;
    for (int value = sum.least; value <= sum.most; ++value)
      values.insert(value);
    for (const auto& said : claims)
      if (said.demand->what == what) values = common(values, said.demand->values);
    std::set<int> next;
    for (const int before : sums)
      for (const int value : values)
        next.insert(before + value);
    sums = std::move(next);
  }
  return sums.contains(sum.sum);
}

/// The sum with as few of the claims as leave it out of reach.
std::optional<Contradiction> contradiction_of_sum(const Said<SumClaim>& sum,
                                                  const std::map<std::string, Numbers>& numbers) {
  Numbers claims;
  for (const std::string& what : sum.demand->whats)
    if (const auto found = numbers.find(what); found != numbers.end())
      claims.insert(claims.end(), found->second.begin(), found->second.end());
  if (can_add_up(*sum.demand, claims)) return std::nullopt;
  for (std::size_t i = claims.size(); i-- > 0;) {
    Numbers fewer = claims;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    if (!can_add_up(*sum.demand, fewer)) claims = std::move(fewer);
  }
  Contradiction found = between(sum);
  for (const auto& said : claims)
    found.parts.emplace_back(said.term, said.claim);
  return found;
}

// --- Places and velocities ---------------------------------------------------------------------------

bool meet(const Region& one, const Region& other) {
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double gap = std::max({one.low[axis] - other.high[axis], other.low[axis] - one.high[axis], 0.0});
    squared += gap * gap;
  }
  return std::sqrt(squared) <= one.radius + other.radius + kRoundingOfPlaces;
}

bool can_both_be(const StateClaim& one, const StateClaim& other) {
  if (one.quantity != other.quantity || one.from > other.to || other.from > one.to) return true;
  if (!one.body && !other.body) return true;  // nobody need take part
  if (one.body && other.body && *one.body != *other.body) return true;
  for (const Region& here : one.regions)
    for (const Region& there : other.regions)
      if (meet(here, there)) return true;
  return false;
}

// --- Order -------------------------------------------------------------------------------------------

/// Events, and which of them come before which: those that terms wish to, strictly, and the first of a kind
/// of touch before the first of a narrower one, or with it.
class Sequence {
 public:
  explicit Sequence(const std::vector<Said<OrderClaim>>& claims) {
    for (const auto& said : claims)
      steps_.push_back({number_of(said.demand->before), number_of(said.demand->after), &said});
    after_.resize(events_.size());
    for (std::size_t step = 0; step < steps_.size(); ++step)
      after_[steps_[step].from].push_back(step);
    wished_ = steps_.size();
    for (std::size_t general = 0; general < events_.size(); ++general)
      for (std::size_t narrow = 0; narrow < events_.size(); ++narrow)
        if (is_wider(general, narrow)) {
          after_[general].push_back(steps_.size());
          steps_.push_back({general, narrow, nullptr});
        }
  }

  /// Circles that have no step in common with one before.
  std::vector<Contradiction> circles() const {
    std::vector<Contradiction> all;
    std::vector<bool> told(wished_, false);
    for (std::size_t step = 0; step < wished_; ++step) {
      if (told[step]) continue;
      const auto way = way_back(steps_[step]);
      if (!way) continue;
      Contradiction circle;
      circle.how = "a circle: " + events_[steps_[step].from]->name;
      std::vector<std::size_t> all_steps = {step};
      all_steps.insert(all_steps.end(), way->begin(), way->end());
      for (const std::size_t each : all_steps) {
        circle.how +=
            (steps_[each].said ? ", then " : ", which is no later than ") + events_[steps_[each].to]->name;
        if (!steps_[each].said) continue;
        told[each] = true;
        circle.parts.emplace_back(steps_[each].said->term, steps_[each].said->claim);
      }
      all.push_back(std::move(circle));
    }
    return all;
  }

 private:
  struct Step {
    std::size_t from, to;
    const Said<OrderClaim>* said;  ///< null: it is so by itself
  };

  std::size_t number_of(const OrderClaim::Event& event) {
    const auto [found, is_new] = numbers_.try_emplace(event.name, events_.size());
    if (is_new) events_.push_back(&event);
    return found->second;
  }

  bool is_wider(std::size_t general, std::size_t narrow) const {
    const auto &one = events_[general]->touch, &other = events_[narrow]->touch;
    return general != narrow && one && other && one->is_general() && other->is_a(*one);
  }

  /// The shortest way of steps from where a step leads to where it begins; none: there is none.
  std::optional<std::vector<std::size_t>> way_back(const Step& begin) const {
    constexpr auto kNone = static_cast<std::size_t>(-1);
    std::vector<std::size_t> by(events_.size(), kNone);  // the step by which an event was come to
    std::vector<bool> seen(events_.size(), false);
    std::deque<std::size_t> front = {begin.to};
    seen[begin.to] = true;
    while (!front.empty() && !seen[begin.from]) {
      const std::size_t event = front.front();
      front.pop_front();
      for (const std::size_t step : after_[event])
        if (const std::size_t next = steps_[step].to; !seen[next]) {
          seen[next] = true;
          by[next] = step;
          front.push_back(next);
        }
    }
    if (!seen[begin.from]) return std::nullopt;
    std::vector<std::size_t> way;
    for (std::size_t event = begin.from; event != begin.to; event = steps_[by[event]].from)
      way.insert(way.begin(), by[event]);
    return way;
  }

  std::map<std::string, std::size_t> numbers_;
  std::vector<const OrderClaim::Event*> events_;
  std::vector<Step> steps_;
  std::size_t wished_ = 0;                       ///< steps that terms wish; the others follow
  std::vector<std::vector<std::size_t>> after_;  ///< steps from each event
};

// --- Touches on beats --------------------------------------------------------------------------------

bool is_bound(const TouchClaim& touch, const BeatClaim& beat) {
  return touch.touch.is_a(beat.touch) && touch.least_impulse >= beat.least_impulse;
}

/// Whether a time that is known but for so much to either side [s] may be some whole periods.
bool may_be_periods(double time, double either_side, double period) {
  return std::abs(std::remainder(time, period)) <= either_side + kRoundingOfTimes;
}

double middle(const TouchClaim& touch) {
  return (touch.from + touch.to) / 2;
}
double half(const TouchClaim& touch) {
  return (touch.to - touch.from) / 2;
}

std::optional<Contradiction> contradiction_of_beat(const Said<BeatClaim>& beat,
                                                   const std::vector<Said<TouchClaim>>& touches) {
  const BeatClaim& wished = *beat.demand;
  for (auto one = touches.begin(); one != touches.end(); ++one) {
    if (!is_bound(*one->demand, wished)) continue;
    const double time = middle(*one->demand), side = half(*one->demand) + wished.tolerance;
    if (wished.offset) {
      if (!may_be_periods(time - *wished.offset, side, wished.period)) return between(beat, *one);
      continue;
    }
    for (auto other = touches.begin(); other != one; ++other)
      if (is_bound(*other->demand, wished) &&
          !may_be_periods(time - middle(*other->demand), side + half(*other->demand) + wished.tolerance,
                          wished.period))
        return between(beat, *other, *one);
  }
  return std::nullopt;
}

// --- The whole ---------------------------------------------------------------------------------------

std::vector<Contradiction> all_contradictions(const std::vector<Claimant>& terms) {
  std::vector<Contradiction> all;
  const auto add = [&](std::optional<Contradiction> found) {
    if (found) all.push_back(std::move(*found));
  };
  const std::map<std::string, Numbers> numbers = by_what(terms);
  for (const auto& [what, claims] : numbers)
    add(contradiction_of_number(claims));
  for (const auto& sum : all_of<SumClaim>(terms))
    add(contradiction_of_sum(sum, numbers));
  const auto states = all_of<StateClaim>(terms);
  for (std::size_t i = 0; i < states.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (!can_both_be(*states[k].demand, *states[i].demand)) add(between(states[k], states[i]));
  const auto orders = all_of<OrderClaim>(terms);
  for (Contradiction& circle : Sequence(orders).circles())
    all.push_back(std::move(circle));
  const auto touches = all_of<TouchClaim>(terms);
  for (const auto& beat : all_of<BeatClaim>(terms))
    add(contradiction_of_beat(beat, touches));
  return all;
}

std::set<const Claimant*> terms_of(const Contradiction& contradiction) {
  std::set<const Claimant*> terms;
  for (const auto& [term, claim] : contradiction.parts)
    terms.insert(term);
  return terms;
}

std::string place_of(const std::pair<const Claimant*, const Claim*>& part) {
  return part.first->pointer + part.second->field;
}

/// At each place once, with the others.
void append_faults(const Contradiction& contradiction, std::vector<Fault>& faults) {
  std::map<std::string, const Claimant*> places;
  for (const auto& part : contradiction.parts)
    places.emplace(place_of(part), part.first);
  for (const auto& [place, term] : places) {
    std::vector<std::string> others;
    for (const auto& [other, whose] : places)
      if (other != place) others.push_back(other + (whose == term ? "" : " (" + whose->wish + ")"));
    std::string detail = "cannot come true";
    if (!others.empty()) detail += " together with " + list_in_words(others);
    if (!contradiction.how.empty()) detail += ": " + contradiction.how;
    faults.push_back({place, std::move(detail)});
  }
}

}  // namespace

bool Touch::is_general() const {
  return one == kAnyBody || other == kAnyBody;
}

bool Touch::is_a(const Touch& general) const {
  const auto covers = [](const std::string& name, const std::string& wished) {
    return name == kAnyBody || name == wished;
  };
  return (covers(general.one, one) && covers(general.other, other)) ||
         (covers(general.one, other) && covers(general.other, one));
}

NumberClaim falls(const std::string& body, bool whether) {
  return {.what = "falls of " + body, .values = {whether ? 1 : 0}};
}

NumberClaim shows(const std::string& body, std::set<int> faces) {
  return {.what = "face of " + body, .values = std::move(faces)};
}

NumberClaim takes_part(const std::string& body) {
  return {.what = "parts of " + body, .values = {1}};
}

void find_contradictions(const std::vector<Claimant>& terms, std::vector<Fault>& faults) {
  std::vector<std::set<const Claimant*>> told;
  for (const Contradiction& contradiction : all_contradictions(terms)) {
    const std::set<const Claimant*> whose = terms_of(contradiction);
    const bool is_known = std::any_of(told.begin(), told.end(), [&](const auto& before) {
      return std::includes(whose.begin(), whose.end(), before.begin(), before.end());
    });
    if (is_known) continue;
    told.push_back(whose);
    append_faults(contradiction, faults);
    if (told.size() == kMostContradictions) return;
  }
}

}  // namespace retake
