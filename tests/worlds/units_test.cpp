// Numbers with units: the same wish is the same document to the bit, whichever unit it was given in, in every
// field of every world that has one; what is no unit of a field is refused with those that are.
#include "worlds/units.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests {
namespace {

const std::vector<std::string> kDimensions = {"m", "s", "rad", "m/s", "rad/s", "m/s^2"};

TEST(Units, TheSIUnitIsAmongThemAndChangesNothing) {
  for (const std::string& si : kDimensions) {
    const Unit* unit = find_unit(si, si);
    ASSERT_NE(unit, nullptr) << si;
    for (const double value : {0.1, 1.0 / 3, -7e300, 5e-324})
      EXPECT_EQ(in_si(*unit, value), value) << si;
  }
  EXPECT_TRUE(units_of("").empty());
  EXPECT_TRUE(units_of("N s").empty());
  EXPECT_EQ(find_unit("m", "deg"), nullptr);
}

TEST(Units, AreWhatTheyAre) {
  const auto one = [](const char* si, const char* name, double value = 1) {
    return in_si(*find_unit(si, name), value);
  };
  EXPECT_EQ(one("m", "cm"), 0.01);
  EXPECT_EQ(one("m", "mm"), 0.001);
  EXPECT_EQ(one("m", "in"), 0.0254);
  EXPECT_EQ(one("m", "ft"), 0.3048);
  EXPECT_EQ(one("s", "ms", 250), 0.25);
  EXPECT_EQ(one("s", "min"), 60);
  EXPECT_NEAR(one("rad", "deg", 180), std::numbers::pi, 1e-14);
  EXPECT_NEAR(one("m/s", "km/h", 36), 10, 1e-14);
  EXPECT_EQ(one("m/s", "mph"), 0.44704);
  EXPECT_NEAR(one("rad/s", "rpm", 60), 2 * std::numbers::pi, 1e-14);
  EXPECT_NEAR(one("rad/s", "deg/s", 90), std::numbers::pi / 2, 1e-14);
}

TEST(Units, ADecimalNumberIsTheSameToTheBit) {
  RandomStream random = stream(701);
  for (int draw = 0; draw < 20000; ++draw) {
    // Up to six digits, of which some are behind the point: digits of 12.3 cm are those of 0.123 m.
    const auto digits = static_cast<long>(random.index(1000000));
    const int behind = static_cast<int>(random.index(5));
    const auto decimal = [&](int places) {
      return std::strtod((std::to_string(digits) + "e-" + std::to_string(places)).c_str(), nullptr);
    };
    EXPECT_EQ(in_si(*find_unit("m", "cm"), decimal(behind)), decimal(behind + 2));
    EXPECT_EQ(in_si(*find_unit("m", "mm"), decimal(behind)), decimal(behind + 3));
    EXPECT_EQ(in_si(*find_unit("s", "ms"), decimal(behind)), decimal(behind + 3));
  }
}

TEST(Units, ATextWithAUnitIsUnderstoodForTheQuestion) {
  EXPECT_EQ(quantity_of("12 cm", "m")->value, 12);
  EXPECT_EQ(quantity_of("1.5in", "m")->unit->name, "in");
  EXPECT_FALSE(quantity_of("12 deg", "m"));
  EXPECT_FALSE(quantity_of("cm", "m"));
  EXPECT_FALSE(quantity_of("", "m"));
  EXPECT_FALSE(quantity_of("12", "m"));
}

// --- In every field of every world -------------------------------------------------------------------

/// Calls `visit` for each place of a wish or model whose schema has units, as a pointer below `at`.
template <typename Visit>
void each_field_with_units(const json& schema, const std::string& at, const Visit& visit) {
  for (const auto& [name, property] : schema.at("properties").items()) {
    const std::string place = at + "/" + name;
    if (property.contains("x-units")) visit(place, property);
    if (property.value("type", "") == "object") each_field_with_units(property, place, visit);
  }
}

/// A document that holds every field of the kinds that it has.
std::vector<json> whole_documents(const World& world) {
  std::vector<json> all;
  for (const json& example : world.examples())
    all.push_back(Scenario::read(example, {&world})->document());
  const json model = all.front().at("model");
  const std::string body = open_smallest(world).roster.movers.front().name;
  const json wishes = {
      {{"kind", "state_at"}, {"time", 1}, {"position", {0.1, 0.2, 0.3}}, {"velocity", {1, 0, 0}}},
      {{"kind", "inside"}, {"box", {{"low", {-1, -1, -1}}, {"high", {1, 1, 1}}}}},
      {{"kind", "contact_at"}, {"times", {0.5, 0.75}}},
      {{"kind", "rest_position"}, {"x", 0.1}, {"z", 0.02}}};
  for (json wish : wishes) {
    if (world.name() == "ball2d" && wish["kind"] == "rest_position") wish.erase("z");
    if (!(world.name() == "ball2d" && wish["kind"] == "rest_position") && wish["kind"] != "contact_at")
      wish["body"] = body;
    const json example = open_smallest(world).scenario->document();
    all.push_back(
        Scenario::read(
            {{"world", world.name()}, {"model", example.at("model")}, {"constraints", json::array({wish})}},
            {&world})
            ->document());
  }
  for (json& document : all)
    document.erase("world_version");
  return all;
}

json in_unit(const json& si, const Unit& unit) {
  const auto one = [&](double value) { return value * unit.over / unit.times; };
  if (si.is_number()) return {{unit.name, one(si.get<double>())}};
  json list = json::array();
  for (const json& member : si)
    list.push_back(one(member.get<double>()));
  return {{unit.name, std::move(list)}};
}

/// SI numbers that differ by rounding alone, which conversion there and back makes.
void expect_near(const json& one, const json& other, const std::string& where) {
  for (const json& change : json::diff(one, other)) {
    const json::json_pointer place(change.at("path").get<std::string>());
    ASSERT_TRUE(one.contains(place) && one.at(place).is_number()) << where << change;
    EXPECT_NEAR(one.at(place).get<double>(), other.at(place).get<double>(),
                1e-13 * std::abs(one.at(place).get<double>()))
        << where;
  }
}

TEST(Units, EveryFieldOfEveryWorldThatHasThemTakesThem) {
  std::set<std::string> met;
  for (const World* world : all_worlds())
    for (const json& document : whole_documents(*world)) {
      const auto walk = [&](const json& schema, const std::string& at) {
        each_field_with_units(schema, at, [&](const std::string& place, const json& property) {
          const json::json_pointer pointer(place);
          const std::string si = property.at("x-unit");
          for (const std::string& name : property.at("x-units").get<std::vector<std::string>>()) {
            json given = document;
            given[pointer] = in_unit(document.at(pointer), *find_unit(si, name));
            json read;
            try {
              read = Scenario::read(given, {world})->document();
            } catch (const InvalidRequest& refused) {
              // Rounded, it may be beyond the bound at which it was.
              EXPECT_NE(std::string(refused.what()).find("must be"), std::string::npos)
                  << world->name() << place << " " << refused.what();
              continue;
            }
            read.erase("world_version");
            expect_near(document, read, std::string(world->name()) + place + " in " + name + ": ");
            met.insert(name);
          }
          json wrong = document;
          wrong[pointer] = {{"kg", 1}};
          const auto faults = faults_of([&] { Scenario::read(wrong, {world}); });
          EXPECT_TRUE(faults.contains(place + "/kg")) << place;
          for (const std::string& name : property.at("x-units").get<std::vector<std::string>>())
            EXPECT_NE(faults.begin()->second.find("{\"" + name + "\""), std::string::npos)
                << faults.begin()->second;
        });
      };
      walk(world->model_parameters().schema(), "/model");
      for (std::size_t i = 0; i < document.at("constraints").size(); ++i)
        for (const TermKind& kind : world->term_kinds())
          if (kind.kind == document["constraints"][i]["kind"])
            walk(kind.parameters.schema(), "/constraints/" + std::to_string(i));
    }
  for (const char* name : {"cm", "mm", "in", "ft", "ms", "min", "deg", "km/h", "mph", "rpm", "cm/s^2"})
    EXPECT_TRUE(met.contains(name)) << name << " is in no field";
}

TEST(Units, TheSameWishIsTheSameScenario) {
  const auto document = [](const char* wish) {
    return Scenario::read({{"world", "dice"}, {"constraints", json::array({json::parse(wish)})}})->document();
  };
  const json plain = document(R"({"kind":"rest_position","x":0.12,"z":0.03,"tolerance":0.005})");
  EXPECT_EQ(plain,
            document(R"({"kind":"rest_position","x":{"cm":12},"z":{"mm":30},"tolerance":{"m":0.005}})"));
  EXPECT_EQ(plain.dump(),
            document(R"({"kind":"rest_position","x":{"cm":12},"z":{"cm":3},"tolerance":{"mm":5}})").dump());
  const json at = document(R"({"kind":"state_at","time":0.25,"position":[0.1,0.02,0]})");
  EXPECT_EQ(at, document(R"({"kind":"state_at","time":{"ms":250},"position":{"cm":[10,2,0]}})"));
  EXPECT_EQ(at, document(R"({"kind":"state_at","time":{"ms":250},"position":[{"cm":10},{"mm":20},0]})"));
  const json box = document(R"({"kind":"inside","box":{"low":[-0.1,0,0],"high":[0.2,0.3,0.4]}})");
  EXPECT_EQ(box, document(R"({"kind":"inside","box":{"low":{"cm":[-10,0,0]},"high":[0.2,{"cm":30},0.4]}})"));
}

TEST(Units, WhatLooksLikeAnotherUnitIsAskedAbout) {
  const auto fault = [](const json& model) {
    const auto faults = faults_of([&] {
      Scenario::read({{"world", "dice"}, {"model", model}, {"constraints", json::array()}});
    });
    EXPECT_EQ(faults.size(), 1u) << model;
    return faults.empty() ? std::pair<const std::string, std::string>() : *faults.begin();
  };
  EXPECT_EQ(
      fault({{"side", 1.6}}).second,
      "must be at least 0.005 and at most 0.05 m, got 1.6; were these centimetres? Then say {\"cm\": 1.6}");
  EXPECT_NE(fault({{"side", 16}}).second.find("millimetres? Then say {\"mm\": 16}"), std::string::npos);
  EXPECT_NE(fault({{"interval", 150}}).second.find("milliseconds? Then say {\"ms\": 150}"),
            std::string::npos);
  EXPECT_EQ(fault({{"side", 1e9}}).second.find("were these"), std::string::npos) << "in no unit would it fit";
  EXPECT_NE(fault({{"side", "1.6 cm"}}).second.find("say {\"cm\": 1.6}"), std::string::npos);
  EXPECT_EQ(fault({{"side", {{"cm", 160}}}}).second.find("were these"), std::string::npos)
      << "who gives a unit is not asked";
  EXPECT_EQ(fault({{"side", {{"deg", 1}}}}).first, "/model/side/deg");
  EXPECT_EQ(fault({{"side", {{"cm", "1"}}}}).first, "/model/side/cm");
  EXPECT_EQ(fault({{"side", {{"cm", 1}, {"mm", 6}}}}).first, "/model/side");
  EXPECT_EQ(fault({{"restitution", {{"cm", 1}}}}).first, "/model/restitution") << "a pure number has no unit";
  EXPECT_EQ(fault({{"dice", {{"cm", 1}}}}).first, "/model/dice");
  EXPECT_EQ(fault({{"side", {{"cm", 1e308}}}}).first, "/model/side/cm");
}

}  // namespace
}  // namespace retake::tests
