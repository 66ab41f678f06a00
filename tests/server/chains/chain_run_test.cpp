// ChainRun: weights are those of the chain itself however it is cut into slices, and the stop rule by
// effective samples is looked at at fixed places.
#include "server/chains/chain_run.h"

#include <map>
#include <random>

#include <gtest/gtest.h>

#include "server/chains/gathered_draws.h"
#include "server/chains/health.h"
#include "tests/worlds/stub_world.h"

namespace retake {
namespace {

using nlohmann::json;
using Place = std::pair<std::uint64_t, std::uint32_t>;  // iteration and walker
using Weights = std::map<Place, std::uint64_t>;

ChainRecord record_of(const std::string& method, const StopRule& stop) {
  ChainRecord record;
  record.id = "c";
  record.scenario = "s";
  record.seed = 9;
  record.method = method;
  record.ratios = "exact";
  record.stop = stop;
  return record;
}

/// What a store keeps of a chain, and a run that comes from it.
class KeptRun {
 public:
  KeptRun(std::shared_ptr<const Scenario> scenario, const ChainRecord& record)
      : scenario_(std::move(scenario)), record_(record) {
    restart();
  }
  ChainRun& run() { return *run_; }
  const Weights& weights() const { return weights_; }
  const GatheredDraws& draws() const { return draws_; }
  Scenario::Performer& performer() { return *performer_; }

  const std::vector<Lesson>& lessons() const { return lessons_; }

  void keep(bool is_last = false) {
    const ChainProgress progress = run_->take_progress(is_last);
    if (progress.lesson) lessons_.push_back(*progress.lesson);
    for (const NewSample& sample : progress.samples) {
      const SampleRecord& record = sample.record;
      EXPECT_EQ(record.id, sample_id("c", record.iteration, record.replica));
      EXPECT_TRUE(weights_.emplace(Place(record.iteration, record.replica), record.weight).second)
          << record.id;
    }
    for (const WeightUpdate& update : progress.weights) {
      const auto found = weights_.find({update.iteration, update.replica});
      ASSERT_NE(found, weights_.end()) << update.iteration;
      EXPECT_NE(found->second, update.weight) << "nothing new is said";
      found->second = update.weight;
    }
    draws_.add(progress);
    record_.counters = progress.counters;
    checkpoint_ = progress.checkpoint;
    if (progress.replace_trace) trace_.clear();
    if (!progress.trace_block.empty()) trace_.push_back(progress.trace_block);
  }
  void restart() {
    run_ = std::make_unique<ChainRun>(scenario_, record_,
                                      ChainRun::Stored{.checkpoint = checkpoint_, .trace_blocks = trace_});
    performer_ = scenario_->make_performer();
  }

