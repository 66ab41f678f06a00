// GatheredDraws: the same draws as the store gives of the same samples.
#include "server/chains/gathered_draws.h"

#include <random>

#include <gtest/gtest.h>

#include "db/open_store.h"
#include "tests/server/child_process.h"

namespace retake {
namespace {

NewSample sample(std::uint64_t iteration, std::uint32_t replica, std::uint64_t weight) {
  const std::string text = std::to_string(iteration) + "/" + std::to_string(replica);
  NewSample made;
  made.record.iteration = iteration;
  made.record.replica = replica;
  made.record.weight = weight;
  made.record.log_prior = -static_cast<double>(iteration);
  made.record.log_constraint = -0.5 * replica;
  made.record.measures = "{\"at\":\"" + text + "\"}";
  made.record.digest = "d";
  made.state = text;
  return made;
}

TEST(GatheredDraws, AreTheStoresWhateverTheWeightsReplicasAndParts) {
  test::TemporaryFolder folder;
  const auto opened = open_store((folder / "retake.db").string());
  Store& store = *opened;
  ScenarioRecord scenario;
  scenario.id = "s";
  store.add_scenario(scenario);
  ChainRecord chain;
  chain.id = "c";
  chain.scenario = "s";
  store.add_chains({chain});
  GatheredDraws gathered;
  std::mt19937 random(3);
  for (std::uint64_t part = 0; part < 20; ++part) {
    ChainProgress progress;
    progress.chain = "c";
    progress.scenario = "s";
    for (std::uint64_t i = 1; i <= 10; ++i)
      progress.samples.push_back(
          sample(10 * part + i, static_cast<std::uint32_t>(random() % 3), random() % 5));
    if (part > 0)
      progress.weights = {{.iteration = progress.samples[0].record.iteration,
                           .replica = progress.samples[0].record.replica,
                           .weight = 40}};
    gathered.add(progress);
    store.commit(progress).get();
  }
  for (const std::size_t most : {0u, 1u, 7u, 100u, 10'000u})
    for (const std::uint64_t from : {0u, 50u, 55u, 199u, 500u}) {
      const auto stored = store.draws("c", most, from), ours = gathered.draws(most, from);
      ASSERT_EQ(ours.size(), stored.size()) << most << " from " << from;
      for (std::size_t i = 0; i < ours.size(); ++i) {
        EXPECT_EQ(ours[i].iteration, stored[i].iteration);
        EXPECT_EQ(ours[i].log_prior, stored[i].log_prior);
        EXPECT_EQ(ours[i].log_constraint, stored[i].log_constraint);
        EXPECT_EQ(ours[i].measures, stored[i].measures);
        EXPECT_EQ(ours[i].state, stored[i].state);
      }
    }
  EXPECT_GT(gathered.draws(10'000, 0).size(), 200u);
}

}  // namespace
}  // namespace retake
