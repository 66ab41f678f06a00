// Chain: resumed equals uninterrupted, bit for bit; checkpoints that do not fit are refused; and the Runs
// that chains hand to simulators always belong to the State they say.
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

double bumpy_constraint(const State& state) {
  return state[5] > 0.9 ? kFails : -0.5 * std::pow(sum_of_present(state) - 1, 2);
}

std::shared_ptr<const Target> rich_target() {
  const auto model = rich_model();
  return target_of(model, rich_kernels(*model, Ratios::exact));
}

class CheckpointTest : public ::testing::TestWithParam<Method> {
 protected:
  const std::shared_ptr<const Target> target = rich_target();
  const ChainSettings settings{.seed = 121, .index = 5, .method = GetParam()};

  std::string checkpoint_after(int iterations) const {
    Chain chain(target, settings);
    ToySimulator simulator(bumpy_constraint);
    for (int i = 0; i < iterations; ++i)
      chain.step(simulator);
    return chain.checkpoint();
  }
  /// True if the bytes are refused.
  bool refuses(const std::string& bytes, const std::shared_ptr<const Target>& other,
               const ChainSettings& with) const {
    try {
      Chain chain(other, with, bytes);
    } catch (const std::runtime_error&) {
      return true;
    }
    return false;
  }
};

INSTANTIATE_TEST_SUITE_P(Methods, CheckpointTest, ::testing::Values(Method::metropolis, Method::rejection),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

TEST_P(CheckpointTest, AResumedChainEqualsOneThatWasNeverInterrupted) {
  Chain uninterrupted(target, settings), resumed(target, settings);
  ToySimulator simulator(bumpy_constraint);
  RandomStream pauses = stream(122);
  int interruptions = 0;
  for (int i = 0; i < 5000; ++i) {
    if (i == 0 || pauses.bernoulli(0.02)) {
      resumed = Chain(target, settings, resumed.checkpoint());
      ++interruptions;
    }
    ToySimulator fresh(bumpy_constraint);  // another simulator, as after a restart
    ASSERT_EQ(uninterrupted.step(simulator), resumed.step(fresh)) << i;
    ASSERT_EQ(uninterrupted.checkpoint(), resumed.checkpoint()) << i;
  }
  EXPECT_GT(interruptions, 60);
  EXPECT_GT(uninterrupted.counts().accepted, 100u);
}

TEST_P(CheckpointTest, ACheckpointHoldsAllThatCanBeSeen) {
  const std::string bytes = checkpoint_after(300);
  const Chain chain(target, settings, bytes);
  EXPECT_EQ(chain.checkpoint(), bytes);
  EXPECT_EQ(chain.counts().iteration, 300u);
  EXPECT_GT(chain.stay().iteration, 0u);
  EXPECT_TRUE(chain.stay().is_sample);
  EXPECT_EQ(chain.stay().score.log_constraint, bumpy_constraint(chain.stay().state));
  EXPECT_EQ(chain.stay().log_prior, target->model->log_prior(chain.stay().state));
}

TEST_P(CheckpointTest, EveryTruncationAndEveryExtensionIsRefused) {
  for (const int iterations : {0, 300}) {
    const std::string bytes = checkpoint_after(iterations);
    EXPECT_FALSE(refuses(bytes, target, settings));
    for (std::size_t length = 0; length < bytes.size(); ++length)
      ASSERT_TRUE(refuses(bytes.substr(0, length), target, settings)) << length;
    EXPECT_TRUE(refuses(bytes + '\0', target, settings));
  }
}

TEST_P(CheckpointTest, ForeignCheckpointsAreRefused) {
  const std::string bytes = checkpoint_after(300);
  ChainSettings other = settings;
  other.seed += 1;
  EXPECT_TRUE(refuses(bytes, target, other));
  other = settings;
  other.index += 1;
  EXPECT_TRUE(refuses(bytes, target, other));
  other = settings;
  other.method = GetParam() == Method::rejection ? Method::metropolis : Method::rejection;
  EXPECT_TRUE(refuses(bytes, target, other));

  const auto fewer_variables = switch_model(4, 1);
  EXPECT_TRUE(
      refuses(bytes, target_of(fewer_variables, rich_kernels(*rich_model(), Ratios::exact)), settings));
  auto more_measures = std::make_shared<Target>(*target);
  more_measures->measure_names.push_back("another");
  EXPECT_TRUE(refuses(bytes, more_measures, settings));
  if (GetParam() == Method::metropolis) {
    auto rows = target->kernels.rows();
    rows.pop_back();
    EXPECT_TRUE(refuses(bytes, target_of(target->model, rows), settings));
  }
  std::string unknown_version = bytes;
  unknown_version[0] = 77;
  EXPECT_TRUE(refuses(unknown_version, target, settings));
}

TEST_P(CheckpointTest, DamagedBytesNeverDoMoreThanBeRefused) {
  // Without a checksum a flipped bit of a counter goes unseen (the store has one); none may crash or read
  // astray.
  const std::string bytes = checkpoint_after(300);
  int refused = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ flip);
      refused += refuses(damaged, target, settings);
    }
  // At least the version, seed, index, method and the three sizes: 29 bytes.
  EXPECT_GE(refused, 3 * 29 - 2);
}

