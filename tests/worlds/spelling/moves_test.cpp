// The moves between complete words: chains of `conditional` say of p(A | satisfied) what rejection from the
// prior says, moves come back bit for bit, drops have the density that they are drawn by, words are found.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/sampler/two_modes.h"
#include "tests/worlds/fixture.h"
#include "worlds/spelling/drop_table.h"

namespace retake::tests {
namespace {

using spelling::DropCounts;
using spelling::DropTable;

/// Three bins by two, some of them designated.
std::shared_ptr<const Scenario> tiny(const std::vector<std::string>& rows, double interval) {
  return Scenario::read({{"world", "spelling"},
                         {"model", {{"columns", 3}, {"rows", 2}, {"interval", interval}}},
                         {"constraints", {{{"kind", "bins"}, {"rows", rows}}}}});
}

std::size_t index_of(const Scenario& scenario, const std::string& name) {
  const auto& measures = scenario.measures();
  const auto found =
      std::find_if(measures.begin(), measures.end(), [&](const Measure& m) { return m.name == name; });
  return static_cast<std::size_t>(found - measures.begin());
}

/// Fifteen numbers of a satisfied animation.
std::vector<double> marginals(const Scenario& scenario, const State& state, const Score& score, int balls) {
  const auto measure = [&](const std::string& name) { return score.measures[index_of(scenario, name)]; };
  const std::string last = std::to_string(balls);
  const Eigen::VectorXd offsets = state.tail(state.size() - 3 * balls) / 0.0001;
  const Eigen::Index x = 1, z = 2, last_x = 3 * (balls - 1) + 1, last_z = last_x + 1;
  return {measure("direct_balls"),
          measure("settling_time"),
          measure("bin_of_ball_1"),
          measure("bin_of_ball_" + last),
          measure("place_of_ball_1"),
          measure("bin_of_ball_1") * measure("direct_balls"),
          state[x],
          state[z],
          state[last_x],
          state[last_z],
          state[x] * state[x] + state[z] * state[z],
          (state.segment<2>(x) - state.segment<2>(last_x)).norm(),
          offsets.squaredNorm() / static_cast<double>(offsets.size()),
          offsets[offsets.size() / 2],
          offsets.segment<3>(3 * (offsets.size() / 6)).squaredNorm()};
}

/// How much is compared, and how far a marginal of 15 may be off.
struct Extent {
  std::size_t hits;  ///< of draws from the prior
  int chains;
  int iterations;  ///< of each, once it has burned in
  double largest_z;
  double largest_squares;
};
// With few chains z has heavy tails.
constexpr Extent kQuick{.hits = 120, .chains = 12, .iterations = 250, .largest_z = 6, .largest_squares = 60};
constexpr Extent kLong{
    .hits = 30'000, .chains = 120, .iterations = 6000, .largest_z = 4, .largest_squares = 45};

/// Compares 15 marginals of satisfied draws of the prior with those of independent chains.
void expect_exact(const std::vector<std::string>& rows, double interval, const Extent& extent) {
  const auto scenario = tiny(rows, interval);
  const auto performer = scenario->make_performer();
  const int balls = static_cast<int>(std::count(rows[0].begin(), rows[0].end(), '#') +
                                     std::count(rows[1].begin(), rows[1].end(), '#'));
  std::vector<std::vector<double>> plain, walked;
  // A complete word takes every ball, so that draws with all of them in play are enough.
  State state;
  Score score;
  score.measures.resize(scenario->measures().size());
  for (std::uint64_t i = 0; plain.size() < extent.hits; ++i) {
    RandomStream random({.seed = 31, .purpose = Purpose::proposal, .iteration = i});
    scenario->model().draw(random, state);
    for (Eigen::Index ball = 0; ball < balls; ++ball) {
      state[3 * ball] = 1;
      for (const Eigen::Index place : {3 * ball + 1, 3 * ball + 2})
        state[place] = scenario->model().variables()[static_cast<std::size_t>(place)].prior.draw(random);
    }
    const auto end = performer->simulate(state, {.needed = -1e-9}, score).end;
    if (end == SimulationEnd::complete && score.satisfied)
      plain.push_back(marginals(*scenario, state, score, balls));
  }
  for (int index = 0; index < extent.chains; ++index) {
    Chain chain(scenario->target(Ratios::exact),
                {.seed = 32, .index = static_cast<std::uint32_t>(index), .method = Method::conditional});
    while (chain.counts().iteration == 0 || chain.counts().is_learning)
      chain.step(*performer);
    std::vector<double> sums(15, 0);
    double noted = 0;
    StayGatherer gatherer;
    const auto add = [&](const Stay& stay) {
      const auto weight = static_cast<double>(stay.weight);
      noted += weight;
      const auto values = marginals(*scenario, stay.state, stay.score, balls);
      for (std::size_t m = 0; m < sums.size(); ++m)
        sums[m] += weight * values[m];
    };
    for (int i = 0; i < extent.iterations; ++i) {
      chain.step(*performer);
      gatherer.note(chain, add);
    }
    gatherer.finish(add);
    ASSERT_GT(noted, 0);
    for (double& sum : sums)
      sum /= noted;
    walked.push_back(sums);
  }
  double squares = 0;
  for (std::size_t m = 0; m < 15; ++m) {
    std::vector<double> left, right;
    for (const auto& values : plain)
      left.push_back(values[m]);
    for (const auto& values : walked)
      right.push_back(values[m]);
    const double z = z_of_means(left, right);
    squares += z * z;
    EXPECT_LT(std::abs(z), extent.largest_z) << "marginal " << m;
    std::printf("marginal %zu: %.4f by rejection, %.4f by chains, z %.2f\n", m, moments(left).mean,
                moments(right).mean, z);
  }
  std::printf("%zu hits, %d chains: sum of z^2 %.1f\n", plain.size(), extent.chains, squares);
  EXPECT_LT(squares, extent.largest_squares) << "15 of them, and not independent";
}

const std::vector<std::string> kTwoBins = {"#..", "..#"}, kThreeBins = {"#.#", ".#."};

TEST(SpellingMoves, AreExactOnTwoBins) {
  expect_exact(kTwoBins, 0.15, kQuick);
}
TEST(SpellingMoves, AreExactOnThreeBinsWhereBallsMeet) {
  expect_exact(kThreeBins, 0.05, kQuick);
}

TEST(SlowSpellingMoves, AreExactOnThreeBinsWhereBallsMeet) {
  expect_exact(kThreeBins, 0.05, kLong);
}
TEST(SlowSpellingMoves, AreExactOnThreeBins) {
  expect_exact(kThreeBins, 0.15, kLong);
}
TEST(SlowSpellingMoves, AreExactOnTwoBins) {
  expect_exact(kTwoBins, 0.15, kLong);
}
TEST(SlowSpellingMoves, AreExactOnTwoBinsWhereBallsMeet) {
  expect_exact(kTwoBins, 0.05, kLong);
}

TEST(SpellingMoves, AWordIsFoundAtOnce) {
  // The greedy start takes few tries a ball.
  for (const std::size_t which : {0u, 1u, 2u}) {
    const auto scenario = Scenario::read(find_world("spelling")->examples().at(which));
    const auto performer = scenario->make_performer();
    const auto balls = scenario->document().at("model").at("balls").get<std::uint64_t>();
    Chain chain(scenario->target(Ratios::exact), {.seed = 33, .method = Method::conditional});
    while (chain.counts().samples == 0 && chain.counts().iteration < 10 * balls)
      chain.step(*performer);
    ASSERT_EQ(chain.counts().samples, 1u) << which;
    EXPECT_TRUE(chain.stay().score.satisfied);
    EXPECT_EQ(chain.stay().weight, 0u) << "it has not burned in";
    const auto take = performer->perform(chain.stay().state);
    EXPECT_TRUE(take.complete && take.score.satisfied);
  }
}

TEST(SpellingMoves, AMoveTakenBackGivesTheSameBits) {
  // Simulated from the run of the other one, both ways.
  const auto scenario = Scenario::read(find_world("spelling")->examples().at(1));
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 35, .method = Method::conditional});
  while (chain.counts().samples == 0)
    chain.step(*performer);
  State current = chain.stay().state;
  Score score = chain.stay().score, candidate_score = score, score_again = score;
  auto run = performer->make_run(), candidate_run = performer->make_run(), run_again = performer->make_run();
  performer->simulate(current, {.record = run.get()}, score);
  int satisfied = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    RandomStream random({.seed = 36, .iteration = i});
    const ScoredKernelTable& kernels = scenario->target(Ratios::exact)->guide->kernels();
    State candidate = current;
    kernels.rows()[kernels.choose(random.uniform())].kernel->propose(
        scenario->model(), {current, score, run.get()}, candidate, random);
    if (scenario->model().log_prior(candidate) == -std::numeric_limits<double>::infinity()) continue;
    performer->simulate(candidate,
                        {.current_state = &current, .current_run = run.get(), .record = candidate_run.get()},
                        candidate_score);
    performer->simulate(
        current, {.current_state = &candidate, .current_run = candidate_run.get(), .record = run_again.get()},
        score_again);
    ASSERT_TRUE(identical(score, score_again)) << i;
    std::swap(run, run_again);
    if (!candidate_score.satisfied) continue;
    ++satisfied;
    std::swap(current, candidate);
    std::swap(score, candidate_score);
    std::swap(run, candidate_run);
  }
  EXPECT_GT(satisfied, 100);
}

