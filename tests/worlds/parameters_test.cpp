// ParameterTable: defaults, types and ranges of an object's fields, and the schema that says the same.
#include "worlds/parameters.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

const ParameterTable& table() {
  static const ParameterTable fields({
      {.name = "size",
       .default_value = 0.5,
       .minimum = 0,
       .maximum = 2,
       .above_minimum = true,
       .unit = "m",
       .summary = "How large",
       .source = "5.1"},
      {.name = "count",
       .kind = Parameter::Kind::integer,
       .default_value = 5,
       .minimum = 1,
       .maximum = 20,
       .summary = "How many",
       .source = "chosen"},
      {.name = "where", .minimum = -10, .maximum = 10, .unit = "m", .summary = "Where"},
      {.name = "free", .default_value = 0, .summary = "Any number"},
  });
  return fields;
}

std::pair<Parameters, std::multimap<std::string, std::string>> read(
    const json& object, const std::vector<std::string>& ignored = {}) {
  std::vector<Fault> faults;
  Parameters parameters = table().read(object, "/model", faults, ignored);
  std::multimap<std::string, std::string> by_pointer;
  for (const Fault& fault : faults)
    by_pointer.emplace(fault.pointer, fault.detail);
  return {std::move(parameters), std::move(by_pointer)};
}

/// The pointers of the faults of an object that has `where` and one more field.
std::vector<std::string> faults_with(const std::string& name, const json& value) {
  json object = {{"where", 0}};
  object[name] = value;
  return pointers(read(object).second);
}

TEST(Parameters, DefaultsAreFilledIn) {
  const auto [parameters, faults] = read({{"where", 3}});
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(parameters.document(), json({{"size", 0.5}, {"count", 5}, {"where", 3.0}, {"free", 0.0}}));
  EXPECT_EQ(parameters.number("size"), 0.5);
  EXPECT_EQ(parameters.integer("count"), 5);
}

TEST(Parameters, GivenNumbersReplaceThem) {
  const auto [parameters, faults] = read({{"where", -2.5}, {"size", 2}, {"count", 7}, {"free", -1e300}});
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(parameters.number("size"), 2);
  EXPECT_EQ(parameters.integer("count"), 7);
  EXPECT_EQ(parameters.number("where"), -2.5);
  EXPECT_EQ(parameters.number("free"), -1e300);
}

TEST(Parameters, TheEndsOfARangeBelongToItUnlessExcluded) {
  for (const double value : {1.0, 20.0})
    EXPECT_TRUE(faults_with("count", value).empty()) << value;
  for (const double value : {0.0, 21.0, -5.0})
    EXPECT_EQ(faults_with("count", value).size(), 1u) << value;
  EXPECT_TRUE(faults_with("size", 2).empty());
  EXPECT_TRUE(faults_with("size", 1e-300).empty());
  for (const double value : {0.0, -0.0, -1e-300, 2.0000001})
    EXPECT_EQ(faults_with("size", value), std::vector<std::string>{"/model/size"}) << value;
  for (const double value : {-10.0, 10.0})
    EXPECT_TRUE(faults_with("where", value).empty()) << value;
}

TEST(Parameters, AnIntegerMayBeWrittenAsAWholeNumberWithAPoint) {
  const auto [parameters, faults] = read({{"where", 0}, {"count", 5.0}});
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(parameters.document().at("count").dump(), "5");
  EXPECT_EQ(faults_with("count", 5.5).size(), 1u);
  EXPECT_EQ(faults_with("count", 1e300).size(), 1u);
}

TEST(Parameters, OnlyNumbersAreNumbers) {
  for (const json& value :
       {json(true), json(false), json(nullptr), json("1"), json::array({1}), json::object()})
    for (const char* name : {"size", "count", "where"}) {
      json object = {{"where", 0}};
      object[name] = value;
      const auto found = read(object).second;
      ASSERT_EQ(pointers(found), std::vector<std::string>{std::string("/model/") + name}) << value;
      EXPECT_NE(found.begin()->second.find(value.type_name()), std::string::npos) << found.begin()->second;
    }
}

