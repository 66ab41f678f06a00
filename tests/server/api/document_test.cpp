// doc/api.md and the program are held to each other: every route, field, parameter, key, metric and event
// that the page names is there as it says, and the program answers nothing else.
#include <algorithm>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "db/open_store.h"
#include "db/sqlite/connection.h"
#include "server/api/api.h"
#include "tests/server/api/bad_input.h"
#include "tests/server/api/event_stream.h"
#include "web/page_files.h"
#include "worlds/formats/keyframes.h"

namespace retake {
namespace {

using namespace test;

/// "A, B" of the words after `before` in a fault's detail; "none" says that there are none.
std::set<std::string> names_after(const std::string& detail, const std::string& before) {
  const std::size_t place = detail.find(before);
  if (place == std::string::npos) return {"no names in: " + detail};
  std::set<std::string> names;
  std::istringstream words(detail.substr(place + before.size()));
  for (std::string name; std::getline(words, name, ',');) {
    name.erase(0, name.find_first_not_of(' '));
    if (name != "none") names.insert(name);
  }
  return names;
}

/// The part of a field's name before and after its last dot; "" without a dot.
std::pair<std::string, std::string> split_at_dot(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? std::pair<std::string, std::string>{"", name}
                                  : std::pair{name.substr(0, dot), name.substr(dot + 1)};
}

/// `value` at a field such as "stop.samples" of an object.
json object_with(const std::string& field, const json& value) {
  const auto [outer, inner] = split_at_dot(field);
  const json object = {{inner, value}};
  return outer.empty() ? object : json{{outer, object}};
}

/// The keys of a shape and of what it holds, as keys_met() spells them; other shapes are not entered.
void add_keys(const json& shape, const std::string& place, std::set<std::string>& keys) {
  if (shape.is_array()) add_keys(shape[0], place, keys);
  if (!shape.is_object()) return;
  for (const auto& [key, inner] : shape.items()) {
    keys.insert(place + "/" + key);
    add_keys(inner, place + "/" + key, keys);
  }
}

/// A daemon that has every kind of thing that the page describes.
class ApiDocumented : public ApiBadInput {
 protected:
  void TearDown() override { EXPECT_FALSE(daemon.process().has_ended()); }
  std::string path_of(const ApiRoute& route) const {
    const std::string id = route.path.starts_with("/v1/worlds")      ? "spelling"
                           : route.path.starts_with("/v1/scenarios") ? scenario
                           : route.path.starts_with("/v1/chains")    ? chain
                                                                     : sample;
    return std::regex_replace(route.path, std::regex("\\{(id|name)\\}"), id);
  }
};

TEST(ApiDocument, Every_kind_of_line_is_read) {
  const ApiDocument document = read_api_document(R"(# Title
## Things
### GET /v1/things/{id}
| parameter | type | default | is |
|---|---|---|---|
| `limit` | integer from 1 to 500 | 50 | |

**200** [Thing](#thing), **404** if not.
### Thing
| key | type | is |
|---|---|---|
| `id` | string | |
| `list[].n` | optional integer or null | |
| `map.*` | optional [Other](#other) | |
)");
  ASSERT_EQ(document.routes.size(), 1);
  EXPECT_EQ(document.routes[0].path, "/v1/things/{id}");
  EXPECT_EQ(document.routes[0].parameters.at(0).type, "integer from 1 to 500");
  EXPECT_EQ(document.routes[0].answers, (std::map<int, std::string>{{200, "Thing"}, {404, ""}}));
  EXPECT_EQ(document.shapes.at("Thing"),
            json::parse(R"({"id":"string","list":[{"n?":"integer|null"}],"map?":{"*":"@Other"}})"));
  for (const char* wrong : {"### A\n| key | type | is |\n|---|---|---|\n| `a` | text | |\n",
                            "### A\n| key | type | is |\n|---|---|---|\n| `a` | any | |\n| `a` | any | |\n",
                            "| key | meaning |\n|---|---|\n| `a` | b |\n"})
    EXPECT_THROW(read_api_document(wrong), std::runtime_error) << wrong;
}

TEST(ApiDocument, Every_shape_that_is_named_is_there_and_every_one_there_is_named) {
  std::set<std::string> named = {"Problem"}, there;
  const auto add_references = [&](const json& shape) {
    const std::string text = shape.dump();
    const std::regex reference("@(\\w+)");
    for (std::sregex_iterator found(text.begin(), text.end(), reference), end; found != end; ++found)
      named.insert((*found)[1]);
  };
  for (const auto& [name, shape] : api_document().shapes) {
    there.insert(name);
    add_references(shape);
  }
  for (const ApiRoute& route : api_document().routes)
    for (const auto& [status, shape] : route.answers)
      if (!shape.empty()) named.insert(shape);
  for (const auto& [name, shape] : api_document().events)
    named.insert(shape);
  EXPECT_EQ(named, there);
}

bool is_of_page(const std::string& path) {
  return std::ranges::any_of(page_files(), [&](const PageFile& file) { return file.path == path; });
}

TEST(ApiDocument, Names_every_route_of_the_program) {
  const TemporaryFolder folder;
  const auto store = open_store(folder / "retake.db");
  ScenarioLibrary library(*store);
  EventHub events;
  Runner runner(*store, library, events, {.threads = 1});
  Pilot pilot(*store, library, events);
  HttpServer server({});
  ChainStarter starter(*store, runner);
  DocumentDesk documents;
  Api api{*store, library, events, runner, starter, pilot, documents, {}, server};
  add_all_routes(server, api);
  std::set<std::pair<std::string, std::string>> documented, known;
  for (const ApiRoute& route : api_document().routes)
    documented.emplace(route.method, route.path);
  for (const auto& route : server.routes())
    if (route.second == "/" || !is_of_page(route.second)) known.insert(route);
  EXPECT_EQ(documented, known);
}

TEST_F(ApiDocumented, Routes_are_those_of_the_program_with_their_methods) {
  std::map<std::string, std::set<std::string>> documented;
  for (const ApiRoute& route : api_document().routes)
    documented[path_of(route)].insert(route.method);
  for (const auto& [path, methods] : documented) {
    std::set<std::string> allowed = methods;
    if (methods.contains("GET")) allowed.insert("HEAD");
    allowed.insert("OPTIONS");
    EXPECT_EQ(names_after(daemon.ask("OPTIONS", path).header("allow"), ""), allowed) << path;
  }
}

TEST_F(ApiDocumented, Parameters_are_those_that_routes_know_with_their_bounds) {
  for (const ApiRoute& route : api_document().routes) {
    if (route.path == "/") continue;  // the page keeps its state there
    const std::string path = path_of(route), what = route.method + " " + route.path;
    std::set<std::string> documented;
    for (const ApiField& parameter : route.parameters)
      documented.insert(parameter.name);
    const json unknown = daemon.ask(route.method, path + "?nonsense=1").json();
    EXPECT_EQ(names_after(unknown.value("detail", ""), "known are "), documented) << what;
    for (const ApiField& parameter : route.parameters) {
      if (parameter.type == "string") continue;
      const json refused = daemon.ask(route.method, path + "?" + parameter.name + "=nonsense").json();
      const std::string detail = refused.value("detail", "");
      EXPECT_TRUE(detail.ends_with("must be " + parameter.type) ||
                  detail.ends_with("must be an " + parameter.type))
          << what << " " << parameter.name << ": " << detail << ", documented as " << parameter.type;
    }
  }
}

TEST_F(ApiDocumented, Fields_are_those_that_routes_know_with_their_bounds) {
  for (const ApiRoute& route : api_document().routes) {
    if (route.method != "POST") {
      EXPECT_TRUE(route.fields.empty()) << route.path;
      continue;
    }
    const std::string what = route.method + " " + route.path;
    const bool is_document = route.path == "/v1/scenarios";
    std::map<std::string, std::set<std::string>> documented = {{"", {}}};  // by the object that has them
    for (const ApiField& field : route.fields) {
      const auto [outer, inner] = split_at_dot(field.name);
      documented[outer].insert(inner);
      if (!outer.empty()) documented[""].insert(outer);
    }
    for (const auto& [outer, names] : documented) {
      const std::string nonsense = outer.empty() ? "nonsense" : outer + ".nonsense";
      const json refused = daemon.post(path_of(route), object_with(nonsense, 1)).json();
      const std::string detail = refused["errors"].at(0).at("detail");
      if (is_document)  // there the world decides what there is
        EXPECT_EQ(detail, "there is no such field here") << what;
      else
        EXPECT_EQ(names_after(detail, "known are "), names) << what << " " << outer;
    }
    for (const ApiField& field : route.fields) {
      const json refused = daemon.post(path_of(route), object_with(field.name, json::array({json()}))).json();
      std::string detail;
      for (const json& error : elements(refused.at("errors")))
        if (error["pointer"] == "/" + std::regex_replace(field.name, std::regex("\\."), "/"))
          detail = error["detail"];
      if (is_document) {
        EXPECT_NE(detail, "there is no such field here") << what << " " << field.name;
      } else {
        EXPECT_TRUE(detail == "must be " + field.type || detail == "must be an " + field.type ||
                    detail == "must be a " + field.type)
            << what << " " << field.name << ": " << detail << ", documented as " << field.type;
      }
    }
  }
}

TEST_F(ApiDocumented, Metrics_are_those_of_the_program) {
  std::map<std::string, std::string> told;
  std::istringstream lines(daemon.get("/metrics").body);
  const std::regex type("# TYPE (\\w+) (\\w+)");
  std::smatch match;
  for (std::string line; std::getline(lines, line);)
    if (std::regex_match(line, match, type)) told[match[1]] = match[2];
  EXPECT_EQ(told, api_document().metrics);
}

/// A body of every shape, which no world has together.
Animation every_shape() {
  Animation animation;
  animation.frames = 1;
  const Mesh triangle{.positions = {0, 0, 0, 1, 0, 0, 0, 0, 1}, .indices = {0, 2, 1}};
  const HeightField field{.rows = 2,
                          .columns = 2,
                          .spacing = 1,
                          .heights = {0, 0, 0, 1},
                          .attributes = {{.name = "friction", .values = {1, 1, 1, 0.5}}}};
  for (const Shape& shape : {Shape(Sphere{1}), Shape(Box{{1, 2, 3}}), Shape(Cylinder{1, 2}),
                             Shape(Revolution{{{0, 0}, {1, 1}}}), Shape(triangle), Shape(field)})
    animation.bodies.push_back({.name = "body", .shape = shape, .colour = "#000000"});
  static_assert(std::variant_size_v<Shape> == 6, "every shape is documented");
  return animation;
}

TEST_F(ApiDocumented, Every_answer_is_documented_and_every_documented_key_is_answered) {
  keys_met().clear();

  // What takes time to come about: odds, ladders, effective samples, stop rules, ground and rims.
  const std::string wish = daemon.add_scenario(wish_document(1, 0.1));
  for (const json& request :
       {json{
            {"count", 4}, {"seed", 1}, {"stop", {{"samples", 60}, {"iterations", 100'000}, {"seconds", 60}}}},
        json{{"method", "tempering"}, {"seed", 1}, {"stop", {{"iterations", 20'000}}}},
        json{{"method", "metropolis"}, {"seed", 1}, {"stop", {{"ess", 8}}}},
        json{{"method", "conditional"}, {"seed", 1}, {"stop", {{"counted", 5}}}}})
    for (const std::string& id : daemon.add_chains(wish, request))
      EXPECT_EQ(daemon.wait_for_end(id)["state"], "finished");
  for (const char* world : {"bowling", "dice", "spelling"}) {
    const std::string id = daemon.add_stocked_scenario({{"world", world}, {"constraints", json::array()}}, 1);
    const std::string first = daemon.samples(id).at(0)["id"];
    EXPECT_EQ(differences(daemon.get("/v1/samples/" + first + "/keyframes").json(), "Keyframes"), "");
  }
  const json shapes = keyframes_json(every_shape(), {.sample = "s", .world = "w", .world_version = 1});
  EXPECT_EQ(differences(shapes, "Keyframes"), "");
  EXPECT_EQ(differences(daemon.get("/v1/scenarios/" + wish + "/diagnostics").json(), "Diagnostics"), "");
  EXPECT_EQ(differences(daemon.get("/v1/scenarios/" + wish + "/chains?limit=1").json(), "Chains"), "");
  EXPECT_EQ(differences(daemon.get("/v1/scenarios/" + wish + "/lessons").json(), "Lessons"), "");
  EXPECT_EQ(differences(daemon.get("/v1/scenarios/" + wish + "/samples?limit=1").json(), "Samples"), "");
  EXPECT_EQ(differences(daemon.get("/v1/scenarios?limit=1").json(), "Scenarios"), "");
  const json with_keyframes =
      daemon.post("/v1/scenarios/" + wish + "/plays", {{"include", "keyframes"}}).json();
  EXPECT_EQ(differences(with_keyframes, "Play"), "");
  EXPECT_EQ(differences(daemon.post("/v1/scenarios", json::object()).json(), "Problem"), "");
  const std::string vain = daemon.add_scenario(vain_document());
  daemon.add_chains(vain, json::parse(R"({"method":"rejection"})"));
  json refused;
  EXPECT_TRUE(wait_until([&] {
    refused = daemon.post("/v1/scenarios/" + vain + "/plays", json::object()).json();
    return refused.contains("eta_seconds") && refused.contains("odds") && refused.contains("verdict");
  })) << refused;
  EXPECT_EQ(differences(refused, "Problem"), "");

  // Every route as it stands on the page. Who does not read what is told for long is no longer told.
  EventStream stream(daemon);
  const std::string unwanted = daemon.add_scenario(prior_document("Unwanted"));
  const std::string running = daemon.add_chains(wish, json::object()).at(0);
  for (const ApiRoute& route : api_document().routes) {
    if (route.path == "/v1/events") continue;
    const std::string what = route.method + " " + route.path;
    std::string path = path_of(route);
    if (route.method == "DELETE") path = "/v1/scenarios/" + unwanted;
    if (route.method == "POST" && path.starts_with("/v1/chains/")) path.replace(11, chain.size(), running);
    json body = json::object();
    if (route.path == "/v1/scenarios") body = prior_document("A new one");
    if (route.path.ends_with("/chains")) body = {{"stop", {{"samples", 1}}}};
    const Answer answer = route.method == "POST" ? daemon.post(path, body) : daemon.ask(route.method, path);
    const auto documented = route.answers.find(answer.status);
    if (route.path == "/") continue;
    if (documented == route.answers.end())
      ADD_FAILURE() << what << " answers " << answer.status << ", which is not documented";
    else if (!documented->second.empty())
      EXPECT_EQ(differences(answer.json(), documented->second.c_str()), "") << what;
    else
      EXPECT_FALSE(json::accept(answer.body)) << what << " answers JSON without a documented shape";
  }

  // Every event.
  std::set<std::string> told;
  const auto tell = [&](const Event& event) {
    told.insert(event.name);
    const auto documented = api_document().events.find(event.name);
    if (documented == api_document().events.end())
      ADD_FAILURE() << "the event " << event.name << " is not documented";
    else
      EXPECT_EQ(differences(event.data, documented->second.c_str()), "") << event.name;
    return event.name == "scenario-deleted";
  };
  stream.next_that(tell);
  std::set<std::string> events;
  for (const auto& [name, shape] : api_document().events)
    events.insert(name);
  EXPECT_EQ(told, events);

  // What a damaged store says of itself.
  const TemporaryFolder hurt;
  {
    Daemon before(hurt.path());
    before.add_scenario(prior_document());
    ASSERT_EQ(before.terminate(), 0);
  }
  database::Connection((hurt / "retake.db").string(), database::Connection::Access::write)
      .execute("UPDATE scenario SET document = '{'");
  const Daemon after(hurt.path());
  EXPECT_EQ(after.get("/v1/scenarios").json()["scenarios"].size(), 0);
  EXPECT_EQ(differences(after.get("/readyz").json(), "Status"), "");

  std::set<std::string> documented, never;
  for (const auto& [name, shape] : api_document().shapes)
    add_keys(shape, name, documented);
  std::set_difference(documented.begin(), documented.end(), keys_met().begin(), keys_met().end(),
                      std::inserter(never, never.end()));
  EXPECT_EQ(never, std::set<std::string>{}) << "documented, but never answered";
}

}  // namespace
}  // namespace retake