// --- Drops ----------------------------------------------------------------------------------------

TEST(SpellingDrops, HaveTheDensityThatTheyAreDrawnBy) {
  const DropTable& table = DropTable::standard();
  RandomStream random({.seed = 34});
  constexpr int kDraws = 100'000;
  // Shares of rings about the bin's centre, by draws and by the density.
  constexpr double kRing = 0.005;
  std::vector<double> drawn(8, 0), expected(8, 0);
  for (int i = 0; i < kDraws; ++i)
    ++drawn[std::min<std::size_t>(7, static_cast<std::size_t>(table.draw(random).norm() / kRing))];
  constexpr int kFine = 16 * spelling::kTableSide;
  constexpr double kSide = spelling::kTableSide * spelling::kTableCell, kStep = kSide / kFine;
  double total = 0;
  for (int i = 0; i < kFine; ++i)
    for (int j = 0; j < kFine; ++j) {
      const Eigen::Vector2d place((i + 0.5) * kStep - kSide / 2, (j + 0.5) * kStep - kSide / 2);
      const double mass = table.density(place) * kStep * kStep;
      total += mass;
      expected[std::min<std::size_t>(7, static_cast<std::size_t>(place.norm() / kRing))] += kDraws * mass;
    }
  EXPECT_NEAR(total, 1, 1e-9);
  for (std::size_t ring = 0; ring < 8; ++ring)
    EXPECT_NEAR(drawn[ring], expected[ring], 6 * std::sqrt(expected[ring]) + 0.01 * expected[ring]) << ring;
  EXPECT_EQ(table.density({1, 0}), 0);
}

TEST(SpellingDrops, AreCountedAlikeFromEverySide) {
  const DropCounts counts = spelling::count_drops(40);
  std::uint64_t sum = 0;
  for (int row = 0; row < spelling::kTableSide; ++row)
    for (int column = 0; column < spelling::kTableSide; ++column) {
      const auto at = [&](int r, int c) {
        return counts[static_cast<std::size_t>(r * spelling::kTableSide + c)];
      };
      sum += at(row, column);
      EXPECT_EQ(at(row, column), at(column, row));
      EXPECT_EQ(at(row, column), at(spelling::kTableSide - 1 - row, column));
    }
  EXPECT_GT(sum, 200u) << "most of 320";
  EXPECT_LE(sum, 320u);
}

}  // namespace
}  // namespace retake::tests
