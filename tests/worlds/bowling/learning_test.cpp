// What chains learn of throws: the coordinate that matters, odds that agree with plain counting, strikes that
// look like plain ones.
#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/worlds/bowling/fixture.h"

namespace retake::tests {
namespace {

std::shared_ptr<const Scenario> spare_six_seven() {
  return bowling_scenario({{"rack", {6, 7}}}, {6, 7});
}

TEST(BowlingLearning, ThePlaceIsLearnedAsWhereTheBallCrossesTheFirstPin) {
  const auto scenario = spare_six_seven();
  const auto target = scenario->target(Ratios::exact);
  ASSERT_EQ(target->learned.size(), 7u);
  const Coordinate& aim = target->learned.back();
  EXPECT_EQ(target->model->variables()[aim.variable].name, "ball_z");
  const double front = bowling::pin_spot(6).x();
  int compared = 0;
  for (State state : draw_states(*target->model, 501, 400)) {
    if (!target->model->in_support(state)) continue;
    const bowling::ReleaseModel releases(bowling::ReleaseStyle::paper, {6, 7});
    const bowling::Release release = releases.read(state);
    const bowling::Roll roll(release.ball, release.motion,
                             {.before = 0.12, .beyond = 0.12, .change = bowling::kFoulLine});
    const auto place = static_cast<Eigen::Index>(aim.variable);
    const double shift = aim.shift(state);
    if (roll.time_at(front) < roll.gutter_time()) {
      ++compared;
      // A ball that starts in the middle may leave the lane where this one does not, and is drawn out
      // straight.
      if (std::abs(shift) < 0.5) {
        EXPECT_NEAR(state[place] + shift, roll.at(roll.time_at(front)).position.z(), 1e-9);
      }
    }
    state[place] = 0.1;
    EXPECT_EQ(aim.shift(state), shift) << "it must not read the place itself";
  }
  EXPECT_GT(compared, 100);
}

TEST(BowlingLearning, EveryPhaseIsTheSameBitForBitWithEarlyRejectionOff) {
  // The wish is common, so that a short chain learns and samples. A pin that must stand gives bounds.
  const auto scenario = bowling_scenario({{"rack", {7, 10}}}, {7});
  const auto performer = scenario->make_performer();
  for (const Method method : {Method::conditional, Method::tempering}) {
    const ChainSettings settings{
        .seed = 502, .method = method, .learning = {.hits = 8, .plain_hits = 2, .plain_draws = 0}};
    ChainSettings patient = settings;
    patient.early_rejection = false;
    Chain early(scenario->target(Ratios::exact), settings), late(scenario->target(Ratios::exact), patient);
    bool sampled = false;
    for (int i = 0; i < 700; ++i) {
      ASSERT_EQ(early.step(*performer), late.step(*performer)) << i;
      ASSERT_EQ(early.walker(), late.walker());
      ASSERT_EQ(early.stay().state, late.stay().state) << i;
      ASSERT_EQ(early.stay().weight, late.stay().weight);
      ASSERT_EQ(early.counts().is_learning, late.counts().is_learning);
      ASSERT_EQ(early.counts().odds.sum, late.counts().odds.sum);
      ASSERT_EQ(early.counts().samples, late.counts().samples);
      sampled |= !early.counts().is_learning;
    }
    EXPECT_GT(early.counts().samples, 5u);
    EXPECT_LT(early.counts().simulated_seconds, late.counts().simulated_seconds);
    if (method == Method::conditional) {
      EXPECT_TRUE(sampled);
    }
  }
}

TEST(BowlingLearning, TheFirstFindIsAPlainThrow) {
  // So it never comes later than those, and it counts if it comes before anything can have been learned.
  const auto scenario = strike();
  const auto performer = scenario->make_performer();
  int counted = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Chain chain(scenario->target(Ratios::exact), {.seed = seed, .method = Method::conditional});
    while (chain.counts().samples == 0)
      chain.step(*performer);
    EXPECT_EQ(chain.counts().kernels.at(0).name, "prior");
    EXPECT_EQ(chain.counts().kernels[0].proposed, chain.counts().iteration);
    EXPECT_TRUE(chain.counts().is_learning);
    EXPECT_EQ(chain.stay().weight, chain.counts().iteration <= 64 ? 1u : 0u);
    counted += chain.stay().weight > 0;
  }
  EXPECT_GT(counted, 0);
}

// --- Odds -------------------------------------------------------------------------------------------

/// Learned odds against counting plain draws, and how often a seed's 95 % interval holds what both say
/// together.
void expect_odds_agree(const Scenario& scenario, std::uint64_t plain_draws, std::uint64_t learning_draws,
                       std::uint64_t learned_draws) {
  const auto performer = scenario.make_performer();
  Chain plain(scenario.target(Ratios::exact), {.seed = 503, .method = Method::rejection});
  while (plain.counts().odds.draws < plain_draws)
    plain.step(*performer);
  const OddsTally& counted = plain.counts().odds;
  const double rejection = counted.sum / static_cast<double>(counted.draws);
  const double rejection_error = std::sqrt(counted.squares) / static_cast<double>(counted.draws);

  std::vector<double> estimates;
  std::vector<Odds> intervals;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Chain chain(scenario.target(Ratios::exact),
                {.seed = 503 + seed, .method = Method::conditional, .learning = {.draws = learning_draws}});
    while (chain.counts().is_learning || chain.counts().odds.draws < learned_draws)
      chain.step(*performer);
    ASSERT_EQ(chain.counts().odds.basis, OddsBasis::learned);
    intervals.push_back(*odds(chain.counts().odds));
    estimates.push_back(intervals.back().probability);
  }
  const double learned = moments(estimates).mean, learned_error = moments(estimates).standard_error();
  // Both together, by their precision.
  const double share = 1 / (1 + std::pow(learned_error / rejection_error, 2));
  const double truth = share * learned + (1 - share) * rejection;
  int held = 0;
  for (const Odds& interval : intervals)
    held += interval.low <= truth && truth <= interval.high ? 1 : 0;
  std::printf(
      "plain %.3g +- %.2g, learned %.3g +- %.2g (a seed: %.0f %%), intervals that hold it: %d of 20\n",
      rejection, rejection_error, learned, learned_error, 100 * std::sqrt(20.0) * learned_error / learned,
      held);
  // Plain hits are Poisson and the spread of 20 seeds has Student's tail: |z| < 5 errs less than once in
  // 10^4.
  EXPECT_LT(std::abs(learned - rejection) / std::hypot(learned_error, rejection_error), 5);
  // Intervals of 95 % miss four of 20 once in 60 runs, so the seeds are fixed.
  EXPECT_GE(held, 17);
}

