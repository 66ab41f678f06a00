// See quantities.h.
#include "server/chains/quantities.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::ptrdiff_t kJudgedOfMany = 120;

/// Where the JSON of a sample's measures has a number.
struct Place {
  std::string key;
  std::optional<std::size_t> member{};  ///< of the list that is there
};

/// The number that a measure's JSON stands for.
double number_of(const json& measures, const Place& place) {
  const auto found = measures.find(place.key);
  if (found == measures.end()) return kAbsent;
  if (place.member && (!found->is_array() || *place.member >= found->size())) return kAbsent;
  const json& value = place.member ? (*found)[*place.member] : *found;
  if (value.is_boolean()) return value.get<bool>() ? 1 : 0;
  return value.is_number() ? value.get<double>() : kAbsent;
}

}  // namespace

std::vector<Quantity> quantities(const Scenario& scenario,
                                 const std::vector<std::vector<DrawRecord>>& chains) {
  const std::size_t variables = scenario.model().size();
  std::vector<Quantity> all;
  for (const Variable& variable : scenario.model().variables())
    all.push_back({.name = variable.name, .unit = variable.unit, .is_one_of_many = true, .draws = {}});
  std::vector<Place> places;  // of the measures among them
  std::map<std::string, std::size_t> members;
  for (const Measure& measure : scenario.measures()) {
    if (measure.kind == Measure::Kind::integer_set) continue;
    all.push_back(
        {.name = measure.name, .unit = measure.unit, .is_one_of_many = !measure.list.empty(), .draws = {}});
    places.push_back(measure.list.empty() ? Place{.key = measure.name}
                                          : Place{.key = measure.list, .member = members[measure.list]++});
  }
  for (const std::vector<DrawRecord>& draws : chains) {
    for (Quantity& quantity : all)
      quantity.draws.emplace_back(static_cast<Eigen::Index>(draws.size()));
    for (std::size_t row = 0; row < draws.size(); ++row) {
      const State state = decode_state(draws[row].state);
      const json measures = json::parse(draws[row].measures);
      for (std::size_t k = 0; k < all.size(); ++k)
        all[k].draws.back()[static_cast<Eigen::Index>(row)] =
            k < variables ? state[static_cast<Eigen::Index>(k)] : number_of(measures, places[k - variables]);
    }
  }
  return all;
}

std::vector<Quantity> slowest(std::vector<Quantity> all) {
  const auto is_one_of_many = [](const Quantity& quantity) { return quantity.is_one_of_many; };
  if (std::count_if(all.begin(), all.end(), is_one_of_many) <= kJudgedOfMany) return all;
  std::vector<double> ess;
  for (const Quantity& quantity : all) {
    const double rough = quantity.is_one_of_many ? ess_rough(quantity.draws) : 0;
    ess.push_back(std::isfinite(rough) ? rough : std::numeric_limits<double>::infinity());
  }
  std::vector<double> of_many;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i].is_one_of_many) of_many.push_back(ess[i]);
  std::nth_element(of_many.begin(), of_many.begin() + (kJudgedOfMany - 1), of_many.end());
  const double limit = of_many[kJudgedOfMany - 1];
  std::vector<Quantity> judged;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (ess[i] <= limit && std::isfinite(ess[i])) judged.push_back(std::move(all[i]));
  return judged;
}

}  // namespace retake
