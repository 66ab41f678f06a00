// Symmetry: one die put where it is wished, painted as it is wished, is a draw of p(A | satisfied) with the
// weight that is stated; the motion stays as it was drawn, bit for bit; what it costs does not depend on how
// tight the wish is.
#include "worlds/dice/symmetry.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/sampler/without_roulette.h"
#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

using nlohmann::json;

std::shared_ptr<const Scenario> one_die(double tolerance, bool with_face,
                                        const json& model = json::object()) {
  json constraints = {
      {{"kind", "rest_position"}, {"x", 0.12}, {"z", 0.03}, {"sd", tolerance}, {"tolerance", tolerance}}};
  if (with_face) constraints.push_back({{"kind", "face_up"}, {"face", 6}});
  return Scenario::read({{"world", "dice"}, {"model", model}, {"constraints", constraints}});
}

TEST(DiceSymmetry, TheScaledBesselFunctionIsThatOfTables) {
  // Abramowitz and Stegun, table 9.8: exp(-x) I0(x).
  EXPECT_NEAR(std::exp(dice::log_scaled_bessel_i0(0)), 1, 1e-12);
  EXPECT_NEAR(std::exp(dice::log_scaled_bessel_i0(1)), 0.4657596077, 1e-9);
  EXPECT_NEAR(std::exp(dice::log_scaled_bessel_i0(5)), 0.1835408126, 1e-9);
  // The series takes over without a step.
  EXPECT_NEAR(dice::log_scaled_bessel_i0(50 - 1e-9), dice::log_scaled_bessel_i0(50 + 1e-9), 1e-6);
}

TEST(DiceSymmetry, AnglesAreVonMises) {
  RandomStream random({.seed = 61});
  for (const double concentration : {0.0, 0.5, 4.0, 60.0, 2000.0}) {
    constexpr int kDraws = 40'000;
    double cosine = 0, sine = 0;
    for (int i = 0; i < kDraws; ++i) {
      const double angle = dice::draw_von_mises(1.0, concentration, random) - 1.0;
      cosine += std::cos(angle) / kDraws;
      sine += std::sin(angle) / kDraws;
    }
    // The mean of the cosine is I1 / I0.
    const double expected =
        concentration == 0    ? 0
        : concentration > 500 ? 1 - 1 / (2 * concentration)
                              : std::cyl_bessel_i(1.0, concentration) / std::cyl_bessel_i(0.0, concentration);
    EXPECT_NEAR(cosine, expected, 5 * std::sqrt((1 - expected * expected) / kDraws)) << concentration;
    EXPECT_NEAR(sine, 0, 5 / std::sqrt(kDraws)) << concentration;
  }
}

TEST(DiceSymmetry, AnglesAreDrawnWhateverTheConcentration) {
  RandomStream random({.seed = 64});
  for (int power = -300; power <= 300; ++power) {
    const double concentration = std::pow(10, power);
    double squares = 0;
    for (int i = 0; i < 200; ++i) {
      const double angle = dice::draw_von_mises(0, concentration, random);
      ASSERT_LE(std::abs(angle), std::numbers::pi) << power;
      squares += angle * angle;
    }
    // Of 200 draws the mean square is known to 10 %.
    if (power > 1) {
      EXPECT_NEAR(squares / 200 * concentration, 1, 0.6) << power;
    }
  }
}

/// Draws that are placed, one by one: what Placed does in a chain.
struct PlacedThrow {
  State drawn, placed;
  Score score;  ///< of what was drawn
  Score placed_score;
  double log_weight;
  double stepped;  ///< [s] for the second simulation
};
std::vector<PlacedThrow> place_throws(const Scenario& scenario, int draws, std::uint64_t seed) {
  const auto performer = scenario.make_performer();
  const auto target = scenario.target(Ratios::exact);
  auto run = performer->make_run(), other = performer->make_run();
  std::vector<PlacedThrow> throws;
  for (int i = 0; i < draws; ++i) {
    RandomStream random({.seed = seed, .iteration = static_cast<std::uint64_t>(i)});
    PlacedThrow thrown;
    thrown.drawn = draw_state(scenario.model(), random);
    thrown.score.measures.resize(scenario.measures().size());
    thrown.placed_score = thrown.score;
    if (performer->simulate(thrown.drawn, {.record = run.get()}, thrown.score).end != SimulationEnd::complete)
      continue;
    thrown.placed = thrown.drawn;
    thrown.log_weight = target->placed->place(thrown.drawn, thrown.score, thrown.placed, random);
    const SimulationOutcome outcome = performer->simulate(
        thrown.placed, {.current_state = &thrown.drawn, .current_run = run.get(), .record = other.get()},
        thrown.placed_score);
    EXPECT_EQ(outcome.end, SimulationEnd::complete);
    thrown.stepped = outcome.simulated_seconds;
    throws.push_back(std::move(thrown));
  }
  return throws;
}

