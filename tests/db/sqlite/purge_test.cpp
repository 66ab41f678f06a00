// The rows of a deleted scenario go little by little, and leave nothing.
#include <gtest/gtest.h>

#include "db/sqlite/sqlite_store.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

class SqlitePurge : public testing::Test {
 protected:
  TemporaryDirectory directory;
  database::SqliteStore store{directory.file(), prompt()};
};

TEST_F(SqlitePurge, the_rows_of_a_deleted_scenario_are_purged) {
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

TEST_F(SqlitePurge, what_is_added_again_meanwhile_stays) {
  fill(store, 250);
  store.delete_scenario("s");
  fill(store, 3);
  EXPECT_TRUE(eventually([&] { return number(directory.file(), "SELECT count(*) FROM sample") == 3; }));
  EXPECT_EQ(store.sample_count("s"), 3u);
}

TEST(SqlitePurgeInterrupted, it_goes_on_when_the_store_is_opened_again) {
  TemporaryDirectory directory;
  {
    database::SqliteStore store(directory.file());
    fill(store, 20'000);
    store.delete_scenario("s");
  }
  EXPECT_GT(number(directory.file(), "SELECT count(*) FROM sample"), 0);
  database::SqliteStore store(directory.file());
  EXPECT_TRUE(eventually([&] { return number(directory.file(), "SELECT count(*) FROM scenario") == 0; }));
}

}  // namespace
}  // namespace retake::test
