// See quantities.h.
#include "server/quantities.h"

#include <algorithm>
#include <map>
#include <optional>

#include "worlds/animation_codec.h"

namespace retake {
namespace {

using nlohmann::json;

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
  std::size_t count = chains.at(0).size();
  for (const auto& draws : chains)
    count = std::min(count, draws.size());
  const std::size_t variables = scenario.model().size();
  std::vector<Quantity> all;
  for (const Variable& variable : scenario.model().variables())
    all.push_back({variable.name, {}});
  std::vector<Place> places;  // of the measures among them
  std::map<std::string, std::size_t> members;
  for (const Measure& measure : scenario.measures()) {
    if (measure.kind == Measure::Kind::integer_set) continue;
    all.push_back({measure.name, {}});
    places.push_back(measure.list.empty() ? Place{.key = measure.name}
                                          : Place{.key = measure.list, .member = members[measure.list]++});
  }
  for (Quantity& quantity : all)
    quantity.draws.resize(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(chains.size()));
  for (std::size_t column = 0; column < chains.size(); ++column)
    for (std::size_t row = 0; row < count; ++row) {
      const DrawRecord& draw = chains[column][row * chains[column].size() / count];
      const State state = decode_state(draw.state);
      const json measures = json::parse(draw.measures);
      for (std::size_t k = 0; k < all.size(); ++k)
        all[k].draws(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
            k < variables ? state[static_cast<Eigen::Index>(k)] : number_of(measures, places[k - variables]);
    }
  return all;
}

}  // namespace retake
