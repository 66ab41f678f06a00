// Routes of chains: start, look, pause, resume, stop, trace.
#include <algorithm>

#include "server/api/api.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::uint64_t kLargestSeed = (std::uint64_t{1} << 53) - 1;  // what every JSON client keeps exactly
constexpr std::uint64_t kLargestCount = (std::uint64_t{1} << 53) - 1;

/// Reads {"count","seed","method","ratios","lesson","stop"}.
ChainWish read_wish(const Api& api, const Scenario& scenario, std::string_view body) {
  ChainWish wish = default_wish(scenario);
  BodyFields fields = BodyFields::parse(body);
  wish.count =
      static_cast<std::uint32_t>(fields.integer("count", 1, api.limits.most_chains_per_request).value_or(1));
  wish.seed = fields.integer("seed", 0, kLargestSeed);
  std::vector<std::string> methods = method_names();
  methods.emplace_back(kAutoMethod);
  const auto method = fields.choice("method", methods);
  if (method && *method != kAutoMethod) wish.method = *method;
  if (const auto ratios = fields.choice("ratios", ratios_names())) wish.ratios = *ratios;
  wish.lesson = fields.integer("lesson", 0, kLargestCount);
  BodyFields stop = fields.object("stop");
  wish.stop.samples = stop.integer("samples", 1, kLargestCount);
  wish.stop.counted = stop.integer("counted", 1, kLargestCount);
  wish.stop.iterations = stop.integer("iterations", 1, kLargestCount);
  wish.stop.seconds = stop.number_above("seconds", 0);
  wish.stop.ess = stop.integer("ess", 1, kMostEffectiveSamples);
  fields.finish();
  return wish;
}

/// Starts what a request asks for. Throws: HttpProblem.
ChainStarter::Started start_chains(Api& api, const Scenario& scenario, std::string_view id,
                                   std::string_view body) {
  const ChainWish wish = read_wish(api, scenario, body);
  try {
    return api.starter.start(id, wish, api.limits.most_live_chains);
  } catch (const ChainStarter::UnknownLesson& fault) {
    throw InvalidRequest(std::vector<Fault>{{"/lesson", fault.what()}});
  } catch (const ChainStarter::TooManyChains&) {
    throw HttpProblem(429, "too-many-chains", "Too many chains are running",
                      "At most " + std::to_string(api.limits.most_live_chains) +
                          " chains run at once; pause or stop some first.",
                      {}, {{"Retry-After", "5"}});
  }
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

ChainWish default_wish(const Scenario& scenario) {
  return {.method = std::string(to_string(scenario.world().default_method())),
          .ratios = std::string(to_string(Ratios::exact))};
}

void add_chain_routes(HttpServer& server, Api& api) {
  server.route("POST", "/v1/scenarios/{id}/chains", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    const auto scenario = find_scenario(api, id, "scenario", id);
    const ChainStarter::Started started = start_chains(api, *scenario, id, request.body);
    HttpResponse response = json_response(chains_json(api, started.chains), started.created > 0 ? 201 : 200);
    response.headers.emplace_back("Location", "/v1/scenarios/" + id + "/chains");
    return response;
  });

  server.route("GET", "/v1/scenarios/{id}/chains", [&api](const HttpRequest& request) {
    QueryFields query(request);
    const std::uint64_t limit =
        query.integer("limit", 1, api.limits.most_listed, api.limits.listed_by_default);
    const std::string cursor = query.text("cursor", "");
    query.finish();
    const std::string& id = request.path_values.at("id");
    if (!api.store.world_of(id)) throw not_found("scenario", id);
    const Page<ChainRecord> page = listed([&] { return api.runner.chains(id, limit, cursor); });
    json body = chains_json(api, page.records);
    if (!page.next_cursor.empty()) body["next_cursor"] = page.next_cursor;
    return json_response(body);
  });

  server.route("GET", "/v1/scenarios/{id}/lessons", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    if (!api.store.world_of(id)) throw not_found("scenario", id);
    return json_response(lessons_json(api.store.lessons(id)));
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
