// Bad methods, hosts, ids, queries and cursors at every route: refused in one shape, nothing stored, nothing
// leaked.

#include "tests/server/api/bad_input.h"

namespace retake {
namespace {

using namespace test;

using ApiBadQuery = ApiBadInput;

TEST_F(ApiBadQuery, Every_route_refuses_other_methods_and_names_its_own) {
  for (const Route& route : routes())
    for (const std::string& method : std::vector<std::string>{"GET", "POST", "PUT", "PATCH", "DELETE"}) {
      if (route.methods.contains(method)) continue;
      const Answer answer = daemon.ask(method, filled(route.path));
      expect_problem(answer, 405, method + " " + route.path);
      for (const std::string& allowed : route.methods)
        EXPECT_NE(answer.header("allow").find(allowed), std::string::npos) << method << " " << route.path;
      EXPECT_EQ(answer.header("allow").find(method), std::string::npos) << answer.header("allow");
    }
}

TEST_F(ApiBadQuery, Every_route_of_the_api_refuses_unknown_query_parameters) {
  for (const Route& route : routes())
    for (const std::string& method : route.methods) {
      if (route.path == "/") continue;  // the page keeps its state there
      const Answer answer = daemon.ask(method, filled(route.path) + "?nonsense=1");
      expect_problem(answer, 400, method + " " + route.path);
      EXPECT_NE(answer.body.find("nonsense"), std::string::npos) << method << " " << route.path;
    }
}

TEST_F(ApiBadQuery, Every_route_refuses_a_foreign_host_and_a_repeated_one) {
  for (const Route& route : routes())
    for (const std::string& method : route.methods)
      expect_problem(daemon.ask(method, filled(route.path), {}, {{"Host", "evil.example"}}), 421,
                     method + " " + route.path);
}

TEST_F(ApiBadQuery, Unknown_ids_are_not_found_however_they_are_spelt) {
  for (const std::string& id :
       std::vector<std::string>{"nosuchid", "%27%20OR%201=1--", "%00", "..%2f..%2fetc", "%F0%9F%98%80", "a-1",
                                "-", "%22", "%3Cscript%3E"})
    for (const Route& route : routes()) {
      std::string path = route.path;
      const std::size_t place = path.find('{');
      if (place == std::string::npos) continue;
      path.replace(place, path.find('}') - place + 1, id);
      for (const std::string& method : route.methods) {
        const Answer answer = daemon.ask(method, path);
        // A path that cannot be decoded decently may be refused as such.
        const int status = answer.status == 400 ? 400 : 404;
        expect_problem(answer, status, method + " " + path);
      }
    }
  for (const std::string& path :
       std::vector<std::string>{"/v1", "/v1/", "/v1/nowhere", "/v2/scenarios", "/v1/worlds/chess",
                                "/v1/scenarios/", "/v1/scenarios//samples", "/index.php", "/v1/samples"})
    expect_problem(daemon.get(path), 404, path);
}

TEST_F(ApiBadQuery, Query_values_out_of_range_are_refused) {
  for (const std::string& path : std::vector<std::string>{"/v1/scenarios", "/v1/scenarios/{scenario}/samples",
                                                          "/v1/scenarios/{scenario}/chains"})
    for (const std::string& value : std::vector<std::string>{"0", "501", "-1", "abc", "1.5", "1e2", "",
                                                             "%20"
                                                             "5",
                                                             "0x10", "+5", "18446744073709551617"})
      expect_problem(daemon.get(filled(path) + "?limit=" + value), 400, path + " limit " + value);
  for (const std::string& value : std::vector<std::string>{"0", "100001", "x", ""})
    expect_problem(daemon.get(filled("/v1/chains/{chain}/trace?points=") + value), 400, "points " + value);
  for (const std::string& value : std::vector<std::string>{"0", "241", "-30", "nan", "30.5"})
    expect_problem(daemon.get(filled("/v1/samples/{sample}/keyframes?rate=") + value), 400, "rate " + value);
  for (const std::string& value : std::vector<std::string>{"worst", "Newest", ""})
    expect_problem(daemon.get(filled("/v1/scenarios/{scenario}/samples?order=") + value), 400,
                   "order " + value);
  const Answer both = daemon.get(filled("/v1/scenarios/{scenario}/samples?limit=0&order=x&more=1"));
  expect_problem(both, 400, "three faults");
  EXPECT_EQ(both.json()["errors"].size(), 3);
  expect_problem(daemon.get("/v1/scenarios?limit=1&limit=2"), 400, "a repeated parameter");
}

TEST_F(ApiBadQuery, A_cursor_serves_only_the_listing_that_handed_it_out) {
  const auto cursor = [&](const std::string& path) {
    return daemon.get(path).json()["next_cursor"].get<std::string>();
  };
  const std::string mine = "/v1/scenarios/" + scenario + "/samples";
  const std::string theirs = "/v1/scenarios/" + other + "/samples";
  const std::string newest = cursor(mine + "?limit=2"), likely = cursor(mine + "?limit=2&order=likely");
  const std::string scenarios = cursor("/v1/scenarios?limit=1");
  EXPECT_EQ(daemon.get(mine + "?cursor=" + newest).status, 200);
  for (const std::string& target :
       {mine + "?order=oldest&cursor=" + newest, mine + "?order=likely&cursor=" + newest,
        mine + "?cursor=" + likely, theirs + "?cursor=" + newest, mine + "?cursor=" + scenarios,
        "/v1/scenarios?cursor=" + newest})
    expect_problem(daemon.get(target), 400, target);
  std::string bent = newest;
  bent[bent.size() / 2] = bent[bent.size() / 2] == 'a' ? 'b' : 'a';
  for (const std::string& garbage :
       {std::string("garbage"), std::string("%00"), std::string("-1"), std::string(300, 'a'), newest + "x",
        newest.substr(1), std::string("'%20OR%201=1"), std::string("%F0%9F%98%80")})
    for (const std::string& path : {mine, std::string("/v1/scenarios")})
      expect_problem(daemon.get(path + "?cursor=" + garbage), 400, path + " " + garbage);
  const int status = daemon.get(mine + "?cursor=" + bent).status;
  EXPECT_TRUE(status == 400 || status == 200) << "a guess may hit another cursor, but never breaks anything";
}

}  // namespace
}  // namespace retake
