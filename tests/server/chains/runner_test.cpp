// The Runner in-process, asked from many threads at once, on a real Store.
#include "server/chains/runner.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "db/open_store.h"
#include "server/chains/identifiers.h"
#include "server/chains/scenario_library.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

class ThreadsRunner : public ::testing::Test {
 protected:
  struct Parts {
    explicit Parts(const std::string& path, std::size_t threads)
        : opened(open_store(path)), library(store), runner(store, library, events, {.threads = threads}) {}
    std::unique_ptr<Store> opened;
    Store& store = *opened;
    ScenarioLibrary library;
    EventHub events;
    Runner runner;
  };
  std::unique_ptr<Parts> open(std::size_t threads = 2) {
    return std::make_unique<Parts>((folder / "retake.db").string(), threads);
  }
  static std::string add_scenario(Parts& parts, const json& document) {
    return parts.store.add_scenario(new_scenario_record(*Scenario::read(document))).scenario.id;
  }
  static std::vector<ChainRecord> chains(const std::string& scenario, std::uint32_t count,
                                         const StopRule& stop = {}, const std::string& method = "rejection") {
    std::vector<ChainRecord> records(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      records[i].id = random_identifier();
      records[i].scenario = scenario;
      records[i].index = i;
      records[i].seed = 17;
      records[i].method = method;
      records[i].ratios = "exact";
      records[i].stop = stop;
    }
    return records;
  }
  static std::uint64_t iteration(Parts& parts, const std::string& id) {
    return parts.runner.chain(id)->counters.iteration;
  }
  static ChainState state(Parts& parts, const std::string& id) { return parts.runner.chain(id)->state; }

  TemporaryFolder folder;
  const json rare = wish_document(1, 1e-6);
};

TEST_F(ThreadsRunner, Many_chains_on_few_threads_advance_again_and_again_and_none_is_left_behind) {
  const auto parts = open(2);
  const auto records = chains(add_scenario(*parts, rare), 24);
  parts->runner.add(records);
  EXPECT_EQ(parts->runner.counters().live_chains, 24);
  std::map<std::string, std::uint64_t> seen;
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(wait_until([&] {
      return std::all_of(records.begin(), records.end(),
                         [&](const ChainRecord& each) { return iteration(*parts, each.id) > seen[each.id]; });
    })) << "round "
        << round;
    for (const ChainRecord& each : records)
      seen[each.id] = iteration(*parts, each.id);
  }
}

TEST_F(ThreadsRunner, Draining_keeps_chains_running_in_the_store_and_the_next_runner_takes_them_up) {
  std::vector<ChainRecord> records;
  std::vector<std::uint64_t> reached;
  {
    const auto parts = open();
    records = chains(add_scenario(*parts, rare), 3);
    parts->runner.add(records);
    ASSERT_TRUE(wait_until([&] { return iteration(*parts, records[2].id) > 0; }));
    parts->runner.pause(records[1].id);
    parts->runner.drain();
    for (const ChainRecord& each : records)
      reached.push_back(parts->store.chain(each.id)->counters.iteration);
    EXPECT_EQ(parts->store.chain(records[0].id)->state, ChainState::running);
    EXPECT_EQ(parts->store.chain(records[1].id)->state, ChainState::paused);
    EXPECT_GT(reached[0], 0);
  }
  const auto parts = open();
  parts->runner.resume_stored();
  EXPECT_EQ(parts->runner.counters().live_chains, 2);
  EXPECT_TRUE(wait_until([&] { return iteration(*parts, records[0].id) > reached[0]; }));
  EXPECT_EQ(iteration(*parts, records[1].id), reached[1]) << "a paused chain stays paused";
}

