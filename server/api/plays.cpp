// Route of plays: a fresh animation for a game.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <mutex>

#include "server/api/api.h"
#include "server/api/keyframe_answers.h"
#include "server/api/request_fields.h"
#include "server/api/views.h"
#include "server/chains/health.h"
#include "worlds/formats/keyframes.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestPlayer = 200;  // bytes, chosen: any account name or UUID
constexpr std::size_t kLongestKey = 200;
constexpr double kLongestRetry = 30;  // [s], chosen: chance may be kinder than expected

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

/// When the next animation may be expected [s], by how the running chains fare; none while nobody can know.
std::optional<double> eta_of_next(Api& api, const ScenarioRecord& record,
                                  const std::vector<ChainRecord>& chains) {
  const auto scenario = api.scenarios.find_runnable(record.id);
  if (!scenario) return std::nullopt;
  if (const auto first = eta_of_first_sample(*scenario, chains, record.pilot)) return first;
  double per_second = 0;
  for (const ChainRecord& chain : chains)
    if (chain.state == ChainState::running && chain.counters.run_seconds > 0)
      per_second += static_cast<double>(chain.counters.counted) / chain.counters.run_seconds;
  if (per_second <= 0) return std::nullopt;
  return 1 / per_second;
}

/// Why there is nothing to hand out, and what may be expected.
[[noreturn]] void refuse_play(Api& api, const std::string& id, Repeats repeats) {
  const auto scenario = api.store.scenario(id);
  if (!scenario) throw not_found("scenario", id);
  const std::vector<ChainRecord> chains = api.runner.chains(id);
  const bool is_looking = scenario->running > 0;
  // Only a refused repeat leaves anything in stock that could be handed out.
  const bool has_seen_all =
      repeats == Repeats::refused && std::any_of(chains.begin(), chains.end(), [](const ChainRecord& chain) {
        return chain.ratios != to_string(Ratios::paper) && chain.counters.samples > 0;
      });
  HttpProblem problem =
      has_seen_all ? HttpProblem(503, "no-new-samples", "No new samples",
                                 std::string("This player has seen all that is in stock; ") +
                                     (is_looking ? "a chain is looking for more: try again soon."
                                                 : "no chain of this scenario is running: start one, or give "
                                                   "low_water."))
                   : HttpProblem(503, "no-samples-yet", "No samples yet",
                                 is_looking ? "The chains have not found one yet; try again soon."
                                            : "No chain of this scenario is running; start one.");
  const std::optional<double> eta = eta_of_next(api, *scenario, chains);
  if (eta) problem.more["eta_seconds"] = *eta;
  if (json known = odds_json(scenario->odds); !known.is_null()) problem.more["odds"] = std::move(known);
  if (const json difficulty = difficulty_json(scenario->pilot); !difficulty.is_null())
    problem.more["verdict"] = difficulty["verdict"];
  // No longer than it is likely to take, in the whole seconds of the header.
  const double seconds = std::clamp(std::floor(eta.value_or(1)), 1.0, kLongestRetry);
  problem.headers = {{"Retry-After", std::to_string(static_cast<int>(seconds))}};
  throw problem;
}

/// A place among the plays that wait for an animation, if there is one.
class Waiting {
 public:
  explicit Waiting(std::atomic<std::size_t>& count)
      : count_(count), has_place_(count_.fetch_add(1) < ServiceLimits::kMostWaiting) {}
  ~Waiting() { --count_; }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  bool has_place() const { return has_place_; }

 private:
  std::atomic<std::size_t>& count_;
  bool has_place_;
};

struct PlayWish {
  std::string scenario;
  std::string player;  ///< empty: nobody
  std::string key;     ///< of idempotency; empty: none
  Repeats repeats = Repeats::allowed;
  std::uint64_t low_water = 0;
  std::chrono::milliseconds wait{0};
};

/// What all plays share.
struct PlayDesk {
  std::mutex refilling;
  std::atomic<std::size_t> waiting{0};
};

/// Hands out an animation; none when the wait is over, or where there is nothing to wait for.
std::optional<PlayRecord> hand_out(Api& api, PlayDesk& desk, const PlayWish& wish) {
  const auto deadline = std::chrono::steady_clock::now() + wish.wait;
  std::uint64_t version = api.events.version();
  const auto ask = [&] { return api.store.play(wish.scenario, wish.player, wish.key, wish.repeats); };
  std::optional<PlayRecord> play = ask();
  refill(api, desk.refilling, wish.scenario, wish.low_water, play ? play->even_remaining : 0);
  if (play || wish.wait.count() == 0) return play;
  const Waiting waiting(desk.waiting);
  if (!waiting.has_place()) return play;
  while (!play && std::chrono::steady_clock::now() < deadline) {
    const auto scenario = api.store.scenario(wish.scenario);
    if (!scenario || scenario->running == 0) return ask();
    const std::uint64_t now = api.events.wait_for_scenario(wish.scenario, version, deadline);
    if (now == version) break;  // the end of the wait, or of the daemon
    version = now;
    play = ask();
  }
  return play;
}

}  // namespace

void add_play_routes(HttpServer& server, Api& api) {
  const auto desk = std::make_shared<PlayDesk>();
  server.route("POST", "/v1/scenarios/{id}/plays", [&api, desk](const HttpRequest& request) {
    QueryFields(request).finish();
    BodyFields fields = BodyFields::parse(request.body);
    PlayWish wish;
    wish.scenario = request.path_values.at("id");
    wish.player = fields.text("player", kLongestPlayer).value_or("");
    const auto include = fields.choice("include", {"keyframes"});
    if (fields.choice("repeat", {"allow", "refuse"}) == "refuse") wish.repeats = Repeats::refused;
    wish.low_water =
        fields.integer("low_water", 0, ServiceLimits::kMostLowWater).value_or(api.limits.low_water);
    wish.wait =
        std::chrono::milliseconds(fields.integer("wait_ms", 0, ServiceLimits::kLongestWait).value_or(0));
    fields.finish();
    if (const auto header = request.headers.find("idempotency-key"); header != request.headers.end())
      wish.key = header->second;
    if (wish.key.size() > kLongestKey)
      throw HttpProblem(400, "bad-idempotency-key", "The idempotency key is too long",
                        "Idempotency-Key holds at most " + std::to_string(kLongestKey) + " bytes.");

    const std::string& id = wish.scenario;
    std::optional<PlayRecord> play;
    try {
      play = hand_out(api, *desk, wish);
    } catch (const IdempotencyConflict&) {
      throw HttpProblem(409, "idempotency-conflict", "The idempotency key was used for another request",
                        "This Idempotency-Key came before with another player.");
    }
    if (!play) refuse_play(api, id, wish.repeats);

    json view = {{"play", play->id},
                 {"sample", sample_json(play->sample)},
                 {"repeat", play->repeat},
                 {"remaining", play->remaining}};
    HttpResponse response = json_response(view, 201);
    if (include) {
      // The animation is the first member, in pieces, and the others follow.
      response.pieces = [write = animation_writer(api, play->sample, formats().front(), 0),
                         others = response.body.substr(1)](const StreamSink& sink) {
        return sink("{\"keyframes\":") && write(sink) && sink("," + others);
      };
    }
    return response;
  });
}

}  // namespace retake
