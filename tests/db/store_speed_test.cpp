// How fast the store is with 100,000 samples of a realistic size. Prints figures; the limits are those that
// the requirements name.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include <gtest/gtest.h>

#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double percentile(std::vector<double>& values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

// Resident memory of this process. [MB]
double resident_megabytes() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  long size = 0, resident = 0;
  const int read = std::fscanf(file, "%ld %ld", &size, &resident);
  std::fclose(file);
  return read == 2 ? static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6 : 0;
}

class SlowStore : public testing::Test {
 protected:
  static constexpr std::uint64_t kSamples = 100'000;

  static void SetUpTestSuite() {
    directory_ = new TemporaryDirectory();
    Store store(directory_->file());
    store.add_scenario(make_scenario("s"));
    store.add_chains({make_chain("a", "s"), make_chain("b", "s")});
    const auto start = Clock::now();
    std::vector<std::future<std::uint64_t>> commits;
    for (std::uint64_t iteration = 1; iteration <= kSamples / 2; ++iteration) {
      for (const char* chain : {"a", "b"}) {
        auto progress = make_progress(chain, "s", iteration, iteration);
        progress.samples[0].state = std::string(500, 's');
        progress.samples[0].animation = std::string(8000, 'a');
        progress.samples[0].record.log_prior = -static_cast<double>(iteration * 2654435761u % 1000003u);
        progress.counters.kernels = {{"redraw", iteration, 1}, {"perturb", iteration, 2}, {"toggle", 1, 1}};
        progress.checkpoint = std::string(600, 'c');
        commits.push_back(store.commit(std::move(progress)));
      }
      if (commits.size() >= 64) {
        for (auto& commit : commits)
          commit.get();
        commits.clear();
      }
    }
    for (auto& commit : commits)
      commit.get();
    std::printf("commit: %.0f samples/s in groups, resident %.0f MB\n", kSamples / seconds_since(start),
                resident_megabytes());
  }
  static void TearDownTestSuite() {
    delete directory_;
    directory_ = nullptr;
  }

  static void play_from_threads(Store& store, const char* what, int plays, bool with_players) {
    std::vector<std::vector<double>> latencies(4);
    const auto start = Clock::now();
    {
      std::vector<std::jthread> threads;
      for (std::size_t index = 0; index < 4; ++index) {
        threads.emplace_back([&, index] {
          const std::string player = with_players ? "player" + std::to_string(index) : "";
          for (int play = 0; play < plays; ++play) {
            const auto begin = Clock::now();
            ASSERT_TRUE(store.play("s", player, "").has_value());
            latencies[index].push_back(seconds_since(begin));
          }
        });
      }
    }
    const double rate = 4 * plays / seconds_since(start);
    std::vector<double> all;
    for (const auto& part : latencies)
      all.insert(all.end(), part.begin(), part.end());
    const double p99 = percentile(all, 0.99);
    std::printf("%s: %.0f plays/s, median %.2f ms, p99 %.2f ms, most %.2f ms\n", what, rate,
                1e3 * percentile(all, 0.5), 1e3 * p99, 1e3 * all.back());
    EXPECT_GE(rate, 2000);
    EXPECT_LT(p99, 0.010);
  }

  static inline TemporaryDirectory* directory_ = nullptr;
};

TEST_F(SlowStore, plays_from_four_threads_are_quick) {
  Store store(directory_->file());
  play_from_threads(store, "four players", 5000, true);
  play_from_threads(store, "no player", 5000, false);
  EXPECT_LT(resident_megabytes(), 200);
}

TEST_F(SlowStore, plays_are_quick_while_samples_are_committed) {
  Store store(directory_->file());
  store.add_chains({make_chain("c", "s")});
  std::atomic<bool> done = false;
  std::jthread chain([&] {
    for (std::uint64_t iteration = 1; !done; ++iteration) {
      auto progress = make_progress("c", "s", iteration, iteration);
      progress.samples[0].animation = std::string(8000, 'a');
      store.commit(std::move(progress)).get();
    }
  });
  play_from_threads(store, "beside a chain", 5000, true);
  done = true;
}

TEST_F(SlowStore, a_page_takes_under_ten_milliseconds) {
  Store store(directory_->file());
  for (const auto order : {SampleOrder::newest, SampleOrder::oldest, SampleOrder::likely}) {
    std::vector<double> times;
    std::string cursor;
    std::size_t listed = 0;
    do {
      const auto begin = Clock::now();
      const auto page = store.samples("s", order, 50, cursor);
      times.push_back(seconds_since(begin));
      cursor = page.next_cursor;
      listed += page.records.size();
    } while (!cursor.empty());
    EXPECT_GE(listed, kSamples);
    const double p99 = percentile(times, 0.99);
    std::printf("page of 50: median %.2f ms, p99 %.2f ms, most %.2f ms\n", 1e3 * percentile(times, 0.5),
                1e3 * p99, 1e3 * times.back());
    EXPECT_LT(p99, 0.010);
  }
  const auto begin = Clock::now();
  EXPECT_EQ(store.draws("a", 1000).size(), 1000u);
  std::printf("1,000 draws of 50,000: %.1f ms\n", 1e3 * seconds_since(begin));
}

// One player has seen nine tenths, others the rest: the search may not walk past what was seen at every play.
TEST_F(SlowStore, a_player_who_has_seen_nearly_everything_is_served_quickly) {
  TemporaryDirectory directory;
  Store store(directory.file());
  fill(store, 30'000);
  for (int play = 0; play < 30'000; ++play)
    store.play("s", play % 10 == 0 ? "rare" : "keen", "");
  std::vector<double> times;
  for (int play = 0; play < 2000; ++play) {
    const auto begin = Clock::now();
    const auto played = store.play("s", "keen", "");
    times.push_back(seconds_since(begin));
    ASSERT_FALSE(played->repeat);
  }
  const double p99 = percentile(times, 0.99);
  std::printf("keen player: median %.2f ms, p99 %.2f ms, most %.2f ms\n", 1e3 * percentile(times, 0.5),
              1e3 * p99, 1e3 * times.back());
  EXPECT_LT(p99, 0.010);
}

TEST_F(SlowStore, deleting_a_large_scenario_holds_nobody_up) {
  TemporaryDirectory directory;
  const auto path = directory.file();
  { Store(directory_->file()).backup(path); }
  Store store(path);
  store.add_scenario(make_scenario("other"));
  store.add_chains({make_chain("o", "other")});
  store.commit(make_progress("o", "other", 1, 100)).get();
  auto begin = Clock::now();
  EXPECT_TRUE(store.delete_scenario("s"));
  std::printf("delete: %.1f ms", 1e3 * seconds_since(begin));
  begin = Clock::now();
  std::vector<double> times;
  while (number(path, "SELECT count(*) FROM scenario") > 1 && seconds_since(begin) < 120) {
    for (int play = 0; play < 20; ++play) {
      const auto before = Clock::now();
      store.play("other", "", "");
      times.push_back(seconds_since(before));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const double purged = seconds_since(begin);
  const double p99 = percentile(times, 0.99);
  std::printf(", purged after %.1f s, plays meanwhile p99 %.2f ms, most %.2f ms\n", purged, 1e3 * p99,
              1e3 * times.back());
  EXPECT_EQ(number(path, "SELECT count(*) FROM sample"), 100);
  EXPECT_LT(p99, 0.030);
}

}  // namespace
}  // namespace retake::test
