// Every registered world and the minimal one keep the contract; and the contract finds what is planted.
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include <set>
#include <thread>
#include <tuple>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/worlds/contract/contract.h"
#include "tests/worlds/contract/open_scenario.h"
#include "tests/worlds/faulty_world.h"
#include "tests/worlds/minimal_world.h"

namespace retake::tests {
namespace {

std::vector<Clause> clauses_of(bool slow) {
  std::vector<Clause> all;
  for (Clause clause : contract()) {
    if (slow) clause.draws = clause.slow_draws;
    if (clause.draws > 0) all.push_back(clause);
  }
  return all;
}

std::string print(const std::vector<std::string>& faults) {
  std::string text;
  for (const std::string& fault : faults)
    text += "\n  " + fault;
  return text;
}

using WorldAndClause = std::tuple<const World*, Clause>;

std::string name_of(const ::testing::TestParamInfo<WorldAndClause>& tested) {
  return std::string(std::get<0>(tested.param)->name()) + "_" + std::get<1>(tested.param).name;
}

class WorldContract : public ::testing::TestWithParam<WorldAndClause> {};
class SlowWorldContract : public WorldContract {};
INSTANTIATE_TEST_SUITE_P(All, WorldContract,
                         ::testing::Combine(::testing::ValuesIn(all_worlds()),
                                            ::testing::ValuesIn(clauses_of(false))),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Slow, SlowWorldContract,
                         ::testing::Combine(::testing::ValuesIn(all_worlds()),
                                            ::testing::ValuesIn(clauses_of(true))),
                         name_of);

void expect_kept(const WorldAndClause& tested) {
  const auto& [world, clause] = tested;
  Faults faults;
  clause.check(*world, clause.draws, faults);
  EXPECT_TRUE(faults.sentences().empty()) << print(faults.sentences());
}

TEST_P(WorldContract, IsKept) {
  expect_kept(GetParam());
}
TEST_P(SlowWorldContract, IsKept) {
  expect_kept(GetParam());
}

TEST(Registry, HasEveryWorldByItsName) {
  std::set<std::string_view> names;
  for (const World* world : worlds()) {
    EXPECT_EQ(find_world(world->name()), world);
    EXPECT_TRUE(names.insert(world->name()).second) << world->name();
  }
  EXPECT_EQ(find_world(minimal_world().name()), nullptr);
}

// --- The contract finds what is wrong ----------------------------------------------------------------

struct Plant {
  Planted planted;
  const char* clause;
};
const Plant kPlants[] = {
    {Planted::still_bodies_swapped, "NamesBodies"},
    {Planted::rest_not_set, "SetsRests"},
    {Planted::rest_set_without_pose, "SetsRests"},
    {Planted::rest_differs_scored, "ScoresWhatItRecords"},
    {Planted::event_differs_scored, "ScoresWhatItRecords"},
    {Planted::measure_not_written, "WritesMeasures"},
    {Planted::joint_proposal, "PriorComesBack"},
    {Planted::wrong_ratio, "PriorComesBack"},
    {Planted::density_above_zero, "ScoresAtMostZero"},
    {Planted::leaks_after_stop, "RemembersNothing"},
    {Planted::leaks_frames, "RemembersNothing"},
    {Planted::bound_too_tight, "StopsWhatCannotMatter"},
    {Planted::bound_too_tight_midway, "ScoresAtMostZero"},
    {Planted::stops_too_early, "StopsWhatCannotMatter"},
    {Planted::stops_too_early, "WalksTheSameEarlyOrNot"},
};

TEST(ContractOfFaultyWorlds, FindsEveryPlantedFault) {
  for (const auto& [planted, clause] : kPlants) {
    const auto world = make_faulty_world(planted);
    EXPECT_FALSE(contract_faults(*world, clause).empty()) << static_cast<int>(planted) << " " << clause;
  }
}

TEST(ContractOfFaultyWorlds, FindsNothingWhereNothingIsPlanted) {
  const auto world = make_faulty_world(Planted::none);
  for (const auto& [planted, clause] : kPlants) {
    const auto faults = contract_faults(*world, clause);
    EXPECT_TRUE(faults.empty()) << clause << print(faults);
  }
}

/// A proposal that draws Variables as one leaves each Variable's own distribution as it is.
TEST(ContractOfFaultyWorlds, SeesJointlyWhatMarginsDoNotShow) {
  const auto world = make_faulty_world(Planted::joint_proposal);
  for (const std::string& fault : contract_faults(*world, "PriorComesBack"))
    EXPECT_EQ(fault.substr(0, 8), "jointly,") << fault;
}

// --- Threads -----------------------------------------------------------------------------------------

class ThreadsWorldContract : public ::testing::TestWithParam<const World*> {};
INSTANTIATE_TEST_SUITE_P(Threads, ThreadsWorldContract, ::testing::ValuesIn(all_worlds()),
                         [](const auto& tested) { return std::string(tested.param->name()); });

TEST_P(ThreadsWorldContract, FourThreadsGiveTheSameAnimationsAndChainsAsOne) {
  const World& world = *GetParam();
  const OpenScenario open = open_scenario(world, world.examples().at(0));
  const std::vector<State> states = draw_states(open.model(), 146, 6);
  const auto work = [&](std::vector<std::string>& results) {
    const auto performer = open.scenario->make_performer();
    for (const State& state : states) {
      const auto take = performer->perform(state);
      results.push_back(take.complete ? digest(state, take.animation) : "failed");
    }
    Chain chain(open.scenario->target(Ratios::exact), {.seed = 147, .method = world.default_method()});
    for (int i = 0; i < 40; ++i)
      chain.step(*performer);
    results.push_back(chain.checkpoint());
  };
  std::vector<std::string> alone;
  work(alone);
  std::vector<std::vector<std::string>> together(4);
  {
    std::vector<std::jthread> threads;
    for (auto& results : together)
      threads.emplace_back([&] { work(results); });
  }
  for (const auto& results : together)
    EXPECT_EQ(results, alone);
}

}  // namespace
}  // namespace retake::tests