TEST(Parameters, EveryFaultIsSaidAtOnce) {
  const auto faults = read({{"size", 0}, {"count", 2.5}, {"a/b", 1}, {"colour", "red"}}).second;
  EXPECT_EQ(pointers(faults), (std::vector<std::string>{"/model/a~1b", "/model/colour", "/model/count",
                                                        "/model/size", "/model/where"}));
}

TEST(Parameters, FaultyFieldsHoldTheirDefaultOrMinimum) {
  const auto [parameters, faults] = read({{"size", 9}, {"count", "many"}});
  EXPECT_EQ(faults.size(), 3u);
  EXPECT_EQ(parameters.number("size"), 0.5);
  EXPECT_EQ(parameters.integer("count"), 5);
  EXPECT_EQ(parameters.number("where"), -10);
}

TEST(Parameters, WhatIsNotAnObjectIsOneFault) {
  for (const json& value : {json::array(), json(1), json("text"), json(nullptr)})
    EXPECT_EQ(pointers(read(value).second), std::vector<std::string>{"/model"}) << value;
}

TEST(Parameters, IgnoredFieldsAreLeftToTheCaller) {
  EXPECT_TRUE(read({{"where", 0}, {"kind", "x"}}, {"kind"}).second.empty());
  EXPECT_EQ(pointers(read({{"where", 0}, {"kind", "x"}}).second), std::vector<std::string>{"/model/kind"});
}

TEST(Parameters, TheSchemaSaysWhatReadingDoes) {
  const json schema = table().schema();
  EXPECT_EQ(schema.at("type"), "object");
  EXPECT_EQ(schema.at("additionalProperties"), false);
  EXPECT_EQ(schema.at("required"), json::array({"where"}));
  const json& size = schema.at("properties").at("size");
  EXPECT_EQ(size, json({{"type", "number"},
                        {"description", "How large"},
                        {"default", 0.5},
                        {"exclusiveMinimum", 0.0},
                        {"maximum", 2.0},
                        {"x-unit", "m"},
                        {"x-units", {"cm", "mm", "m", "in", "ft"}},
                        {"x-source", "5.1"}}));
  const json& count = schema.at("properties").at("count");
  EXPECT_EQ(count.dump(), json({{"type", "integer"},
                                {"description", "How many"},
                                {"default", 5},
                                {"minimum", 1},
                                {"maximum", 20},
                                {"x-source", "chosen"}})
                              .dump());
  const json& free = schema.at("properties").at("free");
  EXPECT_EQ(free.at("default").dump(), "0.0") << "a number, although the table says 0";
  EXPECT_FALSE(free.contains("minimum") || free.contains("maximum") || free.contains("x-unit"));
  EXPECT_FALSE(schema.at("properties").at("where").contains("default"));
}

TEST(Parameters, EveryBoundOfTheSchemaIsTheBoundOfReading) {
  const json properties = table().schema().at("properties");
  for (const auto& [name, property] : properties.items()) {
    if (property.contains("minimum")) {
      EXPECT_TRUE(faults_with(name, property["minimum"]).empty());
      EXPECT_FALSE(faults_with(name, property["minimum"].get<double>() - 1).empty());
    }
    if (property.contains("exclusiveMinimum")) {
      EXPECT_FALSE(faults_with(name, property["exclusiveMinimum"]).empty());
    }
    if (property.contains("maximum")) {
      EXPECT_TRUE(faults_with(name, property["maximum"]).empty());
      EXPECT_FALSE(faults_with(name, property["maximum"].get<double>() + 1).empty());
    }
    if (property.contains("default")) {
      EXPECT_TRUE(faults_with(name, property["default"]).empty());
    }
  }
}

// --- Fields that are no numbers -------------------------------------------------------------------

