// The happy path of every route about worlds, scenarios and chains, held to doc/api.md; the shapes themselves
// are tested.
#include <algorithm>
#include <set>

#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

/// Farther than any ball gets.
const json hopeless = wish_document(1000, 1e-6);

/// A scenario as it is without what its pilot finds, which may arrive at any time.
json without_pilot(json scenario) {
  EXPECT_EQ(scenario.erase("difficulty"), 1);
  return scenario;
}

using ApiScenarios = DaemonTest;
using ApiChains = DaemonTest;

TEST(ApiShapes, A_missing_key_a_wrong_type_a_wrong_element_and_an_unknown_key_are_seen) {
  const json shape = {{"id", "string"},
                      {"list", {{{"n", "integer"}}}},
                      {"extra?", "number|null"},
                      {"kind?", "=one, another"},
                      {"fault?", {{{"*", "any"}, {"pointer", "string"}}}}};
  const auto seen = [&](const char* text) { return differences(json::parse(text), shape); };
  EXPECT_EQ(
      seen(R"({"id":"a","list":[{"n":1}],"extra":null,"kind":"another","fault":[{"pointer":"","x":[]}]})"),
      "");
  EXPECT_EQ(seen(R"({"list":[]})"), "/id is missing\n");
  EXPECT_EQ(seen(R"({"id":"a","list":[{"n":1}],"new":true})"), "/new is not documented\n");
  EXPECT_EQ(seen(R"({"id":"a","list":[{"n":1,"m":1}]})"), "/list/0/m is not documented\n");
  EXPECT_EQ(seen(R"({"id":1,"list":[]})"), "/id is not string: 1\n");
  EXPECT_EQ(seen(R"({"id":"a","list":[{"n":1.5}]})"), "/list/0/n is not integer: 1.5\n");
  EXPECT_EQ(seen(R"({"id":"a","list":[],"extra":"x"})"), "/extra is not number|null: \"x\"\n");
  EXPECT_EQ(seen(R"({"id":"a","list":[],"kind":"other"})"), "/kind is not =one, another: \"other\"\n");
  EXPECT_EQ(seen(R"({"id":"a","list":[],"fault":[{}]})"), "/fault/0/pointer is missing\n");
}

TEST_F(ApiScenarios, Worlds_are_listed_and_found_by_name) {
  const Answer all = daemon.get("/v1/worlds");
  ASSERT_EQ(all.status, 200);
  ASSERT_FALSE(all.json()["worlds"].empty());
  for (const json& world : elements(all.json()["worlds"])) {
    EXPECT_EQ(differences(world, "World"), "");
    EXPECT_EQ(world["methods"], json::parse(R"(["rejection","metropolis","conditional","tempering"])"));
    const Answer one = daemon.get("/v1/worlds/" + world["name"].get<std::string>());
    EXPECT_EQ(one.status, 200);
    EXPECT_EQ(one.json(), world);
  }
  const std::string etag = all.header("etag");
  ASSERT_FALSE(etag.empty());
  EXPECT_EQ(daemon.get("/v1/worlds", {{"If-None-Match", etag}}).status, 304);
}

