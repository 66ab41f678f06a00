// Chain: the right distribution, by both methods, and the bookkeeping around it. checkpoint_test.cpp has the
// rest. Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include "sampler/chain.h"

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/diagnostics.h"
#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

/// A prior N(0, 1) for each of two Variables, and a mark that their sum shall be near.
struct GaussianToy {
  static constexpr double kMark = 2, kSoftness = 0.5;
  std::shared_ptr<const Model> model = gaussian_model(2);
  std::shared_ptr<const Target> target = target_of(
      model, {{"perturb", 4,
               std::make_shared<const Perturb>(std::vector<Perturb::Group>{
                   {.variables = {0}, .size = 0.8, .probability = 0.7},
                   {.variables = {1}, .shape = Perturb::Shape::uniform, .size = 1, .probability = 0.7}})},
              {"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact))}});
  static double log_constraint(const State& state) {
    return -0.5 * std::pow((state[0] + state[1] - kMark) / kSoftness, 2);
  }
  // The sum has prior N(0, 2); each Variable given the sum is half of it, with variance 1/2.
  static constexpr double kSumVariance = 1 / (1 / 2.0 + 1 / (kSoftness * kSoftness));
  static constexpr double kMean = 0.5 * kSumVariance * kMark / (kSoftness * kSoftness);
  static constexpr double kVariance = 0.5 + 0.25 * kSumVariance;
};

void expect_posterior(const std::vector<Eigen::MatrixXd>& quantities) {
  // x, y, (x - mean)^2, (y - mean)^2, one column a chain.
  const double expected[] = {GaussianToy::kMean, GaussianToy::kMean, GaussianToy::kVariance,
                             GaussianToy::kVariance};
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const QuantityDiagnostics of = diagnose(chains_of(quantities[i]));
    const double error = of.sd / std::sqrt(ess_mean(chains_of(quantities[i])));
    EXPECT_LT(error, 0.02) << "too few draws to tell";
    EXPECT_LT(std::abs(of.mean - expected[i]) / error, kLargestZ)
        << i << ": " << of.mean << " not " << expected[i];
  }
}

TEST(Chain, ReachesThePosteriorByBothMethods) {
  constexpr Eigen::Index kChains = 4, kDraws = 20000;
  const GaussianToy toy;
  for (const Method method : {Method::metropolis, Method::rejection}) {
    std::vector<Eigen::MatrixXd> quantities(4, Eigen::MatrixXd(kDraws, kChains));
    for (Eigen::Index index = 0; index < kChains; ++index) {
      Chain chain(toy.target, {.seed = 101, .index = static_cast<std::uint32_t>(index), .method = method});
      ToySimulator simulator(GaussianToy::log_constraint);
      for (int i = 0; i < 1000; ++i)
        chain.step(simulator);
      for (Eigen::Index draw = 0; draw < kDraws; ++draw) {
        for (int i = 0; i < 4; ++i)
          chain.step(simulator);
        if (method == Method::rejection)
          while (!chain.step(simulator))
            continue;
        for (Eigen::Index i = 0; i < 2; ++i) {
          const double value = chain.stay().state[i];
          quantities[static_cast<std::size_t>(i)](draw, index) = value;
          quantities[static_cast<std::size_t>(i + 2)](draw, index) = std::pow(value - GaussianToy::kMean, 2);
        }
      }
    }
    expect_posterior(quantities);
  }
}

TEST(Chain, RejectionKeepsDrawsWithTheProbabilityOfTheConstraint) {
  const GaussianToy toy;
  Chain chain(toy.target, {.seed = 102, .method = Method::rejection});
  ToySimulator simulator(GaussianToy::log_constraint);
  for (int i = 0; i < 100000; ++i)
    chain.step(simulator);
  // E exp(log_constraint), with the sum N(0, 2).
  const double variance = 2 + GaussianToy::kSoftness * GaussianToy::kSoftness;
  const double expected = GaussianToy::kSoftness / std::sqrt(variance) *
                          std::exp(-0.5 * GaussianToy::kMark * GaussianToy::kMark / variance);
  EXPECT_LT(std::abs(z_of_share(static_cast<double>(chain.counts().accepted), 1e5, expected)), kLargestZ);
  EXPECT_EQ(chain.stay().weight, 1u);
}

// --- Early rejection -----------------------------------------------------------------------------

/// A target with all that could go wrong: switches, failures, walls of -infinity, plateaus at 0.
double awkward_constraint(const State& state) {
  if (state[5] > 0.9) return kFails;
  if (state[6] > 1) return -kInfinity;
  return state[3] == 1 ? 0 : -std::abs(sum_of_present(state));
}

TEST(Chain, EarlyRejectionChangesNothingButTheWork) {
  const auto model = rich_model();
  const auto target = target_of(model, rich_kernels(*model, Ratios::exact));
  for (const Method method : {Method::metropolis, Method::rejection}) {
    Chain on(target, {.seed = 103, .method = method, .early_rejection = true});
    Chain off(target, {.seed = 103, .method = method, .early_rejection = false});
    ToySimulator simulator_on(awkward_constraint), simulator_off(awkward_constraint);
    for (int i = 0; i < 50000; ++i) {
      ASSERT_EQ(on.step(simulator_on), off.step(simulator_off)) << i;
      const Stay &a = on.stay(), &b = off.stay();
      ASSERT_EQ(std::memcmp(a.state.data(), b.state.data(), sizeof(double) * model->size()), 0) << i;
      ASSERT_EQ(a.iteration, b.iteration);
      ASSERT_EQ(a.weight, b.weight);
      ASSERT_EQ(a.is_sample, b.is_sample);
      ASSERT_EQ(a.log_prior, b.log_prior);
      if (a.iteration > 0) {
        ASSERT_EQ(a.score.log_constraint, b.score.log_constraint);
        ASSERT_EQ(a.score.measures, b.score.measures);
      }
    }
    const ChainCounts &a = on.counts(), &b = off.counts();
    EXPECT_EQ(a.accepted, b.accepted);
    EXPECT_EQ(a.samples, b.samples);
    EXPECT_GT(a.accepted, 1000u);
    for (std::size_t row = 0; row < a.kernels.size(); ++row) {
      EXPECT_EQ(a.kernels[row].proposed, b.kernels[row].proposed);
      EXPECT_EQ(a.kernels[row].accepted, b.kernels[row].accepted);
    }
    EXPECT_LT(a.simulated_seconds, 0.95 * b.simulated_seconds);
    EXPECT_LE(a.simulations, b.simulations);
    EXPECT_EQ(a.simulations == b.simulations, method == Method::rejection);
    EXPECT_EQ(a.simulations, simulator_on.simulations);
  }
}

TEST(Chain, CandidatesOfAPerfectConstraintAreAllAccepted) {
  // An off-by-epsilon in early rejection would discard exactly these hits: log_constraint 0, needed just
  // below.
  const auto model = gaussian_model(1);
  const auto target =
      target_of(model, {{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact))}});
  Chain chain(target, {.seed = 104});
  ToySimulator simulator(constant);
  for (int i = 0; i < 20000; ++i)
    ASSERT_TRUE(chain.step(simulator)) << i;
}

