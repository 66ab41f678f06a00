// Chains of throws are right: early rejection changes nothing, and what chains visit is what p_w p_c says, as
// draws of the prior foretell it. Paper, sections 4 and 5.2. Seeds are fixed.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/worlds/bowling/fixture.h"

namespace retake::tests {
namespace {

// --- Early rejection
// -------------------------------------------------------------------------------------------

bool same_stay(const Stay& left, const Stay& right) {
  return left.iteration == right.iteration && left.weight == right.weight &&
         left.is_sample == right.is_sample && identical(left.state, right.state) &&
         identical(left.score, right.score) && left.log_prior == right.log_prior;
}

void expect_early_rejection_changes_nothing(int iterations) {
  for (const auto& scenario : {strike(), leave_six_seven()})
    for (const Method method : {Method::metropolis, Method::rejection}) {
      const auto one = scenario->make_performer(), other = scenario->make_performer();
      ChainSettings settings{.seed = 281, .method = method};
      Chain early(scenario->target(Ratios::exact), settings);
      settings.early_rejection = false;
      Chain patient(scenario->target(Ratios::exact), settings);
      for (int i = 0; i < iterations; ++i) {
        ASSERT_EQ(early.step(*one), patient.step(*other)) << "iteration " << i;
        ASSERT_TRUE(same_stay(early.stay(), patient.stay())) << "iteration " << i;
      }
      EXPECT_EQ(early.counts().accepted, patient.counts().accepted);
      EXPECT_EQ(early.counts().samples, patient.counts().samples);
      EXPECT_LE(early.counts().simulated_seconds, patient.counts().simulated_seconds);
      if (method == Method::rejection) {
        EXPECT_LT(early.counts().simulated_seconds, patient.counts().simulated_seconds + 1e-9);
      } else {
        EXPECT_LT(early.counts().simulated_seconds, 0.99 * patient.counts().simulated_seconds);
      }
      std::printf("%s: %llu of %d accepted, %.0f of %.0f s stepped\n", std::string(to_string(method)).c_str(),
                  static_cast<unsigned long long>(early.counts().accepted), iterations,
                  early.counts().simulated_seconds, patient.counts().simulated_seconds);
    }
}
TEST(BowlingChain, EarlyRejectionChangesNothing) {
  expect_early_rejection_changes_nothing(100);
}
TEST(SlowBowlingChain, EarlyRejectionChangesNothing) {
  expect_early_rejection_changes_nothing(3000);
}

// --- A right start stays right
// -----------------------------------------------------------------------------------

/// Passes simulations on and remembers the first one: that of the State in which a chain begins.
class FirstSimulation final : public Simulator {
 public:
  explicit FirstSimulation(Simulator& simulator) : simulator_(simulator) {}
  SimulationOutcome simulate(const State& candidate, const SimulationRequest& request,
                             Score& score) override {
    const SimulationOutcome outcome = simulator_.simulate(candidate, request, score);
    if (!seen_) {
      seen_ = true;
      complete = outcome.end == SimulationEnd::complete;
      stay.state = candidate;
      stay.score = score;
    }
    return outcome;
  }
  Stay stay;
  bool complete = false;

