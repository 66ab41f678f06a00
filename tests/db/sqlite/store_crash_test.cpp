// A daemon killed at any moment leaves a store that opens, is consistent, and holds all that was
// acknowledged.
#include <csignal>
#include <map>
#include <random>
#include <sys/wait.h>

#include <gtest/gtest.h>

#include "db/sqlite/sqlite_store.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

// What the child says through the pipe once a write is committed.
struct Acknowledgement {
  char kind;   // 's': samples of a chain up to `number`, 'p': play `number`
  char chain;  // 'a' or 'b'
  std::uint64_t number;
};

// Commits samples of two chains, plays and deletes without end; tells each commit.
[[noreturn]] void work_until_killed(const std::string& path, int pipe) {
  const auto tell = [&](Acknowledgement acknowledgement) {
    [[maybe_unused]] const auto written = ::write(pipe, &acknowledgement, sizeof(acknowledgement));
  };
  StoreOptions options;
  options.batch_rows = 8;
  options.batch_seconds = 0.002;
  database::SqliteStore store(path, options);
  store.delete_scenario("t");
  store.add_scenario(make_scenario("s"));
  for (const char* chain : {"a", "b"}) {
    if (!store.chain(chain)) store.add_chains({make_chain(chain, "s")});
  }
  const auto run_chain = [&](const std::string& chain) {
    // Goes on from the checkpoint, as a resumed chain does.
    const auto checkpoint = store.checkpoint(chain);
    std::uint64_t iteration = checkpoint.empty() ? 0 : std::stoull(checkpoint);
    for (;;) {
      auto progress = make_progress(chain, "s", iteration + 1, iteration + 3);
      for (auto& sample : progress.samples)
        sample.animation = std::string(5000, 'a');
      progress.checkpoint = std::to_string(iteration + 3);
      progress.trace_block = "t";
      store.commit(progress).get();
      iteration += 3;
      tell({'s', chain[0], iteration});
    }
  };
  std::jthread first(run_chain, "a");
  std::jthread second(run_chain, "b");
  std::jthread deleter([&] {
    for (;;) {
      store.add_scenario(make_scenario("t"));
      store.add_chains({make_chain("x", "t")});
      store.commit(make_progress("x", "t", 1, 50)).get();
      store.delete_scenario("t");
    }
  });
  for (;;) {
    if (const auto played = store.play("s", "alice", "")) tell({'p', '-', std::stoull(played->id.substr(1))});
  }
}

TEST(StoreCrash, what_was_acknowledged_is_there_after_kill_9_at_any_moment) {
  TemporaryDirectory directory;
  std::mt19937 random(20'00);
  std::map<char, std::uint64_t> committed;
  std::uint64_t last_play = 0;
  std::size_t acknowledged = 0;
  constexpr std::size_t kEnough = 100;  // acknowledgements; a slow machine needs more rounds for as many
  for (int round = 0; round < 25 || (acknowledged <= kEnough && round < 250); ++round) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const auto child = ::fork();
    if (child == 0) {
      ::close(ends[0]);
      work_until_killed(directory.file(), ends[1]);
    }
    ::close(ends[1]);
    std::thread killer([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(5'000 + random() % 150'000));
      ::kill(child, SIGKILL);
    });
    Acknowledgement acknowledgement{};
    while (::read(ends[0], &acknowledgement, sizeof(acknowledgement)) == sizeof(acknowledgement)) {
      ++acknowledged;
      if (acknowledgement.kind == 's') {
        committed[acknowledgement.chain] = std::max(committed[acknowledgement.chain], acknowledgement.number);
      } else {
        last_play = std::max(last_play, acknowledgement.number);
      }
    }
    killer.join();
    ::close(ends[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << "the child ended by itself";

    database::SqliteStore store(directory.file());
    const auto faults = store.check();
    ASSERT_TRUE(faults.empty()) << faults[0];
    std::uint64_t samples = 0;
    for (const char chain : {'a', 'b'}) {
      const auto checkpoint = store.checkpoint(std::string(1, chain));
      const std::uint64_t reached = checkpoint.empty() ? 0 : std::stoull(checkpoint);
      ASSERT_GE(reached, committed[chain]) << "an acknowledged commit is lost";
      const auto id = [&](std::uint64_t iteration) { return sample_id(std::string(1, chain), iteration, 0); };
      if (reached > 0) {
        ASSERT_TRUE(store.sample_animation(id(reached))) << "a checkpoint without its samples";
      }
      ASSERT_FALSE(store.sample(id(reached + 1))) << "samples without their checkpoint";
      ASSERT_EQ(store.trace(std::string(1, chain)).size(), reached / 3);
      samples += reached;
    }
    ASSERT_EQ(store.sample_count("s"), samples);
    if (last_play > 0) {
      ASSERT_GE(number(directory.file(), "SELECT max(row) FROM play"), static_cast<std::int64_t>(last_play));
    }
  }
  EXPECT_GT(acknowledged, kEnough);
  EXPECT_GT(committed['a'], 0u);
  EXPECT_GT(last_play, 0u);
}

TEST(StoreCrash, a_store_killed_while_it_was_made_opens) {
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    TemporaryDirectory directory;
    const auto child = ::fork();
    if (child == 0) {
      database::SqliteStore store(directory.file());
      ::pause();
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 12'000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    database::SqliteStore store(directory.file());
    ASSERT_TRUE(store.add_scenario(make_scenario("s")).created);
    ASSERT_TRUE(store.check().empty());
  }
}

}  // namespace
}  // namespace retake::test
