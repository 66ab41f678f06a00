// Whoever waits for a chain is told at once, whatever it simulates; and what was interrupted is done again.
// doc/design.md, section 7.
#include <algorithm>
#include <atomic>
#include <future>
#include <random>

#include <gtest/gtest.h>

#include "db/open_store.h"
#include "server/chains/identifiers.h"
#include "server/chains/pilot.h"
#include "server/chains/runner.h"
#include "tests/server/daemon.h"
#include "tests/server/walks.h"
#include "tests/worlds/stub_world.h"

namespace retake {
namespace {

using namespace test;

/// A bead whose every simulation takes for ever as long as `is_slow`, unless it is interrupted.
class SlowWorld final : public tests::StubWorld {
 public:
  mutable std::atomic<bool> is_slow{false};
  mutable std::atomic<int> waiting{0};  ///< simulations that take for ever just now

  std::string_view name() const override { return "slow"; }
  std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                          std::vector<Fault>& faults) const override {
    return std::make_shared<const SlowScene>(*this, StubWorld::make_scene(model, faults));
  }

 private:
  class SlowBead final : public Physics {
   public:
    SlowBead(const SlowWorld& world, std::unique_ptr<Physics> bead) : world_(world), bead_(std::move(bead)) {}
    SimulationOutcome simulate(const State& state, const Recording& recording, Animation& animation,
                               std::span<double> measures) override {
      const Counted counted(world_.waiting, world_.is_slow);
      while (world_.is_slow) {
        recording.check_interruption();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      return bead_->simulate(state, recording, animation, measures);
    }

   private:
    struct Counted {
      Counted(std::atomic<int>& count, bool counts) : count_(count), by_(counts ? 1 : 0) { count_ += by_; }
      ~Counted() { count_ -= by_; }
      std::atomic<int>& count_;
      const int by_;
    };
    const SlowWorld& world_;
    std::unique_ptr<Physics> bead_;
  };

  class SlowScene final : public Scene {
   public:
    SlowScene(const SlowWorld& world, std::shared_ptr<const Scene> rod)
        : world_(world), rod_(std::move(rod)) {}
    std::shared_ptr<const Model> model() const override { return rod_->model(); }
    KernelTable kernels(Ratios ratios) const override { return rod_->kernels(ratios); }
    std::vector<Measure> measures() const override { return rod_->measures(); }
    std::unique_ptr<Physics> make_physics() const override {
      return std::make_unique<SlowBead>(world_, rod_->make_physics());
    }

   private:
    const SlowWorld& world_;
    std::shared_ptr<const Scene> rod_;
  };
};

struct Parts {
  Parts(const std::filesystem::path& folder, const Runner::Settings& settings,
        std::vector<const World*> offered = worlds())
      : opened(open_store((folder / "retake.db").string())),
        library(store, std::move(offered)),
        runner(store, library, events, settings) {}
  std::unique_ptr<Store> opened;
  Store& store = *opened;
  ScenarioLibrary library;
  EventHub events;
  Runner runner;
};

ChainRecord chain_of(const std::string& scenario, const std::string& method, std::uint64_t seed,
                     const StopRule& stop) {
  ChainRecord record;
  record.id = random_identifier();
  record.scenario = scenario;
  record.seed = seed;
  record.method = method;
  record.ratios = "exact";
  record.stop = stop;
  return record;
}

class ThreadsInterruption : public ::testing::Test {
 protected:
  void SetUp() override {
    document["world"] = "slow";
    const auto scenario = Scenario::read(document, {&world});
    id = parts.store.add_scenario(new_scenario_record(*scenario)).scenario.id;
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
      chains.push_back(chain_of(id, "metropolis", seed, {}));
  }
  void TearDown() override { world.is_slow = false; }
  /// Chains are stepped for ever, on every thread.
  void start_and_get_stuck() {
    world.is_slow = true;
    parts.runner.add(chains);
    ASSERT_TRUE(wait_until([this] { return world.waiting == 2; }));
  }
  ChainState state(std::size_t i) { return parts.store.chain(chains[i].id)->state; }

