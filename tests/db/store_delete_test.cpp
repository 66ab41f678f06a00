// A deleted scenario is gone at once, with all that hung on it.
#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using StoreDelete = StoreTest;

TEST_P(StoreDelete, a_deleted_scenario_is_gone_at_once_with_all_that_hung_on_it) {
  fill(store, 250);
  store.play("s", "alice", "key");
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 5)).get();
  EXPECT_TRUE(store.delete_scenario("s"));
  EXPECT_FALSE(store.delete_scenario("s"));
  EXPECT_FALSE(store.scenario("s"));
  EXPECT_EQ(store.scenarios(10, "").records.size(), 1u);
  EXPECT_FALSE(store.chain("c"));
  EXPECT_TRUE(store.chains("s").empty());
  EXPECT_EQ(store.chains_in_states({ChainState::queued}).size(), 1u);
  EXPECT_FALSE(store.sample("c-1") || store.sample_state("c-1") || store.sample_animation("c-1"));
  EXPECT_TRUE(store.samples("s", SampleOrder::newest, 10, "").records.empty());
  EXPECT_TRUE(store.draws("c", 10).empty());
  EXPECT_EQ(store.checkpoint("c"), "");
  EXPECT_FALSE(store.play("s", "alice", "key"));
  EXPECT_EQ(store.totals().scenarios, 1u);
  EXPECT_EQ(store.totals().samples, 5u);
  EXPECT_EQ(store.totals().plays, 0u);
  EXPECT_TRUE(store.check().empty());
  EXPECT_EQ(store.sample_count("t"), 5u);
}

TEST_P(StoreDelete, the_same_scenario_can_be_added_again_at_once) {
  fill(store, 250);
  store.delete_scenario("s");
  fill(store, 3);
  EXPECT_EQ(store.sample_count("s"), 3u);
  EXPECT_EQ(store.chains("s").size(), 1u);
}

RETAKE_FOR_EVERY_STORE(StoreDelete);

}  // namespace
}  // namespace retake::test