TEST_F(ApiScenarios, A_posted_scenario_is_created_with_every_default_filled_in) {
  const Answer created = daemon.post(
      "/v1/scenarios",
      json::parse(R"({"world":"ball2d","title":"T","constraints":[{"kind":"rest_position","x":1}]})"));
  ASSERT_EQ(created.status, 201) << created.body;
  const json scenario = created.json();
  EXPECT_EQ(differences(scenario, "Scenario"), "");
  EXPECT_EQ(scenario["wishes"], json({"the ball comes to rest at x = 1 m, within 0.1 m"}));
  EXPECT_EQ(scenario["variable_units"], json({{"tilt_#", "rad"}}));
  std::vector<std::string> measures;
  for (const json& measure : scenario["measures"])
    measures.push_back(measure["name"]);
  EXPECT_EQ(measures, (std::vector<std::string>{"x", "bounces", "miss"}));
  EXPECT_EQ(created.header("location"), "/v1/scenarios/" + scenario["id"].get<std::string>());
  EXPECT_EQ(created.header("content-type"), "application/json");
  EXPECT_EQ(scenario["constraints"][0]["sd"], 0.1);
  EXPECT_EQ(scenario["constraints"][0]["tolerance"], 0.1);
  EXPECT_EQ(scenario["samples"], 0);
  EXPECT_EQ(scenario["chains"], json::parse(R"({"running":0,"paused":0,"finished":0,"failed":0})"));
  const json properties = daemon.get("/v1/worlds/ball2d").json()["model"]["properties"];
  for (const auto& [name, field] : properties.items())
    EXPECT_EQ(scenario["model"][name], field["default"]) << name;
  EXPECT_EQ(scenario["model"].size(), properties.size());
  EXPECT_EQ(scenario["odds"], nullptr);
  EXPECT_EQ(scenario["difficulty"], nullptr);
  EXPECT_EQ(without_pilot(daemon.get(created.header("location")).json()), without_pilot(scenario));
}

TEST_F(ApiScenarios, A_pilot_says_how_hard_a_new_wish_is) {
  const std::string id = daemon.add_scenario(hopeless);
  json scenario;
  ASSERT_TRUE(wait_until([&] {
    scenario = daemon.get("/v1/scenarios/" + id).json();
    return !scenario["difficulty"].is_null();
  }));
  const json difficulty = scenario["difficulty"];
  EXPECT_EQ(differences(difficulty, "Difficulty"), "");
  EXPECT_GT(difficulty["seconds"], 0);
  EXPECT_GT(difficulty["draws"], 0);
  EXPECT_EQ(difficulty["hits"], 0);
  EXPECT_EQ(difficulty["verdict"], "nothing-yet");
  EXPECT_EQ(difficulty["one_in"], nullptr);
  EXPECT_EQ(daemon.get("/v1/scenarios").json()["scenarios"][0]["difficulty"], difficulty);

  // It is made once: the next daemon has the same.
  EXPECT_EQ(daemon.terminate(), 0);
  const Daemon next(folder.path());
  EXPECT_EQ(next.get("/v1/scenarios/" + id).json()["difficulty"], difficulty);
}

TEST_F(ApiScenarios, The_same_document_again_is_the_same_scenario) {
  const std::string first = daemon.add_scenario(wish_document(1, 0.1));
  // Once more with keys in another order, a default written out and an integer written as a real.
  const Answer again = daemon.ask(
      "POST", "/v1/scenarios",
      R"({"constraints":[{"tolerance":0.1,"x":1.0,"sd":1e-1,"kind":"rest_position"}],"model":{"collisions":5.0},
          "title":"Rest there","world":"ball2d"})");
  EXPECT_EQ(again.status, 200) << again.body;
  EXPECT_EQ(again.json()["id"], first);
  EXPECT_EQ(again.header("location"), "/v1/scenarios/" + first);
  // In another unit.
  EXPECT_EQ(
      daemon
          .ask(
              "POST", "/v1/scenarios",
              R"({"constraints":[{"tolerance":{"cm":10},"x":{"mm":1000},"sd":{"m":0.1},"kind":"rest_position"}],
          "title":"Rest there","world":"ball2d"})")
          .json()["id"],
      first);
  EXPECT_NE(daemon.add_scenario(wish_document(1.001, 0.1)), first);
  EXPECT_NE(daemon.add_scenario(wish_document(1, 0.1, "Another title")), first);
  EXPECT_EQ(daemon.get("/v1/scenarios").json()["scenarios"].size(), 3);
}

TEST_F(ApiScenarios, Every_example_of_every_world_can_be_posted_and_read_back) {
  for (const json& world : elements(daemon.get("/v1/worlds").json()["worlds"]))
    for (const json& example : world["examples"]) {
      const Answer created = daemon.post("/v1/scenarios", example);
      EXPECT_EQ(created.status, 201) << created.body;
      EXPECT_EQ(differences(created.json(), "Scenario"), "");
      EXPECT_EQ(created.json()["wishes"].size(), created.json()["constraints"].size());
    }
}