TEST(SlowBowlingLearning, LearnedOddsOfStrikesAreThoseOfPlainThrows) {
  expect_odds_agree(*strike(), 20000, 1500, 1200);
}
TEST(SlowBowlingLearning, LearnedOddsOfSparesAreThoseOfPlainThrows) {
  expect_odds_agree(*spare_six_seven(), 600000, 60000, 20000);
}
TEST(SlowBowlingLearning, LearnedOddsOfLeavesAreThoseOfPlainThrows) {
  expect_odds_agree(*leave_six_seven(), 120000, 25000, 6000);
}

// --- Strikes ----------------------------------------------------------------------------------------

/// Means of the ball's variables over each chain's strikes, as often as it stayed there.
std::vector<std::vector<double>> strikes_of(const Scenario& scenario, Method method, std::uint32_t chains,
                                            std::uint64_t samples) {
  const auto performer = scenario.make_performer();
  std::vector<std::vector<double>> means;
  for (std::uint32_t index = 0; index < chains; ++index) {
    Chain chain(scenario.target(Ratios::exact),
                {.seed = 504, .index = index, .method = method, .learning = {.hits = 60}});
    std::vector<double> sums(8);
    double weight = 0;
    std::vector<Stay> last(1);
    const auto take = [&](const Stay& stay) {
      if (!stay.is_sample || stay.weight == 0) return;
      const double count = static_cast<double>(stay.weight);
      weight += count;
      for (Eigen::Index k = 0; k < 7; ++k)
        sums[static_cast<std::size_t>(k)] += count * stay.state[k];
      sums[7] += count * std::abs(stay.state[2]);
    };
    std::uint64_t found = 0;
    while (found < samples) {
      const bool moved = chain.step(*performer);
      if (chain.counts().is_learning) continue;
      last.resize(chain.walkers());
      Stay& before = last[chain.walker()];
      if (moved) {
        take(before);
        found += before.is_sample && before.weight > 0 ? 1 : 0;
      }
      before = chain.stay();
    }
    for (double& sum : sums)
      sum /= weight;
    means.push_back(sums);
  }
  return means;
}

TEST(SlowBowlingLearning, StrikesOfEveryMethodAreThrownAlike) {
  const auto scenario = strike();
  const auto plain = strikes_of(*scenario, Method::rejection, 30, 25);
  for (const Method method : {Method::conditional, Method::tempering}) {
    const auto found = strikes_of(*scenario, method, 30, 60);
    for (std::size_t k = 0; k < 8; ++k) {
      std::vector<double> left, right;
      for (const auto& means : found)
        left.push_back(means[k]);
      for (const auto& means : plain)
        right.push_back(means[k]);
      std::printf("%s, variable %zu: %9.4f +- %.4f, rejection %9.4f +- %.4f\n",
                  std::string(to_string(method)).c_str(), k, moments(left).mean,
                  moments(left).standard_error(), moments(right).mean, moments(right).standard_error());
      // 30 chains a side: |z| < 6 errs less than once in 10^5 for each of 16.
      EXPECT_LT(std::abs(z_of_means(left, right)), 6) << to_string(method) << " " << k;
    }
  }
}

}  // namespace
}  // namespace retake::tests
