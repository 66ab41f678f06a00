// Health: independence is judged over chains, odds are pooled, time is told while nothing is found.
#include "server/chains/health.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "server/chains/quantities.h"
#include "tests/worlds/stub_world.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;
using Draws = std::vector<DrawRecord>;

DrawRecord draw(double x) {
  const json measures = {{"x", -x}, {"past_the_middle", true}, {"passed", nullptr}};
  return {.measures = measures.dump(), .state = encode_state(State::Constant(1, x))};
}

class HealthTest : public ::testing::Test {
 protected:
  /// `count` draws around `mean`, each of which keeps `memory` of the one before; standard deviation 1.
  Draws walk(std::size_t count, double memory = 0, double mean = 0) {
    std::normal_distribution<double> normal;
    Draws draws;
    double x = normal(random);
    for (std::size_t i = 0; i < count; ++i) {
      draws.push_back(draw(mean + x));
      x = memory * x + std::sqrt(1 - memory * memory) * normal(random);
    }
    return draws;
  }
  static ChainRecord chain(const std::string& method = "rejection") {
    ChainRecord record;
    record.method = method;
    record.state = ChainState::running;
    return record;
  }
  Health health(const std::vector<Draws>& draws, double run_seconds = 0) const {
    std::vector<ChainRecord> chains(draws.size(), chain());
    for (ChainRecord& each : chains)
      each.counters.run_seconds = run_seconds;
    return health_of(*scenario, chains, draws, std::nullopt);
  }
  Health health(const std::vector<ChainRecord>& chains, const std::optional<PilotTally>& pilot = {}) const {
    return health_of(*scenario, chains, std::vector<Draws>(chains.size()), pilot);
  }

  std::mt19937 random{5};
  const std::shared_ptr<const Scenario> scenario =
      tests::read_stub_scenario({{"world", "stub"}, {"constraints", json::array()}});
};

TEST_F(HealthTest, IndependentDrawsCountInFullAndNeverMore) {
  std::vector<Draws> draws;
  for (int i = 0; i < 8; ++i)
    draws.push_back(walk(250));
  const Health said = health(draws, 30);
  EXPECT_EQ(said.chains, 8u);
  EXPECT_EQ(said.draws_per_chain, 250u);
  ASSERT_EQ(said.quantities.size(), 3u);
  ASSERT_TRUE(said.effective);
  EXPECT_EQ(said.effective->quantity, "x");
  EXPECT_LE(said.effective->samples, 2000);
  EXPECT_GT(said.effective->samples, 600);  // the spread of 8 means is known to a factor
  EXPECT_NEAR(said.effective->within, 2000, 500);
  EXPECT_DOUBLE_EQ(*said.effective->per_cpu_minute, said.effective->samples / 4);  // 8 chains for 30 s
  EXPECT_FALSE(health(draws, 0).effective->per_cpu_minute) << "no time has passed";
}

TEST_F(HealthTest, DrawsThatRememberCountLess) {
  // n draws that keep 0.9 of the one before are worth n (1 - 0.9) / (1 + 0.9).
  std::vector<Draws> draws;
  for (int i = 0; i < 40; ++i)
    draws.push_back(walk(1000, 0.9));
  const QuantityHealth x = health(draws).quantities[0];
  const double expected = 40 * 1000 * 0.1 / 1.9;
  EXPECT_NEAR(x.together.ess_bulk, expected, 0.25 * expected);
  EXPECT_NEAR(x.ess_within, expected, 0.25 * expected);
  EXPECT_NEAR(x.ess_across, expected, 0.6 * expected);
}

TEST_F(HealthTest, ChainsThatDisagreeAreWorthLittleWhateverEachClaims) {
  const Health said = health({walk(300, 0, 0), walk(300, 0, 20), walk(300, 0, 40), walk(300, 0, 60)});
  ASSERT_TRUE(said.effective);
  EXPECT_GT(said.effective->within, 800);
  EXPECT_LT(said.effective->samples, 8);
  EXPECT_LT(said.quantities[0].ess_across, 8);
  EXPECT_GT(said.quantities[0].together.rhat, 1.5);
}

TEST_F(HealthTest, TheSpreadOfMeansIsToldFromFourChainsOn) {
  std::vector<Draws> draws = {walk(50), walk(50), walk(50)};
  EXPECT_TRUE(std::isnan(health(draws).quantities[0].ess_across));
  draws.push_back(walk(50));
  EXPECT_TRUE(std::isfinite(health(draws).quantities[0].ess_across));
}

TEST_F(HealthTest, AConstantQuantityIsNoWorstOne) {
  const Health said = health({walk(100), walk(100)});
  const QuantityHealth& constant = said.quantities[2];
  EXPECT_EQ(constant.name, "past_the_middle");
  EXPECT_TRUE(std::isnan(constant.together.ess_bulk));
  EXPECT_TRUE(std::isnan(constant.ess_within));
  EXPECT_EQ(said.effective->quantity, "x");
  EXPECT_FALSE(health({Draws(100, draw(3)), Draws(100, draw(3))}).effective) << "nothing varies";
}

