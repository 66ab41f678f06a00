// Painting: thrown dice that are painted as it is wished are draws of p(A | satisfied), with the weight that
// is stated, beside plain throws. And which wishes are met by paint, which by the guide, which by neither.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

using nlohmann::json;

json total(int sum) {
  return {{"kind", "total"}, {"sum", sum}};
}
json face(int die, int shown) {
  return {{"kind", "face_up"}, {"body", "die_" + std::to_string(die)}, {"face", shown}};
}
json place(int die, double tolerance) {
  return {{"kind", "rest_position"},
          {"body", "die_" + std::to_string(die)},
          {"x", 0.12},
          {"z", 0.03 * die},
          {"sd", tolerance},
          {"tolerance", tolerance}};
}
json contact(const char* with) {
  return {{"kind", "contact_at"}, {"body", "die_1"}, {"with", with},
          {"times", {0.3}},       {"sd", 0.1},       {"tolerance", 0.1}};
}

/// A list, also of one.
template <typename... Wishes>
json list(const Wishes&... wishes) {
  json all = json::array();
  (all.push_back(wishes), ...);
  return all;
}

std::shared_ptr<const Scenario> dice_scenario(const json& constraints, json model = {{"dice", 2}}) {
  return Scenario::read({{"world", "dice"}, {"model", std::move(model)}, {"constraints", constraints}});
}

/// The measures of so many samples, each by its weight, and the odds.
struct Met {
  std::vector<std::vector<double>> measures;
  OddsTally odds;
  std::uint64_t draws = 0;
};
Met samples_of(const Scenario& scenario, Method method, std::size_t count, std::uint64_t seed) {
  Met met;
  Chain chain(scenario.target(Ratios::exact), {.seed = seed, .method = method});
  const auto performer = scenario.make_performer();
  while (met.measures.size() < count) {
    if (!chain.step(*performer) || !chain.stay().is_sample) continue;
    met.measures.push_back(chain.stay().score.measures);
    EXPECT_TRUE(chain.stay().score.satisfied);
  }
  met.odds = chain.counts().odds;
  met.draws = chain.counts().iteration;
  return met;
}

/// Largest |z| between the means of every measure of two lots of independent samples.
double largest_z(const Met& one, const Met& other) {
  double largest = 0;
  for (std::size_t measure = 0; measure < one.measures.front().size(); ++measure) {
    std::array<Moments, 2> of;
    for (std::size_t lot = 0; lot < 2; ++lot) {
      std::vector<double> values;
      for (const auto& sample : (lot == 0 ? one : other).measures)
        if (!std::isnan(sample[measure])) values.push_back(sample[measure]);
      if (values.size() < 50) return largest;
      of[lot] = moments(values);
    }
    const double error = std::hypot(of[0].standard_error(), of[1].standard_error());
    if (error > 0) largest = std::max(largest, std::abs(of[0].mean - of[1].mean) / error);
  }
  return largest;
}

TEST(DicePainting, IsExactBesidePlainThrows) {
  // A sum, a face of one die, both, and faces with something that paint does not give.
  const std::vector<json> wishes = {list(total(7)), list(face(1, 6)), list(face(2, 2), total(6)),
                                    list(face(1, 3), contact("table"))};
  for (const json& wish : wishes) {
    const auto scenario = dice_scenario(wish);
    ASSERT_TRUE(scenario->target(Ratios::exact)->placed) << wish;
    const Met painted = samples_of(*scenario, Method::conditional, 250, 71);
    const Met plain = samples_of(*scenario, Method::rejection, 250, 72);
    // Of some twenty measures none differs that much with probability 1e-4.
    EXPECT_LT(largest_z(painted, plain), 4.8) << wish;
    const Odds by_paint = odds(painted.odds).value(), by_throws = odds(plain.odds).value();
    EXPECT_GT(by_paint.probability, 0.9 * by_throws.low) << wish;
    EXPECT_LT(by_paint.probability, 1.1 * by_throws.high) << wish;
  }
}

