// A deleted scenario is gone at once, its rows little by little.
#include <gtest/gtest.h>

#include "tests/db/fixture.h"

namespace retake::test {
namespace {

class StoreTest : public testing::Test {
 protected:
  TemporaryDirectory directory;
  Store store{directory.file(), prompt()};
};
using StoreDelete = StoreTest;

TEST_F(StoreDelete, a_deleted_scenario_is_gone_at_once_with_all_that_hung_on_it) {
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

TEST_F(StoreDelete, the_rows_of_a_deleted_scenario_are_purged) {
  fill(store, 250);
  auto progress = make_progress("c", "s", 251, 251);
  progress.trace_block = "block";
  progress.counters.kernels = {{"redraw", 1, 1}};
  store.commit(progress).get();
  store.play("s", "alice", "key");
  store.delete_scenario("s");
  EXPECT_TRUE(eventually([&] { return number(directory.file(), "SELECT count(*) FROM scenario") == 0; }));
  for (const char* sql :
       {"SELECT count(*) FROM sample", "SELECT count(*) FROM sample_blob", "SELECT count(*) FROM chain",
        "SELECT count(*) FROM chain_kernel", "SELECT count(*) FROM checkpoint",
        "SELECT count(*) FROM trace_block", "SELECT count(*) FROM play", "SELECT count(*) FROM seen",
        "SELECT count(*) FROM player", "SELECT count(*) FROM idempotency", "SELECT count(*) FROM stock"}) {
    EXPECT_EQ(number(directory.file(), sql), 0) << sql;
  }
}

TEST_F(StoreDelete, the_same_scenario_can_be_added_again_at_once) {
  fill(store, 250);
  store.delete_scenario("s");
  fill(store, 3);
  EXPECT_EQ(store.sample_count("s"), 3u);
  EXPECT_EQ(store.chains("s").size(), 1u);
  EXPECT_TRUE(eventually([&] { return number(directory.file(), "SELECT count(*) FROM sample") == 3; }));
  EXPECT_EQ(store.sample_count("s"), 3u);
}

TEST(StoreDeleteInterrupted, a_purge_goes_on_when_the_store_is_opened_again) {
  TemporaryDirectory directory;
  {
    Store store(directory.file());
    fill(store, 20'000);
    store.delete_scenario("s");
  }
  EXPECT_GT(number(directory.file(), "SELECT count(*) FROM sample"), 0);
  Store store(directory.file());
  EXPECT_TRUE(eventually([&] { return number(directory.file(), "SELECT count(*) FROM scenario") == 0; }));
}

}  // namespace
}  // namespace retake::test
