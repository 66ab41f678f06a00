// Route of diagnostics: how well the chains of a scenario agree, what they know of its odds, what it took.
// doc/design.md, section 3, "Diagnostics". The draws are the satisfied iterations that the store holds.
#include <algorithm>

#include "server/api/api.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"
#include "server/chains/health.h"

namespace retake {
namespace {

constexpr std::size_t kMostDraws = 1000;  // a chain; chosen: enough for two digits of every figure
// Fewer draws of models with very many variables; chosen: 24 MB, a fifth of a second.
constexpr std::size_t kMostNumbers = 3'000'000;
constexpr std::size_t kFewestDraws = 50;  // a chain; chosen
constexpr std::size_t kMostChains = 32;   // the newest ones; chosen to bound the work of one request

}  // namespace

void add_diagnostics_routes(HttpServer& server, Api& api) {
  server.route("GET", "/v1/scenarios/{id}/diagnostics", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    const auto scenario = find_scenario(api, id, "scenario", id);
    const auto record = api.store.scenario(id);
    if (!record) throw not_found("scenario", id);
    const std::vector<ChainRecord> chains = api.store.chains(id);
    std::vector<std::vector<DrawRecord>> draws(chains.size());
    const std::size_t looked_at = std::min(chains.size(), kMostChains);
    const std::size_t numbers = std::max<std::size_t>(looked_at * scenario->model().size(), 1);
    const std::size_t most = std::clamp(kMostNumbers / numbers, kFewestDraws, kMostDraws);
    for (std::size_t i = chains.size() - looked_at; i < chains.size(); ++i)
      draws[i] = api.store.draws(chains[i].id, most, warm_up_iterations(chains[i]));
    return json_response(diagnostics_json(health_of(*scenario, chains, draws, record->pilot)));
  });
}

}  // namespace retake
