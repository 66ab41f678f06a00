// Bad bodies at every route: the right status, a pointer to each fault, nothing stored, nothing leaked.

#include "tests/server/api/bad_input.h"

namespace retake {
namespace {

using namespace test;

TEST_F(ApiBadInput, Every_body_must_be_declared_as_JSON_and_be_of_bounded_length) {
  for (const Route& route : routes()) {
    if (!route.methods.contains("POST")) continue;
    for (const std::string& type :
         std::vector<std::string>{"text/plain", "application/x-www-form-urlencoded", "application/jsonx", ""})
      expect_problem(daemon.ask("POST", filled(route.path), "{}", {{"Content-Type", type}}), 415,
                     route.path + " as " + type);
    const std::string long_body = "{\"title\":\"" + std::string(1 << 20, 'a') + "\"}";
    expect_problem(daemon.ask("POST", filled(route.path), long_body), 413, route.path);
  }
}

TEST_F(ApiBadInput, Every_route_with_a_body_refuses_what_is_not_a_decent_JSON_object) {
  struct Case {
    const char* name;
    std::string body;
    int status;
    std::vector<std::string> pointers;
  };
  const auto nested = [](int depth) {
    return "{\"title\":" + std::string(static_cast<std::size_t>(depth), '[') +
           std::string(static_cast<std::size_t>(depth), ']') + "}";
  };
  std::string deepest = "/title";
  for (int level = 0; level < 31; ++level)
    deepest += "/0";
  const std::vector<Case> cases = {
      {"breaks off", R"({"a":1)", 400, {""}},
      {"not JSON", "hello", 400, {""}},
      {"two documents", "{}{}", 400, {""}},
      {"a comma too many", R"({"a":1,})", 400, {""}},
      {"a comment", "{/* no */}", 400, {""}},
      {"NaN", R"({"seed":NaN})", 400, {""}},
      {"not UTF-8", "{\"title\":\"\xff\xfe\"}", 400, {""}},
      {"an overlong encoding", "{\"title\":\"\xc0\xaf\"}", 400, {""}},
      {"half a surrogate pair", R"({"title":"\ud800"})", 400, {""}},
      {"only white space", "  ", 400, {""}},
      {"an array", "[]", 422, {""}},
      {"a string", "\"{}\"", 422, {""}},
      {"null", "null", 422, {""}},
      {"a key twice", R"({"title":"a","title":"a"})", 422, {"/title"}},
      {"a key twice within", R"({"model":{"a/b":1,"a/b":1}})", 422, {"/model/a~1b"}},
      {"a number beyond a double", R"({"seed":1e999})", 422, {"/seed"}},
      {"a negative one within", R"({"stop":{"seconds":[0,-1e999]}})", 422, {"/stop/seconds/1"}},
      {"nested too deep", nested(32), 422, {deepest}},
      {"nested far too deep", nested(100000), 422, {deepest}},
  };
  for (const Route& route : routes()) {
    if (!route.methods.contains("POST")) continue;
    for (const Case& each : cases)
      expect_faults(daemon.ask("POST", filled(route.path), each.body), each.status, each.pointers,
                    route.path + ": " + each.name);
  }
}

TEST_F(ApiBadInput, A_scenario_document_is_refused_with_a_pointer_to_each_fault) {
  const std::string term = R"({"kind":"rest_position","x":1})";
  const auto with_model = [](const std::string& model) {
    return R"({"world":"ball2d","constraints":[],"model":)" + model + "}";
  };
  const auto with_terms = [](const std::string& terms) {
    return R"({"world":"ball2d","constraints":)" + terms + "}";
  };
  const auto with_title = [](const std::string& title) {
    return R"({"world":"ball2d","constraints":[],"title":)" + title + "}";
  };
  std::string many = "[" + term;
  for (int i = 0; i < 32; ++i)
    many += "," + term;
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"{}", {"/world"}},
      {R"({"world":"chess","constraints":[]})", {"/world"}},
      {R"({"world":7,"constraints":[]})", {"/world"}},
      {R"({"world":"ball2d"})", {"/constraints"}},
      {R"({"world":"ball2d","constraints":[],"id":"mine"})", {"/id"}},
      {R"({"world":"ball2d","constraints":[],"a/b~c":1})", {"/a~1b~0c"}},
      {R"({"world":"ball2d","constraints":[],"world_version":1})", {"/world_version"}},
      {with_title("7"), {"/title"}},
      {with_title("\"\""), {"/title"}},
      {with_title("\"a\\u0000b\""), {"/title"}},
      {with_title("\"" + std::string(201, 'x') + "\""), {"/title"}},
      {with_model("[]"), {"/model"}},
      {with_model("null"), {"/model"}},
      {with_model(R"({"mass":1})"), {"/model/mass"}},
      {with_model(R"({"collisions":2.5})"), {"/model/collisions"}},
      {with_model(R"({"collisions":0})"), {"/model/collisions"}},
      {with_model(R"({"collisions":21})"), {"/model/collisions"}},
      {with_model(R"({"collisions":"5"})"), {"/model/collisions"}},
      {with_model(R"({"collisions":true,"gravity":null,"step":{}})"),
       {"/model/collisions", "/model/gravity", "/model/step"}},
      {with_model(R"({"normal_sd":0})"), {"/model/normal_sd"}},
      {with_model(R"({"collisions":1e300})"), {"/model/collisions"}},
      {with_terms("{}"), {"/constraints"}},
      {with_terms("null"), {"/constraints"}},
      {with_terms("[7]"), {"/constraints/0"}},
      {with_terms("[{}]"), {"/constraints/0/kind"}},
      {with_terms(R"([{"kind":"pins","down":[1]}])"), {"/constraints/0/kind"}},
      {with_terms(R"([{"kind":["rest_position"]}])"), {"/constraints/0/kind"}},
      {with_terms(R"([{"kind":"rest_position"}])"), {"/constraints/0/x"}},
      {with_terms("[" + term + R"(,{"kind":"rest_position","x":"1","sd":0,"tolerance":-1,"y":0}])"),
       {"/constraints/1/x", "/constraints/1/sd", "/constraints/1/tolerance", "/constraints/1/y"}},
      {with_terms(many + "]"), {"/constraints"}},
      {with_terms("[" + term + R"(,{"kind":"rest_position","x":2}])"),
       {"/constraints/0/x", "/constraints/1/x"}},
      {with_terms(R"([{"kind":"rest_position","x":{"deg":30}}])"), {"/constraints/0/x/deg"}},
      {with_terms(R"([{"kind":"rest_position","x":{"cm":"1"}}])"), {"/constraints/0/x/cm"}},
      {with_terms(R"([{"kind":"rest_position","x":{"cm":1,"mm":1}}])"), {"/constraints/0/x"}},
      {R"({"world":"ball2d","title":"","model":{"step":-1},"constraints":[{"kind":"no"}],"extra":0})",
       {"/title", "/model/step", "/constraints/0/kind", "/extra"}},
  };
  for (const auto& [body, pointers] : cases)
    expect_faults(daemon.ask("POST", "/v1/scenarios", body), 422, pointers, body.substr(0, 200));
}