TEST(DiceSymmetry, APlacedThrowEndsWhereItIsWishedWithoutAStep) {
  for (const double tolerance : {0.004, 0.0001}) {
    const auto scenario = one_die(tolerance, true);
    const double most = scenario->target(Ratios::exact)->placed->most_log_weight();
    int satisfied = 0, stepped = 0;
    const std::vector<PlacedThrow> throws = place_throws(*scenario, 1500, 62);
    for (const PlacedThrow& thrown : throws) {
      satisfied += thrown.placed_score.satisfied ? 1 : 0;
      stepped += thrown.stepped > 0 ? 1 : 0;
      EXPECT_LE(thrown.log_weight, most);
    }
    // A die that leans shows no face, and may end with another one highest.
    EXPECT_GT(satisfied, 0.985 * static_cast<double>(throws.size())) << tolerance;
    EXPECT_EQ(stepped, 0) << "of " << throws.size();
  }
}

TEST(DiceSymmetry, TheLargestWeightIsTheLargest) {
  // Beside the best of many displacements about the target's direction, about its mirror image, and between.
  RandomStream random = stream(63);
  for (const double z : {0.0, 0.0005, 0.005, 0.03, 0.12, -0.12})
    for (const double x : {0.12, 0.0, -0.05, 0.5})
      for (const double spread : {0.003, 0.0003, 0.05}) {
        if (x == 0 && z == 0) continue;
        const auto scenario = Scenario::read(
            {{"world", "dice"},
             {"model", {{"start_spread", spread}}},
             {"constraints",
              {{{"kind", "rest_position"}, {"x", x}, {"z", z}, {"sd", 1e-6}, {"tolerance", 1e-6}}}}});
        const auto& symmetry = dynamic_cast<const dice::Symmetry&>(*scenario->target(Ratios::exact)->placed);
        const dice::DiceSettings settings;
        const double fast = settings.speed + 5 * settings.speed_spread;
        const Eigen::Vector2d target(x, z);
        const double direction = std::atan2(z, x);
        double best = -std::numeric_limits<double>::infinity();
        for (int i = 0; i < 20'000; ++i) {
          const double length = target.norm() * (i % 2 == 0 ? random.uniform() : 1 - 0.1 * random.uniform());
          const double angle = i % 5 == 0 ? direction
                               : i % 5 == 1
                                   ? direction * random.uniform()
                                   : direction + 0.3 * std::pow(random.uniform(), 3) * random.gaussian();
          const Eigen::Vector2d displacement(length * std::cos(angle), length * std::sin(angle));
          best = std::max(best, symmetry.log_weight_of_place(fast, displacement, target));
        }
        EXPECT_LE(best, symmetry.most_log_weight() + 1e-9) << x << ", " << z << ", " << spread;
        EXPECT_GE(best, symmetry.most_log_weight() - 0.03) << x << ", " << z << ", " << spread;
      }
}

/// Numbers of a throw, among them all that placing sets.
std::vector<double> numbers(const Scenario& scenario, const State& state, const Score& score) {
  const auto& measures = scenario.measures();
  const auto value = [&](const std::string& name) {
    for (std::size_t i = 0; i < measures.size(); ++i)
      if (measures[i].name == name) return score.measures[i];
    return kAbsent;
  };
  const auto& variables = scenario.model().variables();
  const auto variable = [&](const std::string& name) {
    for (std::size_t i = 0; i < variables.size(); ++i)
      if (variables[i].name == name) return state[static_cast<Eigen::Index>(i)];
    return kAbsent;
  };
  const double vx = variable("die_1_velocity_x"), vz = variable("die_1_velocity_z");
  return {variable("die_1_x"),
          variable("die_1_z"),
          std::atan2(vz, vx),
          std::hypot(vx, vz),
          variable("die_1_height"),
          variable("grid_mirrored"),
          value("settling_time"),
          value("touched_points"),
          std::hypot(value("rest_x") - 0.12, value("rest_z") - 0.03),
          variable("die_1_velocity_y")};
}

