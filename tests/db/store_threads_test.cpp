// Many threads at once: chains that commit, players, readers, people who add and delete, a backup.
#include <atomic>
#include <map>
#include <mutex>
#include <set>

#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using ThreadsStore = EveryStore;

TEST_P(ThreadsStore, chains_commit_side_by_side_and_nothing_is_lost) {
  const auto opened = open();
  Store& store = *opened;
  store.add_scenario(make_scenario("s"));
  constexpr std::uint64_t chains = 4, commits = 40;
  {
    std::vector<std::jthread> threads;
    for (std::uint64_t index = 0; index < chains; ++index) {
      threads.emplace_back([&, index] {
        const auto id = "c" + std::to_string(index);
        store.add_chains({make_chain(id, "s")});
        std::vector<std::future<std::uint64_t>> pending;
        for (std::uint64_t commit = 0; commit < commits; ++commit) {
          pending.push_back(store.commit(make_progress(id, "s", 3 * commit + 1, 3 * commit + 3)));
        }
        std::uint64_t before = 0;
        for (auto& commit : pending) {
          const auto samples = commit.get();
          EXPECT_GE(samples, before + 3);
          before = samples;
        }
      });
    }
  }
  EXPECT_EQ(store.sample_count("s"), chains * commits * 3);
  EXPECT_TRUE(store.check().empty());
}

TEST_P(ThreadsStore, no_player_gets_a_sample_twice) {
  const auto opened = open();
  Store& store = *opened;
  fill(store, 200);
  std::mutex mutex;
  std::map<std::string, std::set<std::string>> seen;
  {
    std::vector<std::jthread> threads;
    for (int index = 0; index < 4; ++index) {
      threads.emplace_back([&, index] {
        const auto player = index < 2 ? "alice" : "bob";  // each plays on two devices
        for (int play = 0; play < 100; ++play) {
          const auto played = store.play("s", player, "").value();
          EXPECT_FALSE(played.repeat);
          const std::lock_guard lock(mutex);
          EXPECT_TRUE(seen[player].insert(played.sample.id).second);
        }
      });
    }
  }
  EXPECT_EQ(seen["alice"].size(), 200u);
  EXPECT_EQ(seen["bob"].size(), 200u);
  EXPECT_TRUE(store.play("s", "bob", "")->repeat);
}

TEST_P(ThreadsStore, one_key_from_many_threads_is_one_play) {
  const auto opened = open();
  Store& store = *opened;
  fill(store, 20);
  std::atomic<int> fresh = 0;
  {
    std::vector<std::jthread> threads;
    for (int index = 0; index < 8; ++index) {
      threads.emplace_back([&] { fresh += store.play("s", "alice", "key")->replayed ? 0 : 1; });
    }
  }
  EXPECT_EQ(fresh, 1);
  EXPECT_EQ(store.totals().plays, 1u);
}

TEST_P(ThreadsStore, everything_at_once) {
  StoreOptions options;
  options.batch_seconds = 0.005;
  options.reader_connections = 2;  // fewer than readers
  const auto opened = open(options);
  Store& store = *opened;
  fill(store, 100);
  std::atomic<bool> done = false;
  {
    std::vector<std::jthread> threads;
    threads.emplace_back([&] {
      for (std::uint64_t iteration = 101; !done; ++iteration) {
        store.commit(make_progress("c", "s", iteration, iteration)).get();
      }
    });
    threads.emplace_back([&] {
      while (!done) {
        store.add_scenario(make_scenario("t"));
        store.add_chains({make_chain("d", "t")});
        store.commit(make_progress("d", "t", 1, 30)).get();
        store.delete_scenario("t");
      }
    });
    for (const char* player : {"alice", ""}) {
      threads.emplace_back([&, player] {
        while (!done) {
          store.play("s", player, "");
          store.play("t", player, "");
        }
      });
    }
    for (int reader = 0; reader < 3; ++reader) {
      threads.emplace_back([&] {
        while (!done) {
          // Everything read in one call is of one moment.
          const auto page = store.samples("s", SampleOrder::newest, 1, "");
          EXPECT_GE(store.sample_count("s"), page.records.at(0).iteration);
          EXPECT_TRUE(store.sample_animation(page.records[0].id));
          const auto scenario = store.scenario("t");
          EXPECT_TRUE(!scenario || scenario->samples == 0 || scenario->samples == 30);
          store.samples("s", SampleOrder::likely, 20, "");
          store.draws("c", 10);
          store.chains_in_states({ChainState::queued});
          store.totals();
          EXPECT_EQ(store.last_error(), "");
        }
      });
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    store.backup(directory.file("copy.db"));
    EXPECT_TRUE(store.check().empty());
    done = true;
  }
  const auto copy = open({}, "copy.db");
  EXPECT_GE(copy->sample_count("s"), 100u);
  EXPECT_TRUE(copy->check().empty());
  EXPECT_TRUE(store.check().empty());
}

RETAKE_FOR_EVERY_STORE(ThreadsStore);

}  // namespace
}  // namespace retake::test