  SlowWorld world;
  json document = {{"world", "slow"}, {"constraints", json::array()}};
  TemporaryFolder folder;
  std::string id;
  std::vector<ChainRecord> chains;
  Parts parts{folder.path(), {.threads = 2, .patience = std::chrono::milliseconds(1)}, {&world}};
};

TEST_F(ThreadsInterruption, Every_chain_pauses_and_stops_while_simulations_take_for_ever) {
  start_and_get_stuck();
  // Those that are simulated, and those that wait for their turn, at once.
  std::vector<std::future<std::optional<ChainRecord>>> answers;
  for (std::size_t i = 0; i < chains.size(); ++i)
    answers.push_back(std::async(std::launch::async, [this, i] {
      return i % 2 == 0 ? parts.runner.pause(chains[i].id) : parts.runner.stop(chains[i].id);
    }));
  for (std::size_t i = 0; i < chains.size(); ++i)
    EXPECT_EQ(answers[i].get()->state, i % 2 == 0 ? ChainState::paused : ChainState::finished) << i;
  EXPECT_EQ(world.waiting, 0);
  EXPECT_EQ(parts.runner.counters().live_chains, 0);

  // They go on when they can.
  ASSERT_EQ(parts.runner.resume(chains[0].id)->state, ChainState::running);
  ASSERT_TRUE(wait_until([this] { return world.waiting == 1; }));
  world.is_slow = false;
  EXPECT_TRUE(wait_until([this] { return parts.runner.chain(chains[0].id)->counters.samples > 0; }));
}

TEST_F(ThreadsInterruption, A_scenario_is_dropped_while_its_simulations_take_for_ever) {
  start_and_get_stuck();
  parts.runner.drop_scenario(id);
  EXPECT_EQ(parts.runner.counters().live_chains, 0);
  EXPECT_TRUE(parts.store.delete_scenario(id));
}

TEST_F(ThreadsInterruption, The_runner_and_the_pilot_end_while_simulations_take_for_ever) {
  start_and_get_stuck();
  {
    Pilot pilot(parts.store, parts.library, parts.events);
    pilot.add(id);
    ASSERT_TRUE(wait_until([this] { return world.waiting == 3; }));
  }
  parts.runner.drain();
  for (std::size_t i = 0; i < chains.size(); ++i)
    EXPECT_EQ(state(i), ChainState::running) << "the next start takes it up";
}

// --- What was interrupted is done again, bit for bit ---------------------------------------------

/// The counters and the checkpoint of a chain, without the two that tell what was really stepped.
std::string standing(Store& store, const std::string& id) {
  ChainCounters counters = store.chain(id)->counters;
  std::string checkpoint = store.checkpoint(id);
  std::size_t place = 4 + 8 + 4 + 1;  // version, seed, index, method
  json told;
  visit_counters(static_cast<ChainCounts&>(counters), [&](const std::string& name, auto& value) {
    if (name == "simulated_seconds" || name == "skipped_seconds")
      std::fill_n(checkpoint.begin() + static_cast<std::ptrdiff_t>(place), sizeof value, '\0');
    else
      told[name] = value;
    place += sizeof value;
  });
  for (const KernelCounter& kernel : counters.kernels)
    told[kernel.name] = {kernel.proposed, kernel.accepted};
  for (const RungCounter& rung : counters.rungs)
    told["rungs"].push_back({rung.beta, rung.proposed, rung.accepted});
  told["counted"] = counters.counted;
  told["odds"] = {counters.odds.draws, counters.odds.hits, counters.odds.sum, counters.odds.squares};
  return told.dump() + checkpoint;
}

class ThreadsInterruptedWalk : public ::testing::TestWithParam<std::size_t> {
 protected:
  const WalkCase walk = walks()[GetParam()];
};
INSTANTIATE_TEST_SUITE_P(Methods, ThreadsInterruptedWalk, ::testing::Range<std::size_t>(0, walks().size()),
                         [](const auto& parameter) { return std::string(walks()[parameter.param].name); });

TEST_P(ThreadsInterruptedWalk, Finds_what_it_finds_undisturbed) {
  TemporaryFolder folder;
  // No patience: whatever is under way is interrupted.
  Parts parts(folder.path(), {.threads = 2, .patience = std::chrono::milliseconds(0)});
  const std::string scenario =
      parts.store.add_scenario(new_scenario_record(*Scenario::read(walk.scenario))).scenario.id;
  const StopRule stop{.iterations = walk.chain["stop"]["iterations"].get<std::uint64_t>()};
  const auto add = [&] {
    const ChainRecord record = chain_of(scenario, walk.chain["method"], walk.chain["seed"], stop);
    parts.runner.add({record});
    return record.id;
  };
  const auto is_over = [&](const std::string& id) {
    return wait_until([&] { return parts.runner.chain(id)->state == ChainState::finished; });
  };
  const std::string disturbed = add();
  std::mt19937 random(5);
  int pauses = 0;
  for (; pauses < 60; ++pauses) {
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 40'000));
    const ChainState state = parts.runner.pause(disturbed)->state;
    if (state == ChainState::finished) break;
    ASSERT_EQ(state, ChainState::paused);
    ASSERT_EQ(parts.runner.resume(disturbed)->state, ChainState::running);
  }
  EXPECT_GE(pauses, 3);
  ASSERT_TRUE(is_over(disturbed));
  const std::string alone = add();
  ASSERT_TRUE(is_over(alone));

  using Found = std::vector<std::tuple<std::uint64_t, std::uint32_t, std::uint64_t, std::string>>;
  std::map<std::string, Found> found;
  for (const SampleRecord& sample : parts.store.samples(scenario, SampleOrder::oldest, 100'000, "").records)
    found[sample.chain].emplace_back(sample.iteration, sample.replica, sample.weight, sample.digest);
  for (auto& [id, samples] : found)
    std::sort(samples.begin(), samples.end());
  EXPECT_GT(found[disturbed].size(), walk.fewest);
  EXPECT_EQ(found[disturbed], found[alone]);
  EXPECT_EQ(standing(parts.store, disturbed), standing(parts.store, alone));
}

}  // namespace
}  // namespace retake
