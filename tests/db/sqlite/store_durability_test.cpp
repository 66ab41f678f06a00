// When a write reaches the disk, how writes are grouped, and what a failing disk does to them.
#include <cerrno>
#include <csignal>
#include <fstream>
#include <functional>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <gtest/gtest.h>

#include "db/sqlite/sqlite_store.h"
#include "tests/db/disk.h"
#include "tests/db/fixture.h"
#include "tests/db/mounted.h"

namespace retake::test {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

bool ready(const std::future<std::uint64_t>& future) {
  return future.wait_for(milliseconds(0)) == std::future_status::ready;
}

// The message of the StoreError that the call throws, empty if it throws none.
std::string failure_of(const std::function<void()>& call) {
  try {
    call();
    return "";
  } catch (const StoreError& error) {
    return error.what();
  }
}

// Flushes that the call makes.
int flushes_of(const std::function<void()>& call) {
  const int before = disk().flushes;
  call();
  return disk().flushes - before;
}

// --- Flushes -----------------------------------------------------------------------------------

TEST(StoreDurability, what_returns_as_committed_was_flushed) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file(), prompt());
  EXPECT_GE(flushes_of([&] { store.add_scenario(make_scenario("s")); }), 1);
  EXPECT_GE(flushes_of([&] { store.add_chains({make_chain("c", "s")}); }), 1);
  EXPECT_GE(flushes_of([&] { store.commit(make_progress("c", "s", 1, 1)).get(); }), 1);
  EXPECT_GE(flushes_of([&] { store.set_chain_state("c", ChainState::paused, "", ""); }), 1);
  EXPECT_GE(flushes_of([&] { store.backup(directory.file("copy.db")); }), 2);
  EXPECT_GE(flushes_of([&] { store.delete_scenario("s"); }), 1);
}

TEST(StoreDurability, plays_are_not_flushed_one_by_one_but_within_a_second) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file(), prompt());
  fill(store, 50);
  store.play("s", "alice", "");
  std::this_thread::sleep_for(milliseconds(700));
  const auto start = Clock::now();
  int before = disk().flushes;
  for (int play = 0; play < 20; ++play)
    store.play("s", "alice", "");
  const int flushes = disk().flushes - before;
  EXPECT_TRUE(flushes == 0 || seconds_since(start) > 0.4) << flushes;
  std::this_thread::sleep_for(milliseconds(1000) - (Clock::now() - start));
  EXPECT_GE(disk().flushes - before, 1);
  before = disk().flushes;
  std::this_thread::sleep_for(milliseconds(700));
  EXPECT_EQ(disk().flushes - before, 0);  // at rest it stays still
}

TEST(StoreDurability, a_commit_that_changes_nothing_flushes_the_plays_before_it) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file(), prompt());
  fill(store, 2);
  store.play("s", "alice", "");
  EXPECT_GE(flushes_of([&] { store.set_chain_state("gone", ChainState::paused, "", ""); }), 1);
}

// --- Groups ------------------------------------------------------------------------------------

TEST(StoreGroups, samples_wait_for_a_full_group) {
  TemporaryDirectory directory;
  StoreOptions options;
  options.batch_rows = 4;
  options.batch_seconds = 3600;
  database::SqliteStore store(directory.file(), options);
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto first = store.commit(make_progress("c", "s", 1, 3));
  std::this_thread::sleep_for(milliseconds(150));
  EXPECT_FALSE(ready(first));
  EXPECT_EQ(store.totals().queued_commits, 1u);
  EXPECT_EQ(store.sample_count("s"), 0u);
  auto second = store.commit(make_progress("c", "s", 4, 4));
  EXPECT_EQ(first.get(), 3u);
  EXPECT_EQ(second.get(), 4u);
  EXPECT_EQ(store.totals().queued_commits, 0u);
}

TEST(StoreGroups, samples_wait_no_longer_than_they_may) {
  TemporaryDirectory directory;
  StoreOptions options;
  options.batch_rows = 1000;
  options.batch_seconds = 0.2;
  database::SqliteStore store(directory.file(), options);
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  const auto start = Clock::now();
  store.commit(make_progress("c", "s", 1, 1)).get();
  EXPECT_GE(seconds_since(start), 0.19);
  EXPECT_LT(seconds_since(start), 60);
}