TEST_F(HealthTest, EveryChainCountsByItsDraws) {
  Health said = health({walk(5), walk(200), walk(201)});
  EXPECT_EQ(said.chains, 3u);
  EXPECT_EQ(said.draws_per_chain, 406u / 3);
  EXPECT_GT(said.effective->samples, 100) << "one that has just begun costs the others nothing";
  said = health({walk(3), walk(4), walk(2)});
  EXPECT_EQ(said.chains, 1u) << "fewer than 4 draws say nothing";
  EXPECT_TRUE(std::isnan(said.quantities[0].together.rhat)) << "nor do so few in all";
  EXPECT_TRUE(std::isnan(health({walk(12), walk(11)}).quantities[0].together.rhat));
  EXPECT_TRUE(std::isfinite(health({walk(12), walk(12)}).quantities[0].together.rhat));
  said = health({walk(3), {}});
  EXPECT_EQ(said.chains, 0u);
  EXPECT_EQ(said.draws_per_chain, 0u);
  EXPECT_TRUE(said.quantities.empty());
  EXPECT_FALSE(said.effective);
}

TEST_F(HealthTest, ALongChainDoesNotHideShortOnesThatDisagree) {
  std::vector<Draws> draws;
  for (const double place : {-9, -6, -3, 3, 6, 9})
    draws.push_back(walk(30, 0, place));
  EXPECT_GT(health(draws).quantities[0].together.rhat, 2);
  draws.push_back(walk(1000));
  const Health said = health(draws);
  EXPECT_EQ(said.chains, 7u);
  EXPECT_GT(said.quantities[0].together.rhat, 1.1);
  EXPECT_LT(said.effective->samples, 30);
  EXPECT_GT(said.effective->within, 900) << "what each claims for itself";
}

TEST_F(HealthTest, OddsArePooledAndTimesAndSavingsAddedUp) {
  std::vector<ChainRecord> chains = {chain(), chain("conditional"), chain("conditional")};
  chains[0].counters.iteration = 100;
  chains[1].counters.iteration = 1;
  chains[0].counters.simulations = 90;
  chains[1].counters.simulations = 2;
  chains[0].counters.simulated_seconds = 30;
  chains[1].counters.simulated_seconds = 3;
  chains[0].counters.skipped_seconds = 10;
  chains[1].counters.skipped_seconds = 4;
  chains[0].counters.odds = {OddsBasis::rejection, 100, 1, 1, 1, 1};
  chains[1].counters.odds = {OddsBasis::learned, 50, 4, 0.5, 0.25, 0.25};
  chains[2].counters.odds = {OddsBasis::learned, 50, 6, 0.5, 0.25, 0.5};
  chains[1].counters.first_sample_seconds = 0.75;
  chains[2].counters.first_sample_seconds = 0.25;
  const Health said = health(chains);
  EXPECT_EQ(said.odds.basis, OddsBasis::learned);
  EXPECT_EQ(said.odds.draws, 100u);
  EXPECT_EQ(said.odds.hits, 10u);
  EXPECT_EQ(said.odds.largest, 0.5);
  EXPECT_EQ(said.first_sample_seconds, 0.25);
  EXPECT_EQ(said.iterations, 101u);
  EXPECT_EQ(said.simulations, 92u);
  EXPECT_EQ(said.simulated_seconds, 33);
  EXPECT_EQ(said.skipped_seconds, 14);
  EXPECT_FALSE(health(std::vector<ChainRecord>{}).first_sample_seconds);
}

