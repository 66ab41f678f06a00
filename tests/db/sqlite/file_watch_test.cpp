// A store whose files are taken away under it says so within a second, writes nothing, and goes on when they
// are put right.
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <set>
#include <sys/mount.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "db/sqlite/sqlite_store.h"
#include "tests/db/disk.h"
#include "tests/db/fixture.h"
#include "tests/db/mounted.h"

namespace retake::test {
namespace {

namespace fs = std::filesystem;

class StoreTakenAway : public ::testing::Test {
 protected:
  void SetUp() override {
    StoreOptions options = prompt();
    options.tell = [this](const std::string& error) { ++(error.empty() ? recoveries : failures); };
    store = std::make_unique<database::SqliteStore>(directory.file(), options);
    fill(*store, 10);
  }
  bool says(const std::string& text) {
    return eventually([&] { return store->last_error().find(text) != std::string::npos; });
  }
  void expect_refused() {
    EXPECT_THROW(store->add_scenario(make_scenario("t")), StoreUnavailable);
    EXPECT_THROW(store->commit(make_progress("c", "s", 11, 11)).get(), StoreUnavailable);
    EXPECT_THROW(store->play("s", "alice", ""), StoreUnavailable);
    EXPECT_EQ(store->sample_count("s"), 10u) << "reading goes on";
    EXPECT_EQ(failures, 1) << "one line";
  }
  void expect_that_it_goes_on() {
    EXPECT_TRUE(eventually([&] { return store->last_error().empty(); })) << "without a write";
    EXPECT_EQ(recoveries, 1);
    EXPECT_EQ(store->commit(make_progress("c", "s", 11, 11)).get(), 11u);
    store.reset();
    database::SqliteStore again(directory.file());
    EXPECT_EQ(again.sample_count("s"), 11u);
    EXPECT_TRUE(again.check().empty());
  }
  std::string other(const std::string& suffix) const { return directory.file("other") + suffix; }