TEST(StoreGroups, a_call_that_waits_takes_along_what_was_queued_before_it) {
  TemporaryDirectory directory;
  StoreOptions options;
  options.batch_seconds = 3600;
  database::SqliteStore store(directory.file(), options);
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto queued = store.commit(make_progress("c", "s", 1, 1));
  store.set_chain_state("c", ChainState::paused, "", "");
  EXPECT_TRUE(ready(queued));
  EXPECT_EQ(store.chain("c")->state, ChainState::paused);
}

TEST(StoreGroups, a_play_does_not_wait_for_samples_nor_samples_for_plays) {
  TemporaryDirectory directory;
  StoreOptions options;
  options.batch_seconds = 2;
  database::SqliteStore store(directory.file(), options);
  fill(store, 100);
  auto queued = store.commit(make_progress("c", "s", 101, 101));
  const auto start = Clock::now();
  EXPECT_TRUE(store.play("s", "alice", ""));
  EXPECT_FALSE(ready(queued));
  while (!ready(queued) && seconds_since(start) < 60)
    store.play("s", "alice", "");
  EXPECT_TRUE(ready(queued));
}

TEST(StoreGroups, what_is_queued_is_committed_when_the_store_closes) {
  TemporaryDirectory directory;
  std::future<std::uint64_t> queued;
  {
    StoreOptions options;
    options.batch_seconds = 3600;
    database::SqliteStore store(directory.file(), options);
    store.add_scenario(make_scenario("s"));
    store.add_chains({make_chain("c", "s")});
    queued = store.commit(make_progress("c", "s", 1, 5));
  }
  EXPECT_EQ(queued.get(), 5u);
  EXPECT_EQ(database::SqliteStore(directory.file()).sample_count("s"), 5u);
}

TEST(StoreGroups, a_job_that_fails_spoils_no_other_of_its_group) {
  TemporaryDirectory directory;
  StoreOptions options;
  options.batch_rows = 3;
  options.batch_seconds = 3600;
  database::SqliteStore store(directory.file(), options);
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s"), make_chain("d", "s"), make_chain("e", "s")});
  auto bad = make_progress("d", "s", 1, 1);
  bad.counters.iteration = std::uint64_t{1} << 63;  // fails after its sample was written
  std::vector<std::future<std::uint64_t>> commits;
  const int flushes = flushes_of([&] {
    commits.push_back(store.commit(make_progress("c", "s", 1, 1)));
    commits.push_back(store.commit(bad));
    commits.push_back(store.commit(make_progress("e", "s", 1, 1)));
    for (auto& commit : commits)
      commit.wait();
  });
  EXPECT_EQ(flushes, 1);
  EXPECT_EQ(commits[0].get(), 1u);
  const auto failure = failure_of([&] { commits[1].get(); });
  EXPECT_NE(failure.find("store: cannot write a chain's progress to " + directory.file()), std::string::npos)
      << failure;
  EXPECT_EQ(commits[2].get(), 2u);
  EXPECT_EQ(store.last_error(), failure);
  EXPECT_FALSE(store.sample("d-1"));
  EXPECT_TRUE(store.check().empty());
}

// --- A failing disk ----------------------------------------------------------------------------

TEST(StoreFullDisk, every_job_of_the_group_fails_and_the_next_group_tries_again) {
  TemporaryDirectory directory;
  StoreOptions options;
  options.batch_rows = 2;
  database::SqliteStore store(directory.file(), options);
  fill(store, 10);
  store.play("s", "alice", "");
  disk().write_error = ENOSPC;
  auto first = store.commit(make_progress("c", "s", 11, 11));
  auto second = store.commit(make_progress("c", "s", 12, 12));
  const auto expected = "store: cannot commit to " + directory.file() + ": database or disk is full";
  EXPECT_EQ(failure_of([&] { first.get(); }), expected);
  EXPECT_EQ(failure_of([&] { second.get(); }), expected);
  EXPECT_EQ(failure_of([&] { store.play("s", "alice", ""); }), expected);
  EXPECT_EQ(failure_of([&] { store.add_scenario(make_scenario("t")); }), expected);
  EXPECT_EQ(store.last_error(), expected);
  EXPECT_EQ(store.sample_count("s"), 10u);  // reading goes on
  disk().write_error = 0;
  EXPECT_EQ(store.totals().failed_commits, 4u);
  EXPECT_EQ(store.play("s", "alice", "")->sample.id, "c-2");
  EXPECT_EQ(store.commit(make_progress("c", "s", 11, 12)).get(), 12u);
  EXPECT_EQ(store.last_error(), "");
  EXPECT_TRUE(store.check().empty());
}