TEST_F(ThreadsRunner, Clients_that_pause_resume_and_stop_at_once_leave_every_chain_in_an_honest_state) {
  const auto parts = open();
  const auto records = chains(add_scenario(*parts, wish_document(1, 0.01)), 4);
  parts->runner.add(records);
  std::vector<std::thread> clients;
  for (unsigned client = 0; client < 6; ++client)
    clients.emplace_back([&, client] {
      std::mt19937 random(client);
      for (int i = 0; i < 60; ++i) {
        const std::string& id = records[random() % 3].id;  // the last chain is left alone
        if (random() % 2 == 0)
          parts->runner.pause(id);
        else
          parts->runner.resume(id);
      }
    });
  for (std::thread& client : clients)
    client.join();

  // What is said to run advances; what is said to be paused does not, and can be taken up again.
  for (const ChainRecord& each : records) {
    ASSERT_NE(state(*parts, each.id), ChainState::failed) << parts->runner.chain(each.id)->error;
    const auto paused = parts->runner.pause(each.id);
    ASSERT_EQ(paused->state, ChainState::paused);
    ASSERT_EQ(parts->runner.resume(each.id)->state, ChainState::running);
    EXPECT_TRUE(wait_until([&] { return iteration(*parts, each.id) > paused->counters.iteration; }))
        << "said to run, but stands still";
  }
  EXPECT_EQ(parts->runner.counters().live_chains, 4);

  // Stopping from everywhere at once ends each for good, whoever tries to resume it.
  clients.clear();
  for (unsigned client = 0; client < 6; ++client)
    clients.emplace_back([&, client] {
      for (const ChainRecord& each : records)
        client % 3 == 0   ? parts->runner.stop(each.id)
        : client % 3 == 1 ? parts->runner.resume(each.id)
                          : parts->runner.pause(each.id);
    });
  for (std::thread& client : clients)
    client.join();
  for (const ChainRecord& each : records)
    EXPECT_EQ(state(*parts, each.id), ChainState::finished);
  EXPECT_EQ(parts->runner.counters().live_chains, 0);
}

