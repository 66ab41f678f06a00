// Names and ids of records.
#include "db/records.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "db/sqlite/sample_rows.h"

namespace retake::test {
namespace {

TEST(Records, chain_states_are_named_and_found_by_name) {
  for (const auto state : {ChainState::queued, ChainState::running, ChainState::paused, ChainState::finished,
                           ChainState::failed}) {
    EXPECT_EQ(chain_state(to_string(state)), state);
  }
  EXPECT_EQ(to_string(ChainState::paused), "paused");
  EXPECT_THROW(chain_state("resting"), std::logic_error);
}

TEST(Records, sample_ids_name_a_replica_other_than_0) {
  EXPECT_EQ(sample_id("c", 12, 0), "c-12");
  EXPECT_EQ(sample_id("c", 12, 3), "c-12-3");
}

TEST(Records, sample_ids_are_read_back) {
  const auto place = database::parse_sample_id("chain-12-3");
  ASSERT_TRUE(place);
  EXPECT_EQ(place->chain, "chain");
  EXPECT_EQ(place->iteration, 12u);
  EXPECT_EQ(place->replica, 3u);
  EXPECT_TRUE(database::parse_sample_id(sample_id("c", 9223372036854775807u, 4294967295u)));
}

TEST(Records, what_is_no_sample_id_is_refused) {
  for (const char* id :
       {"", "-", "c", "c-", "-1", "c--1", "c-x", "c-1x", "c-01", "c-+1", "c- 1", "c-1-", "c-1-0", "c-1-01",
        "c-1-2-3", "c-9223372036854775808", "c-1-4294967296", "c-99999999999999999999999"}) {
    EXPECT_FALSE(database::parse_sample_id(id)) << id;
  }
}

}  // namespace
}  // namespace retake::test
