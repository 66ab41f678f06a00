// Route of diagnostics: how well the chains of a scenario agree, over every variable and measure that is a
// quantity. DESIGN section 3, "Diagnostics". The draws are the satisfied iterations that the store holds.
#include <cmath>

#include "sampler/diagnostics.h"
#include "server/api.h"
#include "server/quantities.h"
#include "server/request_fields.h"
#include "server/views.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kMostDraws = 1000;  // a chain; chosen: enough for two digits of every figure
constexpr std::size_t kFewestDraws = 4;   // a chain; below, R-hat is not defined
constexpr std::size_t kMostChains = 32;   // the newest ones; chosen to bound the work of one request

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