TEST_F(ThreadsRunner, Disturbed_by_every_client_a_chain_finds_what_it_finds_alone) {
  const auto parts = open();
  const StopRule stop{.iterations = 400'000};
  const std::string scenario = add_scenario(*parts, wish_document(1, 0.003));
  auto records = chains(scenario, 2, stop, "metropolis");
  records[1].index = 0;  // the same chain twice, the second one left alone
  parts->runner.add(records);
  std::vector<std::thread> clients;
  for (int client = 0; client < 3; ++client)
    clients.emplace_back([&] {
      for (int i = 0; i < 40; ++i) {
        parts->runner.pause(records[0].id);
        parts->runner.resume(records[0].id);
      }
    });
  for (std::thread& client : clients)
    client.join();
  for (const ChainRecord& each : records)
    ASSERT_TRUE(wait_until([&] { return state(*parts, each.id) == ChainState::finished; }));
  std::vector<std::vector<std::pair<std::uint64_t, std::string>>> found(2);
  for (const SampleRecord& sample : parts->store.samples(scenario, SampleOrder::oldest, 100'000, "").records)
    found[sample.chain == records[1].id].emplace_back(sample.iteration,
                                                      sample.digest + std::to_string(sample.weight));
  for (auto& list : found)
    std::sort(list.begin(), list.end());
  EXPECT_GT(found[0].size(), 100);
  EXPECT_EQ(found[0], found[1]);
}

TEST_F(ThreadsRunner, Disturbed_and_restarted_a_chain_ends_at_the_effective_samples_at_which_it_ends_alone) {
  const StopRule stop{.ess = 20};
  std::vector<ChainRecord> records;
  std::string scenario;
  {
    const auto parts = open();
    scenario = add_scenario(*parts, wish_document(1, 0.02));
    records = chains(scenario, 2, stop, "metropolis");
    records[1].index = 0;  // the same chain twice, the second one left alone
    parts->runner.add({records[0]});
    parts->runner.drain();
  }
  for (int start = 0; start < 8; ++start) {
    const auto parts = open();
    parts->runner.resume_stored();
    std::this_thread::sleep_for(std::chrono::milliseconds(5 * start));
    parts->runner.pause(records[0].id);
    parts->runner.resume(records[0].id);
  }
  const auto parts = open();
  parts->runner.resume_stored();
  parts->runner.add({records[1]});
  for (const ChainRecord& each : records) {
    ASSERT_TRUE(wait_until([&] { return state(*parts, each.id) == ChainState::finished; }));
    EXPECT_EQ(parts->runner.chain(each.id)->ended_by, "ess");
    EXPECT_GE(parts->runner.chain(each.id)->counters.effective_samples, 20);
  }
  const auto end = [&](std::size_t i) { return parts->runner.chain(records[i].id)->counters; };
  EXPECT_EQ(end(0).iteration, end(1).iteration);
  EXPECT_EQ(end(0).samples, end(1).samples);
  EXPECT_EQ(end(0).effective_samples, end(1).effective_samples);
  EXPECT_GT(end(0).samples, 40);
}

TEST_F(ThreadsRunner, A_scenario_deleted_under_its_chains_takes_them_along) {
  const auto parts = open();
  const std::string kept = add_scenario(*parts, rare);
  const auto staying = chains(kept, 1);
  parts->runner.add(staying);
  std::atomic<bool> is_over = false;
  std::thread client([&] {  // adds chains all the time, also to what is being deleted
    while (!is_over)
      try {
        parts->runner.add(chains(new_scenario_record(*Scenario::read(prior_document())).id, 2));
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      } catch (const std::runtime_error&) {  // the scenario is gone
      }
  });
  for (int round = 0; round < 15; ++round) {
    const std::string scenario = add_scenario(*parts, prior_document());
    ASSERT_TRUE(wait_until([&] { return !parts->store.chains(scenario).empty(); }));
    parts->runner.drop_scenario(scenario);
    EXPECT_TRUE(parts->store.delete_scenario(scenario));
    parts->library.forget(scenario);
    EXPECT_TRUE(parts->store.chains(scenario).empty());
  }
  is_over = true;
  client.join();
  EXPECT_TRUE(wait_until([&] { return parts->runner.counters().live_chains == 1; }))
      << "chains of a deleted scenario go on for ever";
  const std::uint64_t before = iteration(*parts, staying[0].id);
  EXPECT_TRUE(wait_until([&] { return iteration(*parts, staying[0].id) > before; }));
}

TEST_F(ThreadsRunner, A_chain_ends_when_its_scenario_holds_as_many_samples_as_allowed) {
  const auto opened = open_store((folder / "retake.db").string());
  Store& store = *opened;
  ScenarioLibrary library(store);
  EventHub events;
  Runner runner(store, library, events, {.threads = 1, .most_samples_per_scenario = 100});
  const std::string scenario =
      store.add_scenario(new_scenario_record(*Scenario::read(prior_document()))).scenario.id;
  const auto records = chains(scenario, 1);
  runner.add(records);
  ASSERT_TRUE(wait_until([&] { return runner.chain(records[0].id)->state == ChainState::finished; }));
  EXPECT_EQ(runner.chain(records[0].id)->ended_by, "stock");
  EXPECT_GE(store.sample_count(scenario), 100);
}

TEST_F(ThreadsRunner, Unknown_chains_are_nothing_and_ended_ones_stay_as_they_are) {
  const auto parts = open();
  EXPECT_FALSE(parts->runner.pause("nosuch"));
  EXPECT_FALSE(parts->runner.resume("nosuch"));
  EXPECT_FALSE(parts->runner.stop("nosuch"));
  const auto records = chains(add_scenario(*parts, prior_document()), 1, {.samples = 1});
  parts->runner.add(records);
  ASSERT_TRUE(wait_until([&] { return state(*parts, records[0].id) == ChainState::finished; }));
  for (const auto ask : {&Runner::pause, &Runner::resume, &Runner::stop}) {
    const auto ended = (parts->runner.*ask)(records[0].id);
    EXPECT_EQ(ended->state, ChainState::finished);
    EXPECT_EQ(ended->ended_by, "samples");
  }
}

TEST_F(ThreadsRunner, A_chain_that_cannot_be_read_fails_and_leaves_the_others_alone) {
  std::vector<ChainRecord> records;
  {
    const auto parts = open();
    records = chains(add_scenario(*parts, rare), 2);
    parts->runner.add(records);
    ASSERT_TRUE(wait_until([&] { return iteration(*parts, records[1].id) > 0; }));
    parts->runner.drain();
    ChainProgress damaged;
    damaged.chain = records[0].id;
    damaged.scenario = records[0].scenario;
    damaged.checkpoint = "not a checkpoint";
    parts->store.commit(damaged).get();
  }
  const auto parts = open();
  parts->runner.resume_stored();
  EXPECT_EQ(state(*parts, records[0].id), ChainState::failed);
  EXPECT_FALSE(parts->runner.chain(records[0].id)->error.empty());
  EXPECT_EQ(state(*parts, records[1].id), ChainState::running);
}

}  // namespace
}  // namespace retake