TEST_F(HealthTest, AnEtaIsGivenWhileNothingIsFoundAndAChainRuns) {
  const auto stepped = [](std::uint64_t iterations, double per_second) {
    ChainRecord record = chain();
    record.counters.iteration = iterations;
    record.counters.iterations_per_second = per_second;
    return record;
  };
  std::vector<ChainRecord> chains = {stepped(4000, 60), stepped(999, 40), stepped(5000, 1000)};
  chains[2].state = ChainState::paused;
  EXPECT_DOUBLE_EQ(health(chains).eta_seconds.value(), 10'000 / 100.0);
  // The draws of a pilot are draws as well; its hits make the wish likelier.
  EXPECT_DOUBLE_EQ(health(chains, PilotTally{.draws = 10'000, .hits = 0}).eta_seconds.value(), 200);
  EXPECT_DOUBLE_EQ(health(chains, PilotTally{.draws = 10'000, .hits = 3}).eta_seconds.value(), 50);
  chains[2].counters.samples = 1;
  EXPECT_FALSE(health(chains).eta_seconds);
  chains.pop_back();
  for (ChainRecord& each : chains)
    each.state = ChainState::finished;
  EXPECT_FALSE(health(chains).eta_seconds);
}

TEST_F(HealthTest, AGuidedChainThatRunsDoesNotWaitForChance) {
  const auto word =
      Scenario::read({{"world", "spelling"}, {"constraints", {{{"kind", "spell"}, {"text", "I"}}}}});
  std::vector<ChainRecord> chains = {chain("metropolis")};
  chains[0].counters.iteration = 999;
  chains[0].counters.iterations_per_second = 10;
  const auto eta = [&] {
    return health_of(*word, chains, std::vector<Draws>(chains.size()), std::nullopt).eta_seconds;
  };
  EXPECT_EQ(eta(), 100);
  chains.push_back(chain("conditional"));
  EXPECT_FALSE(eta());
  chains[1].state = ChainState::paused;
  EXPECT_EQ(eta(), 100);
}

TEST_F(HealthTest, SwapsAreThoseBetweenNeighboursOfEachLadder) {
  std::vector<ChainRecord> chains = {chain("tempering"), chain("rejection"), chain("tempering")};
  chains[0].id = "a";
  chains[0].counters.rungs = {{0, 10, 5}, {0.25, 20, 6}, {1, 0, 0}};
  chains[2].id = "b";
  chains[2].counters.rungs = {{0, 7, 3}, {1, 0, 0}};
  const auto swaps = health(chains).swaps;
  ASSERT_EQ(swaps.size(), 3u);
  EXPECT_EQ(swaps[1].chain, "a");
  EXPECT_EQ(swaps[1].low, 0.25);
  EXPECT_EQ(swaps[1].high, 1);
  EXPECT_EQ(swaps[1].proposed, 20u);
  EXPECT_EQ(swaps[1].accepted, 6u);
  EXPECT_EQ(swaps[2].chain, "b");
  EXPECT_EQ(swaps[2].accepted, 3u);
}

TEST_F(HealthTest, ThePapersRatiosAreAnotherPopulation) {
  std::vector<ChainRecord> chains(4, chain("metropolis"));
  chains[3].ratios = "paper";
  // Three that disagree, and a long one that would hide them.
  const std::vector<Draws> draws = {walk(60, 0, -3), walk(60, 0, 0), walk(60, 0, 3), walk(900)};
  const Health said = health_of(*scenario, chains, draws, std::nullopt);
  EXPECT_EQ(said.chains, 3u);
  EXPECT_GT(said.quantities[0].together.rhat, 2);
  const Health alone = health_of(*scenario, {chains[3]}, {draws[3]}, std::nullopt);
  EXPECT_EQ(alone.chains, 1u);
  EXPECT_LT(alone.quantities[0].together.rhat, 1.02);
}

TEST_F(HealthTest, OnlyAWalkOverTheWholeTargetHasAWarmUp) {
  for (const char* method : {"rejection", "metropolis", "conditional", "tempering"}) {
    ChainRecord record = chain(method);
    record.counters.iteration = 1003;
    EXPECT_EQ(warm_up_iterations(record), record.method == "metropolis" ? 250u : 0u) << method;
  }
}

TEST_F(HealthTest, AChainByItselfIsWorthItsWorstQuantity) {
  ChainRecord record = chain("metropolis");
  record.counters.iteration = 4000;
  record.counters.samples = 77;
  const Draws draws = walk(500, 0.8);
  std::uint64_t asked_from = 0;
  const auto give = [&](std::size_t most, std::uint64_t from_iteration) {
    asked_from = from_iteration;
    return Draws(draws.begin(), draws.begin() + static_cast<std::ptrdiff_t>(std::min(most, draws.size())));
  };
  double least = INFINITY;
  for (const Quantity& quantity : quantities(*scenario, {draws}))
    if (const double ess = ess_bulk(quantity.draws); ess < least) least = ess;
  ASSERT_TRUE(std::isfinite(least));
  EXPECT_EQ(effective_samples(*scenario, record, give), least);
  EXPECT_EQ(asked_from, 1000u);
  EXPECT_LT(least, 150);

  const auto nothing = [](std::size_t, std::uint64_t) { return Draws(); };
  EXPECT_FALSE(effective_samples(*scenario, record, nothing));
  const auto alike = [](std::size_t, std::uint64_t) { return Draws(300, draw(1)); };
  EXPECT_FALSE(effective_samples(*scenario, record, alike)) << "it never moved";
  // What comes again and again is one sample.
  const auto eight = [&](std::size_t, std::uint64_t) {
    Draws stays;
    for (std::size_t i = 0; i < 59; ++i)
      stays.push_back(
          draw(i / 8 % 2 == 0 ? -1.0 - static_cast<double>(i / 8) : 1.0 + static_cast<double>(i / 8)));
    return stays;
  };
  EXPECT_FALSE(effective_samples(*scenario, record, eight)) << "too few to tell";
  const auto to_and_fro = [&](std::size_t, std::uint64_t) {
    Draws sides;
    for (std::size_t i = 0; i < 120; ++i)
      sides.push_back(draw((i / 3 % 2 == 0 ? -1.0 : 1.0) * (1 + static_cast<double>(i / 3) / 100)));
    return sides;
  };
  const std::optional<double> opposite = effective_samples(*scenario, record, to_and_fro);
  ASSERT_TRUE(opposite);
  EXPECT_LE(*opposite, 40) << "there are 40, however much each makes up for the one before";
  EXPECT_EQ(effective_samples(
                *scenario,
                [] {
                  ChainRecord independent = chain("rejection");
                  independent.counters.samples = 77;
                  return independent;
                }(),
                nothing),
            77);
}

}  // namespace
}  // namespace retake
