// Which sample a play hands out, against the words of store.h and against a model that counts everything
// anew.
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

class StorePlays : public StoreTest {
 protected:
  std::string play(const std::string& player) { return store.play("s", player, "").value().sample.id; }
};

TEST_P(StorePlays, nothing_is_handed_out_where_there_is_nothing) {
  EXPECT_FALSE(store.play("s", "alice", ""));
  store.add_scenario(make_scenario("s"));
  EXPECT_FALSE(store.play("s", "alice", ""));
  EXPECT_FALSE(store.play("s", "", "key"));
  EXPECT_EQ(store.totals().plays, 0u);
}

TEST_P(StorePlays, a_player_sees_every_sample_once_then_the_one_seen_longest_ago) {
  fill(store, 3);
  for (std::uint64_t turn = 0; turn < 3; ++turn) {
    const auto played = store.play("s", "alice", "").value();
    EXPECT_EQ(played.sample.id, "c-" + std::to_string(turn + 1));
    EXPECT_EQ(played.sample.plays, 1u);
    EXPECT_FALSE(played.repeat);
    EXPECT_FALSE(played.replayed);
    EXPECT_EQ(played.remaining, 2 - turn);
  }
  for (const char* id : {"c-1", "c-2", "c-3", "c-1"}) {
    const auto played = store.play("s", "alice", "").value();
    EXPECT_EQ(played.sample.id, id);
    EXPECT_TRUE(played.repeat);
    EXPECT_EQ(played.remaining, 0u);
  }
  EXPECT_EQ(store.sample("c-1")->plays, 3u);
  store.commit(make_progress("c", "s", 4, 4)).get();
  const auto fresh = store.play("s", "alice", "").value();
  EXPECT_EQ(fresh.sample.id, "c-4");
  EXPECT_FALSE(fresh.repeat);
}

TEST_P(StorePlays, without_a_player_the_least_played_then_the_oldest_comes) {
  fill(store, 3);
  for (std::uint64_t turn = 0; turn < 7; ++turn) {
    const auto played = store.play("s", "", "").value();
    EXPECT_EQ(played.sample.id, "c-" + std::to_string(turn % 3 + 1));
    EXPECT_EQ(played.remaining, turn < 3 ? 2 - turn : 0);
    EXPECT_FALSE(played.repeat);
  }
  EXPECT_EQ(store.totals().plays, 7u);
}

TEST_P(StorePlays, players_share_the_stock_evenly) {
  fill(store, 4);
  EXPECT_EQ(play("alice"), "c-1");
  EXPECT_EQ(play("bob"), "c-2");
  EXPECT_EQ(play(""), "c-3");
  EXPECT_EQ(play("bob"), "c-4");
  EXPECT_EQ(play("alice"), "c-2");
  EXPECT_EQ(play("bob"), "c-1");
}

TEST_P(StorePlays, a_players_views_are_kept_by_scenario) {
  fill(store, 2);
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 2)).get();
  EXPECT_EQ(play("alice"), "c-1");
  const auto played = store.play("t", "alice", "").value();
  EXPECT_EQ(played.sample.id, "d-1");
  EXPECT_EQ(played.remaining, 1u);
}

TEST_P(StorePlays, the_same_key_gives_the_same_play) {
  fill(store, 3);
  const auto first = store.play("s", "alice", "key").value();
  store.play("s", "alice", "");
  const auto again = store.play("s", "alice", "key").value();
  EXPECT_FALSE(first.replayed);
  EXPECT_TRUE(again.replayed);
  EXPECT_EQ(again.id, first.id);
  EXPECT_EQ(again.sample.id, first.sample.id);
  EXPECT_EQ(again.repeat, first.repeat);
  EXPECT_EQ(again.remaining, first.remaining);
  EXPECT_EQ(store.totals().plays, 2u);
  EXPECT_NE(store.play("s", "alice", "key 2")->id, first.id);
}

TEST_P(StorePlays, a_key_belongs_to_one_player_and_one_scenario) {
  fill(store, 3);
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 2)).get();
  store.play("s", "alice", "key");
  EXPECT_THROW(store.play("s", "bob", "key"), IdempotencyConflict);
  EXPECT_THROW(store.play("s", "", "key"), IdempotencyConflict);
  EXPECT_FALSE(store.play("t", "bob", "key")->replayed);
  EXPECT_EQ(store.totals().plays, 2u);
  EXPECT_EQ(store.last_error(), "");  // the caller's mistake, not ours
  EXPECT_EQ(store.totals().failed_commits, 0u);
}

TEST_P(StorePlays, plays_outlive_the_store) {
  fill(store, 3);
  const auto first = store.play("s", "alice", "key").value();
  store.backup(directory.file("copy.db"));
  const auto copy = open({}, "copy.db");
  EXPECT_EQ(copy->play("s", "alice", "key")->id, first.id);
  EXPECT_EQ(copy->play("s", "alice", "")->sample.id, "c-2");
}