/// The log_constraint that the candidate of the first iteration would have to exceed, and its outcome when it
/// has exactly `excess` more than that.
bool accepts_with_excess(Method method, bool early_rejection, double excess) {
  const auto model = gaussian_model(1);
  const auto target =
      target_of(model, {{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact))}});
  // The first pass finds the number out, the second answers with it.
  double needed = 0;
  for (const bool answers : {false, true}) {
    Chain chain(target, {.seed = 105, .method = method, .early_rejection = answers ? early_rejection : true});
    double answer = -3;
    ToySimulator simulator([&](const State&) { return answer; });
    simulator.observe = [&](const State&, const SimulationRequest& request) {
      if (chain.counts().iteration == 0) return;
      if (!answers) needed = request.needed;
      if (answers) answer = needed + excess;
    };
    const bool moved = chain.step(simulator);
    if (answers) return moved;
  }
  return false;
}

TEST(Chain, ACandidateMustExceedWhatIsNeededStrictly) {
  for (const Method method : {Method::metropolis, Method::rejection})
    for (const bool early_rejection : {true, false}) {
      EXPECT_FALSE(accepts_with_excess(method, early_rejection, -1e-9));
      EXPECT_FALSE(accepts_with_excess(method, early_rejection, 0)) << "exactly what is needed";
      EXPECT_TRUE(accepts_with_excess(method, early_rejection, 1e-9));
    }
}

// --- Failures, impossible places, nothing to do ------------------------------------------------------

TEST(Chain, FailedSimulationsAreRejectedAndCounted) {
  // The upper half of a unit interval fails: what remains is uniform on the lower half.
  const auto model = std::make_shared<const Model>(
      std::vector<Variable>{{.name = "x", .unit = "", .prior = Distribution::uniform(0, 1)}});
  const auto target =
      target_of(model, {{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact))}});
  for (const Method method : {Method::metropolis, Method::rejection}) {
    Chain chain(target, {.seed = 106, .method = method});
    std::uint64_t failures = 0;
    ToySimulator simulator([&](const State& state) { return state[0] > 0.5 ? (++failures, kFails) : 0.0; });
    std::vector<double> kept;
    for (int i = 0; i < 20000; ++i)
      if (chain.step(simulator)) kept.push_back(chain.stay().state[0]);
    EXPECT_EQ(chain.counts().failed_simulations, failures);
    EXPECT_EQ(chain.counts().simulations, simulator.simulations);
    EXPECT_LT(std::abs(z_of_share(static_cast<double>(kept.size()), 20000, 0.5)), kLargestZ);
    EXPECT_GT(kolmogorov_smirnov_p(kept, [](double x) { return std::min(1.0, 2 * x); }), kErrorRate);
  }
}

