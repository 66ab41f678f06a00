// What the bad_*_test.cpp files share: every route, a daemon with something to lose, the shape of a
// refusal.
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/api/api_document.h"
#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake::test {

class ApiBadInput : public ::testing::Test {
 protected:
  void SetUp() override {
    scenario = daemon.add_stocked_scenario(prior_document(), 4);
    other = daemon.add_stocked_scenario(prior_document("Another"), 4);
    chain = daemon.get("/v1/scenarios/" + scenario + "/chains").json()["chains"][0]["id"];
    sample = daemon.samples(scenario).at(0)["id"];
    // A scenario's first look comes by itself; afterwards nothing changes.
    for (const std::string& id : {scenario, other})
      ASSERT_TRUE(
          wait_until([&] { return !daemon.get("/v1/scenarios/" + id).json()["difficulty"].is_null(); }));
    counts = count();
  }
  /// Whatever was asked, the store holds what it held, and the daemon lives.
  void TearDown() override {
    EXPECT_EQ(count(), counts);
    EXPECT_FALSE(daemon.process().has_ended());
  }

  std::string count() const {
    std::string text;
    for (const std::string& id : {scenario, other}) {
      text += daemon.get("/v1/scenarios/" + id).body + daemon.get("/v1/scenarios/" + id + "/chains").body;
      for (const json& each : daemon.samples(id))
        text += each["plays"].dump();
    }
    return text + daemon.get("/v1/scenarios").body;
  }

  std::string filled(std::string path) const {
    for (const auto& [name, id] :
         {std::pair{"{scenario}", scenario}, {"{chain}", chain}, {"{sample}", sample}})
      if (const std::size_t place = path.find(name); place != std::string::npos)
        path.replace(place, std::string(name).size(), id);
    return path;
  }

  void expect_problem(const Answer& answer, int status, const std::string& what) const {
    EXPECT_EQ(answer.status, status) << what << "\n" << answer.body;
    EXPECT_EQ(answer.header("content-type"), "application/problem+json") << what;
    if (!json::accept(answer.body)) {
      ADD_FAILURE() << what << ": not JSON: " << answer.body;
      return;
    }
    const json problem = answer.json();
    EXPECT_EQ(differences(problem, "Problem"), "") << what;
    EXPECT_EQ(problem.value("status", 0), status) << what;
    EXPECT_FALSE(problem.value("title", "").empty() || problem.value("detail", "").empty()) << what;
    for (const std::string& secret :
         std::vector<std::string>{"SQL", "sqlite", "SQLITE", "/tmp", "std::", "exception", "nlohmann",
                                  "retake.db", ".cpp", "constraint failed"})
      EXPECT_EQ(answer.body.find(secret), std::string::npos)
          << what << " leaks " << secret << ": " << answer.body;
  }

  void expect_faults(const Answer& answer, int status, std::vector<std::string> pointers,
                     const std::string& what) const {
    expect_problem(answer, status, what);
    std::vector<std::string> found;
    if (json::accept(answer.body))
      for (const json& error : elements(answer.json().value("errors", json::array())))
        found.push_back(error["pointer"]);
    std::sort(found.begin(), found.end());
    std::sort(pointers.begin(), pointers.end());
    EXPECT_EQ(found, pointers) << what << "\n" << answer.body;
  }

  TemporaryFolder folder;
  Daemon daemon{folder.path()};
  std::string scenario, other, chain, sample, counts;
};

struct Route {
  std::string path;  ///< with {scenario}, {chain} and {sample} where an id stands
  std::set<std::string> methods;
};
/// Those of doc/api.md, which document_test.cpp holds to the program's.
inline const std::vector<Route>& routes() {
  static const std::vector<Route> all = [] {
    std::vector<Route> found;
    for (const ApiRoute& route : api_document().routes) {
      std::string path = route.path;
      const auto fill = [&](const std::string& place, const std::string& name) {
        if (const std::size_t at = path.find(place); at != std::string::npos)
          path.replace(at, place.size(), name);
      };
      fill("/scenarios/{id}", "/scenarios/{scenario}");
      fill("/chains/{id}", "/chains/{chain}");
      fill("/samples/{id}", "/samples/{sample}");
      fill("/worlds/{name}", "/worlds/ball2d");
      const auto known = std::ranges::find(found, path, &Route::path);
      if (known != found.end())
        known->methods.insert(route.method);
      else
        found.push_back({path, {route.method}});
    }
    return found;
  }();
  return all;
}

}  // namespace retake::test