 private:
  Simulator& simulator_;
  bool seen_ = false;
};

/// Draws of the prior, weighted by p_c, are distributed as p_w p_c; so are the same States after any number
/// of iterations, without any burn-in, if and only if chains leave p_w p_c as it is. Each chain starts at a
/// draw of the prior: its weight counts what it shows at the end against what it showed at the start. Draws
/// of small weight are thinned, which their weight makes up for.
void expect_chains_keep_the_target(const Scenario& scenario, double log_lambda, std::uint32_t chains,
                                   int iterations) {
  const auto performer = scenario.make_performer();
  const std::size_t short_index = measure_index(scenario, "short_of_wish");
  struct Pair {
    double weight;
    Stay first, last;
  };
  std::vector<Pair> pairs;
  RandomStream thinning = stream(286);
  for (std::uint32_t index = 0; index < chains; ++index) {
    Chain chain(scenario.target(Ratios::exact), {.seed = 287, .index = index});
    FirstSimulation simulator(*performer);
    chain.step(simulator);
    if (!simulator.complete) continue;
    const double weight = std::exp(-log_lambda * simulator.stay.score.measures[short_index]);
    const double kept = std::min(1.0, 20 * weight);
    if (!thinning.bernoulli(kept)) continue;
    for (int i = 1; i < iterations; ++i)
      chain.step(simulator);
    pairs.push_back({weight / kept, simulator.stay, chain.stay()});
  }
  const auto hit = [](const Stay& stay) { return stay.score.satisfied ? 1.0 : 0.0; };
  double hits = 0, whole = 0, hits_last = 0;
  for (const Pair& pair : pairs) {
    whole += pair.weight;
    hits += pair.weight * hit(pair.first);
    hits_last += pair.weight * hit(pair.last);
  }
  std::printf("%zu chains: share %.4f at the start, %.4f at the end\n", pairs.size(), hits / whole,
              hits_last / whole);
  // Of every quantity: its weighted mean over hits before and after.
  const auto z_of = [&](const auto& quantity) {
    std::vector<double> changes;
    for (const Pair& pair : pairs)
      changes.push_back(pair.weight * (quantity(pair.last) - quantity(pair.first)));
    return z_of_mean(changes, 0);
  };
  // Weights are uneven, so tails are heavier than Gauss'; |z| < 6 leaves room for them.
  const double share = z_of(hit);
  EXPECT_LT(std::abs(share), 6);
  std::printf("z: share %.2f;", share);
  for (Eigen::Index k = 0; k < 7; ++k) {
    double mean = 0, square = 0;
    for (const Pair& pair : pairs)
      mean += pair.weight * hit(pair.first) * pair.first.state[k] / hits;
    for (const Pair& pair : pairs)
      square += pair.weight * hit(pair.first) * std::pow(pair.first.state[k] - mean, 2) / hits;
    const double first = z_of([&](const Stay& stay) { return hit(stay) * (stay.state[k] - mean); });
    const double second =
        z_of([&](const Stay& stay) { return hit(stay) * (std::pow(stay.state[k] - mean, 2) - square); });
    std::printf(" %.2f %.2f", first, second);
    EXPECT_LT(std::abs(first), 6) << "mean of "
                                  << scenario.model().variables()[static_cast<std::size_t>(k)].name;
    EXPECT_LT(std::abs(second), 6) << "spread of "
                                   << scenario.model().variables()[static_cast<std::size_t>(k)].name;
  }
  std::printf("\n");
}

std::shared_ptr<const Scenario> spare_ten() {
  return bowling_scenario({{"rack", {10}}}, {10});
}

TEST(BowlingChain, StrikesKeepTheirDistribution) {
  expect_chains_keep_the_target(*strike(), 2.5, 600, 8);
}
TEST(BowlingChain, SparesKeepTheirDistribution) {
  expect_chains_keep_the_target(*spare_ten(), 5, 3000, 40);
}
TEST(SlowBowlingChain, StrikesKeepTheirDistribution) {
  expect_chains_keep_the_target(*strike(), 2.5, 10000, 15);
}
TEST(SlowBowlingChain, SparesKeepTheirDistribution) {
  expect_chains_keep_the_target(*spare_ten(), 5, 10000, 60);
}

// --- The share of the time at the wish
// -------------------------------------------------------------------------

struct Estimate {
  double value = 0, error = 0;
};

/// Of how many are short of the wish, draws of the prior tell everything about a chain's stay: it visits a
/// miss of m with a weight of lambda^-m.
Estimate foretell(const Scenario& scenario, double log_lambda, std::uint64_t seed, int count) {
  const auto performer = scenario.make_performer();
  const std::size_t short_index = measure_index(scenario, "short_of_wish");
  Score score;
  score.measures.resize(scenario.measures().size());
  std::vector<double> hits, weights;
  for (const State& state : draw_states(scenario.model(), seed, count)) {
    const bool complete = performer->simulate(state, {}, score).end == SimulationEnd::complete;
    const double weight = complete ? std::exp(-log_lambda * score.measures[short_index]) : 0;
    weights.push_back(weight);
    hits.push_back(complete && score.satisfied ? weight : 0);
  }
  // A ratio of means, with its error by the delta method.
  const double share = moments(hits).mean / moments(weights).mean;
  std::vector<double> residuals;
  for (std::size_t i = 0; i < hits.size(); ++i)
    residuals.push_back(hits[i] - share * weights[i]);
  const double found =
      static_cast<double>(std::count_if(hits.begin(), hits.end(), [](double h) { return h > 0; }));
  std::printf("prior: %.5f of %d are as wished\n", found / count, count);
  return {share, moments(residuals).standard_error() / moments(weights).mean};
}

/// The mean over independent chains of the share of iterations at the wish, its error by their spread.
Estimate walk(const Scenario& scenario, std::uint64_t seed, std::uint32_t chains, int burn_in,
              int iterations) {
  const auto performer = scenario.make_performer();
  std::vector<double> shares;
  for (std::uint32_t index = 0; index < chains; ++index) {
    Chain chain(scenario.target(Ratios::exact), {.seed = seed, .index = index});
    int satisfied = 0;
    for (int i = 0; i < burn_in + iterations; ++i) {
      chain.step(*performer);
      satisfied += i >= burn_in && chain.stay().score.satisfied;
    }
    shares.push_back(static_cast<double>(satisfied) / iterations);
  }
  return {moments(shares).mean, moments(shares).standard_error()};
}

/// The spread of a few dozen chains is known to a tenth or two, so the tail is Student's, not Gauss': |z| < 6
/// errs less than once in 10^5 with 30 chains.
void expect_share(const Scenario& scenario, double log_lambda, int draws, std::uint32_t chains, int burn_in,
                  int iterations, double widest) {
  const Estimate foretold = foretell(scenario, log_lambda, 282, draws);
  const Estimate walked = walk(scenario, 283, chains, burn_in, iterations);
  const double error = std::hypot(foretold.error, walked.error);
  std::printf("%s: foretold %.4f +- %.4f, walked %.4f +- %.4f\n",
              scenario.document().at("constraints").at(0).at("down").dump().c_str(), foretold.value,
              foretold.error, walked.value, walked.error);
  EXPECT_LT(error, widest) << "too few draws or chains to tell";
  EXPECT_LT(std::abs(foretold.value - walked.value) / error, 6);
}

TEST(SlowBowlingChain, StrikesAsOftenAsThePriorForetells) {
  expect_share(*strike(), 2.5, 20000, 30, 250, 800, 0.03);
}
TEST(SlowBowlingChain, SparesAsOftenAsThePriorForetells) {
  expect_share(*spare_ten(), 5, 20000, 60, 400, 2000, 0.02);
}
TEST(SlowBowlingChain, LeavesAsOftenAsThePriorForetells) {
  expect_share(*leave_six_seven(), 2.5, 20000, 24, 700, 1400, 0.25);
}

// --- What strikes look like
// ------------------------------------------------------------------------------------

/// Means of the release's variables and of the entry over each chain's samples, by how long it stayed there.
std::vector<std::vector<double>> strikes_of(const Scenario& scenario, Method method, std::uint64_t seed,
                                            std::uint32_t chains, int burn_in, int iterations) {
  const auto performer = scenario.make_performer();
  const std::size_t offset = measure_index(scenario, "entry_offset"),
                    speed = measure_index(scenario, "entry_speed");
  std::vector<std::vector<double>> means;
  for (std::uint32_t index = 0; index < chains; ++index) {
    Chain chain(scenario.target(Ratios::exact), {.seed = seed, .index = index, .method = method});
    std::vector<double> sums(9);
    double weight = 0;
    for (int i = 0; i < burn_in + iterations; ++i) {
      const bool moved = chain.step(*performer);
      const bool counts = method == Method::metropolis ? i >= burn_in : moved;
      const Stay& stay = chain.stay();
      if (!counts || !stay.score.satisfied) continue;
      ++weight;
      for (Eigen::Index k = 0; k < 7; ++k)
        sums[static_cast<std::size_t>(k)] += stay.state[k];
      // Either side of the head pin serves; how far from its middle is what matters.
      sums[7] += std::abs(stay.score.measures[offset]);
      sums[8] += stay.score.measures[speed];
    }
    if (weight == 0) continue;
    for (double& sum : sums)
      sum /= weight;
    means.push_back(sums);
  }
  return means;
}

/// Every variable's mean given a strike: the same by both methods. Chains are independent, so their means
/// tell the error; |z| < 6 with 30 chains errs less than once in 10^5 for each of nine.
void expect_methods_agree(std::uint32_t chains, int burn_in, int iterations, int draws) {
  const auto scenario = strike();
  const auto walked = strikes_of(*scenario, Method::metropolis, 284, chains, burn_in, iterations);
  const auto drawn = strikes_of(*scenario, Method::rejection, 285, chains, 0, draws);
  ASSERT_GE(walked.size(), 0.7 * chains);
  ASSERT_GE(drawn.size(), 0.7 * chains);
  const std::vector<const char*> names = {"radius", "density",        "place",
                                          "height", "velocity x",     "velocity z",
                                          "spin",   "|entry offset|", "entry speed"};
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::vector<double> left, right;
    for (const auto& means : walked)
      left.push_back(means[k]);
    for (const auto& means : drawn)
      right.push_back(means[k]);
    std::printf("%-14s metropolis %9.4f +- %.4f, rejection %9.4f +- %.4f\n", names[k], moments(left).mean,
                moments(left).standard_error(), moments(right).mean, moments(right).standard_error());
    EXPECT_LT(std::abs(z_of_means(left, right)), 6) << names[k];
  }
}
TEST(SlowBowlingChain, StrikesLookAlikeByBothMethods) {
  expect_methods_agree(30, 250, 800, 800);
}

}  // namespace
}  // namespace retake::tests
