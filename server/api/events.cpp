// Route of events: one multiplexed stream of server-sent events that shows chains and scenarios live.
#include <chrono>
#include <thread>

#include "server/api/api.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kBetweenRounds{250};  // chosen: as often as chains commit
constexpr std::chrono::milliseconds kHeartbeat{700};      // with a round between: a sign of life each second
constexpr std::size_t kLatestSamples = 8;

std::string event(const char* name, const json& data) {
  return "event: " + std::string(name) +
         "\ndata: " + data.dump(-1, ' ', false, json::error_handler_t::replace) + "\n\n";
}

/// What a stream has to say after a round of changes.
std::string tell(const Api& api, const EventHub::Changes& changes) {
  std::string text;
  for (const std::string& id : changes.deleted_scenarios)
    text += event("scenario-deleted", {{"id", id}});
  for (const std::string& id : changes.scenarios) {
    const auto record = api.store.scenario(id);
    if (!record) continue;
    text += event("scenario", scenario_json(*record));
    if (record->samples == 0) continue;
    json latest = json::array();
    for (const SampleRecord& sample : api.store.samples(id, SampleOrder::newest, kLatestSamples, "").records)
      latest.push_back(sample_json(sample));
    text += event("samples", {{"scenario", id}, {"count", record->samples}, {"latest", std::move(latest)}});
  }
  for (const std::string& id : changes.chains)
    if (const auto record = api.runner.chain(id)) text += event("chain", chain_view(api, *record));
  return text;
}

}  // namespace

void add_event_routes(HttpServer& server, Api& api) {
  server.route("GET", "/v1/events", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    HttpResponse response;
    response.content_type = "text/event-stream";
    response.stream = [&api](const StreamSink& write) {
      std::uint64_t version = 0;
      if (!write("retry: 1000\n\n: hello\n\n")) return;
      while (true) {
        const EventHub::Changes changes = api.events.changes_since(version, kHeartbeat);
        version = changes.version;
        const std::string text = tell(api, changes);
        if (!write(text.empty() ? ": still here\n\n" : text)) return;
        std::this_thread::sleep_for(kBetweenRounds);
      }
    };
    return response;
  });
}

}  // namespace retake