TEST_F(ApiScenarios, The_listing_walks_over_every_scenario_once_newest_first) {
  std::vector<std::string> added;
  for (int i = 0; i < 7; ++i)
    added.push_back(daemon.add_scenario(prior_document("Number " + std::to_string(i))));
  std::vector<std::string> walked;
  std::string cursor;
  for (int pages = 0; pages < 10; ++pages) {
    const json page =
        daemon.get("/v1/scenarios?limit=3" + (cursor.empty() ? "" : "&cursor=" + cursor)).json();
    EXPECT_LE(page["scenarios"].size(), 3);
    for (const json& scenario : page["scenarios"])
      walked.push_back(scenario["id"]);
    if (!page.contains("next_cursor")) break;
    cursor = page["next_cursor"];
  }
  std::reverse(added.begin(), added.end());
  EXPECT_EQ(walked, added);
  EXPECT_FALSE(daemon.get("/v1/scenarios?limit=7").json().contains("next_cursor"));
  EXPECT_FALSE(daemon.get("/v1/scenarios").json().contains("next_cursor"));
}

TEST_F(ApiScenarios, Deleting_takes_everything_below_with_it) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 5);
  const std::string running = daemon.add_chains(scenario, json::object()).at(0);
  const std::string sample = daemon.samples(scenario, "oldest").at(0)["id"];
  const std::string kept = daemon.add_stocked_scenario(prior_document("Another"), 5);
  EXPECT_EQ(daemon.remove("/v1/scenarios/" + scenario).status, 204);
  for (const std::string& path :
       {"/v1/scenarios/" + scenario, "/v1/scenarios/" + scenario + "/chains",
        "/v1/scenarios/" + scenario + "/samples", "/v1/scenarios/" + scenario + "/diagnostics",
        "/v1/chains/" + running, "/v1/chains/" + running + "/trace", "/v1/samples/" + sample,
        "/v1/samples/" + sample + "/keyframes"})
    EXPECT_EQ(daemon.get(path).status, 404) << path;
  for (const std::string& path :
       {"/v1/scenarios/" + scenario + "/chains", "/v1/scenarios/" + scenario + "/plays",
        "/v1/chains/" + running + "/pause", "/v1/chains/" + running + "/resume",
        "/v1/chains/" + running + "/stop", "/v1/samples/" + sample + "/verify"})
    EXPECT_EQ(daemon.post(path).status, 404) << path;
  EXPECT_EQ(daemon.remove("/v1/scenarios/" + scenario).status, 404);
  EXPECT_EQ(daemon.get("/v1/scenarios").json()["scenarios"].size(), 1);
  EXPECT_EQ(daemon.samples(kept).size(), 5);

  // The same document may come back, empty.
  const Answer again = daemon.post("/v1/scenarios", prior_document());
  EXPECT_EQ(again.status, 201);
  EXPECT_EQ(again.json()["samples"], 0);
}

TEST_F(ApiChains, Chains_are_started_with_seed_and_index_and_shown_alike_everywhere) {
  const std::string scenario = daemon.add_scenario(prior_document());
  const Answer created = daemon.post("/v1/scenarios/" + scenario + "/chains",
                                     json::parse(R"({"count":3,"seed":7,"stop":{"samples":4}})"));
  ASSERT_EQ(created.status, 201) << created.body;
  const json chains = created.json()["chains"];
  ASSERT_EQ(chains.size(), 3);
  std::set<std::string> ids;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    EXPECT_EQ(differences(chains[i], "Chain"), "");
    EXPECT_EQ(chains[i]["index"], i);
    EXPECT_EQ(chains[i]["seed"], 7);
    EXPECT_EQ(chains[i]["scenario"], scenario);
    EXPECT_EQ(chains[i]["method"], "rejection");
    EXPECT_EQ(chains[i]["phase"], "sampling");
    EXPECT_EQ(chains[i]["guided"], false);
    EXPECT_TRUE(chains[i].contains("created_at"));
    EXPECT_EQ(chains[i]["stop"], json({{"samples", 4}}));
    EXPECT_EQ(chains[i]["ratios"], "exact");
    ids.insert(chains[i]["id"].get<std::string>());
  }
  EXPECT_EQ(ids.size(), 3);
  for (const std::string& id : ids) {
    const json ended = daemon.wait_for_end(id);
    EXPECT_EQ(differences(ended, "Chain") + differences(ended["first_sample"], "FirstSample"), "");
    EXPECT_EQ(ended["samples"], 4);
    EXPECT_EQ(ended["effective_samples"], 4);
    EXPECT_LE(ended["accepted"], ended["iteration"]);
  }
  const json listed = daemon.get("/v1/scenarios/" + scenario + "/chains").json()["chains"];
  ASSERT_EQ(listed.size(), 3);
  for (const json& chain : listed)
    EXPECT_EQ(daemon.chain(chain["id"]), chain);
  EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).json()["chains"]["finished"], 3);
  EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).json()["samples"], 12);
}

