// Routes of the service itself: health, readiness, metrics, limits.
#include <algorithm>
#include <sstream>

#include "server/api/api.h"
#include "server/api/request_fields.h"

namespace retake {
namespace {

using nlohmann::json;

/// Prometheus text, one family after another.
class Metrics {
 public:
  void family(const std::string& name, const char* type, const char* help) {
    name_ = "retake_" + name;
    text_ << "# HELP " << name_ << ' ' << help << "\n# TYPE " << name_ << ' ' << type << '\n';
  }
  template <typename Number>
  void value(Number number, const std::string& labels = "") {
    text_ << name_ << labels << ' ' << number << '\n';
  }
  template <typename Number>
  void single(const std::string& name, const char* type, const char* help, Number number) {
    family(name, type, help);
    value(number);
  }
  std::string text() const { return text_.str(); }

 private:
  std::string name_;
  std::ostringstream text_;
};

std::string metrics_text(const Api& api) {
  const StoreTotals store = api.store.totals();
  const Runner::Counters runner = api.runner.counters();
  const HttpCounters http = api.server.counters();
  Metrics metrics;
  metrics.single("scenarios", "gauge", "Scenarios in the store.", store.scenarios);
  metrics.single("samples", "gauge", "Samples in the store.", store.samples);
  metrics.single("plays", "counter", "Plays handed out since the store was made.", store.plays);
  metrics.single("store_bytes", "gauge", "Bytes of the store's files.", store.file_bytes);
  metrics.single("store_queued_commits", "gauge", "Writes that wait for the writer.", store.queued_commits);
  metrics.single("store_failed_commits_total", "counter", "Writes that failed.", store.failed_commits);
  metrics.single("store_damaged_rows", "gauge",
                 "Rows met since the start that are damaged; they are left out.", store.damaged_rows);
  metrics.single("chains_live", "gauge", "Chains that are being stepped.", runner.live_chains);
  metrics.single("iterations_total", "counter", "Iterations of all chains since the start.",
                 runner.iterations);
  metrics.single("samples_found_total", "counter", "Samples found since the start.", runner.samples);
  metrics.single("simulations_total", "counter", "Simulations since the start.", runner.simulations);
  metrics.single("failed_simulations_total", "counter", "Simulations that exploded or never came to rest.",
                 runner.failed_simulations);
  metrics.family("http_requests_total", "counter", "Requests answered, by status.");
  for (const auto& [status, count] : http.by_status)
    metrics.value(count, "{status=\"" + std::to_string(status) + "\"}");
  metrics.single("http_refused_total", "counter", "Connections and requests that the guard refused.",
                 http.refused);
  metrics.single("http_connections", "gauge", "Open connections.", http.open_connections);
  metrics.single("http_streams", "gauge", "Open event streams.", http.open_streams);
  return metrics.text();
}

/// What is set apart, the first few by name.
std::string detail_of(const std::vector<std::string>& damages, std::uint64_t count) {
  constexpr std::size_t kMostNamed = 10;  // chosen: what fits into an operator's alert
  std::string detail = std::to_string(count) + " damaged rows are left out; `retake check` names them all";
  for (std::size_t i = 0; i < std::min(damages.size(), kMostNamed); ++i)
    detail += (i == 0 ? ": " : "; ") + damages[i];
  return detail + (damages.size() > kMostNamed ? "; …" : "") + ".";
}

/// What lasts is told as such, and not as something to be tried again.
std::optional<HttpProblem> lasting_problem(const std::runtime_error& error) {
  if (dynamic_cast<const Damaged*>(&error))
    return HttpProblem(410, "damaged", "What is asked for is damaged in the store",
                       std::string(error.what()) + ". It is set apart for good; everything else goes on.");
  if (dynamic_cast<const OtherVersion*>(&error))
    return HttpProblem(409, "other-world-version", "The scenario's world has another version here",
                       std::string("The scenario cannot be simulated: ") + error.what() + ".");
  if (dynamic_cast<const RefusedDocument*>(&error))
    return HttpProblem(409, "refused-document", "The scenario's document is refused here",
                       std::string(error.what()) + ". Its samples play on.");
  return std::nullopt;
}

}  // namespace

void add_service_routes(HttpServer& server, Api& api) {
  server.route("GET", "/healthz", [](const HttpRequest& request) {
    QueryFields(request).finish();
    return json_response({{"status", "ok"}});
  });

  server.route("GET", "/readyz", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    if (const std::string error = api.store.last_error(); !error.empty())
      throw HttpProblem(503, "store-failing", "The store cannot write", error, {}, {{"Retry-After", "5"}});
    json view = {{"status", "ready"}};
    if (const std::vector<std::string> damages = api.store.damages(); !damages.empty())
      view["detail"] = detail_of(damages, api.store.totals().damaged_rows);
    return json_response(view);
  });

  server.route("GET", "/metrics", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    HttpResponse response;
    response.content_type = "text/plain; version=0.0.4; charset=utf-8";
    response.body = metrics_text(api);
    return response;
  });

  server.route("GET", "/v1/limits", [&api](const HttpRequest& request) {
    QueryFields(request).finish();
    const ServiceLimits& limits = api.limits;
    const HttpSettings http;
    return json_response({{"limit", {{"default", limits.listed_by_default}, {"maximum", limits.most_listed}}},
                          {"chains_per_request", limits.most_chains_per_request},
                          {"live_chains", limits.most_live_chains},
                          {"trace_points", limits.most_trace_points},
                          {"frame_rate", limits.most_frame_rate},
                          {"keyframe_numbers", limits.most_keyframe_numbers},
                          {"samples_per_scenario", limits.most_samples_per_scenario},
                          {"low_water", limits.low_water},
                          {"refill", limits.refill},
                          {"document_depth", kDeepestDocument},
                          {"document_values", kMostDocumentValues},
                          {"body_bytes", http.most_body_bytes},
                          {"event_streams", http.most_streams},
                          {"event_streams_per_client", http.most_streams_of_client}});
  });
}

void add_all_routes(HttpServer& server, Api& api) {
  server.explain(lasting_problem);
  add_world_routes(server, api);
  add_scenario_routes(server, api);
  add_chain_routes(server, api);
  add_sample_routes(server, api);
  add_play_routes(server, api);
  add_diagnostics_routes(server, api);
  add_service_routes(server, api);
  add_event_routes(server, api);
  add_page_routes(server);
}

}  // namespace retake