// --- Runs ----------------------------------------------------------------------------------------

/// A Run that remembers which State was recorded in it.
struct ToyRun final : Run {
  State recorded;
};

/// Offers Runs and checks, at every call, that they are what the contract of SimulationRequest says.
class ResumingSimulator final : public Simulator {
 public:
  std::unique_ptr<Run> make_run() const override { return std::make_unique<ToyRun>(); }

  SimulationOutcome simulate(const State& candidate, const SimulationRequest& request,
                             Score& score) override {
    auto* record = dynamic_cast<ToyRun*>(request.record);
    if (!record) ++missing_records;
    EXPECT_EQ(request.current_run == nullptr, request.current_state == nullptr);
    if (const auto* current = dynamic_cast<const ToyRun*>(request.current_run)) {
      ++resumed;
      EXPECT_NE(request.current_run, request.record);
      EXPECT_TRUE(same(current->recorded, *request.current_state))
          << "the run is not that of the current state";
      EXPECT_FALSE(same(candidate, *request.current_state));
      if (chain) {
        EXPECT_EQ(request.current_state, &chain->stay().state);
      }
    }
    if (record) record->recorded = candidate;
    return toy_.simulate(candidate, request, score);
  }

  const Chain* chain = nullptr;
  std::uint64_t resumed = 0, missing_records = 0;

 private:
  static bool same(const State& left, const State& right) {
    return left.size() == right.size() &&
           std::memcmp(left.data(), right.data(), sizeof(double) * static_cast<std::size_t>(left.size())) ==
               0;
  }
  ToySimulator toy_{bumpy_constraint};
};

TEST(Runs, AlwaysBelongToTheCurrentState) {
  const auto target = rich_target();
  const ChainSettings settings{.seed = 123};
  Chain chain(target, settings), plain(target, settings);
  ResumingSimulator simulator;
  ToySimulator without_runs(bumpy_constraint);
  RandomStream pauses = stream(124);
  for (int i = 0; i < 10000; ++i) {
    if (pauses.bernoulli(0.01)) chain = Chain(target, settings, chain.checkpoint());
    simulator.chain = &chain;
    ASSERT_EQ(chain.step(simulator), plain.step(without_runs));
    // Runs, checkpoints and which simulator it is change nothing.
    ASSERT_EQ(chain.checkpoint(), plain.checkpoint()) << i;
  }
  EXPECT_EQ(simulator.missing_records, 0u);
  EXPECT_GT(simulator.resumed, 1000u);
}

TEST(Runs, AreNotAskedForByRejection) {
  Chain chain(rich_target(), {.seed = 125, .method = Method::rejection});
  ResumingSimulator simulator;
  for (int i = 0; i < 200; ++i)
    chain.step(simulator);
  EXPECT_EQ(simulator.resumed, 0u);
  EXPECT_EQ(simulator.missing_records, chain.counts().simulations);
}

TEST(Runs, MayBeOfferedByOneSimulatorAndNotByAnother) {
  // A chain moves between threads, whose simulators are alike; the contract does not promise the same object.
  const auto target = rich_target();
  Chain chain(target, {.seed = 126}), plain(target, {.seed = 126});
  ResumingSimulator first, second;
  ToySimulator without_runs(bumpy_constraint);
  for (int i = 0; i < 2000; ++i)
    ASSERT_EQ(chain.step(i % 3 == 0 ? first : second), plain.step(without_runs));
  EXPECT_EQ(first.missing_records + second.missing_records, 0u);
}

}  // namespace
}  // namespace retake::tests