TEST(DicePainting, EveryWayToShowASumIsAsLikely) {
  const auto scenario = dice_scenario(list(total(7)));
  const Met met = samples_of(*scenario, Method::conditional, 600, 73);
  const std::vector<std::string> names = scenario->target(Ratios::exact)->measure_names;
  const auto top =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "top_face_1") - names.begin());
  ASSERT_LT(top, names.size());
  std::vector<double> seen(6, 0.0);
  for (const auto& measures : met.measures)
    seen.at(static_cast<std::size_t>(measures[top]) - 1) += 1;
  EXPECT_GT(chi_square_p(seen, std::vector<double>(6, 100.0)), 1e-4);
}

TEST(DicePainting, CostsNothingHoweverRareTheFacesAre) {
  for (const auto& [wish, probability] : std::vector<std::pair<json, double>>{
           {list(total(36)), std::pow(6, -6)},
           {list(face(1, 1), face(2, 2), face(3, 3), face(4, 4), face(5, 5), face(6, 6)), std::pow(6, -6)},
           {list(total(35)), 6 * std::pow(6, -6)}}) {
    const Met met = samples_of(*dice_scenario(wish, {{"dice", 6}}), Method::conditional, 20, 74);
    EXPECT_LT(met.draws, 40u) << wish;
    const Odds known = odds(met.odds).value();
    EXPECT_LE(known.probability, probability * (1 + 1e-9)) << wish;
    EXPECT_GT(known.probability, probability / 2) << "but for dice that lean";
  }
}

TEST(DicePainting, WhatContradictsItselfIsNotPainted) {
  EXPECT_THROW(dice_scenario(list(face(1, 6), total(2))), InvalidRequest);
  EXPECT_NE(dice_scenario(list(face(1, 6), total(7))), nullptr);
}

TEST(DicePainting, AGuideIsUsedWhereItServesEveryTerm) {
  enum class By { paint, guide, throws };
  const auto by = [](const json& constraints, const json& model = {{"dice", 2}}) {
    const auto target = dice_scenario(constraints, model)->target(Ratios::exact);
    EXPECT_FALSE(target->guide && target->placed);
    return target->guide ? By::guide : target->placed ? By::paint : By::throws;
  };
  const json plain = {{"dice", 2}, {"paint", "fixed"}}, many = {{"dice", 4}, {"paint", "fixed"}};
  EXPECT_EQ(by(list(place(1, 0.01))), By::guide);
  EXPECT_EQ(by(list(place(1, 0.01), face(2, 6))), By::guide);
  EXPECT_EQ(by(list(face(2, 6))), By::paint);
  EXPECT_EQ(by(list(total(7))), By::paint);
  EXPECT_EQ(by(json::array()), By::throws);
  EXPECT_EQ(by(list(face(1, 6), face(2, 6)), plain), By::throws);
  EXPECT_EQ(by(list(face(1, 6), face(2, 6), face(3, 6), face(4, 6)), many), By::guide);
  EXPECT_EQ(by(list(total(7)), plain), By::throws);
  // The guide keeps dice apart.
  const json hit = {
      {"kind", "order"},
      {"events",
       {{{"kind", "contact"}, {"body", "die_1"}, {"with", "die_2"}}, {{"kind", "rest"}, {"body", "die_2"}}}}};
  const json beat = {{"kind", "contact_at"}, {"body", "die_2"}, {"with", "die_1"}, {"bpm", 300}};
  EXPECT_EQ(by(list(place(1, 0.01), contact("table"))), By::guide);
  for (const json& meets : {contact("die_2"), hit, beat}) {
    EXPECT_EQ(by(list(place(1, 0.01), meets)), By::throws) << meets;
    EXPECT_EQ(by(list(place(1, 0.01), face(1, 6), meets)), By::paint) << meets;
    EXPECT_EQ(by(list(face(1, 6), meets)), By::paint) << meets;
    EXPECT_EQ(by(list(meets)), By::throws) << meets;
  }
  EXPECT_EQ(samples_of(*dice_scenario(list(face(1, 6), contact("die_2"))), Method::conditional, 3, 1)
                .measures.size(),
            3u);
}

}  // namespace
}  // namespace retake::tests
