// Draws that are placed where they satisfy: exact with any weights, with roulette and without, and the same
// after any interruption. Each statistical comparison errs with probability 1e-6 unless it says more.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/roulette.h"
#include "tests/sampler/walk_checks.h"

namespace retake::tests {
namespace {

/// Puts y where x lets it satisfy: in one part by a slope, in the other one evenly.
class PlaceY final : public PlacedRedraw {
 public:
  explicit PlaceY(bool plays_roulette) : plays_roulette_(plays_roulette) {}
  double place(const State& drawn, const Score&, State& candidate, RandomStream& random) const override {
    const double x = drawn[TwoModes::kX];
    if (x > 1.2 && x < 1.6) {
      // Density 2 u / 0.1^2, u from 0 to 0.1.
      const double u = 0.1 * std::sqrt(random.uniform());
      candidate[TwoModes::kY] = 0.1 + u;
      return -std::log(200 * u);
    }
    if (x > -1.0 && x < -0.7) {
      candidate[TwoModes::kY] = 0.6 + 0.15 * random.uniform();
      return std::log(0.15);
    }
    return -kInfinity;
  }
  double most_log_weight() const override { return std::log(0.3); }
  bool plays_roulette() const override { return plays_roulette_; }
  /// Of the parts and of what lies about them, one more often than the other.
  double survival(std::size_t, std::span<const double> features) const override {
    const double x = features[0];
    return x > 1.3 && x < 2 ? 0.9 : x > -1.2 && x < 0 ? 0.4 : 0.1;
  }

 private:
  bool plays_roulette_;
};

struct Case {
  TwoModes toy;
  bool plays_roulette;
};
TwoModes placed(const Case& tested) {
  TwoModes toy = tested.toy;
  toy.placed = std::make_shared<const PlaceY>(tested.plays_roulette);
  return toy;
}
std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const TwoModes& toy : all_two_modes())
    for (const bool plays_roulette : {false, true})
      cases.push_back({toy, plays_roulette});
  return cases;
}

ChainSettings placed_settings(std::uint64_t seed) {
  return {.seed = seed, .method = Method::conditional};
}

std::string name_of(const Case& tested) {
  return name_of(tested.toy) + (tested.plays_roulette ? "AndRoulette" : "");
}

class PlacedTest : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Toys, PlacedTest, ::testing::ValuesIn(all_cases()),
                         [](const auto& tested) { return name_of(tested.param); });

TEST_P(PlacedTest, IsExact) {
  const Truth truth = truth_of(GetParam().toy, 1'000'000, 501);
  EXPECT_LT(largest_t(runs_of(placed(GetParam()), placed_settings(502), 30'000), truth), kLargestT);
}

/// Of toys whose simulations all end: whether they do may not depend on what is placed.
class PlacedOddsTest : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Roulette, PlacedOddsTest, ::testing::Bool());

TEST_P(PlacedOddsTest, AreThoseOfThePrior) {
  const Case tested{.toy = {.height = TwoModes::Height::stepped}, .plays_roulette = GetParam()};
  const Truth truth = truth_of(tested.toy, 1'000'000, 503);
  const TwoModes toy = placed(tested);
  std::vector<double> said;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Chain chain(toy.target(), placed_settings(504 + seed));
    ToySimulator simulator = toy.simulator();
    for (int i = 0; i < 20'000; ++i)
      chain.step(simulator);
    said.push_back(odds(chain.counts().odds)->probability);
  }
  const Moments of = moments(said);
  EXPECT_LT(std::abs(of.mean - truth.probability) / std::hypot(of.standard_error(), truth.probability_error),
            kLargestT);
}

TEST_P(PlacedTest, ResumedEqualsUninterrupted) {
  expect_resumes(placed(GetParam()), placed_settings(530), 6000,
                 [](int i) { return i % 7 == 0 || i > 3900; });
}

TEST(Placed, DamagedCheckpointsAreRefused) {
  const TwoModes toy = placed({.toy = {}, .plays_roulette = true});
  for (const int iterations : {0, 50, 5000}) {
    Chain chain(toy.target(), placed_settings(531));
    ToySimulator simulator = toy.simulator();
    for (int i = 0; i < iterations; ++i)
      chain.step(simulator);
    expect_survives_damage(toy, placed_settings(531), chain.checkpoint(), 3);
  }
}

TEST(Placed, RouletteSavesWork) {
  std::vector<double> seconds;
  for (const bool plays_roulette : {false, true}) {
    const TwoModes toy = placed({.toy = {}, .plays_roulette = plays_roulette});
    Chain chain(toy.target(), placed_settings(532));
    ToySimulator simulator = toy.simulator();
    for (int i = 0; i < 20'000; ++i)
      chain.step(simulator);
    seconds.push_back(chain.counts().simulated_seconds);
  }
  EXPECT_LT(seconds[1], 0.9 * seconds[0]);
}

TEST(Roulette, SurvivesAsOftenAsTheLeastThatItMet) {
  constexpr int kGames = 100'000;
  const std::vector<double> met = {0.8, 0.9, 0.3, 0.5};
  const auto survival = [&](std::size_t checkpoint, std::span<const double>) { return met[checkpoint]; };
  RandomStream random = stream(533);
  int survived = 0;
  for (int game = 0; game < kGames; ++game) {
    Roulette roulette(survival, random);
    bool goes_on = true;
    for (std::size_t checkpoint = 0; checkpoint < met.size() && goes_on; ++checkpoint)
      goes_on = roulette.goes_on(checkpoint, 0, {});
    if (!goes_on) continue;
    ++survived;
    EXPECT_DOUBLE_EQ(roulette.survival(), 0.3);
  }
  EXPECT_LT(std::abs(z_of_share(survived, kGames, 0.3)), kLargestZ);
}

TEST(Roulette, WhatPromisesMoreSurvivesMoreOften) {
  EXPECT_EQ(survival_of_promise(0), 1);
  EXPECT_EQ(survival_of_promise(std::log(0.25)), 1);
  EXPECT_NEAR(survival_of_promise(std::log(0.01)), 0.2, 1e-12);
  EXPECT_EQ(survival_of_promise(-1e9), 0.02);
}

}  // namespace
}  // namespace retake::tests
