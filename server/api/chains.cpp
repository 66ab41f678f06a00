// Routes of chains: start, look, pause, resume, stop, trace.
#include <algorithm>

#include "server/api/api.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"
#include "server/chains/identifiers.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::uint64_t kLargestSeed = (std::uint64_t{1} << 53) - 1;  // what every JSON client keeps exactly
constexpr std::uint64_t kLargestCount = (std::uint64_t{1} << 53) - 1;

ChainRecord chain_record(const Scenario& scenario, std::string_view scenario_id, std::uint32_t index,
                         std::uint64_t seed) {
  ChainRecord record;
  record.id = random_identifier();
  record.scenario = scenario_id;
  record.index = index;
  record.seed = seed;
  record.method = to_string(scenario.world().default_method());
  record.ratios = to_string(Ratios::exact);
  record.created_at = now_milliseconds();
  return record;
}

/// Reads {"count","seed","method","ratios","stop"} and gives the records of new chains.
std::vector<ChainRecord> read_chains(const Api& api, const Scenario& scenario, std::string_view scenario_id,
                                     std::string_view body) {
  BodyFields fields = BodyFields::parse(body);
  const std::uint64_t count = fields.integer("count", 1, api.limits.most_chains_per_request).value_or(1);
  const auto seed = fields.integer("seed", 0, kLargestSeed);
  const auto method = fields.choice("method", method_names());
  const auto ratios = fields.choice("ratios", ratios_names());
  BodyFields stop_fields = fields.object("stop");
  StopRule stop;
  stop.samples = stop_fields.integer("samples", 1, kLargestCount);
  stop.iterations = stop_fields.integer("iterations", 1, kLargestCount);
  stop.seconds = stop_fields.number_above("seconds", 0);
  stop.ess = stop_fields.integer("ess", 1, kMostEffectiveSamples);
  fields.finish();

  const std::uint64_t chosen_seed = seed ? *seed : random_seed();
  std::vector<ChainRecord> records;
  for (std::uint32_t index = 0; index < count; ++index) {
    ChainRecord record = chain_record(scenario, scenario_id, index, chosen_seed);
    if (method) record.method = *method;
    if (ratios) record.ratios = *ratios;
    record.stop = stop;
    records.push_back(std::move(record));
  }
  return records;
}

json chains_json(const Api& api, const std::vector<ChainRecord>& records) {
  json views = json::array();
  for (const ChainRecord& record : records)
    views.push_back(chain_view(api, record));
  return {{"chains", std::move(views)}};
}

void add_control(HttpServer& server, Api& api, const std::string& verb,
                 std::optional<ChainRecord> (Runner::*ask)(std::string_view)) {
  server.route("POST", "/v1/chains/{id}/" + verb, [&api, ask](const HttpRequest& request) {
    QueryFields(request).finish();
    BodyFields::parse(request.body).finish();
    const std::string& id = request.path_values.at("id");
    try {
      const auto record = (api.runner.*ask)(id);
      if (!record) throw not_found("chain", id);
      return json_response(chain_view(api, *record));
    } catch (const Runner::WrongState& refusal) {
      throw HttpProblem(409, "chain-ended", "The chain has ended", refusal.what());
    } catch (const OtherVersion& reason) {
      throw HttpProblem(409, "other-world-version", "The scenario's world has another version here",
                        "Chain " + id + " cannot go on: " + reason.what() + ".");
    }
  });
}

}  // namespace

json chain_view(const Api& api, const ChainRecord& record) {
  return chain_json(record, api.scenarios.find_runnable(record.scenario).get());
}

std::vector<ChainRecord> start_default_chains(Runner& runner, const Scenario& scenario,
                                              std::string_view scenario_id, std::size_t count,
                                              const StopRule& stop) {
  const std::uint64_t seed = random_seed();
  std::vector<ChainRecord> records;
  for (std::uint32_t index = 0; index < count; ++index) {
    records.push_back(chain_record(scenario, scenario_id, index, seed));
    records.back().stop = stop;
  }
  runner.add(records);
  return records;
}

void add_chain_routes(HttpServer& server, Api& api) {
  server.route("POST", "/v1/scenarios/{id}/chains", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    const auto scenario = find_scenario(api, id, "scenario", id);
    const std::vector<ChainRecord> records = read_chains(api, *scenario, id, request.body);
    if (api.runner.counters().live_chains + records.size() > api.limits.most_live_chains)
      throw HttpProblem(429, "too-many-chains", "Too many chains are running",
                        "At most " + std::to_string(api.limits.most_live_chains) +
                            " chains run at once; pause or stop some first.",
                        {}, {{"Retry-After", "5"}});
    api.runner.add(records);
    std::vector<ChainRecord> started;
    for (const ChainRecord& record : records)
      started.push_back(api.runner.chain(record.id).value_or(record));
    HttpResponse response = json_response(chains_json(api, started), 201);
    response.headers.emplace_back("Location", "/v1/scenarios/" + id + "/chains");
    return response;
  });

  server.route("GET", "/v1/scenarios/{id}/chains", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    if (!api.store.scenario(id)) throw not_found("scenario", id);
    return json_response(chains_json(api, api.runner.chains(id)));
  });

  server.route("GET", "/v1/chains/{id}", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    const auto record = api.runner.chain(id);
    if (!record) throw not_found("chain", id);
    return json_response(chain_view(api, *record));
  });

  server.route("GET", "/v1/chains/{id}/trace", [&api](const HttpRequest& request) {
    QueryFields query(request);
    const std::uint64_t points = query.integer("points", 1, api.limits.most_trace_points, 1000);
    query.finish();
    const std::string& id = request.path_values.at("id");
    const auto record = api.store.chain(id);
    if (!record) throw not_found("chain", id);
    const auto scenario = find_scenario(api, record->scenario, "chain", id);
    const Trace trace(scenario->measures(), api.store.trace(id));
    return json_response(trace_json(trace, scenario->measures(), points));
  });

  add_control(server, api, "pause", &Runner::pause);
  add_control(server, api, "resume", &Runner::resume);
  add_control(server, api, "stop", &Runner::stop);
}

}  // namespace retake