  TemporaryDirectory directory;
  std::atomic<int> failures{0}, recoveries{0};
  std::unique_ptr<database::SqliteStore> store;
};

TEST_F(StoreTakenAway, Removed_and_put_back) {
  for (const std::string suffix : {"", "-wal", "-shm"}) {
    SCOPED_TRACE(suffix);
    failures = recoveries = 0;
    fs::rename(directory.file() + suffix, other(suffix));
    EXPECT_TRUE(says("was removed")) << store->last_error();
    expect_refused();
    fs::rename(other(suffix), directory.file() + suffix);
    EXPECT_TRUE(eventually([&] { return store->last_error().empty(); }));
    EXPECT_EQ(recoveries, 1);
  }
  failures = recoveries = 0;
  fs::rename(directory.file(), other(""));
  EXPECT_TRUE(says("the file was removed"));
  fs::rename(other(""), directory.file());
  expect_that_it_goes_on();
}

TEST_F(StoreTakenAway, Replaced_by_a_copy_which_is_left_as_it_is) {
  database::SqliteStore(other("")).add_scenario(make_scenario("another"));
  const auto bytes = fs::file_size(other(""));
  fs::rename(directory.file(), other(".kept"));
  fs::rename(other(""), directory.file());
  EXPECT_TRUE(says("the file was replaced")) << store->last_error();
  expect_refused();
  EXPECT_EQ(fs::file_size(directory.file()), bytes);
  fs::rename(directory.file(), other(""));
  fs::rename(other(".kept"), directory.file());
  expect_that_it_goes_on();
}

TEST_F(StoreTakenAway, A_file_that_took_its_place_keeps_its_log_when_the_store_closes) {
  fs::rename(directory.file(), other(""));
  fs::rename(directory.file() + "-wal", other("-wal"));
  std::ofstream(directory.file()) << "another";
  std::ofstream(directory.file() + "-wal") << "another's";
  EXPECT_TRUE(says("was replaced"));
  store.reset();
  EXPECT_EQ(fs::file_size(directory.file() + "-wal"), 9u);
  // What was acknowledged is all there.
  for (const std::string suffix : {"", "-wal"})
    fs::rename(other(suffix), directory.file() + suffix);
  EXPECT_EQ(database::SqliteStore(directory.file()).sample_count("s"), 10u);
}

TEST_F(StoreTakenAway, A_second_name_until_it_is_gone) {
  fs::create_hard_link(directory.file(), other(""));
  EXPECT_TRUE(says("a second name")) << store->last_error();
  expect_refused();
  fs::remove(other(""));
  expect_that_it_goes_on();
}

TEST_F(StoreTakenAway, Truncated_for_good) {
  store->commit(make_progress("c", "s", 11, 400)).get();
  fs::resize_file(directory.file() + "-wal", 4096);
  EXPECT_TRUE(says("its write-ahead log was truncated")) << store->last_error();
  EXPECT_THROW(store->add_scenario(make_scenario("t")), StoreUnavailable);
  fs::resize_file(directory.file() + "-wal", 10'000'000);
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  EXPECT_TRUE(says("was truncated"));
}

TEST_F(StoreTakenAway, No_write_is_acknowledged_in_the_moment_before_anybody_looks) {
  fs::rename(directory.file(), other(""));
  EXPECT_THROW(store->add_scenario(make_scenario("t")), StoreUnavailable);
  fs::rename(other(""), directory.file());
  EXPECT_NO_THROW(store->add_scenario(make_scenario("t")));
}

// --- Opened on a disk that cannot be written -----------------------------------------------------

/// 0, or the step at which it went wrong.
int open_unwritable(const std::string& path, const std::function<void()>& make_writable) {
  database::SqliteStore store(path, prompt());
  if (store.last_error().empty()) return 1;
  if (store.sample_count("s") != 10) return 2;
  if (!store.sample_animation("c-1") || store.chains("s").size() != 1) return 3;
  try {
    store.add_scenario(make_scenario("t"));
    return 4;
  } catch (const StoreUnavailable&) {
  }
  make_writable();
  if (!eventually([&] { return store.last_error().empty(); })) return 5;
  if (store.commit(make_progress("c", "s", 11, 11)).get() != 11) return 6;
  if (store.sample_count("s") != 11 || !store.check().empty()) return 7;
  return 0;
}

TEST(StoreUnwritable, A_full_disk_is_read_and_written_once_there_is_room) {
  TemporaryDirectory directory;
  fill(*std::make_unique<database::SqliteStore>(directory.file(), prompt()), 10);
  disk().write_error = ENOSPC;
  EXPECT_EQ(open_unwritable(directory.file(), [] { disk().write_error = 0; }), 0);
  disk().write_error = 0;
}

TEST(StoreUnwritable, Damage_is_told_and_left_out_before_and_after_there_is_room) {
  TemporaryDirectory directory;
  fill(*std::make_unique<database::SqliteStore>(directory.file(), prompt()), 10);
  database::Connection(directory.file(), database::Connection::Access::write)
      .execute(
          "UPDATE chain SET seed = 8; UPDATE sample SET digest = 'none' WHERE iteration = 3;"
          "UPDATE sample_blob SET animation = x'00' WHERE sample = 5");
  const std::string of_chain = "chain c is damaged: seed is not what was written";
  std::mutex mutex;
  std::vector<std::string> told;
  StoreOptions options = prompt();
  options.on_damage = [&](const std::string& damage) {
    const std::lock_guard lock(mutex);
    told.push_back(damage);
  };
  disk().write_error = ENOSPC;
  {
    database::SqliteStore store(directory.file(), options);
    EXPECT_NE(store.last_error(), "");
    EXPECT_TRUE(store.chains("s").empty());
    EXPECT_EQ(store.damages(), std::vector<std::string>{of_chain});
    EXPECT_EQ(store.scenario("s")->failed, 0u);

    disk().write_error = 0;
    ASSERT_TRUE(eventually([&] { return store.last_error().empty(); }));
    EXPECT_EQ(store.scenario("s")->failed, 1u) << "nothing waits for it";
    EXPECT_EQ(store.samples("s", SampleOrder::oldest, 20, "").records.size(), 9u);
    EXPECT_EQ(store.damages().size(), 2u) << "the reading connections tell";
    std::set<std::string> given;
    while (const auto play = store.play("s", "alice", "", Repeats::refused))
      given.insert(play->sample.id);
    EXPECT_EQ(given.size(), 8u);
    EXPECT_FALSE(given.contains("c-3"));
    EXPECT_EQ(store.damages().size(), 3u) << "and the writing one";
  }
  EXPECT_EQ(told.size(), 3u);
}

TEST(StoreUnwritable, A_new_store_on_a_full_disk_is_refused) {
  TemporaryDirectory directory;
  disk().write_error = ENOSPC;
  EXPECT_THROW(database::SqliteStore(directory.file(), prompt()), StoreError);
  disk().write_error = 0;
  EXPECT_NO_THROW(database::SqliteStore(directory.file(), prompt()));
}

/// After a clean end, and after a crash: then part of it is in the log alone.
class StoreReadOnly : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(After, StoreReadOnly, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "a_crash" : "a_clean_end"; });

TEST_P(StoreReadOnly, A_read_only_file_system_is_read_and_written_once_it_may_be) {
  TemporaryDirectory directory;
  const auto folder = fs::path(directory.file()).parent_path().string();
  const int code = exit_code_in_mount(folder, "size=30m", [&] {
    const int filled = exit_code_of_child([&] {
      auto store = std::make_unique<database::SqliteStore>(directory.file(), prompt());
      fill(*store, 10);
      if (GetParam()) ::_exit(0);
      return 0;
    });
    if (filled != 0) return 50;
    for (const char* left : {"-shm", ".lock"})
      fs::remove(directory.file() + left);
    if (::mount("none", folder.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, "size=30m") != 0) return 51;
    return open_unwritable(directory.file(),
                           [&] { ::mount("none", folder.c_str(), "tmpfs", MS_REMOUNT, "size=30m"); });
  });
  expect_done_in_mount(code);
}

}  // namespace
}  // namespace retake::test