 private:
  std::shared_ptr<const Scenario> scenario_;
  ChainRecord record_;
  std::unique_ptr<ChainRun> run_;
  std::unique_ptr<Scenario::Performer> performer_;
  Weights weights_;
  GatheredDraws draws_;
  std::string checkpoint_;
  std::vector<std::string> trace_;
  std::vector<Lesson> lessons_;
};

std::shared_ptr<const Scenario> bead_before(double limit) {
  return tests::read_stub_scenario(
      {{"world", "stub"}, {"constraints", {{{"kind", "before"}, {"limit", limit}}}}});
}

/// Of ten: too rarely met by chance for nothing to be learned.
constexpr double kRare = 0.5;
constexpr std::chrono::duration<double> kMoment{1e-9};
constexpr std::chrono::duration<double> kShort{0.002};
constexpr std::chrono::duration<double> kLong{60};

TEST(ChainRunLessons, AreHandedOverOnceHoweverOftenTheRunBeginsAgain) {
  for (const bool restarts : {false, true})
    for (const auto& [method, kind] : std::map<std::string, LessonKind>{{"conditional", LessonKind::proposal},
                                                                        {"tempering", LessonKind::place}}) {
      KeptRun kept(bead_before(kRare), record_of(method, {.iterations = 20'000}));
      while (kept.run().ended_by().empty()) {
        kept.run().step_for(kept.performer(), kShort, 10);
        kept.keep();
        ASSERT_TRUE(kept.lessons().empty() || !kept.run().record().counters.is_learning);
        if (restarts) kept.restart();
      }
      EXPECT_FALSE(kept.run().record().counters.is_learning) << method;
      EXPECT_EQ(kept.lessons().size(), kind == LessonKind::place ? 0u : 1u) << method;
      kept.keep(true);
      ASSERT_EQ(kept.lessons().size(), 1u) << method;
      EXPECT_EQ(kept.lessons()[0].kind, kind);
    }
  // One that ends while it is learning teaches what it has found so far.
  KeptRun short_one(bead_before(kRare), record_of("conditional", {.samples = 30}));
  short_one.run().step_for(short_one.performer(), kLong, 1000);
  short_one.keep();
  EXPECT_TRUE(short_one.lessons().empty());
  short_one.keep(true);
  ASSERT_EQ(short_one.lessons().size(), 1u);
  EXPECT_EQ(short_one.lessons()[0].kind, LessonKind::unfinished);

  KeptRun plain(bead_before(3), record_of("rejection", {.iterations = 100}));
  plain.run().step_for(plain.performer(), kLong, 1000);
  plain.keep(true);
  EXPECT_TRUE(plain.lessons().empty()) << "there is nothing to learn";
}

class ChainRunWeights : public ::testing::TestWithParam<Method> {};
INSTANTIATE_TEST_SUITE_P(Methods, ChainRunWeights,
                         ::testing::Values(Method::rejection, Method::metropolis, Method::conditional,
                                           Method::tempering),
                         [](const auto& parameter) { return std::string(to_string(parameter.param)); });

TEST_P(ChainRunWeights, AreThoseOfTheChainItselfWhateverTheSlicesAndRestarts) {
  constexpr std::uint64_t kIterations = 4000;
  const auto scenario = bead_before(kRare);
  const ChainRecord record = record_of(std::string(to_string(GetParam())), {.iterations = kIterations});

  // The chain alone: what each stay weighs when it ends.
  Chain chain(scenario->target(Ratios::exact), settings_of(record));
  const auto performer = scenario->make_performer();
  Weights expected;
  for (std::uint64_t i = 0; i < kIterations; ++i) {
    if (chain.step(*performer) && chain.stay().is_sample)
      expected.emplace(Place(chain.stay().iteration, chain.walker()), 0);
    for (std::size_t walker = 0; walker < chain.walkers(); ++walker) {
      const Stay& stay = chain.stay(walker);
      if (const auto found = expected.find(Place(stay.iteration, walker)); found != expected.end())
        found->second = stay.weight;
    }
  }
  ASSERT_EQ(expected.size(), chain.counts().samples);
  ASSERT_GT(expected.size(), 100u);

  // In slices, one after another from checkpoints.
  KeptRun kept(scenario, record);
  std::mt19937 random(1);
  while (kept.run().ended_by().empty()) {
    kept.run().step_for(kept.performer(), kMoment, 1 + random() % 20);
    if (random() % 3 == 0) kept.keep();
    if (random() % 50 == 0) {
      kept.keep();
      kept.restart();
    }
  }
  kept.keep();
  EXPECT_EQ(kept.run().ended_by(), "iterations");
  EXPECT_EQ(kept.weights(), expected);
  EXPECT_EQ(kept.run().record().counters.samples, expected.size());
}

TEST(ChainRun, NamesAndCountsItsKernels) {
  for (const char* method : {"rejection", "metropolis"}) {
    KeptRun kept(bead_before(3), record_of(method, {.iterations = 500}));
    kept.run().step_for(kept.performer(), kLong, 1'000'000);
    const auto& kernels = kept.run().record().counters.kernels;
    ASSERT_EQ(kernels.size(), 1u);
    EXPECT_EQ(kernels[0].name, std::string(method) == "rejection" ? "prior" : "redraw");
    EXPECT_EQ(kernels[0].proposed, 500u);
    EXPECT_FALSE(kept.run().record().counters.is_learning);
  }
}

/// Steps to the next place where the chain is judged.
std::uint64_t next_place(KeptRun& kept) {
  while (!kept.run().awaits_judgement() && kept.run().ended_by().empty()) {
    kept.run().step_for(kept.performer(), kLong, 5);
    kept.keep();
  }
  return kept.run().record().counters.samples;
}

TEST(ChainRunJudgement, IsDueAtAGrowingSequenceOfNumbersOfSamples) {
  KeptRun kept(bead_before(3), record_of("metropolis", {.samples = 60, .ess = 10}));
  for (const std::uint64_t place : {8u, 10u, 13u, 17u, 22u, 28u, 35u, 44u, 55u}) {
    EXPECT_EQ(next_place(kept), place);
    ASSERT_TRUE(kept.run().awaits_judgement());
    const std::uint64_t iteration = kept.run().record().counters.iteration;
    kept.run().step_for(kept.performer(), kLong, 5);
    EXPECT_EQ(kept.run().record().counters.iteration, iteration) << "it waits";
    kept.run().judge(place < 13 ? std::nullopt : std::optional(9.5));
    EXPECT_FALSE(kept.run().awaits_judgement());
    EXPECT_EQ(kept.run().ended_by(), "");
    kept.keep();
    EXPECT_EQ(kept.run().record().counters.effective_samples.has_value(), place >= 13);
  }
  EXPECT_EQ(next_place(kept), 60u);
  EXPECT_EQ(kept.run().ended_by(), "samples");
  EXPECT_EQ(kept.run().record().counters.effective_samples, 9.5);
}

TEST(ChainRunJudgement, EndsTheChainThatReachesTheWish) {
  KeptRun kept(bead_before(3), record_of("metropolis", {.ess = 10}));
  next_place(kept);
  kept.run().judge(9.99);
  EXPECT_EQ(kept.run().ended_by(), "");
  next_place(kept);
  kept.run().judge(10);
  EXPECT_EQ(kept.run().ended_by(), "ess");
}

TEST(ChainRunJudgement, IsDueAgainAfterARestartThatFoundTheChainWaiting) {
  KeptRun kept(bead_before(3), record_of("metropolis", {.ess = 10}));
  EXPECT_EQ(next_place(kept), 8u);
  kept.restart();
  EXPECT_TRUE(kept.run().awaits_judgement());
  kept.run().judge(std::nullopt);
  kept.run().step_for(kept.performer(), kMoment, 1);
  kept.keep();
  kept.restart();
  EXPECT_FALSE(kept.run().awaits_judgement()) << "it has gone on since";
}

TEST(ChainRunJudgement, NoWishNoJudgement) {
  KeptRun kept(bead_before(3), record_of("metropolis", {.samples = 100}));
  next_place(kept);
  EXPECT_EQ(kept.run().ended_by(), "samples");
  EXPECT_FALSE(kept.run().record().counters.effective_samples);
}

TEST(ChainRunJudgement, IndependentSamplesAreAllEffective) {
  KeptRun kept(bead_before(3), record_of("rejection", {.samples = 30}));
  kept.run().step_for(kept.performer(), kLong, 1000);
  EXPECT_EQ(kept.run().record().counters.effective_samples, 30);
}

TEST(ChainRunJudgement, AChainEndsAtTheSameSampleWhateverTheSlicesAndRestarts) {
  const auto scenario = bead_before(3);
  const ChainRecord record = record_of("metropolis", {.ess = 40});
  std::optional<Weights> undisturbed;
  for (unsigned disturbance = 0; disturbance < 5; ++disturbance) {
    KeptRun kept(scenario, record);
    std::mt19937 random(disturbance);
    while (kept.run().ended_by().empty()) {
      kept.run().step_for(kept.performer(), kMoment, disturbance == 0 ? 1000 : 1 + random() % 10);
      if (kept.run().awaits_judgement() || random() % 4 == 0) kept.keep();
      if (disturbance > 0 && random() % 20 == 0) {
        kept.keep();
        kept.restart();
      }
      if (kept.run().awaits_judgement())
        kept.run().judge(effective_samples(*scenario, kept.run().record(), [&](auto most, auto from) {
          return kept.draws().draws(most, from);
        }));
    }
    kept.keep();
    EXPECT_EQ(kept.run().ended_by(), "ess");
    EXPECT_GE(kept.run().record().counters.effective_samples, 40);
    if (!undisturbed) undisturbed = kept.weights();
    EXPECT_EQ(kept.weights(), *undisturbed) << disturbance;
  }
  EXPECT_GT(undisturbed->size(), 40u);
}

}  // namespace
}  // namespace retake