TEST_F(ApiBadInput, Requests_for_chains_and_plays_are_refused_with_a_pointer_to_each_fault) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> chain_cases = {
      {R"({"count":0})", {"/count"}},
      {R"({"count":65})", {"/count"}},
      {R"({"count":-1})", {"/count"}},
      {R"({"count":1.5})", {"/count"}},
      {R"({"count":"1"})", {"/count"}},
      {R"({"count":true})", {"/count"}},
      {R"({"count":1e300})", {"/count"}},
      {R"({"seed":-1})", {"/seed"}},
      {R"({"seed":9007199254740992})", {"/seed"}},
      {R"({"seed":18446744073709551616})", {"/seed"}},
      {R"({"seed":null})", {"/seed"}},
      {R"({"method":"guess"})", {"/method"}},
      {R"({"method":1})", {"/method"}},
      {R"({"ratios":"printed"})", {"/ratios"}},
      {R"({"index":1})", {"/index"}},
      {R"({"stop":7})", {"/stop"}},
      {R"({"stop":null})", {"/stop"}},
      {R"({"stop":{"samples":0}})", {"/stop/samples"}},
      {R"({"stop":{"iterations":0.5}})", {"/stop/iterations"}},
      {R"({"stop":{"seconds":0}})", {"/stop/seconds"}},
      {R"({"stop":{"seconds":"60"}})", {"/stop/seconds"}},
      {R"({"stop":{"ess":0}})", {"/stop/ess"}},
      {R"({"stop":{"ess":1001}})", {"/stop/ess"}},
      {R"({"stop":{"ess":1.5}})", {"/stop/ess"}},
      {R"({"stop":{"ess":"10","samples":0}})", {"/stop/ess", "/stop/samples"}},
      {R"({"stop":{"minutes":1}})", {"/stop/minutes"}},
      {R"({"count":0,"seed":-1,"method":"x","ratios":"y","stop":{"samples":-1,"a/b":1},"more":1})",
       {"/count", "/seed", "/method", "/ratios", "/stop/samples", "/stop/a~1b", "/more"}},
  };
  for (const auto& [body, pointers] : chain_cases)
    expect_faults(daemon.ask("POST", "/v1/scenarios/" + scenario + "/chains", body), 422, pointers, body);

  const std::vector<std::pair<std::string, std::vector<std::string>>> play_cases = {
      {R"({"player":""})", {"/player"}},
      {R"({"player":7})", {"/player"}},
      {R"({"player":null})", {"/player"}},
      {R"({"player":")" + std::string(201, 'p') + "\"}", {"/player"}},
      {R"({"include":"glb"})", {"/include"}},
      {R"({"low_water":-1})", {"/low_water"}},
      {R"({"low_water":0.5})", {"/low_water"}},
      {R"({"name":"alice"})", {"/name"}},
      {R"({"player":[],"include":[],"low_water":[],"x":[]})", {"/player", "/include", "/low_water", "/x"}},
  };
  for (const auto& [body, pointers] : play_cases)
    expect_faults(daemon.ask("POST", "/v1/scenarios/" + scenario + "/plays", body), 422, pointers, body);

  for (const std::string& path :
       std::vector<std::string>{"/v1/chains/{chain}/pause", "/v1/chains/{chain}/resume",
                                "/v1/chains/{chain}/stop", "/v1/samples/{sample}/verify"})
    expect_faults(daemon.ask("POST", filled(path), R"({"force":true})"), 422, {"/force"}, path);
}

}  // namespace
}  // namespace retake
