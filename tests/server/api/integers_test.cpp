// Whole numbers are integers in every document about every world: what it says of itself, scenarios, samples,
// traces and keyframes. Seeds are fixed.
#include <gtest/gtest.h>

#include "server/api/views.h"
#include "server/chains/measures.h"
#include "tests/server/api/shapes.h"
#include "worlds/formats/keyframes.h"

namespace retake {
namespace {

using nlohmann::json;

/// Where a value has a float for what its JSON Schema calls an integer, one line a place.
std::string floats_by_schema(const json& value, const json& schema, const std::string& at) {
  const std::string type = schema.value("type", "");
  if (type == "integer") return value.is_number_integer() ? "" : at + ": " + value.dump() + "\n";
  std::string found;
  if (type == "array")
    for (std::size_t i = 0; i < value.size(); ++i)
      found += floats_by_schema(value[i], schema.at("items"), at + "/" + std::to_string(i));
  if (type == "object")
    for (const auto& [name, property] : schema.at("properties").items())
      if (value.contains(name)) found += floats_by_schema(value[name], property, at + "/" + name);
  return found;
}

/// The same of a measure's value, or of each of a list, a set or a curve.
std::string floats_by_kind(const json& value, const json& measure) {
  const std::string kind = measure.value("of", measure.at("kind").get<std::string>());
  if (kind != "integer" && kind != "set") return "";
  if (value.is_null() || value.is_number_integer()) return "";
  if (!value.is_array()) return measure.at("name").get<std::string>() + ": " + value.dump() + "\n";
  std::string found;
  for (const json& member : value)
    found += floats_by_kind(member, measure);
  return found;
}

std::string floats_of_measures(const json& values, const json& measures) {
  std::string found;
  for (const json& measure : measures)
    if (const auto value = values.find(measure.at("name")); value != values.end())
      found += floats_by_kind(*value, measure);
  return found;
}

/// Of a scenario's document.
std::string floats_of_scenario(const json& document, const json& world) {
  std::string found = floats_by_schema(document.at("model"), world.at("model"), "/model");
  for (const json& constraint : document.at("constraints"))
    for (const json& kind : world.at("constraints"))
      if (kind.at("kind") == constraint.at("kind"))
        found += floats_by_schema(constraint, kind.at("schema"), constraint.at("kind"));
  return found;
}

TEST(Integers, AFloatIsSeenWhereAnIntegerBelongs) {
  const json measure = {{"name", "face"}, {"kind", "integer"}};
  EXPECT_EQ(floats_by_kind(3, measure), "");
  EXPECT_EQ(floats_by_kind(nullptr, measure), "");
  EXPECT_NE(floats_by_kind(3.0, measure), "");
  EXPECT_NE(floats_by_kind({3, 4.0}, {{"name", "bin"}, {"kind", "list"}, {"of", "integer"}}), "");
  EXPECT_EQ(floats_by_kind({0.5}, {{"name", "time"}, {"kind", "list"}, {"of", "number"}}), "");
  const json world = world_json(*find_world("dice"));
  const json document = {
      {"model", {{"dice", 2.0}}},
      {"constraints", {{{"kind", "order"}, {"events", json::array()}}, {{"kind", "total"}, {"sum", 7.0}}}}};
  const std::string found = floats_of_scenario(document, world);
  EXPECT_NE(found.find("/model/dice"), std::string::npos) << found;
  EXPECT_NE(found.find("total/sum"), std::string::npos) << found;
}

class Integers : public ::testing::TestWithParam<const World*> {};
INSTANTIATE_TEST_SUITE_P(All, Integers, ::testing::ValuesIn(worlds()),
                         [](const ::testing::TestParamInfo<const World*>& tested) {
                           return std::string(tested.param->name());
                         });

TEST_P(Integers, AreIntegersInEveryDocument) {
  const World& world = *GetParam();
  const json told = world_json(world);
  EXPECT_EQ(test::differences(told, "World"), "");
  for (const json& example : world.examples()) {
    const auto scenario = Scenario::read(example);
    EXPECT_EQ(floats_of_scenario(scenario->document(), told), "") << scenario->title();

    // A chain on the scenario, a take where it stands.
    const json measures = measures_json(scenario->measures());
    const auto performer = scenario->make_performer();
    Chain chain(scenario->target(Ratios::exact), {.seed = 171, .method = Method::metropolis});
    Trace trace(scenario->measures());
    for (int step = 0; step < 5; ++step) {
      chain.step(*performer);
      trace.record(chain);
    }
    EXPECT_EQ(floats_of_measures(trace_json(trace, scenario->measures(), 5), measures), "");
    const auto take = performer->perform(chain.stay().state);
    if (!take.complete) continue;
    EXPECT_EQ(floats_of_measures(measures_json(scenario->measures(), take.score.measures), measures), "");
    const KeyframeHead head =
        keyframe_head(take.animation, "sample", std::string(world.name()), world.version());
    EXPECT_EQ(test::differences(keyframes_json(take.animation, head), "Keyframes"), "");
  }
}

}  // namespace
}  // namespace retake
