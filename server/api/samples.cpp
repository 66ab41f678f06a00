// Routes of samples: listings, one sample, its keyframes, its proof.
#include <algorithm>

#include "server/api/api.h"
#include "server/api/keyframe_answers.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"
#include "worlds/formats/formats.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;

SampleRecord find_sample(const Api& api, const std::string& id) {
  auto record = api.store.sample(id);
  if (!record) throw not_found("sample", id);
  return std::move(*record);
}

SampleOrder read_order(QueryFields& query) {
  const std::string order = query.text("order", "newest");
  if (order == "newest") return SampleOrder::newest;
  if (order == "oldest") return SampleOrder::oldest;
  if (order == "likely") return SampleOrder::likely;
  query.refuse("order", "must be one of newest, oldest, likely");
  return SampleOrder::newest;
}

}  // namespace

void add_sample_routes(HttpServer& server, Api& api) {
  server.route("GET", "/v1/scenarios/{id}/samples", [&api](const HttpRequest& request) {
    QueryFields query(request);
    const std::uint64_t limit =
        query.integer("limit", 1, api.limits.most_listed, api.limits.listed_by_default);
    const std::string cursor = query.text("cursor", "");
    const SampleOrder order = read_order(query);
    query.finish();
    const std::string& id = request.path_values.at("id");
    if (!api.store.world_of(id)) throw not_found("scenario", id);
    const Page<SampleRecord> page = listed([&] { return api.store.samples(id, order, limit, cursor); });
    json views = json::array();
    for (const SampleRecord& record : page.records)
      views.push_back(sample_json(record));
    json body = {{"samples", std::move(views)}};
    if (!page.next_cursor.empty()) body["next_cursor"] = page.next_cursor;
    return json_response(body);
  });

  server.route("GET", "/v1/samples/{id}", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const std::string& id = request.path_values.at("id");
    const SampleRecord record = find_sample(api, id);
    const bool runs = api.scenarios.find_runnable(record.scenario) != nullptr;
    json view = sample_json(record);
    view["verifiable"] = runs;
    if (runs) {
      const auto scenario = find_scenario(api, record.scenario, "sample", id);
      const State state = decode_stored(id, api.store.sample_state(id), decode_state);
      view["variables"] = variables_json(scenario->model(), state);
    }
    return json_response(view);
  });

  for (const Format& format : formats())
    server.route("GET", "/v1/samples/{id}/" + std::string(format.name), [&](const HttpRequest& request) {
      QueryFields query(request);
      const std::uint64_t rate = query.integer("rate", 1, api.limits.most_frame_rate, 0);
      query.finish();
      const std::string& id = request.path_values.at("id");
      const SampleRecord record = find_sample(api, id);
      HttpResponse response;
      response.content_type = format.media_type;
      response.pieces = animation_writer(api, record, format, static_cast<double>(rate));
      response.etag = record.digest + "-" + std::to_string(rate);
      response.cache_control = "public, max-age=31536000, immutable";
      return response;
    });

  server.route("POST", "/v1/samples/{id}/verify", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    BodyFields::parse(request.body).finish();
    const std::string& id = request.path_values.at("id");
    const SampleRecord record = find_sample(api, id);
    const auto scenario = find_scenario(api, record.scenario, "sample", id);
    const State state = decode_stored(id, api.store.sample_state(id), decode_state);
    const auto performer = scenario->make_performer();
    const Scenario::Performer::Take take = performer->perform(state);
    const std::string found = digest(state, take.animation);
    return json_response({{"identical", take.complete && found == record.digest},
                          {"digest", found},
                          {"stored_digest", record.digest}});
  });
}

}  // namespace retake