TEST(Chain, SurvivesAnInitialStateThatFailsOrIsImpossible) {
  const GaussianToy toy;
  for (const double first : {kFails, -kInfinity}) {
    Chain chain(toy.target, {.seed = 107});
    bool is_first = true;
    ToySimulator simulator([&](const State& state) {
      return std::exchange(is_first, false) ? first : GaussianToy::log_constraint(state);
    });
    simulator.observe = [&](const State&, const SimulationRequest& request) {
      EXPECT_EQ(request.needed, -kInfinity) << "whatever follows it is better";
    };
    int steps = 1;
    while (!chain.step(simulator))
      ASSERT_LT(++steps, 10);
    EXPECT_TRUE(std::isfinite(chain.stay().score.log_constraint));
    EXPECT_EQ(chain.counts().failed_simulations, std::isnan(first) ? 1u : 0u);
  }
}

TEST(Chain, SaysSoWhenThePriorNeverLiesWithinItsSupport) {
  const auto nowhere = std::make_shared<const Model>(
      std::vector<Variable>{{.name = "x", .unit = "", .prior = Distribution::uniform(0, 1)}},
      [](const State&) { return false; });
  const auto target = target_of(
      nowhere, {{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*nowhere, Ratios::exact))}});
  Chain chain(target, {.seed = 112});
  ToySimulator simulator(constant);
  EXPECT_THROW(chain.step(simulator), std::runtime_error);
}

TEST(Chain, TheInitialStateIsNeverASample) {
  const GaussianToy toy;
  Chain chain(toy.target, {.seed = 108});
  ToySimulator simulator([&](const State&) { return chain.counts().iteration == 0 ? 0.0 : -kInfinity; });
  for (int i = 0; i < 100; ++i)
    EXPECT_FALSE(chain.step(simulator) && chain.stay().is_sample);
  EXPECT_FALSE(chain.stay().is_sample);
  EXPECT_EQ(chain.stay().iteration, 0u);
  EXPECT_EQ(chain.counts().samples, 0u);
}

TEST(Chain, WeightsOfAllStaysAddUpToTheIterations) {
  // The initial State is stayed at from iteration 0 on, so n iterations share a weight of n + 1.
  const GaussianToy toy;
  Chain chain(toy.target, {.seed = 109});
  ToySimulator simulator(GaussianToy::log_constraint);
  simulator.satisfied_above = -0.5;
  std::uint64_t sum = 0, moves = 0, samples = 0;
  Stay before;
  for (std::uint64_t iteration = 1; iteration <= 20000; ++iteration) {
    if (chain.step(simulator)) {
      sum += before.weight;
      ++moves;
      samples += chain.stay().is_sample;
      ASSERT_EQ(chain.stay().iteration, iteration);
      ASSERT_EQ(chain.stay().weight, 1u);
      ASSERT_EQ(chain.stay().is_sample, chain.stay().score.log_constraint > -0.5);
    }
    ASSERT_EQ(chain.stay().iteration + chain.stay().weight, iteration + 1);
    before = chain.stay();
  }
  EXPECT_EQ(sum + chain.stay().weight, 20000u + 1);
  EXPECT_EQ(chain.counts().samples, samples);
  EXPECT_GE(chain.counts().accepted, moves);
  EXPECT_GT(samples, 500u);
}

TEST(Chain, ACandidateEqualToTheCurrentStateCostsNoSimulation) {
  const auto model = gaussian_model(1);
  const auto rarely = std::make_shared<const Perturb>(
      std::vector<Perturb::Group>{{.variables = {0}, .size = 0.1, .probability = 0.1}});
  Chain chain(target_of(model, {{"perturb", 1, rarely}}), {.seed = 110});
  ToySimulator simulator(constant);
  // Candidates differ with probability 0.1, and a few of those are hopeless; the others count as accepted.
  for (int i = 0; i < 20000; ++i)
    chain.step(simulator);
  EXPECT_LT(simulator.simulations, 2200u);
  EXPECT_GT(simulator.simulations, 1600u);
  EXPECT_GE(chain.counts().accepted, 20000 - 2200u);
}

TEST(Chain, TheStayHasThePriorAndScoreOfItsState) {
  const auto model = rich_model();
  Chain chain(target_of(model, rich_kernels(*model, Ratios::exact)), {.seed = 111});
  ToySimulator simulator(awkward_constraint);
  for (int i = 0; i < 5000; ++i) {
    chain.step(simulator);
    ASSERT_EQ(chain.stay().log_prior, model->log_prior(chain.stay().state));
    if (chain.stay().iteration == 0) continue;  // the initial State may have failed
    ASSERT_EQ(chain.stay().score.log_constraint, awkward_constraint(chain.stay().state));
  }
}

}  // namespace
}  // namespace retake::tests