TEST_F(ApiChains, They_are_listed_page_by_page) {
  const std::string scenario = daemon.add_scenario(prior_document());
  const std::string other = daemon.add_scenario(prior_document("Another"));
  const std::string list = "/v1/scenarios/" + scenario + "/chains";
  std::vector<std::string> started = daemon.add_chains(scenario, {{"count", 60}, {"stop", {{"samples", 1}}}});
  daemon.add_chains(other, {{"count", 3}, {"stop", {{"samples", 1}}}});
  EXPECT_EQ(daemon.get(list).json()["chains"].size(), 50) << "unless it is said";
  EXPECT_EQ(daemon.get(list + "?limit=60").json().count("next_cursor"), 0) << "the last page";

  std::vector<std::string> listed;
  std::string cursor;
  do {
    const Answer answer = daemon.get(list + "?limit=7" + (cursor.empty() ? "" : "&cursor=" + cursor));
    ASSERT_EQ(answer.status, 200) << answer.body;
    EXPECT_EQ(differences(answer.json(), "Chains"), "");
    const json page = answer.json();
    EXPECT_LE(page["chains"].size(), 7);
    for (const json& chain : page["chains"])
      listed.push_back(chain["id"]);
    if (cursor.empty())
      started.push_back(daemon.add_chains(scenario, {{"seed", 2}, {"stop", {{"samples", 1}}}}).at(0));
    cursor = page.value("next_cursor", "");
  } while (!cursor.empty());
  EXPECT_EQ(listed, started) << "in the order in which they were started, each once";

  const std::string of_samples = daemon.get("/v1/scenarios?limit=1").json()["next_cursor"];
  const std::string of_other = daemon.get("/v1/scenarios/" + other + "/chains?limit=1").json()["next_cursor"];
  for (const std::string& wrong : {of_samples, of_other, of_other + "0", std::string("x")})
    EXPECT_EQ(daemon.get(list + "?cursor=" + wrong).status, 400) << wrong;
}

TEST_F(ApiChains, The_method_auto_is_the_worlds_own_and_the_record_says_which) {
  const std::string wish = daemon.add_scenario(wish_document(1, 0.5));
  const std::string chain =
      daemon.add_chains(wish, json::parse(R"({"method":"auto","seed":7,"stop":{"samples":4}})")).at(0);
  EXPECT_EQ(daemon.chain(chain)["method"], daemon.get("/v1/worlds/ball2d").json()["default_method"]);
  const Answer again =
      daemon.post("/v1/scenarios/" + wish + "/chains", json::parse(R"({"seed":7,"stop":{"samples":4}})"));
  EXPECT_EQ(again.status, 200);
  EXPECT_EQ(again.json()["chains"][0]["id"], chain) << "it is the same chain";
}

