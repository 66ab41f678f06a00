// Trace: bounded, evenly spaced, and the same whether or not it went through the store.
#include "server/chains/trace.h"

#include <gtest/gtest.h>

#include "worlds/scenario.h"

namespace retake {
namespace {

struct Walk {
  std::shared_ptr<const Scenario> scenario =
      Scenario::read({{"world", "ball2d"}, {"constraints", {{{"kind", "rest_position"}, {"x", 1.0}}}}});
  std::unique_ptr<Scenario::Performer> performer = scenario->make_performer();
  Chain chain{scenario->target(Ratios::exact), {.seed = 5, .index = 0, .method = Method::metropolis}};

  void step_and_record(Trace& trace, int steps) {
    for (int i = 0; i < steps; ++i) {
      chain.step(*performer);
      trace.record(chain);
    }
  }
};

std::vector<std::uint64_t> iterations(const Trace& trace) {
  std::vector<std::uint64_t> all;
  for (std::size_t i = 0; i < trace.size(); ++i)
    all.push_back(trace.point(i).iteration);
  return all;
}

TEST(Trace, HoldsEveryIterationUntilItIsFull) {
  Walk walk;
  Trace trace(walk.scenario->measures());
  walk.step_and_record(trace, 100);
  ASSERT_EQ(trace.size(), 100u);
  EXPECT_EQ(trace.point(0).iteration, 1u);
  EXPECT_EQ(trace.point(99).iteration, 100u);
  EXPECT_EQ(trace.point(99).log_constraint, walk.chain.stay().score.log_constraint);
  EXPECT_EQ(trace.point(99).measures[0], walk.chain.stay().score.measures[0]);
}

TEST(Trace, StaysBoundedAndEvenlySpacedOverALongChain) {
  Walk walk;
  Trace trace(walk.scenario->measures());
  walk.step_and_record(trace, 50'000);
  EXPECT_LE(trace.size(), Trace::kMostPoints);
  EXPECT_GE(trace.size(), Trace::kMostPoints / 2);
  const std::vector<std::uint64_t> at = iterations(trace);
  const std::uint64_t stride = at[0];
  for (std::size_t i = 0; i < at.size(); ++i)
    EXPECT_EQ(at[i], (i + 1) * stride);
}

TEST(Trace, ComesBackFromItsBlocksAsItWasWhereverItWasCut) {
  Walk whole_walk;
  Trace whole(whole_walk.scenario->measures());
  whole_walk.step_and_record(whole, 9'000);

  Walk cut_walk;
  const std::vector<Measure>& measures = cut_walk.scenario->measures();
  auto trace = std::make_unique<Trace>(measures);
  std::vector<std::string> stored;
  for (const int steps : {1, 700, 2'000, 0, 3'000, 3'299}) {
    cut_walk.step_and_record(*trace, steps);
    Trace::Block block = trace->take_block();
    if (block.replace) stored.clear();
    if (!block.bytes.empty()) stored.push_back(std::move(block.bytes));
    trace = std::make_unique<Trace>(measures, stored);
  }
  ASSERT_EQ(iterations(*trace), iterations(whole));
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(trace->point(i).log_prior, whole.point(i).log_prior);
    EXPECT_EQ(trace->point(i).measures[1], whole.point(i).measures[1]);
  }
}

TEST(Trace, LeavesOutMembersOfLists) {
  Walk walk;
  std::vector<Measure> measures = walk.scenario->measures();
  ASSERT_EQ(measures.size(), 7u) << "x, five bounces, miss";
  measures[0].list = "some";
  Trace trace(measures);
  walk.step_and_record(trace, 5);
  Trace again(measures, {trace.take_block().bytes});
  ASSERT_EQ(again.size(), 5u);
  EXPECT_EQ(again.point(4).measures[0], walk.chain.stay().score.measures.back());
}

TEST(Trace, RefusesDamagedBlocks) {
  EXPECT_THROW(Trace(std::vector<Measure>(2), {std::string("short")}), std::runtime_error);
  Walk walk;
  Trace trace(std::vector<Measure>(2));
  walk.step_and_record(trace, 3);
  EXPECT_THROW(Trace(std::vector<Measure>(3), {trace.take_block().bytes}), std::runtime_error);
}

}  // namespace
}  // namespace retake
