// Scenarios come back as they were put in, with what is known of them.
#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using StoreScenarios = StoreTest;

TEST_P(StoreScenarios, a_scenario_comes_back) {
  auto scenario = make_scenario("s");
  scenario.created_at = 1234;
  const auto added = store.add_scenario(scenario);
  EXPECT_TRUE(added.created);
  const auto found = store.scenario("s").value();
  EXPECT_EQ(found.id, "s");
  EXPECT_EQ(found.world, "bowling");
  EXPECT_EQ(found.world_version, 3);
  EXPECT_EQ(found.title, "Title of s");
  EXPECT_EQ(found.document, scenario.document);
  EXPECT_EQ(found.created_at, 1234);
  EXPECT_EQ(found.samples + found.running + found.paused + found.finished + found.failed, 0u);
  EXPECT_FALSE(store.scenario("other"));
}

TEST_P(StoreScenarios, a_pilot_is_kept_and_those_without_are_listed) {
  for (const char* id : {"a", "b", "c"})
    store.add_scenario(make_scenario(id));
  EXPECT_FALSE(store.scenario("b")->pilot);
  EXPECT_EQ(store.scenarios_without_pilot(), (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_TRUE(store.set_pilot("b", {.draws = 1000, .hits = 0, .seconds = 0.75}));
  EXPECT_FALSE(store.set_pilot("gone", {}));
  const auto pilot = store.scenario("b")->pilot;
  ASSERT_TRUE(pilot);
  EXPECT_EQ(pilot->draws, 1000u);
  EXPECT_EQ(pilot->hits, 0u);
  EXPECT_EQ(pilot->seconds, 0.75);
  EXPECT_EQ(store.scenarios(2, "").records[1].pilot->draws, 1000u);
  store.delete_scenario("a");
  EXPECT_FALSE(store.set_pilot("a", {}));
  EXPECT_EQ(store.scenarios_without_pilot(), (std::vector<std::string>{"c"}));
}

TEST_P(StoreScenarios, the_odds_of_all_its_chains_are_pooled) {
  store.add_scenario(make_scenario("s"));
  store.add_scenario(make_scenario("other"));
  EXPECT_EQ(store.scenario("s")->odds.basis, OddsBasis::none);
  const auto add = [&](const std::string& id, const std::string& scenario, const OddsTally& tally) {
    auto chain = make_chain(id, scenario);
    chain.counters.odds = tally;
    store.add_chains({chain});
  };
  add("unused", "s", {});
  add("ladder", "s", {OddsBasis::ladder, 100, 90, 90, 90, 1});
  EXPECT_EQ(store.scenario("s")->odds.draws, 100u);
  add("first", "s", {OddsBasis::rejection, 1000, 2, 2, 2, 1});
  add("second", "s", {OddsBasis::rejection, 500, 3, 3, 3, 1});
  add("foreign", "other", {OddsBasis::rejection, 7, 0, 0, 0, 0});
  auto odds = store.scenario("s")->odds;
  EXPECT_EQ(odds.basis, OddsBasis::rejection);
  EXPECT_EQ(odds.draws, 1500u);
  EXPECT_EQ(odds.hits, 5u);
  EXPECT_EQ(odds.sum, 5);
  add("learned", "s", {OddsBasis::learned, 40, 40, 4, 0.5, 0.25});
  add("learned2", "s", {OddsBasis::learned, 60, 20, 4, 1, 0.5});
  odds = store.scenarios(2, "").records[1].odds;
  EXPECT_EQ(odds.basis, OddsBasis::learned);
  EXPECT_EQ(odds.draws, 100u);
  EXPECT_EQ(odds.hits, 60u);
  EXPECT_EQ(odds.sum, 8);
  EXPECT_EQ(odds.squares, 1.5);
  EXPECT_EQ(odds.largest, 0.5);
  EXPECT_EQ(store.scenario("other")->odds.draws, 7u);
}

TEST_P(StoreScenarios, the_same_id_again_gives_the_first_one) {
  store.add_scenario(make_scenario("s"));
  auto again = make_scenario("s");
  again.title = "another";
  const auto added = store.add_scenario(again);
  EXPECT_FALSE(added.created);
  EXPECT_EQ(added.scenario.title, "Title of s");
}

TEST_P(StoreScenarios, a_time_is_set_where_there_is_none) {
  EXPECT_GT(store.add_scenario(make_scenario("s")).scenario.created_at, 1'600'000'000'000);
}

TEST_P(StoreScenarios, pages_are_newest_first_and_end) {
  for (int index = 0; index < 7; ++index)
    store.add_scenario(make_scenario("s" + std::to_string(index)));
  std::string ids, cursor;
  int pages = 0;
  do {
    const auto page = store.scenarios(3, cursor);
    for (const auto& scenario : page.records)
      ids += scenario.id;
    cursor = page.next_cursor;
    ++pages;
    store.add_scenario(make_scenario("late" + std::to_string(pages)));  // does not move the pages to come
  } while (!cursor.empty());
  EXPECT_EQ(ids, "s6s5s4s3s2s1s0");
  EXPECT_EQ(pages, 3);
}

TEST_P(StoreScenarios, a_page_that_holds_the_last_one_has_no_cursor) {
  for (int index = 0; index < 4; ++index)
    store.add_scenario(make_scenario("s" + std::to_string(index)));
  EXPECT_TRUE(store.scenarios(4, "").next_cursor.empty());
  EXPECT_FALSE(store.scenarios(3, "").next_cursor.empty());
  EXPECT_TRUE(store.scenarios(0, "").records.empty());
}

TEST_P(StoreScenarios, chains_are_counted_by_state_and_queued_ones_run) {
  store.add_scenario(make_scenario("s"));
  store.add_scenario(make_scenario("other"));
  std::vector<ChainRecord> chains;
  const std::vector<ChainState> states{ChainState::queued,   ChainState::running,  ChainState::running,
                                       ChainState::paused,   ChainState::finished, ChainState::finished,
                                       ChainState::finished, ChainState::failed};
  for (const auto state : states) {
    chains.push_back(make_chain("c" + std::to_string(chains.size()), "s"));
    chains.back().state = state;
  }
  store.add_chains(chains);
  store.add_chains({make_chain("o", "other")});
  const auto scenario = store.scenario("s").value();
  EXPECT_EQ(scenario.running, 3u);
  EXPECT_EQ(scenario.paused, 1u);
  EXPECT_EQ(scenario.finished, 3u);
  EXPECT_EQ(scenario.failed, 1u);
  EXPECT_EQ(store.scenarios(1, "").records[0].running, 1u);
}

// --- Totals ------------------------------------------------------------------------------------

TEST_P(StoreScenarios, totals_add_up) {
  fill(store, 30);
  store.play("s", "", "");
  store.play("s", "alice", "");
  const auto totals = store.totals();
  EXPECT_EQ(totals.scenarios, 1u);
  EXPECT_EQ(totals.samples, 30u);
  EXPECT_EQ(totals.plays, 2u);
  EXPECT_EQ(totals.queued_commits, 0u);
  EXPECT_EQ(totals.failed_commits, 0u);
  EXPECT_GT(totals.file_bytes, 4096u);
}

RETAKE_FOR_EVERY_STORE(StoreScenarios);

}  // namespace
}  // namespace retake::test
