// Pours: what is measured and shown agrees with what was simulated, whichever way it was simulated.
#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/worlds/fixture.h"
#include "worlds/spelling/pour.h"
#include "worlds/spelling/wish.h"

namespace retake::tests {
namespace {

using spelling::Box;
using spelling::Tessellation;

std::shared_ptr<const Scenario> hi(const json& more = json::object()) {
  json model = {{"columns", 7}, {"rows", 5}};
  model.update(more);
  return Scenario::read(
      {{"world", "spelling"}, {"model", model}, {"constraints", {{{"kind", "spell"}, {"text", "HI"}}}}});
}

double measure(const Scenario& scenario, const Score& score, const std::string& name) {
  for (std::size_t i = 0; i < scenario.measures().size(); ++i)
    if (scenario.measures()[i].name == name) return score.measures[i];
  ADD_FAILURE() << name;
  return kAbsent;
}

TEST(SpellingPour, MeasuresSayWhatTheAnimationShows) {
  const auto scenario = hi();
  const Box box(7, 5, Tessellation::two);
  const auto performer = scenario->make_performer();
  RandomStream random({.seed = 1});
  int complete = 0, in_bins = 0, on_others = 0;
  for (int i = 0; i < 20; ++i) {
    const State state = draw_state(scenario->model(), random);
    const auto take = performer->perform(state);
    if (!take.complete) continue;
    ++complete;
    const auto& tracks = take.animation.tracks;
    EXPECT_EQ(measure(*scenario, take.score, "active_balls"), static_cast<double>(tracks.size()));
    std::set<double> places;
    double direct = 0, last = 0;
    std::size_t track = 0;
    for (int ball = 0; ball < 10; ++ball) {
      const std::string number = std::to_string(ball + 1);
      const double bin = measure(*scenario, take.score, "bin_of_ball_" + number);
      const double place = measure(*scenario, take.score, "place_of_ball_" + number);
      if (state[3 * ball] != 1) {
        EXPECT_TRUE(std::isnan(bin) && std::isnan(place));
        continue;
      }
      const Track& shown = tracks[track];
      EXPECT_EQ(take.animation.bodies[track].name, "marble_" + number);
      EXPECT_EQ(take.animation.bodies[track].track, track);
      ++track;
      EXPECT_EQ(shown.start.position, Eigen::Vector3d(state[3 * ball + 1], 0.072, state[3 * ball + 2]));
      EXPECT_NEAR(shown.from, 0.15 * ball, 1e-12) << "whether or not those before it take part";
      const auto lies_in = box.bin_of(shown.rest.position);
      EXPECT_EQ(lies_in.has_value(), !std::isnan(bin));
      if (lies_in) {
        EXPECT_EQ(static_cast<double>(*lies_in), bin);
        EXPECT_TRUE(box.opening(*lies_in).contains(shown.rest.position.x(), shown.rest.position.z()));
        EXPECT_LT(shown.rest.position.y(), 0.012 + 0.002) << "below the rim";
        direct += box.opening(*lies_in).contains(shown.start.position.x(), shown.start.position.z());
      }
      (lies_in ? in_bins : on_others) += 1;
      EXPECT_TRUE(places.insert(place).second);
      ASSERT_TRUE(shown.settled);
      EXPECT_GT(*shown.settled, 0.15 * ball + 0.1);
      last = std::max(last, *shown.settled);
    }
    EXPECT_EQ(places.empty() ? 0 : *places.rbegin(), static_cast<double>(tracks.size()));
    // A drop over a partition counts with the nearest bin, so there may be more.
    EXPECT_GE(measure(*scenario, take.score, "direct_balls"), direct);
    EXPECT_EQ(measure(*scenario, take.score, "settling_time"), last);
    EXPECT_NEAR(take.animation.duration(), last, 1.0 / 60 + 1e-9);
  }
  EXPECT_GT(complete, 15);
  EXPECT_GT(in_bins, 50);
  EXPECT_LT(on_others, in_bins / 5);
}

TEST(SpellingPour, TheSlotOfABallDoesNotDependOnTheOthers) {
  const auto scenario = hi();
  const auto performer = scenario->make_performer();
  RandomStream random({.seed = 2});
  State state = draw_state(scenario->model(), random);
  for (int ball : {0, 4, 9})
    state.segment<3>(3 * ball) = Eigen::Vector3d(1, 0.01 * ball, 0);
  const auto all = performer->perform(state).animation;
  // What comes later leaves what is earlier as it was, to the frame.
  State fewer = state;
  for (int ball = 4; ball < 10; ++ball)
    fewer.segment<3>(3 * ball) = Eigen::Vector3d(0, kAbsent, kAbsent);
  const auto some = performer->perform(fewer).animation;
  ASSERT_LT(some.tracks.size(), all.tracks.size());
  constexpr Eigen::Index kFrames = 36;  // until ball 5 is dropped, 0.6 s
  for (std::size_t track = 0; track < some.tracks.size(); ++track)
    EXPECT_EQ(some.tracks[track].positions.leftCols(kFrames), all.tracks[track].positions.leftCols(kFrames));
  const Track& later = all.tracks[some.tracks.size()];
  EXPECT_NEAR(later.from, 0.6, 1e-12);
  EXPECT_EQ(later.positions.col(kFrames), later.start.position) << "it is let go";
  EXPECT_LT(later.positions(1, kFrames + 6), 0.072 - 0.04) << "it falls";
}

/// Steps two chains of one seed side by side and expects them to stay equal.
void expect_equal_chains(const Scenario& scenario, const ChainSettings& a, const ChainSettings& b,
                         Simulator& for_a, Simulator& for_b, int steps) {
  Chain first(scenario.target(Ratios::exact), a), second(scenario.target(Ratios::exact), b);
  for (int i = 0; i < steps; ++i) {
    first.step(for_a);
    second.step(for_b);
  }
  EXPECT_EQ(first.counts().accepted, second.counts().accepted);
  EXPECT_GT(first.counts().accepted, static_cast<std::uint64_t>(steps / 5));
  EXPECT_TRUE(identical(first.stay().state, second.stay().state));
  EXPECT_TRUE(identical(first.stay().score, second.stay().score));
}

/// A simulator that never resumes.
class FromScratch final : public Simulator {
 public:
  explicit FromScratch(Simulator& simulator) : simulator_(simulator) {}
  SimulationOutcome simulate(const State& candidate, const SimulationRequest& request,
                             Score& score) override {
    return simulator_.simulate(candidate, {.needed = request.needed}, score);
  }

