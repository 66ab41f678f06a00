// Route of plays: a fresh animation for a game.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <mutex>

#include "server/api/api.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"
#include "worlds/formats/keyframes.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestPlayer = 200;  // bytes, chosen: any account name or UUID
constexpr std::size_t kLongestKey = 200;

/// Starts a chain again where stock runs low and none is running. One request at a time, so that many players
/// who find it low start one chain.
void refill(Api& api, std::mutex& one_at_a_time, const std::string& scenario_id, std::uint64_t low_water,
            std::uint64_t remaining) try {
  if (remaining >= low_water) return;
  const std::lock_guard lock(one_at_a_time);
  const auto record = api.store.scenario(scenario_id);
  if (!record || record->running > 0 || record->samples >= api.limits.most_samples_per_scenario) return;
  if (!api.scenarios.find_runnable(scenario_id)) return;
  const auto scenario = api.scenarios.find(scenario_id);
  if (!scenario) return;
  ChainWish wish = default_wish(*scenario);
  wish.stop.counted = std::max(api.limits.refill, low_water);
  api.starter.start(scenario_id, wish, api.limits.most_live_chains);
} catch (const ChainStarter::TooManyChains&) {
  // Those that run come first.
} catch (const std::runtime_error& fault) {
  // The play itself is made, and stays the client's.
  std::fprintf(stderr, "retake: scenario %s is low on samples but no chain can be started: %s\n",
               scenario_id.c_str(), fault.what());
}

/// Why there is nothing to hand out.
[[noreturn]] void refuse_play(Api& api, const std::string& id, bool may_repeat) {
  const auto scenario = api.store.scenario(id);
  if (!scenario) throw not_found("scenario", id);
  const bool is_looking = scenario->running > 0;
  const std::vector<std::pair<std::string, std::string>> headers = {{"Retry-After", "1"}};
  // Only a refused repeat leaves anything in stock.
  if (!may_repeat && scenario->samples > 0)
    throw HttpProblem(
        503, "no-new-samples", "No new samples",
        std::string("This player has seen all that is in stock; ") +
            (is_looking ? "a chain is looking for more: try again soon."
                        : "no chain of this scenario is running: start one, or give low_water."),
        {}, headers);
  throw HttpProblem(503, "no-samples-yet", "No samples yet",
                    is_looking ? "The chains have not found one yet; try again soon."
                               : "No chain of this scenario is running; start one.",
                    {}, headers);
}

}  // namespace

void add_play_routes(HttpServer& server, Api& api) {
  const auto refilling = std::make_shared<std::mutex>();
  server.route("POST", "/v1/scenarios/{id}/plays", [&api, refilling](const HttpRequest& request) {
    QueryFields(request).finish();
    BodyFields fields = BodyFields::parse(request.body);
    const std::string player = fields.text("player", kLongestPlayer).value_or("");
    const auto include = fields.choice("include", {"keyframes"});
    const bool may_repeat = fields.choice("repeat", {"allow", "refuse"}) != "refuse";
    const std::uint64_t low_water =
        fields.integer("low_water", 0, ServiceLimits::kMostLowWater).value_or(api.limits.low_water);
    fields.finish();
    const auto header = request.headers.find("idempotency-key");
    const std::string key = header == request.headers.end() ? "" : header->second;
    if (key.size() > kLongestKey)
      throw HttpProblem(400, "bad-idempotency-key", "The idempotency key is too long",
                        "Idempotency-Key holds at most " + std::to_string(kLongestKey) + " bytes.");

    const std::string& id = request.path_values.at("id");
    std::optional<PlayRecord> play;
    try {
      play = api.store.play(id, player, key, may_repeat ? Repeats::allowed : Repeats::refused);
    } catch (const IdempotencyConflict&) {
      throw HttpProblem(409, "idempotency-conflict", "The idempotency key was used for another request",
                        "This Idempotency-Key came before with another player.");
    }
    if (!play) {
      refill(api, *refilling, id, low_water, 0);
      refuse_play(api, id, may_repeat);
    }
    if (low_water > 0) refill(api, *refilling, id, low_water, play->even_remaining);

    json view = {{"play", play->id},
                 {"sample", sample_json(play->sample)},
                 {"repeat", play->repeat},
                 {"remaining", play->remaining}};
    if (include) {
      const auto scenario = api.store.scenario(id);
      const auto bytes = api.store.sample_animation(play->sample.id);
      if (!scenario || !bytes) throw not_found("scenario", id);
      const Animation animation = decode_animation(*bytes);
      view["keyframes"] = keyframes_json(
          animation, keyframe_head(animation, play->sample.id, scenario->world, scenario->world_version));
    }
    return json_response(view, 201);
  });
}

}  // namespace retake
