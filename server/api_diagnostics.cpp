// Route of diagnostics: how well the chains of a scenario agree, over every variable and measure.
// DESIGN section 3, "Diagnostics". The draws are the satisfied iterations that the store holds.
#include <algorithm>
#include <cmath>

#include "sampler/diagnostics.h"
#include "server/api.h"
#include "server/request_fields.h"
#include "server/views.h"
#include "worlds/animation_codec.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kMostDraws = 1000;  // a chain; chosen: enough for two digits of every figure
constexpr std::size_t kFewestDraws = 4;   // a chain; below, R-hat is not defined
constexpr std::size_t kMostChains = 32;   // the newest ones; chosen to bound the work of one request

/// The draws of one quantity: a column a chain.
struct Quantity {
  std::string name;
  Eigen::MatrixXd draws;
};

/// Draws of each chain that has enough; a Markov chain's first quarter is left out as warm-up.
std::vector<std::vector<DrawRecord>> chain_draws(const Api& api, const std::string& scenario) {
  std::vector<ChainRecord> records = api.store.chains(scenario);
  if (records.size() > kMostChains) records.erase(records.begin(), records.end() - kMostChains);
  std::vector<std::vector<DrawRecord>> chains;
  for (const ChainRecord& record : records) {
    const bool walks = record.method != to_string(Method::rejection);
    auto draws = api.store.draws(record.id, kMostDraws, walks ? record.counters.iteration / 4 : 0);
    if (draws.size() >= kFewestDraws) chains.push_back(std::move(draws));
  }
  return chains;
}

std::vector<Quantity> quantities(const Scenario& scenario,
                                 const std::vector<std::vector<DrawRecord>>& chains) {
  std::size_t count = kMostDraws;
  for (const auto& draws : chains)
    count = std::min(count, draws.size());
  std::vector<Quantity> all;
  for (const Variable& variable : scenario.model().variables())
    all.push_back({variable.name, {}});
  for (const std::string& measure : scenario.measure_names())
    all.push_back({measure, {}});
  for (Quantity& quantity : all)
    quantity.draws.resize(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(chains.size()));
  for (std::size_t column = 0; column < chains.size(); ++column)
    for (std::size_t row = 0; row < count; ++row) {
      const DrawRecord& draw = chains[column][row * chains[column].size() / count];
      const State state = decode_state(draw.state);
      const json measures = json::parse(draw.measures);
      for (std::size_t k = 0; k < all.size(); ++k) {
        const bool is_variable = k < scenario.model().size();
        double value = kAbsent;
        if (is_variable)
          value = state[static_cast<Eigen::Index>(k)];
        else if (const auto found = measures.find(all[k].name); found != measures.end() && found->is_number())
          value = found->get<double>();
        all[k].draws(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) = value;
      }
    }
  return all;
}

json finite(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

}  // namespace

void add_diagnostics_routes(HttpServer& server, Api& api) {
  server.route("GET", "/v1/scenarios/{id}/diagnostics", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    const auto scenario = api.scenarios.find(id);
    if (!scenario) throw not_found("scenario", id);
    const auto chains = chain_draws(api, id);
    json views = json::array();
    std::size_t draws_per_chain = 0;
    if (!chains.empty())
      for (const Quantity& quantity : quantities(*scenario, chains)) {
        const QuantityDiagnostics said = diagnose(quantity.draws);
        draws_per_chain = static_cast<std::size_t>(quantity.draws.rows());
        views.push_back({{"name", quantity.name},
                         {"rhat", finite(said.rhat)},
                         {"ess_bulk", finite(said.ess_bulk)},
                         {"ess_tail", finite(said.ess_tail)},
                         {"mean", finite(said.mean)},
                         {"sd", finite(said.sd)}});
      }
    std::uint64_t iterations = 0, simulations = 0;
    for (const ChainRecord& chain : api.store.chains(id)) {
      iterations += chain.counters.iteration;
      simulations += chain.counters.simulations;
    }
    return json_response({{"quantities", std::move(views)},
                          {"chains", chains.size()},
                          {"draws_per_chain", draws_per_chain},
                          {"saved", {{"iterations", iterations}, {"simulations", simulations}}},
                          {"swaps", json::array()}});
  });
}

}  // namespace retake