const ParameterTable& lane() {
  static const ParameterTable fields({
      {.name = "mirrored",
       .kind = Parameter::Kind::boolean,
       .default_value = false,
       .summary = "Left-handed"},
      {.name = "oil",
       .kind = Parameter::Kind::choice,
       .default_value = "house",
       .choices = {"house", "sport", "dry"},
       .summary = "Pattern of the oil"},
      {.name = "rack",
       .kind = Parameter::Kind::integer_set,
       .default_value = {3, 1, 2},
       .minimum = 1,
       .maximum = 10,
       .fewest = 2,
       .summary = "Pins that are set",
       .source = "A.1"},
      {.name = "down",
       .kind = Parameter::Kind::integer_set,
       .minimum = 1,
       .maximum = 10,
       .summary = "Pins that shall fall"},
  });
  return fields;
}

std::pair<Parameters, std::multimap<std::string, std::string>> read_lane(const json& object) {
  std::vector<Fault> faults;
  Parameters parameters = lane().read(object, "/model", faults);
  std::multimap<std::string, std::string> by_pointer;
  for (const Fault& fault : faults)
    by_pointer.emplace(fault.pointer, fault.detail);
  return {std::move(parameters), std::move(by_pointer)};
}

/// The faults of an object that has `down` and one more field.
std::multimap<std::string, std::string> lane_faults(const std::string& name, const json& value) {
  json object = {{"down", json::array()}};
  object[name] = value;
  return read_lane(object).second;
}

TEST(Parameters, BooleansChoicesAndSetsAreFilledInAndRead) {
  const auto [filled, no_faults] = read_lane({{"down", json::array()}});
  EXPECT_TRUE(no_faults.empty());
  EXPECT_FALSE(filled.boolean("mirrored"));
  EXPECT_EQ(filled.choice("oil"), "house");
  EXPECT_EQ(filled.integer_set("rack"), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(filled.integer_set("down"), std::vector<int>{});

  const auto [given, faults] =
      read_lane({{"mirrored", true}, {"oil", "dry"}, {"rack", {10, 7}}, {"down", {7}}});
  EXPECT_TRUE(faults.empty());
  EXPECT_TRUE(given.boolean("mirrored"));
  EXPECT_EQ(given.choice("oil"), "dry");
  EXPECT_EQ(given.integer_set("rack"), (std::vector<int>{7, 10}));
}

TEST(Parameters, EqualSetsHaveEqualDocuments) {
  const std::string ascending = read_lane({{"down", {1, 5, 10}}}).first.document().dump();
  EXPECT_NE(ascending.find(R"("down":[1,5,10])"), std::string::npos) << ascending;
  EXPECT_EQ(read_lane({{"down", {10, 1.0, 5}}, {"rack", {2, 1, 3}}}).first.document().dump(), ascending);
}

TEST(Parameters, OnlyBooleansAreBooleans) {
  for (const json& value : {json(0), json(1), json("true"), json(nullptr), json::array()})
    EXPECT_EQ(pointers(lane_faults("mirrored", value)), std::vector<std::string>{"/model/mirrored"}) << value;
}

TEST(Parameters, AChoiceIsOneOfThoseThatTheFaultLists) {
  EXPECT_TRUE(lane_faults("oil", "sport").empty());
  for (const json& value : {json(""), json("House"), json(1), json(nullptr), json::array({"dry"})})
    EXPECT_EQ(pointers(lane_faults("oil", value)), std::vector<std::string>{"/model/oil"}) << value;
  EXPECT_EQ(lane_faults("oil", "wet").begin()->second, "must be one of house, sport, dry");
}

TEST(Parameters, FaultyMembersOfASetAreRefusedWhereTheyStand) {
  EXPECT_EQ(pointers(lane_faults("rack", {1, 0, 11, 2.5, "3", nullptr, {4}, 1, 5, 1.0})),
            (std::vector<std::string>{"/model/rack/1", "/model/rack/2", "/model/rack/3", "/model/rack/4",
                                      "/model/rack/5", "/model/rack/6", "/model/rack/7", "/model/rack/9"}));
  EXPECT_EQ(pointers(lane_faults("rack", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 10})),
            std::vector<std::string>{"/model/rack/10"});
  for (const json& value : {json(1), json("1,2"), json(nullptr), json::object({{"1", true}})})
    EXPECT_EQ(pointers(lane_faults("rack", value)), std::vector<std::string>{"/model/rack"}) << value;
}

