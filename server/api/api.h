// Api: the routes of doc/api.md, version 1. Each file adds the routes of one noun.
// Data flows one way: request -> scenario -> chain -> sample -> store; the routes only read and ask.
#pragma once

#include <nlohmann/json.hpp>

#include "db/store.h"
#include "server/api/document_desk.h"
#include "server/api/limits.h"
#include "server/chains/chain_starter.h"
#include "server/chains/event_hub.h"
#include "server/chains/pilot.h"
#include "server/chains/runner.h"
#include "server/chains/scenario_library.h"
#include "server/http/problem.h"
#include "server/http/server.h"

namespace retake {

/// Everything that the routes work on. Outlives the server.
struct Api {
  Store& store;
  ScenarioLibrary& scenarios;
  EventHub& events;
  Runner& runner;
  ChainStarter& starter;
  Pilot& pilot;
  DocumentDesk& documents;
  ServiceLimits limits;
  const HttpServer& server;
};

void add_world_routes(HttpServer& server, Api& api);
void add_scenario_routes(HttpServer& server, Api& api);
void add_chain_routes(HttpServer& server, Api& api);
void add_sample_routes(HttpServer& server, Api& api);
void add_play_routes(HttpServer& server, Api& api);
void add_diagnostics_routes(HttpServer& server, Api& api);
void add_service_routes(HttpServer& server, Api& api);
void add_event_routes(HttpServer& server, Api& api);
void add_page_routes(HttpServer& server);
void add_all_routes(HttpServer& server, Api& api);

/// A chain as clients see it.
nlohmann::json chain_view(const Api& api, const ChainRecord& record);

/// A 404 that names what is missing.
HttpProblem not_found(std::string_view kind, std::string_view id);

/// The compiled scenario of that id; it belongs to the `kind` of thing `name` that a client asked for.
/// Throws: HttpProblem, 404 if there is none, 409 if its world has another version here.
std::shared_ptr<const Scenario> find_scenario(Api& api, std::string_view id, std::string_view kind,
                                              std::string_view name);

/// A listing from the store; a cursor that it did not hand out is a 400.
template <typename List>
auto listed(List list) {
  try {
    return list();
  } catch (const BadCursor&) {
    throw HttpProblem(400, "bad-query", "The query is wrong",
                      "query parameter cursor was not handed out here",
                      {{"", "query parameter cursor was not handed out for this listing"}});
  }
}

/// A wish for chains of a scenario by the world's default method; what a request, an example and a refill
/// begin with.
ChainWish default_wish(const Scenario& scenario);

}  // namespace retake
