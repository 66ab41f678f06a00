// The service's own routes: health, readiness, metrics, limits, the page.
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

using ApiService = DaemonTest;

/// The values of a Prometheus text by name and labels; every line is held to the format.
std::map<std::string, double> metrics(const std::string& text) {
  static const std::regex help(R"(# HELP ([a-z_:][a-z0-9_:]*) [^\n]+)");
  static const std::regex type(R"(# TYPE ([a-z_:][a-z0-9_:]*) (counter|gauge))");
  static const std::regex value(
      R"re(([a-z_:][a-z0-9_:]*)(\{[a-z_]+="[^"\\]*"(,[a-z_]+="[^"\\]*")*\})? ([-+0-9.eE]+))re");
  std::map<std::string, double> values;
  std::set<std::string> helped, typed;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, help)) {
      EXPECT_TRUE(helped.insert(match[1]).second) << "HELP twice: " << line;
    } else if (std::regex_match(line, match, type)) {
      EXPECT_TRUE(typed.insert(match[1]).second) << "TYPE twice: " << line;
    } else if (std::regex_match(line, match, value)) {
      EXPECT_TRUE(helped.contains(match[1]) && typed.contains(match[1])) << line;
      EXPECT_TRUE(values.emplace(match[1].str() + match[2].str(), std::stod(match[4])).second)
          << "twice: " << line;
    } else {
      ADD_FAILURE() << "not Prometheus text: " << line;
    }
  }
  return values;
}

TEST_F(ApiService, It_is_healthy_and_ready) {
  EXPECT_EQ(daemon.get("/healthz").status, 200);
  EXPECT_EQ(daemon.get("/healthz").json()["status"], "ok");
  EXPECT_EQ(daemon.get("/readyz").status, 200);
  EXPECT_EQ(daemon.ask("HEAD", "/healthz").status, 200);
  EXPECT_EQ(daemon.get("/healthz").header("cache-control"), "no-store");
}

TEST_F(ApiService, The_metrics_are_Prometheus_text_that_counts_what_happens) {
  const Answer idle = daemon.get("/metrics");
  ASSERT_EQ(idle.status, 200);
  EXPECT_EQ(idle.header("content-type"), "text/plain; version=0.0.4; charset=utf-8");
  EXPECT_EQ(idle.body.back(), '\n');
  const auto before = metrics(idle.body);
  for (const auto& [name, value] : before)
    EXPECT_TRUE(name.starts_with("retake_")) << name;
  EXPECT_EQ(before.at("retake_scenarios"), 0);
  EXPECT_EQ(before.at("retake_samples"), 0);

  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 7);
  daemon.post("/v1/scenarios/" + scenario + "/plays", {{"player", "a"}});
  daemon.get("/v1/nowhere");
  const auto after = metrics(daemon.get("/metrics").body);
  EXPECT_EQ(after.at("retake_scenarios"), 1);
  EXPECT_EQ(after.at("retake_samples"), 7);
  EXPECT_EQ(after.at("retake_plays"), 1);
  EXPECT_EQ(after.at("retake_iterations_total"), 7);
  EXPECT_EQ(after.at("retake_samples_found_total"), 7);
  EXPECT_EQ(after.at("retake_store_failed_commits_total"), 0);
  EXPECT_GT(after.at("retake_store_bytes"), 0);
  EXPECT_EQ(after.at("retake_http_requests_total{status=\"404\"}"), 1);
  EXPECT_GE(after.at("retake_http_requests_total{status=\"201\"}"), 3);
  // A chain is live until its thread has let go of it, shortly after it is seen to be finished.
  double live = 1;
  for (int wait = 0; live != 0 && wait < 500; ++wait) {
    live = metrics(daemon.get("/metrics").body).at("retake_chains_live");
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(live, 0);
}

TEST_F(ApiService, Large_counts_keep_all_their_digits_in_the_metrics) {
  const std::string scenario = daemon.add_scenario(wish_document(1, 1e-6));
  const auto chain =
      daemon.add_chains(scenario, json::parse(R"({"method":"rejection","stop":{"iterations":1234567}})"));
  ASSERT_EQ(daemon.wait_for_end(chain.at(0))["state"], "finished");
  EXPECT_EQ(metrics(daemon.get("/metrics").body).at("retake_iterations_total"), 1234567);
}

TEST_F(ApiService, The_limits_are_told) {
  const json limits = daemon.get("/v1/limits").json();
  EXPECT_EQ(differences(limits, "Limits"), "");
  EXPECT_EQ(limits["limit"], json::parse(R"({"default":50,"maximum":500})"));
  EXPECT_EQ(limits["low_water"], 0);
  EXPECT_EQ(limits["document_depth"], 32);
}

TEST_F(ApiService, More_chains_than_the_limit_are_refused_and_none_of_the_request_is_stored) {
  const std::uint64_t most = daemon.get("/v1/limits").json()["live_chains"];
  const std::string scenario = daemon.add_scenario(wish_document(900, 1e-6));
  for (std::uint64_t started = 0; started < most; started += 64)
    ASSERT_EQ(daemon.add_chains(scenario, {{"count", 64}}).size(), 64u);
  const Answer refused = daemon.post("/v1/scenarios/" + scenario + "/chains", {{"count", 1}});
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.json()["type"], "/problems/too-many-chains");
  EXPECT_EQ(differences(refused.json(), "Problem"), "");
  EXPECT_FALSE(refused.header("retry-after").empty());
  EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).json()["chains"]["running"], most);
}

TEST_F(ApiService, The_page_is_served_with_a_strict_policy) {
  const Answer page = daemon.get("/");
  ASSERT_EQ(page.status, 200);
  EXPECT_TRUE(page.header("content-type").starts_with("text/html"));
  EXPECT_NE(page.header("content-security-policy").find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(page.header("x-content-type-options"), "nosniff");
  EXPECT_EQ(daemon.get("/", {{"If-None-Match", page.header("etag")}}).status, 304);
  EXPECT_EQ(daemon.get("/?scenario=abc&player=x").status, 200) << "the page's state is in its URL";
}

}  // namespace
}  // namespace retake
