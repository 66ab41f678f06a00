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

TEST(Parameters, PlainNumbersReadAsAPersonWritesThem) {
  EXPECT_EQ(plain_number(5), "5");
  EXPECT_EQ(plain_number(0.1), "0.1");
  EXPECT_EQ(plain_number(-1e-6), "-1e-06");
}

}  // namespace
}  // namespace retake::tests
