// Routes of worlds and scenarios.
#include "server/api/api.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"
#include "server/chains/identifiers.h"

namespace retake {

using nlohmann::json;

HttpProblem not_found(std::string_view kind, std::string_view id) {
  return HttpProblem(404, "not-found", "There is no such " + std::string(kind),
                     "There is no " + std::string(kind) + " " + std::string(id) + ".");
}

std::shared_ptr<const Scenario> find_scenario(Api& api, std::string_view id, std::string_view kind,
                                              std::string_view name) {
  try {
    if (auto scenario = api.scenarios.find(id)) return scenario;
  } catch (const OtherVersion& reason) {
    throw HttpProblem(409, "other-world-version", "The scenario's world has another version here",
                      "Scenario " + std::string(id) + ": " + reason.what() +
                          ". Its samples play on. Post its document again to sample this version.");
  }
  throw not_found(kind, name);
}

namespace {

/// A scenario with what its measures and variables mean, as far as this build can run it.
json whole_scenario_json(const Api& api, const ScenarioRecord& record) {
  json view = scenario_json(record);
  if (const auto scenario = api.scenarios.find_runnable(record.id)) {
    view["measures"] = measures_json(scenario->measures());
    view["variable_units"] = variable_units_json(scenario->model());
  }
  return view;
}

std::vector<std::string> chain_ids(const Api& api, std::string_view scenario) {
  std::vector<std::string> ids;
  Page<ChainRecord> page;
  do {
    page = api.store.chains(scenario, api.limits.most_listed, page.next_cursor);
    for (const ChainRecord& chain : page.records)
      ids.push_back(chain.id);
  } while (!page.next_cursor.empty());
  return ids;
}

}  // namespace

void add_world_routes(HttpServer& server, Api&) {
  server.route("GET", "/v1/worlds", [](const HttpRequest& request) {
    QueryFields(request).finish();
    json views = json::array();
    for (const World* world : worlds())
      views.push_back(world_json(*world));
    HttpResponse response = json_response({{"worlds", std::move(views)}});
    response.etag = digest_identifier(response.body, 20);
    return response;
  });
  server.route("GET", "/v1/worlds/{name}", [](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& name = request.path_values.at("name");
    const World* world = find_world(name);
    if (!world) throw not_found("world", name);
    HttpResponse response = json_response(world_json(*world));
    response.etag = digest_identifier(response.body, 20);
    return response;
  });
}

void add_scenario_routes(HttpServer& server, Api& api) {
  server.route("POST", "/v1/scenarios", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const auto scenario = Scenario::read(parse_document(request.body));
    const AddedScenario added = api.store.add_scenario(new_scenario_record(*scenario));
    if (added.created) {
      api.events.scenario_changed(added.scenario.id);
      api.pilot.add(added.scenario.id);
    }
    HttpResponse response =
        json_response(whole_scenario_json(api, added.scenario), added.created ? 201 : 200);
    response.headers.emplace_back("Location", "/v1/scenarios/" + added.scenario.id);
    return response;
  });

  server.route("GET", "/v1/scenarios", [&api](const HttpRequest& request) {
    QueryFields query(request);
    const std::uint64_t limit =
        query.integer("limit", 1, api.limits.most_listed, api.limits.listed_by_default);
    const std::string cursor = query.text("cursor", "");
    query.finish();
    const Page<ScenarioRecord> page = listed([&] { return api.store.scenarios(limit, cursor); });
    json views = json::array();
    for (const ScenarioRecord& record : page.records)
      views.push_back(scenario_json(record));
    json body = {{"scenarios", std::move(views)}};
    if (!page.next_cursor.empty()) body["next_cursor"] = page.next_cursor;
    return json_response(body);
  });

  server.route("GET", "/v1/scenarios/{id}", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    const auto record = api.store.scenario(id);
    if (!record) throw not_found("scenario", id);
    return json_response(whole_scenario_json(api, *record));
  });

  server.route("DELETE", "/v1/scenarios/{id}", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    api.runner.drop_scenario(id);
    const std::vector<std::string> chains = chain_ids(api, id);
    if (!api.store.delete_scenario(id)) throw not_found("scenario", id);
    api.scenarios.forget(id);
    api.events.scenario_deleted(id, chains);
    HttpResponse response;
    response.status = 204;
    return response;
  });
}

}  // namespace retake