// Behind the place where the search for alice begins there are first a few, then many new samples.
TEST_P(StorePlays, new_samples_that_others_took_first_are_found) {
  fill(store, 200);
  const auto play_times = [&](const std::string& player, int times) {
    std::string last;
    for (int turn = 0; turn < times; ++turn)
      last = play(player);
    return last;
  };
  play_times("", 200);
  play_times("alice", 100);
  play_times("", 100);
  EXPECT_EQ(play("alice"), "c-101");  // all were played twice
  store.commit(make_progress("c", "s", 201, 210)).get();
  play_times("bob", 10);
  EXPECT_EQ(play("alice"), "c-201");
  EXPECT_EQ(play_times("alice", 9), "c-210");
  EXPECT_EQ(play("alice"), "c-102");
  store.commit(make_progress("c", "s", 211, 810)).get();
  EXPECT_EQ(play_times("alice", 300), "c-510");
  EXPECT_EQ(play_times("bob", 300), "c-810");
  EXPECT_EQ(play("alice"), "c-511");
}

// --- Against a model ---------------------------------------------------------------------------

struct ModelSample {
  std::uint64_t plays = 0;
  std::map<std::string, int> seen;  // player -> turn
};

struct Expected {
  std::size_t index = 0;
  bool repeat = false;
  std::uint64_t remaining = 0;
};

// What store.h says, by looking at every sample.
Expected choose(std::vector<ModelSample>& samples, const std::string& player, int turn) {
  Expected expected;
  const auto unseen = [&](const ModelSample& sample) {
    return player.empty() || !sample.seen.contains(player);
  };
  expected.repeat = std::none_of(samples.begin(), samples.end(), unseen);
  bool found = false;
  for (std::size_t index = 0; index < samples.size(); ++index) {
    const auto& best = samples[expected.index];
    const auto& sample = samples[index];
    const bool better = !found || (expected.repeat ? sample.seen.at(player) < best.seen.at(player)
                                                   : sample.plays < best.plays);
    if ((expected.repeat || unseen(sample)) && better) {
      expected.index = index;
      found = true;
    }
  }
  auto& chosen = samples[expected.index];
  ++chosen.plays;
  if (!player.empty()) chosen.seen[player] = turn;
  for (const auto& sample : samples) {
    expected.remaining += player.empty() ? sample.plays == 0 : !sample.seen.contains(player);
  }
  return expected;
}

// Players of very different appetite, samples that come in between, in bursts or one by one, and a store that
// is closed and opened: the searches that start half-way have to find what the search from the start would.
class StorePlaysModel : public EveryStore {
 protected:
  void play_as_the_model(unsigned seed);
};

void StorePlaysModel::play_as_the_model(unsigned seed) {
  std::mt19937 random(seed);
  const auto below = [&](unsigned bound) { return random() % bound; };
  const std::string name = "retake-" + std::to_string(seed) + ".db";
  auto store = open(prompt(), name);
  std::vector<ModelSample> model(150);
  fill(*store, model.size());

  for (int turn = 1; turn <= 1500; ++turn) {
    if (below(8) == 0) {
      const std::uint64_t more = below(40) == 0 ? 300 : 1 + below(3);
      if (model.size() + more <= 900) {
        store->commit(make_progress("c", "s", model.size() + 1, model.size() + more)).get();
        model.resize(model.size() + more);
      }
    }
    if (below(400) == 0) {
      store.reset();
      store = open(prompt(), name);
    }
    const auto die = below(20);
    const std::string player = die < 7    ? "keen"
                               : die < 12 ? "bob"
                               : die < 18 ? "p" + std::to_string(below(30))
                                          : "";
    const auto expected = choose(model, player, turn);
    const auto played = store->play("s", player, "").value();
    ASSERT_EQ(played.sample.iteration, expected.index + 1) << "turn " << turn << ", " << player;
    ASSERT_EQ(played.repeat, expected.repeat) << "turn " << turn;
    ASSERT_EQ(played.remaining, expected.remaining) << "turn " << turn << ", " << player;
    ASSERT_EQ(played.sample.plays, model[expected.index].plays);
  }
  EXPECT_TRUE(store->check().empty());
}

TEST_P(StorePlaysModel, every_play_is_the_one_that_counting_everything_gives) {
  for (unsigned seed = 1; seed < 7; ++seed) {
    SCOPED_TRACE(seed);
    play_as_the_model(seed);
    if (HasFatalFailure()) return;
  }
}

RETAKE_FOR_EVERY_STORE(StorePlays);
RETAKE_FOR_EVERY_STORE(StorePlaysModel);

}  // namespace
}  // namespace retake::test