TEST(Parameters, ALongListOfFaultyMembersHasFewFaults) {
  EXPECT_EQ(lane_faults("rack", std::vector<int>(100000, 1)).size(), 10u);
  EXPECT_EQ(lane_faults("rack", std::vector<int>(100000, 0)).size(), 11u);
}

TEST(Parameters, ASetMayNeedMembers) {
  EXPECT_EQ(pointers(lane_faults("rack", json::array())), std::vector<std::string>{"/model/rack"});
  EXPECT_EQ(pointers(lane_faults("rack", {11})), (std::vector<std::string>{"/model/rack", "/model/rack/0"}));
  EXPECT_TRUE(lane_faults("rack", {1, 2}).empty());
}

TEST(Parameters, FaultyFieldsThatAreNoNumbersHoldTheirDefault) {
  const auto [parameters, faults] = read_lane({{"mirrored", 1}, {"oil", "wet"}, {"rack", {1, 1}}});
  EXPECT_EQ(pointers(faults),
            (std::vector<std::string>{"/model/down", "/model/mirrored", "/model/oil", "/model/rack/1"}));
  EXPECT_FALSE(parameters.boolean("mirrored"));
  EXPECT_EQ(parameters.choice("oil"), "house");
  EXPECT_EQ(parameters.integer_set("rack"), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(parameters.integer_set("down"), std::vector<int>{});
}

TEST(Parameters, TheSchemaSaysWhatAFieldMayHold) {
  const json properties = lane().schema().at("properties");
  EXPECT_EQ(lane().schema().at("required"), json::array({"down"}));
  EXPECT_EQ(properties.at("mirrored"),
            json({{"type", "boolean"}, {"description", "Left-handed"}, {"default", false}}));
  EXPECT_EQ(properties.at("oil"), json({{"type", "string"},
                                        {"enum", {"house", "sport", "dry"}},
                                        {"description", "Pattern of the oil"},
                                        {"default", "house"}}));
  EXPECT_EQ(properties.at("rack").dump(),
            json({{"type", "array"},
                  {"items", {{"type", "integer"}, {"minimum", 1}, {"maximum", 10}}},
                  {"uniqueItems", true},
                  {"minItems", 2},
                  {"description", "Pins that are set"},
                  {"default", {1, 2, 3}},
                  {"x-source", "A.1"}})
                .dump());
}

TEST(ParametersDeathTest, ADefaultThatReadingWouldRefuseIsOurFault) {
  EXPECT_DEATH(ParameterTable({{.name = "size", .default_value = 3, .maximum = 2}}), "at most 2");
  EXPECT_DEATH(
      ParameterTable(
          {{.name = "oil", .kind = Parameter::Kind::choice, .default_value = "wet", .choices = {"dry"}}}),
      "must be one of dry");
  EXPECT_DEATH(ParameterTable({{.name = "rack", .kind = Parameter::Kind::integer_set, .minimum = 1}}),
               "rack");
}

TEST(Parameters, PlainNumbersReadAsAPersonWritesThem) {
  EXPECT_EQ(plain_number(5), "5");
  EXPECT_EQ(plain_number(0.1), "0.1");
  EXPECT_EQ(plain_number(-1e-6), "-1e-06");
}

// --- Texts ------------------------------------------------------------------------------------------

const ParameterTable& texts() {
  static const ParameterTable fields({
      {.name = "word", .kind = Parameter::Kind::text, .longest = 4, .summary = "What it says"},
      {.name = "lines",
       .kind = Parameter::Kind::text_list,
       .default_value = {"ab", "cd"},
       .fewest = 1,
       .most = 3,
       .longest = 2,
       .summary = "What it shows",
       .source = "chosen"},
  });
  return fields;
}

std::multimap<std::string, std::string> faults_of_texts(const json& object) {
  std::vector<Fault> faults;
  texts().read(object, "/term", faults);
  std::multimap<std::string, std::string> by_pointer;
  for (const Fault& fault : faults)
    by_pointer.emplace(fault.pointer, fault.detail);
  return by_pointer;
}

TEST(Parameters, TextsAndListsOfTextsAreReadAsTheyStand) {
  std::vector<Fault> faults;
  const Parameters given = texts().read({{"word", "b, a"}, {"lines", {"z", "a", "z"}}}, "/term", faults);
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(given.text("word"), "b, a");
  EXPECT_EQ(given.text_list("lines"), (std::vector<std::string>{"z", "a", "z"}));
  EXPECT_EQ(texts().read({{"word", "a"}}, "/term", faults).text_list("lines"),
            (std::vector<std::string>{"ab", "cd"}));
  EXPECT_TRUE(faults.empty());
}

TEST(Parameters, FaultyTextsAreRefusedAtTheirPlace) {
  for (const json& word : {json(""), json("abcde"), json(3), json(nullptr), json::array({"a"})})
    EXPECT_EQ(pointers(faults_of_texts({{"word", word}})), std::vector<std::string>{"/term/word"}) << word;
  EXPECT_EQ(pointers(faults_of_texts(json::object())), std::vector<std::string>{"/term/word"});
  const auto faults_of_lines = [](const json& lines) {
    return pointers(faults_of_texts({{"word", "a"}, {"lines", lines}}));
  };
  const std::vector<std::string> whole = {"/term/lines"};
  for (const json& lines : {json("ab"), json::array(), json({"a", "a", "a", "a"}), json(nullptr)})
    EXPECT_EQ(faults_of_lines(lines), whole) << lines;
  EXPECT_EQ(faults_of_lines({"ab", 3, "abc"}), (std::vector<std::string>{"/term/lines/1", "/term/lines/2"}));
}

TEST(Parameters, TheSchemaOfTextsSaysTheirLengths) {
  const json properties = texts().schema().at("properties");
  EXPECT_EQ(properties.at("word"),
            json({{"type", "string"}, {"minLength", 1}, {"maxLength", 4}, {"description", "What it says"}}));
  EXPECT_EQ(properties.at("lines").at("items"),
            json({{"type", "string"}, {"minLength", 1}, {"maxLength", 2}}));
  EXPECT_EQ(properties.at("lines").at("minItems"), 1);
  EXPECT_EQ(properties.at("lines").at("maxItems"), 3);
}

// --- Lists of numbers, and objects within objects ---------------------------------------------------

const ParameterTable& story() {
  static const auto event = std::make_shared<const ParameterTable>(
      std::vector<Parameter>{{.name = "time", .minimum = 0, .summary = "When"},
                             {.name = "loud",
                              .kind = Parameter::Kind::boolean,
                              .default_value = false,
                              .summary = "Whether heard"}});
  static const ParameterTable fields({
      {.name = "place",
       .kind = Parameter::Kind::number_list,
       .default_value = {1, 2},
       .minimum = -5,
       .maximum = 5,
       .fewest = 2,
       .most = 3,
       .unit = "m",
       .summary = "Where"},
      {.name = "first", .kind = Parameter::Kind::object, .fields = event, .summary = "What happens first"},
      {.name = "events",
       .kind = Parameter::Kind::object_list,
       .default_value = json::array(),
       .most = 2,
       .fields = event,
       .summary = "What happens then"},
  });
  return fields;
}

std::vector<std::string> story_faults(const json& object) {
  std::vector<Fault> faults;
  story().read(object, "/t", faults);
  std::vector<std::string> all;
  for (const Fault& fault : faults)
    all.push_back(fault.pointer);
  return all;
}

TEST(Parameters, ListsOfNumbersAndObjectsAreFilledInAndRead) {
  std::vector<Fault> faults;
  const Parameters given = story().read({{"place", {-0.0, 1.5, 5}},
                                         {"first", {{"time", 1}}},
                                         {"events", {{{"time", 2}, {"loud", true}}, {{"time", 3}}}}},
                                        "/t", faults);
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(given.number_list("place"), (std::vector<double>{0, 1.5, 5}));
  EXPECT_EQ(given.object("first").number("time"), 1);
  EXPECT_FALSE(given.object("first").boolean("loud"));
  ASSERT_EQ(given.object_list("events").size(), 2u);
  EXPECT_TRUE(given.object_list("events")[0].boolean("loud"));
  EXPECT_EQ(
      given.document().dump(),
      R"({"events":[{"loud":true,"time":2.0},{"loud":false,"time":3.0}],"first":{"loud":false,"time":1.0},)"
      R"("place":[0.0,1.5,5.0]})");
  const Parameters filled = story().read({{"first", {{"time", 0}}}}, "/t", faults);
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(filled.number_list("place"), (std::vector<double>{1, 2}));
  EXPECT_TRUE(filled.object_list("events").empty());
}

TEST(Parameters, FaultsWithinAnObjectHaveTheirOwnPlace) {
  using Pointers = std::vector<std::string>;
  const json first = {{"time", 1}};
  EXPECT_EQ(story_faults({{"first", first}, {"place", {1, 6, "2"}}}), (Pointers{"/t/place/1", "/t/place/2"}));
  EXPECT_EQ(story_faults({{"first", first}, {"place", {1}}}), Pointers{"/t/place"});
  EXPECT_EQ(story_faults({{"first", first}, {"place", 1}}), Pointers{"/t/place"});
  EXPECT_EQ(story_faults(json::object()), Pointers{"/t/first"});
  EXPECT_EQ(story_faults({{"first", 3}}), Pointers{"/t/first"});
  EXPECT_EQ(story_faults({{"first", {{"loud", 1}, {"colour", 1}}}}),
            (Pointers{"/t/first/time", "/t/first/loud", "/t/first/colour"}));
  EXPECT_EQ(story_faults({{"first", first}, {"events", json::array({first, {{"time", -1}}})}}),
            Pointers{"/t/events/1/time"});
  EXPECT_EQ(story_faults({{"first", first}, {"events", json::array({first, first, first})}}),
            Pointers{"/t/events"});
}

TEST(Parameters, FaultyObjectsHoldWhatTheirFieldsWould) {
  std::vector<Fault> faults;
  const Parameters parameters = story().read({{"events", 1}}, "/t", faults);
  EXPECT_EQ(faults.size(), 2u);
  EXPECT_EQ(parameters.object("first").number("time"), 0);
  EXPECT_TRUE(parameters.object_list("events").empty());
}

TEST(Parameters, TheSchemaOfAnObjectIsThatOfItsTable) {
  const json properties = story().schema().at("properties");
  EXPECT_EQ(properties.at("place").at("items"),
            json({{"type", "number"}, {"minimum", -5.0}, {"maximum", 5.0}}));
  EXPECT_EQ(properties.at("place").at("maxItems"), 3);
  EXPECT_EQ(properties.at("first").at("required"), json::array({"time"}));
  EXPECT_EQ(properties.at("first").at("description"), "What happens first");
  EXPECT_EQ(properties.at("events").at("items").at("properties").at("time").at("description"), "When");
}

TEST(ParametersDeathTest, OnlyObjectsHaveFields) {
  EXPECT_DEATH(ParameterTable({{.name = "box", .kind = Parameter::Kind::object}}), "box");
  EXPECT_DEATH(ParameterTable({{.name = "places", .kind = Parameter::Kind::number_list}}), "places");
}

}  // namespace
}  // namespace retake::tests