TEST_F(ApiChains, What_a_chain_learned_is_a_lesson_and_the_next_one_begins_from_it) {
  const std::string wish = daemon.add_scenario(wish_document(1, 0.05));
  const std::string lessons = "/v1/scenarios/" + wish + "/lessons";
  EXPECT_EQ(daemon.get(lessons).json(), json({{"lessons", json::array()}}));
  EXPECT_EQ(daemon.get("/v1/scenarios/nope/lessons").status, 404);
  const json body = json::parse(R"({"method":"conditional","seed":7,"stop":{"counted":20}})");
  const json first = daemon.wait_for_end(daemon.add_chains(wish, body).at(0));
  EXPECT_EQ(first["ended_by"], "counted");
  EXPECT_EQ(first["counted"], 20);
  EXPECT_EQ(first["lesson"], 0);
  EXPECT_GT(first["samples"], 20);
  const json learned = daemon.get(lessons).json()["lessons"];
  ASSERT_EQ(learned.size(), 1);
  EXPECT_EQ(differences(learned[0], "Lesson"), "");
  EXPECT_EQ(learned[0]["number"], 1);
  EXPECT_EQ(learned[0]["chain"], first["id"]);
  EXPECT_EQ(learned[0]["kind"], "proposal");
  EXPECT_EQ(learned[0]["usable"], true);

  json other = body;
  other["seed"] = 8;
  const json second = daemon.wait_for_end(daemon.add_chains(wish, other).at(0));
  EXPECT_EQ(second["lesson"], 1);
  EXPECT_EQ(second["samples"], second["counted"]);

  // The same request again is the chain that is there.
  const Answer again = daemon.post("/v1/scenarios/" + wish + "/chains", body);
  EXPECT_EQ(again.status, 200);
  EXPECT_EQ(again.json()["chains"][0]["id"], first["id"]);
  other["lesson"] = 5;
  const Answer unknown = daemon.post("/v1/scenarios/" + wish + "/chains", other);
  EXPECT_EQ(unknown.status, 422);
  EXPECT_EQ(unknown.json()["errors"][0]["pointer"], "/lesson");
}

TEST_F(ApiChains, An_empty_body_starts_one_chain_with_a_seed_that_is_reported) {
  const std::string scenario = daemon.add_scenario(prior_document());
  std::set<json> seeds;
  for (int i = 0; i < 4; ++i) {
    const Answer created = daemon.ask("POST", "/v1/scenarios/" + scenario + "/chains");
    ASSERT_EQ(created.status, 201) << created.body;
    ASSERT_EQ(created.json()["chains"].size(), 1);
    seeds.insert(created.json()["chains"][0]["seed"]);
  }
  EXPECT_EQ(seeds.size(), 4);
}

TEST_F(ApiChains, Each_stop_rule_ends_a_chain_and_says_so) {
  const std::string wish = daemon.add_scenario(wish_document(1, 0.001));
  const auto by_iterations =
      daemon.wait_for_end(daemon.add_chains(wish, json::parse(R"({"stop":{"iterations":12345}})")).at(0));
  EXPECT_EQ(by_iterations["state"], "finished");
  EXPECT_EQ(by_iterations["iteration"], 12345);
  EXPECT_EQ(by_iterations["ended_by"], "iterations");
  const auto by_seconds = daemon.wait_for_end(
      daemon
          .add_chains(wish,
                      json::parse(R"({"method":"metropolis","stop":{"seconds":0.05,"samples":100000}})"))
          .at(0));
  EXPECT_EQ(by_seconds["ended_by"], "seconds");
  EXPECT_GE(by_seconds["run_seconds"], 0.05);
  EXPECT_GT(by_seconds["iteration"], 0);
  const auto by_samples = daemon.wait_for_end(
      daemon.add_chains(wish, json::parse(R"({"stop":{"samples":3,"seconds":100}})")).at(0));
  EXPECT_EQ(by_samples["ended_by"], "samples");
  EXPECT_EQ(by_samples["samples"], 3);
  const auto by_ess = daemon.wait_for_end(
      daemon.add_chains(wish, json::parse(R"({"stop":{"ess":100},"seed":3,"method":"rejection"})")).at(0));
  EXPECT_EQ(by_ess["ended_by"], "ess");
  EXPECT_EQ(by_ess["stop"], json({{"ess", 100}}));
  EXPECT_EQ(by_ess["samples"], 109) << "8 and then a quarter more each time";
  EXPECT_EQ(by_ess["effective_samples"], 109);
}