 private:
  Simulator& simulator_;
};

TEST(SpellingPour, AChainIsTheSameWhetherItResumesOrNot) {
  for (const json& model : {json::object(), json({{"interval", 0.02}}), json({{"tessellation", 4}})}) {
    const auto scenario = hi(model);
    const auto one = scenario->make_performer(), other = scenario->make_performer();
    FromScratch scratch(*other);
    for (const Method method : {Method::metropolis, Method::conditional}) {
      const ChainSettings settings{.seed = 3, .method = method};
      expect_equal_chains(*scenario, settings, settings, *one, scratch, 120);
    }
  }
}

TEST(SpellingPour, AChainIsTheSameWhetherItRejectsEarlyOrNot) {
  const auto scenario = hi();
  const auto one = scenario->make_performer(), other = scenario->make_performer();
  for (const Method method : {Method::metropolis, Method::conditional})
    expect_equal_chains(*scenario, {.seed = 4, .method = method},
                        {.seed = 4, .method = method, .early_rejection = false}, *one, *other, 400);
}

TEST(SpellingPour, ResumingAndStoppingEarlySaveMostOfTheSimulation) {
  const auto scenario = hi();
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 5});
  for (int i = 0; i < 400; ++i)
    chain.step(*performer);
  const ChainCounts& counts = chain.counts();
  EXPECT_GT(counts.skipped_seconds, counts.simulated_seconds);
}