TEST(StoreFullDisk, a_flush_that_fails_is_a_commit_that_fails) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file(), prompt());
  fill(store, 10);
  disk().flush_error = EIO;
  const auto failure = failure_of([&] { store.commit(make_progress("c", "s", 11, 11)).get(); });
  disk().flush_error = 0;
  EXPECT_NE(failure.find("disk I/O error: Input/output error"), std::string::npos) << failure;
  EXPECT_EQ(store.commit(make_progress("c", "s", 11, 11)).get(), 11u);
  EXPECT_TRUE(store.check().empty());
}

TEST(StoreFullDisk, plays_that_cannot_be_flushed_are_reported_and_flushed_later) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file(), prompt());
  fill(store, 10);
  disk().flush_error = EIO;
  EXPECT_TRUE(store.play("s", "alice", ""));
  EXPECT_TRUE(eventually([&] { return !store.last_error().empty(); }));
  disk().flush_error = 0;
  const int before = disk().flushes;
  EXPECT_TRUE(eventually([&] { return disk().flushes > before; }));
}

TEST(StoreFullDisk, a_backup_that_does_not_fit_leaves_nothing_behind) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file());
  fill(store, 100);
  disk().write_error = ENOSPC;
  const auto failure = failure_of([&] { store.backup(directory.file("copy.db")); });
  disk().write_error = 0;
  EXPECT_NE(failure.find("database or disk is full"), std::string::npos) << failure;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(directory.file()).parent_path())) {
    EXPECT_EQ(entry.path().filename().string().find("copy"), std::string::npos) << entry.path();
  }
  store.backup(directory.file("copy.db"));
}

// Fills a store until its commits fail, in a child process; then makes room. Says 0, or at which step it went
// wrong.
int run_full(const std::string& path, const std::string& reason, const std::function<void()>& make_room) {
  database::SqliteStore store(path, prompt());
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  std::uint64_t committed = 0;
  std::string failure;
  while (failure.empty() && committed < 10'000) {
    auto progress = make_progress("c", "s", committed + 1, committed + 1);
    progress.samples[0].animation = std::string(50'000, 'a');
    failure = failure_of([&] { store.commit(progress).get(); });
    if (failure.empty()) ++committed;
  }
  if (failure.find(reason) == std::string::npos) return 1;
  if (store.last_error() != failure) return 2;
  if (store.sample_count("s") != committed) return 3;
  if (failure_of([&] {
        store.commit(make_progress("c", "s", committed + 1, committed + 200)).get();
      }).empty()) {
    return 4;  // still full
  }
  make_room();
  if (store.commit(make_progress("c", "s", committed + 1, committed + 1)).get() != committed + 1) return 5;
  if (!store.last_error().empty()) return 6;
  if (!store.check().empty()) return 7;
  return 0;
}

TEST(StoreFullDisk, a_file_that_may_not_grow_any_more) {
  TemporaryDirectory directory;
  EXPECT_EQ(exit_code_of_child([&] {
              ::signal(SIGXFSZ, SIG_IGN);
              const rlimit small{1'500'000, RLIM_INFINITY};
              ::setrlimit(RLIMIT_FSIZE, &small);
              return run_full(directory.file(), "disk I/O error: File too large", [] {
                const rlimit none{RLIM_INFINITY, RLIM_INFINITY};
                ::setrlimit(RLIMIT_FSIZE, &none);
              });
            }),
            0);
  database::SqliteStore store(directory.file());
  EXPECT_TRUE(store.check().empty());
}

TEST(StoreFullDisk, a_file_system_without_room) {
  TemporaryDirectory directory;
  const auto folder = std::filesystem::path(directory.file()).parent_path().string();
  const int code = exit_code_in_mount(folder, "size=3m", [&] {
    return run_full(directory.file(),
                    "store: cannot commit to " + directory.file() + ": database or disk is full",
                    [&] { ::mount("none", folder.c_str(), "tmpfs", MS_REMOUNT, "size=30m"); });
  });
  expect_done_in_mount(code);
}

}  // namespace
}  // namespace retake::test