/// P(place) and moments: placed and weighted draws against plain ones that came out as wished.
void expect_exact(double tolerance, int plain_draws, int placed_draws) {
  // Draws are compared on the disc, whatever p_c is within it.
  const auto scenario = one_die(tolerance, false);
  std::vector<std::vector<double>> plain;
  const auto performer = scenario->make_performer();
  Score score;
  score.measures.resize(scenario->measures().size());
  for (int i = 0; i < plain_draws; ++i) {
    RandomStream random({.seed = 63, .iteration = static_cast<std::uint64_t>(i)});
    const State state = draw_state(scenario->model(), random);
    if (performer->simulate(state, {}, score).end == SimulationEnd::complete && score.satisfied)
      plain.push_back(numbers(*scenario, state, score));
  }
  std::vector<std::vector<double>> placed;
  std::vector<double> weights;
  double sum = 0, squares = 0;
  for (const PlacedThrow& thrown : place_throws(*scenario, placed_draws, 64)) {
    if (!thrown.placed_score.satisfied) continue;
    weights.push_back(std::exp(thrown.log_weight));
    sum += weights.back();
    squares += weights.back() * weights.back();
    placed.push_back(numbers(*scenario, thrown.placed, thrown.placed_score));
  }
  const double hits = static_cast<double>(plain.size());
  const double p = hits / plain_draws, q = sum / placed_draws;
  const double error = std::hypot(std::sqrt(hits) / plain_draws, std::sqrt(squares) / placed_draws);
  std::printf("P(place) %.5f plainly (%g hits), %.5f placed, z %.2f\n", p, hits, q, (p - q) / error);
  EXPECT_LT(std::abs(p - q), 5 * error);
  for (std::size_t k = 0; k < plain[0].size(); ++k) {
    double mean = 0, variance = 0, placed_mean = 0, placed_variance = 0;
    for (const auto& each : plain)
      mean += each[k] / hits;
    for (const auto& each : plain)
      variance += std::pow(each[k] - mean, 2) / hits / hits;
    for (std::size_t i = 0; i < placed.size(); ++i)
      placed_mean += weights[i] / sum * placed[i][k];
    for (std::size_t i = 0; i < placed.size(); ++i)
      placed_variance += std::pow(weights[i] / sum * (placed[i][k] - placed_mean), 2);
    const double z = (mean - placed_mean) / std::sqrt(variance + placed_variance);
    std::printf("number %zu: %.5f plainly, %.5f placed, z %.2f\n", k, mean, placed_mean, z);
    EXPECT_LT(std::abs(z), 5) << k;
  }
}

TEST(DiceSymmetry, IsExact) {
  expect_exact(0.02, 2500, 2500);
}
TEST(SlowDiceSymmetry, IsExact) {
  expect_exact(0.01, 400'000, 200'000);
}

/// What a chain says of how likely the wish is, and how long it simulated.
struct Said {
  double probability, error, seconds;
};
Said said_by_chain(const Scenario& scenario, bool roulette, int iterations) {
  auto target = std::make_shared<Target>(*scenario.target(Ratios::exact));
  if (!roulette) target->placed = std::make_shared<const WithoutRoulette>(target->placed);
  const auto performer = scenario.make_performer();
  Chain chain(target, {.seed = 66, .method = Method::conditional});
  for (int i = 0; i < iterations; ++i)
    chain.step(*performer);
  const OddsTally& odds = chain.counts().odds;
  const auto draws = static_cast<double>(odds.draws);
  return {.probability = odds.sum / draws,
          .error = std::sqrt(odds.squares) / draws,
          .seconds = chain.counts().simulated_seconds};
}

void expect_roulette_changes_no_odds(double tolerance, int iterations) {
  const auto scenario = one_die(tolerance, true);
  const Said with = said_by_chain(*scenario, true, 4 * iterations),
             without = said_by_chain(*scenario, false, iterations);
  const double z = (with.probability - without.probability) / std::hypot(with.error, without.error);
  std::printf("within %g m: %.3e with roulette, %.3e without, z %.2f\n", tolerance, with.probability,
              without.probability, z);
  EXPECT_LT(std::abs(z), 5);
  EXPECT_LT(with.seconds, 3 * without.seconds) << "of four times as many draws";
}

TEST(DiceSymmetry, RouletteChangesNoOdds) {
  expect_roulette_changes_no_odds(0.01, 700);
}
TEST(SlowDiceSymmetry, RouletteChangesNoOdds) {
  for (const double tolerance : {0.01, 0.001, 0.0001})
    expect_roulette_changes_no_odds(tolerance, 60'000);
}

TEST(DiceSymmetry, AChainCountsThrowsByTheirWeights) {
  const auto scenario = one_die(0.001, true);
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 65, .method = Method::conditional});
  ASSERT_EQ(chain.counts().kernels.size(), 1u);
  EXPECT_EQ(chain.counts().kernels[0].name, "placed");
  for (int i = 0; i < 6000; ++i)
    if (chain.step(*performer)) {
      EXPECT_TRUE(chain.stay().score.satisfied);
      EXPECT_GE(chain.stay().weight, 1u);
    }
  EXPECT_GT(chain.counts().samples, 3u);
  const auto said = odds(chain.counts().odds);
  ASSERT_TRUE(said.has_value());
  // The study has 3.9e-5 for the place, a sixth of it with a face.
  EXPECT_GT(said->probability, 2e-6);
  EXPECT_LT(said->probability, 2e-5);
}

}  // namespace
}  // namespace retake::tests