TEST(SpellingPour, ATooSmallPourIsNotSimulatedAtAll) {
  const auto scenario = hi();
  const auto performer = scenario->make_performer();
  RandomStream random({.seed = 6});
  State state = draw_state(scenario->model(), random);
  for (int ball = 3; ball < 10; ++ball)
    state.segment<3>(3 * ball) = Eigen::Vector3d(0, kAbsent, kAbsent);
  Score score;
  score.measures.resize(scenario->measures().size());
  // Three balls fill at most three of ten bins: log p_c is at most -35.
  const auto outcome = performer->simulate(state, {.needed = -35}, score);
  EXPECT_EQ(outcome.end, SimulationEnd::stopped);
  EXPECT_EQ(outcome.simulated_seconds, 0);
  EXPECT_NE(performer->simulate(state, {.needed = -50.5}, score).end, SimulationEnd::stopped);
}

TEST(SpellingPour, AnEmptyBoxIsAnAnimationToo) {
  const auto scenario = hi();
  const auto performer = scenario->make_performer();
  RandomStream random({.seed = 7});
  State state = draw_state(scenario->model(), random);
  for (int ball = 0; ball < 10; ++ball)
    state.segment<3>(3 * ball) = Eigen::Vector3d(0, kAbsent, kAbsent);
  const auto take = performer->perform(state);
  ASSERT_TRUE(take.complete);
  EXPECT_EQ(take.score.log_constraint, -50);
  EXPECT_GE(take.animation.frames, 1u);
  EXPECT_TRUE(take.animation.tracks.empty());
}

TEST(SpellingPour, TheBoxIsShownWithThisPoursOffsets) {
  const auto scenario = hi();
  const auto performer = scenario->make_performer();
  RandomStream random({.seed = 8});
  const auto partitions = [&](const State& state) {
    for (const Body& body : performer->perform(state).animation.bodies)
      if (body.name == "partitions") return std::get<Mesh>(body.shape).positions;
    return std::vector<double>{};
  };
  State state = draw_state(scenario->model(), random);
  const auto before = partitions(state);
  state[state.size() - 3 * 48 + 1] += 0.0003;  // up, of a crossing in the middle
  const auto after = partitions(state);
  ASSERT_FALSE(before.empty());
  ASSERT_EQ(before.size(), after.size());
  int moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] == after[i]) continue;
    ++moved;
    EXPECT_EQ(i % 3, 1u);
    EXPECT_NEAR(after[i] - before[i], 0.0003, 1e-12);
  }
  EXPECT_GT(moved, 0);
}

// --- Long words and large boxes ---------------------------------------------------------------------

TEST(SpellingPour, ALongWordIsReadAndPoured) {
  const auto scenario = Scenario::read({{"world", "spelling"},
                                        {"model", {{"columns", 40}, {"rows", 7}}},
                                        {"constraints", {{{"kind", "spell"}, {"text", "HOMEMADE"}}}}});
  const auto performer = scenario->make_performer();
  RandomStream random({.seed = 9});
  const auto take = performer->perform(draw_state(scenario->model(), random));
  ASSERT_TRUE(take.complete);
  EXPECT_EQ(measure(*scenario, take.score, "filled_bins") * 9.25 - 85 * 9.25, take.score.log_constraint);
  EXPECT_GT(measure(*scenario, take.score, "filled_bins"), 5);
  EXPECT_GT(measure(*scenario, take.score, "stray_balls"), 5);
}

TEST(SpellingPour, TheLargestAndTheSmallestBoxArePoured) {
  for (const auto& [columns, rows] : {std::pair(40, 12), std::pair(1, 1), std::pair(1, 12)}) {
    const auto scenario = Scenario::read({{"world", "spelling"},
                                          {"model", {{"columns", columns}, {"rows", rows}, {"balls", 1}}},
                                          {"constraints", json::array()}});
    const auto performer = scenario->make_performer();
    RandomStream random({.seed = 10});
    EXPECT_TRUE(performer->perform(draw_state(scenario->model(), random)).complete) << columns;
  }
}

}  // namespace
}  // namespace retake::tests