TEST_F(ApiChains, A_walk_ends_once_its_worst_quantity_has_effective_samples_enough) {
  const std::string wish = daemon.add_scenario(wish_document(1, 0.1));
  const auto ended = daemon.wait_for_end(
      daemon.add_chains(wish, json::parse(R"({"stop":{"ess":30},"seed":3,"method":"metropolis"})")).at(0));
  EXPECT_EQ(ended["ended_by"], "ess");
  EXPECT_GE(ended["effective_samples"], 30);
  EXPECT_GT(ended["samples"], 30) << "a walk's samples resemble each other";
  const json diagnostics = daemon.get("/v1/scenarios/" + wish + "/diagnostics").json();
  EXPECT_EQ(differences(diagnostics["effective"], "Effective"), "");
}

TEST_F(ApiChains, Every_method_that_a_world_names_can_be_started) {
  const std::string wish = daemon.add_scenario(wish_document(1, 0.1));
  for (const json& method : elements(daemon.get("/v1/worlds/ball2d").json()["methods"])) {
    const auto chain = daemon.add_chains(wish, {{"method", method}, {"stop", {{"iterations", 50}}}}).at(0);
    const json ended = daemon.wait_for_end(chain);
    EXPECT_EQ(ended["method"], method);
    EXPECT_EQ(ended["ended_by"], "iterations") << ended;
    EXPECT_EQ(differences(ended, "Chain"), "");
  }
}

TEST_F(ApiChains, Pause_resume_and_stop_do_what_they_say_any_number_of_times) {
  const std::string scenario = daemon.add_scenario(wish_document(1, 0.001));
  const std::string id = daemon.add_chains(scenario, json::object()).at(0);
  const std::string path = "/v1/chains/" + id;
  const auto ask = [&](const std::string& verb) { return daemon.post(path + "/" + verb); };
  const auto count = [&](const char* state) {
    return daemon.get("/v1/scenarios/" + scenario).json()["chains"][state];
  };
  ASSERT_TRUE(wait_until([&] { return daemon.chain(id)["iteration"] > 0; }));

  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(ask("pause").json()["state"], "paused");
    const json paused = ask("pause").json();
    EXPECT_EQ(paused["state"], "paused");
    EXPECT_EQ(count("paused"), 1);
    EXPECT_EQ(daemon.chain(id)["iteration"], paused["iteration"]);
    EXPECT_EQ(ask("resume").json()["state"], "running");
    EXPECT_EQ(ask("resume").json()["state"], "running");
    EXPECT_EQ(count("running"), 1);
    EXPECT_TRUE(wait_until([&] { return daemon.chain(id)["iteration"] > paused["iteration"]; }));
  }
  const json stopped = ask("stop").json();
  EXPECT_EQ(differences(stopped, "Chain"), "");
  EXPECT_EQ(stopped["state"], "finished");
  EXPECT_EQ(stopped["ended_by"], "stop");
  for (const char* verb : {"stop", "pause", "resume"}) {
    EXPECT_EQ(ask(verb).status, 200) << verb;
    EXPECT_EQ(ask(verb).json(), stopped) << verb;
  }
  EXPECT_EQ(daemon.chain(id), stopped);

  // A paused chain can be stopped as well.
  const std::string second = daemon.add_chains(scenario, json::object()).at(0);
  EXPECT_EQ(daemon.post("/v1/chains/" + second + "/pause").json()["state"], "paused");
  EXPECT_EQ(daemon.post("/v1/chains/" + second + "/stop").json()["state"], "finished");
}

