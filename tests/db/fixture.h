// What the tests of db/ share: a directory of one's own, and records that are told apart easily.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <future>
#include <stdexcept>
#include <stdlib.h>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include "db/sqlite/connection.h"
#include "db/store.h"

namespace retake::test {

/// A new directory, removed with everything in it.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "retake-db-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
    path_ = pattern;
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  std::string file(const std::string& name = "retake.db") const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

inline ScenarioRecord make_scenario(const std::string& id) {
  ScenarioRecord scenario;
  scenario.id = id;
  scenario.world = "bowling";
  scenario.world_version = 3;
  scenario.title = "Title of " + id;
  scenario.document = R"({"world":"bowling"})";
  return scenario;
}

inline ChainRecord make_chain(const std::string& id, const std::string& scenario) {
  ChainRecord chain;
  chain.id = id;
  chain.scenario = scenario;
  chain.seed = 7;
  chain.method = "metropolis";
  chain.ratios = "exact";
  return chain;
}

inline NewSample make_sample(std::uint64_t iteration, std::uint64_t weight = 1, std::uint32_t replica = 0) {
  NewSample sample;
  sample.record.iteration = iteration;
  sample.record.replica = replica;
  sample.record.weight = weight;
  sample.record.log_prior = -1.5 - static_cast<double>(iteration % 7);
  sample.record.log_constraint = -0.25 * static_cast<double>(iteration % 3);
  sample.record.duration = 2.5;
  sample.record.measures = R"({"pins":10})";
  sample.record.digest = "d" + std::to_string(iteration);
  sample.state = "state of " + std::to_string(iteration);
  sample.animation = "animation of " + std::to_string(iteration);
  return sample;
}

/// Progress of a chain with one new sample for each iteration of [first, last].
inline ChainProgress make_progress(const std::string& chain, const std::string& scenario, std::uint64_t first,
                                   std::uint64_t last) {
  ChainProgress progress;
  progress.chain = chain;
  progress.scenario = scenario;
  for (std::uint64_t iteration = first; iteration <= last; ++iteration) {
    progress.samples.push_back(make_sample(iteration));
  }
  progress.counters.iteration = last;
  progress.counters.samples = last;
  progress.checkpoint = "checkpoint " + std::to_string(last);
  return progress;
}

/// A store with the scenario "s", its chain "c" and samples of iterations 1 to `samples`.
inline void fill(Store& store, std::uint64_t samples) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  std::vector<std::future<std::uint64_t>> commits;
  for (std::uint64_t first = 1; first <= samples; first += 100) {
    commits.push_back(store.commit(make_progress("c", "s", first, std::min(first + 99, samples))));
  }
  for (auto& commit : commits)
    commit.get();
}

/// Options that commit every sample at once, for tests that wait for each.
inline StoreOptions prompt() {
  StoreOptions options;
  options.batch_rows = 1;
  return options;
}

inline std::vector<std::string> ids_of(const std::vector<SampleRecord>& samples) {
  std::vector<std::string> ids;
  for (const auto& sample : samples)
    ids.push_back(sample.id);
  return ids;
}

/// One number asked of the file beside the store.
inline std::int64_t number(const std::string& path, std::string_view sql) {
  database::Connection connection(path, database::Connection::Access::read);
  database::Query query(connection, sql);
  return query.next() ? query.integer() : -1;
}

/// Waits until the condition holds; false: it did not within ten seconds.
template <typename Condition>
bool eventually(Condition condition) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace retake::test
