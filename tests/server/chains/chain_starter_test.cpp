// ChainStarter: chains begin from what others learned, the same chain is not run twice, and it goes on.
#include "server/chains/chain_starter.h"

#include <set>

#include <gtest/gtest.h>

#include "db/open_store.h"
#include "server/chains/scenario_library.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

constexpr std::uint64_t kManyLive = 100;

class ThreadsChainStarter : public ::testing::Test {
 protected:
  std::string add_scenario(const json& document) {
    return store.add_scenario(new_scenario_record(*Scenario::read(document))).scenario.id;
  }
  static ChainWish wish(const StopRule& stop, std::optional<std::uint64_t> seed = 7,
                        const std::string& method = "conditional") {
    return {.seed = seed, .method = method, .ratios = "exact", .stop = stop};
  }
  /// The chains of a wish, once they have ended.
  std::vector<ChainRecord> ended(const std::string& of, const ChainWish& wanted) {
    auto started = starter.start(of, wanted, kManyLive).chains;
    for (ChainRecord& record : started) {
      EXPECT_TRUE(wait_until([&] { return store.chain(record.id)->state == ChainState::finished; }));
      record = *store.chain(record.id);
    }
    return started;
  }
  /// (place, weight, digest) of the samples of a chain that count.
  std::set<std::string> counted(const ChainRecord& chain) {
    std::set<std::string> samples;
    for (const SampleRecord& sample : store.samples(chain.scenario, SampleOrder::oldest, 10'000, "").records)
      if (sample.chain == chain.id && sample.weight > 0)
        samples.insert(std::to_string(sample.iteration) + " " + sample.digest);
    return samples;
  }

  TemporaryFolder folder;
  std::unique_ptr<Store> opened = open_store((folder / "retake.db").string());
  Store& store = *opened;
  ScenarioLibrary library{store};
  EventHub events;
  Runner runner{store, library, events, {.threads = 2}};
  ChainStarter starter{store, runner};
  const std::string scenario = add_scenario(wish_document(1, 0.05));
};

TEST_F(ThreadsChainStarter, A_second_chain_never_learns) {
  const auto first = ended(scenario, wish({.counted = 30})).at(0);
  EXPECT_EQ(first.lesson, 0u);
  EXPECT_GE(first.counters.counted, 30u);
  EXPECT_GT(first.counters.samples, first.counters.counted) << "what it found while learning";
  ASSERT_EQ(store.lessons(scenario).size(), 1u);
  EXPECT_EQ(store.lessons(scenario)[0].chain, first.id);

  const auto second = ended(scenario, wish({.counted = 30}, 8)).at(0);
  EXPECT_EQ(second.lesson, 1u);
  EXPECT_EQ(second.counters.samples, second.counters.counted);
  EXPECT_EQ(second.counters.kernels.at(0).proposed, 0u) << "no draw of the prior, by which chains explore";
  EXPECT_EQ(store.lessons(scenario).size(), 1u) << "it learned nothing";

  // Seed and lesson decide everything: the same again, elsewhere.
  const std::string other = add_scenario(wish_document(1, 0.05, "The same, elsewhere"));
  ended(other, wish({.counted = 30}));
  const auto same = ended(other, wish({.counted = 30}, 8)).at(0);
  EXPECT_EQ(same.lesson, 1u);
  EXPECT_EQ(counted(same), counted(second));
  EXPECT_EQ(counted(second).size(), 30u);

  ChainWish anew = wish({.counted = 30}, 9);
  anew.lesson = 0;
  EXPECT_EQ(ended(scenario, anew).at(0).lesson, 0u);
  EXPECT_EQ(store.lessons(scenario).size(), 2u);
  anew.seed = 10;
  anew.lesson = 1;
  EXPECT_EQ(ended(scenario, anew).at(0).lesson, 1u) << "named, though not the newest";
  anew.lesson.reset();
  anew.seed = 11;
  EXPECT_EQ(ended(scenario, anew).at(0).lesson, 2u);
}

TEST_F(ThreadsChainStarter, From_a_ladder_one_chain_goes_on) {
  ChainWish two = wish({.counted = 20}, 7, "tempering");
  two.count = 2;
  ended(scenario, two);
  ASSERT_EQ(store.lessons(scenario).size(), 2u);
  two.seed = 8;
  two.count = 3;
  const auto next = ended(scenario, two);
  EXPECT_EQ((std::set<std::uint64_t>{next[0].lesson, next[1].lesson}), (std::set<std::uint64_t>{1, 2}));
  EXPECT_EQ(next[2].lesson, 0u) << "there was no place left";
  EXPECT_EQ(next[0].counters.samples, next[0].counters.counted);
  EXPECT_EQ(store.lessons(scenario).size(), 5u) << "each of them is a place to go on from";
}

TEST_F(ThreadsChainStarter, The_same_chain_is_the_same_evidence) {
  const auto first = ended(scenario, wish({.counted = 20}));
  const auto again = starter.start(scenario, wish({.counted = 20}), kManyLive);
  EXPECT_EQ(again.created, 0u);
  EXPECT_EQ(again.chains.at(0).id, first[0].id) << "though there is a lesson now";
  EXPECT_EQ(again.chains[0].state, ChainState::finished);
  EXPECT_EQ(store.chains(scenario).size(), 1u);

  // More of it: those that are there, going on, and one that is new.
  ChainWish more = wish({.counted = 50});
  more.count = 2;
  const auto both = ended(scenario, more);
  EXPECT_EQ(both[0].id, first[0].id);
  EXPECT_EQ(both[0].counters.counted, 50u);
  EXPECT_EQ(both[0].stop.counted, 50u);
  EXPECT_EQ(both[1].index, 1u);
  EXPECT_EQ(store.chains(scenario).size(), 2u);
  // As if it had never ended.
  const std::string other = add_scenario(wish_document(1, 0.05, "The same, elsewhere"));
  EXPECT_EQ(counted(both[0]), counted(ended(other, wish({.counted = 50})).at(0)));

  // Fewer are there already; of other settings it is another chain.
  EXPECT_EQ(starter.start(scenario, wish({.counted = 10}), kManyLive).chains.at(0).counters.counted, 50u);
  EXPECT_EQ(starter.start(scenario, wish({.counted = 10}, 8), kManyLive).created, 1u);
  EXPECT_EQ(starter.start(scenario, wish({.counted = 10}, 7, "rejection"), kManyLive).created, 1u);
  EXPECT_EQ(starter.start(scenario, wish({.counted = 10}, {}), kManyLive).created, 1u);
  ChainWish named = wish({.counted = 10});
  named.lesson = 1;
  EXPECT_EQ(starter.start(scenario, named, kManyLive).created, 1u);
  EXPECT_EQ(starter.start(scenario, named, kManyLive).created, 0u);
}

TEST_F(ThreadsChainStarter, A_chain_that_runs_keeps_its_rule_unless_more_is_allowed_in_every_respect) {
  const std::string rare = add_scenario(wish_document(1, 1e-6));
  const auto start = [&](const StopRule& stop) {
    return starter.start(rare, wish(stop, 7, "rejection"), kManyLive).chains.at(0);
  };
  const std::string id = start({.samples = 100, .seconds = 1000}).id;
  EXPECT_EQ(start({.samples = 200, .seconds = 10}).stop.samples, 100u);
  EXPECT_EQ(start({.ess = 10}).stop.samples, 100u);
  const auto changed = start({.samples = 200, .seconds = 1000});
  EXPECT_EQ(changed.id, id);
  EXPECT_EQ(changed.state, ChainState::running);
  EXPECT_EQ(changed.stop.samples, 200u);
  EXPECT_FALSE(start({}).stop.samples) << "without a rule it goes on for ever";
  runner.pause(id);
  EXPECT_EQ(start({.samples = 200}).state, ChainState::running);
  runner.stop(id);
  EXPECT_EQ(start({.samples = 200}).state, ChainState::running);
  EXPECT_EQ(store.chains(rare).size(), 1u);
  runner.stop(id);
}

TEST_F(ThreadsChainStarter, What_cannot_be_begun_begins_nothing) {
  ended(scenario, wish({.counted = 10}));
  ChainWish named = wish({.counted = 10}, 8);
  named.lesson = 2;
  EXPECT_THROW(starter.start(scenario, named, kManyLive), ChainStarter::UnknownLesson);
  named.lesson = 1;
  named.method = "tempering";
  EXPECT_THROW(starter.start(scenario, named, kManyLive), ChainStarter::UnknownLesson);
  ChainWish many = wish({.counted = 10}, 9);
  many.count = 3;
  EXPECT_THROW(starter.start(scenario, many, 2), ChainStarter::TooManyChains);
  // Those that would go on count too, and those that have nothing to do do not.
  EXPECT_THROW(starter.start(scenario, wish({.counted = 20}), 0), ChainStarter::TooManyChains);
  EXPECT_EQ(starter.start(scenario, wish({.counted = 10}), 0).created, 0u);
  EXPECT_EQ(store.chains(scenario).size(), 1u);
}

TEST_F(ThreadsChainStarter, Requests_at_once_begin_a_chain_once) {
  std::vector<std::thread> clients;
  std::atomic<std::size_t> created{0};
  for (int client = 0; client < 6; ++client)
    clients.emplace_back(
        [&] { created += starter.start(scenario, wish({.counted = 10}), kManyLive).created; });
  for (std::thread& client : clients)
    client.join();
  EXPECT_EQ(created, 1u);
  EXPECT_EQ(store.chains(scenario).size(), 1u);
}

}  // namespace
}  // namespace retake
