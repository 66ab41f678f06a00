// A chain that ends the process, whatever it does it by, is taken up again so often and no more.
#include <csignal>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "db/open_store.h"
#include "server/chains/identifiers.h"
#include "server/chains/runner.h"
#include "tests/server/daemon.h"
#include "tests/worlds/stub_world.h"

namespace retake {
namespace {

using namespace test;

/// A bead that ends the process.
class DeadlyWorld final : public tests::StubWorld {
 public:
  explicit DeadlyWorld(bool is_deadly) : is_deadly_(is_deadly) {}
  std::string_view name() const override { return "deadly"; }
  std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                          std::vector<Fault>& faults) const override {
    if (is_deadly_) return std::make_shared<const DeadlyScene>(StubWorld::make_scene(model, faults));
    return StubWorld::make_scene(model, faults);
  }

 private:
  class DeadlyBead final : public Physics {
   public:
    SimulationOutcome simulate(const State&, const Recording&, Animation&, std::span<double>) override {
      std::raise(SIGKILL);
      return {};
    }
  };
  class DeadlyScene final : public Scene {
   public:
    explicit DeadlyScene(std::shared_ptr<const Scene> rod) : rod_(std::move(rod)) {}
    std::shared_ptr<const Model> model() const override { return rod_->model(); }
    KernelTable kernels(Ratios ratios) const override { return rod_->kernels(ratios); }
    std::vector<Measure> measures() const override { return rod_->measures(); }
    std::unique_ptr<Physics> make_physics() const override { return std::make_unique<DeadlyBead>(); }

   private:
    std::shared_ptr<const Scene> rod_;
  };
  const bool is_deadly_;
};

class DeadlyChain : public ::testing::Test {
 protected:
  struct Parts {
    Parts(const std::filesystem::path& folder, bool is_deadly)
        : world(is_deadly),
          opened(open_store((folder / "retake.db").string())),
          library(store, {&world}),
          runner(store, library, events, {.threads = 1}) {}
    const DeadlyWorld world;
    std::unique_ptr<Store> opened;
    Store& store = *opened;
    ScenarioLibrary library;
    EventHub events;
    Runner runner;
  };
  enum class End { by_its_world, by_a_signal, in_good_order };

  /// Runs a daemon's parts in a process of its own until that ends. Gives how it did.
  template <typename Work>
  int in_process(bool is_deadly, Work work) {
    const pid_t pid = fork();
    if (pid == 0) {
      {
        Parts parts(folder.path(), is_deadly);
        work(parts);
      }
      _exit(0);
    }
    int status = 0;
    EXPECT_EQ(waitpid(pid, &status, 0), pid);
    return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  }
  int take_up(bool is_deadly, End end) {
    return in_process(is_deadly, [&](Parts& parts) {
      parts.runner.resume_stored();
      if (end == End::by_its_world) std::this_thread::sleep_for(std::chrono::seconds(60));
      if (end == End::in_good_order) return;
      wait_until([&] { return parts.store.chain("chain")->attempts == 0; });
      std::raise(SIGKILL);
    });
  }
  ChainRecord chain() {
    const auto store = open_store((folder / "retake.db").string());
    return *store->chain("chain");
  }
  void add_and_die() {
    ASSERT_EQ(in_process(true,
                         [&](Parts& parts) {
                           const json document = {{"world", "deadly"}, {"constraints", json::array()}};
                           const auto scenario = Scenario::read(document, {&parts.world});
                           ChainRecord record;
                           record.id = "chain";
                           record.scenario =
                               parts.store.add_scenario(new_scenario_record(*scenario)).scenario.id;
                           record.method = "rejection";
                           record.ratios = "exact";
                           parts.runner.add({record});
                           std::this_thread::sleep_for(std::chrono::seconds(60));
                         }),
              -SIGKILL);
  }

  TemporaryFolder folder;
};

TEST_F(DeadlyChain, Is_not_taken_up_again_after_three_deaths_unless_a_client_wants_it) {
  add_and_die();
  for (int death = 2; death <= 3; ++death) {
    EXPECT_EQ(chain().state, ChainState::running);
    ASSERT_EQ(take_up(true, End::by_its_world), -SIGKILL);
  }
  ASSERT_EQ(in_process(true, [](Parts& parts) { parts.runner.resume_stored(); }), 0);
  EXPECT_EQ(chain().state, ChainState::failed);
  EXPECT_EQ(chain().error, "the process died 3 times while it was running; resume it to try once more");

  // Once more, and no more.
  ASSERT_EQ(in_process(true,
                       [](Parts& parts) {
                         parts.runner.resume("chain");
                         std::this_thread::sleep_for(std::chrono::seconds(60));
                       }),
            -SIGKILL);
  ASSERT_EQ(in_process(true, [](Parts& parts) { parts.runner.resume_stored(); }), 0);
  EXPECT_EQ(chain().state, ChainState::failed);
  // What ends it no more sets it free.
  ASSERT_EQ(in_process(false,
                       [](Parts& parts) {
                         parts.runner.resume("chain");
                         wait_until([&] { return parts.store.chain("chain")->counters.iteration > 0; });
                       }),
            0);
  EXPECT_EQ(chain().state, ChainState::running);
  EXPECT_EQ(chain().attempts, 0);
}

TEST_F(DeadlyChain, Is_taken_up_as_long_as_it_makes_progress_in_between) {
  for (const End end : {End::by_a_signal, End::in_good_order}) {
    SCOPED_TRACE(static_cast<int>(end));
    if (end == End::by_a_signal) add_and_die();
    for (int round = 0; round < 2; ++round) {
      while (chain().attempts < 2)
        ASSERT_EQ(take_up(true, End::by_its_world), -SIGKILL);
      EXPECT_EQ(take_up(false, end), end == End::by_a_signal ? -SIGKILL : 0);
      EXPECT_EQ(chain().state, ChainState::running);
      EXPECT_EQ(chain().attempts, 0);
    }
  }
}

TEST_F(DeadlyChain, Is_alone_to_blame) {
  add_and_die();
  const auto add_innocents = [](Parts& parts) {
    const ChainRecord deadly = *parts.store.chain("chain");
    std::vector<ChainRecord> others(5, deadly);
    for (std::size_t i = 0; i < others.size(); ++i) {
      others[i].id = "other" + std::to_string(i);
      others[i].seed = i + 1;
    }
    parts.store.add_chains(others);
  };
  ASSERT_EQ(in_process(false, add_innocents), 0);
  // They wait behind it each time.
  while (chain().state == ChainState::running && chain().attempts < Runner::kMostAttempts)
    ASSERT_EQ(take_up(true, End::by_its_world), -SIGKILL);
  ASSERT_EQ(in_process(false,
                       [](Parts& parts) {
                         parts.runner.resume_stored();
                         wait_until([&] { return parts.store.chain("other4")->counters.iteration > 0; });
                       }),
            0);
  EXPECT_EQ(chain().state, ChainState::failed);
  const auto store = open_store((folder / "retake.db").string());
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(store->chain("other" + std::to_string(i))->state, ChainState::running);
    EXPECT_EQ(store->chain("other" + std::to_string(i))->attempts, 0);
  }
}

}  // namespace
}  // namespace retake