TEST_F(ApiChains, A_trace_has_arrays_of_one_length_and_as_many_points_as_asked_for) {
  const std::string scenario = daemon.add_scenario(wish_document(1, 0.1));
  const std::string id =
      daemon
          .add_chains(scenario, json::parse(R"({"method":"metropolis","seed":3,"stop":{"iterations":5000}})"))
          .at(0);
  ASSERT_EQ(daemon.wait_for_end(id)["state"], "finished");
  for (const std::size_t points : {1u, 2u, 10u, 1000u, 2048u}) {
    const json trace = daemon.get("/v1/chains/" + id + "/trace?points=" + std::to_string(points)).json();
    EXPECT_EQ(differences(trace, "Trace"), "");
    EXPECT_TRUE(trace.contains("x") && trace.contains("miss")) << "measures";
    const std::size_t length = trace["iteration"].size();
    EXPECT_LE(length, points);
    EXPECT_GE(length, std::min<std::size_t>(points, 1000));
    for (const auto& [name, values] : trace.items())
      EXPECT_EQ(values.size(), length) << name;
    const std::vector<int> iterations = trace["iteration"];
    EXPECT_TRUE(std::is_sorted(iterations.begin(), iterations.end()));
  }
  EXPECT_EQ(daemon.get("/v1/chains/" + id + "/trace").json()["iteration"].size(), 1000);
}

TEST_F(ApiChains, Diagnostics_cover_every_variable_and_measure) {
  const std::string scenario = daemon.add_scenario(prior_document());
  const json empty = daemon.get("/v1/scenarios/" + scenario + "/diagnostics").json();
  EXPECT_EQ(differences(empty, "Diagnostics"), "");
  EXPECT_EQ(empty["quantities"].size(), 0);
  for (const char* unknown : {"effective", "odds", "first_sample", "eta_seconds"})
    EXPECT_EQ(empty[unknown], nullptr) << unknown;
  EXPECT_EQ(empty["saved"]["share"], nullptr);
  for (const std::string& id :
       daemon.add_chains(scenario, json::parse(R"({"count":2,"seed":1,"stop":{"samples":400}})")))
    daemon.wait_for_end(id);
  const json diagnostics = daemon.get("/v1/scenarios/" + scenario + "/diagnostics").json();
  EXPECT_EQ(differences(diagnostics, "Diagnostics"), "");
  std::set<std::string> names;
  for (const json& quantity : diagnostics["quantities"])
    names.insert(quantity["name"]);
  EXPECT_EQ(names, (std::set<std::string>{"tilt_1", "tilt_2", "tilt_3", "tilt_4", "tilt_5", "x", "bounce_1",
                                          "bounce_2", "bounce_3", "bounce_4", "bounce_5"}));
  for (const json& quantity : diagnostics["quantities"])  // independent draws: R-hat is near 1
    EXPECT_NEAR(quantity["rhat"].get<double>(), 1, 0.05) << quantity["name"];
  EXPECT_EQ(differences(diagnostics["effective"], "Effective"), "");
  EXPECT_LE(diagnostics["effective"]["samples"], 800);
  EXPECT_GT(diagnostics["effective"]["samples"], 200);
  EXPECT_TRUE(names.contains(diagnostics["effective"]["quantity"]));
  EXPECT_EQ(differences(diagnostics["first_sample"], "FirstTime"), "");
  EXPECT_EQ(diagnostics["eta_seconds"], nullptr);
  EXPECT_EQ(diagnostics["chains"], 2);
  EXPECT_EQ(diagnostics["draws_per_chain"], 400);
  EXPECT_EQ(diagnostics["saved"]["iterations"], 800);
}

TEST_F(ApiChains, Diagnostics_of_a_wish_that_is_not_found_yet_tell_how_long_it_may_take) {
  const std::string scenario = daemon.add_scenario(hopeless);
  daemon.add_chains(scenario, json::object());
  json diagnostics;
  ASSERT_TRUE(wait_until([&] {
    diagnostics = daemon.get("/v1/scenarios/" + scenario + "/diagnostics").json();
    return !diagnostics["eta_seconds"].is_null();
  }));
  EXPECT_EQ(differences(diagnostics, "Diagnostics"), "");
  EXPECT_GT(diagnostics["eta_seconds"], 0);
  EXPECT_EQ(diagnostics["first_sample"], nullptr);
  EXPECT_EQ(diagnostics["effective"], nullptr);
}

}  // namespace
}  // namespace retake
