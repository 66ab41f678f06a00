// See quantities.h.
#include "server/quantities.h"

#include <algorithm>

#include "worlds/animation_codec.h"

namespace retake {
namespace {

using nlohmann::json;

/// The number that a measure's JSON stands for.
double number_of(const json& measures, const std::string& name) {
  const auto found = measures.find(name);
  if (found == measures.end()) return kAbsent;
  if (found->is_boolean()) return found->get<bool>() ? 1 : 0;
  return found->is_number() ? found->get<double>() : kAbsent;
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
  for (const Measure& measure : scenario.measures())
    if (measure.kind != Measure::Kind::integer_set) all.push_back({measure.name, {}});
  for (Quantity& quantity : all)
    quantity.draws.resize(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(chains.size()));
  for (std::size_t column = 0; column < chains.size(); ++column)
    for (std::size_t row = 0; row < count; ++row) {
      const DrawRecord& draw = chains[column][row * chains[column].size() / count];
      const State state = decode_state(draw.state);
      const json measures = json::parse(draw.measures);
      for (std::size_t k = 0; k < all.size(); ++k)
        all[k].draws(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
            k < variables ? state[static_cast<Eigen::Index>(k)] : number_of(measures, all[k].name);
    }
  return all;
}

}  // namespace retake
