// Model: p_w is the product over the Variables that are there, and nothing else.
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include "sampler/model.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/kernel.h"
#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

TEST(Model, LogPriorOfTenPinsIsTheSumOfTheirLogDensities) {
  // sampler/README.md: A.1 prints a sum of the pins' densities, where independent pins need the product.
  const auto pins = gaussian_model(10, 0.5);
  State state(10);
  double sum_of_logs = 0, sum_of_densities = 0;
  for (Eigen::Index i = 0; i < 10; ++i) {
    state[i] = 0.1 * static_cast<double>(i) - 0.3;
    const double density = std::exp(-0.5 * std::pow(state[i] / 0.5, 2)) / (0.5 * std::sqrt(2 * M_PI));
    sum_of_logs += std::log(density);
    sum_of_densities += density;
  }
  EXPECT_NEAR(pins->log_prior(state), sum_of_logs, 1e-12);
  EXPECT_GT(std::abs(pins->log_prior(state) - std::log(sum_of_densities)), 1);
}

TEST(Model, AbsentVariablesDoNotCount) {
  const auto model = switch_model(2, 0.1);
  State state(4);
  state << 1, 0.05, 0, kAbsent;
  EXPECT_NEAR(model->log_prior(state), 2 * std::log(0.5) + std::log(10), 1e-14);
  EXPECT_TRUE(model->is_present(state, 1));
  EXPECT_FALSE(model->is_present(state, 3));
  state << 0, kAbsent, 0, kAbsent;
  EXPECT_NEAR(model->log_prior(state), 2 * std::log(0.5), 1e-14);
  state << 1, 0.05, 1, 0.11;
  EXPECT_EQ(model->log_prior(state), -kInfinity);
}

TEST(Model, AbsentVariablesAreDrawnAsNaN) {
  const auto model = rich_model();
  RandomStream random = stream(21);
  State state;
  for (int draw = 0; draw < 1000; ++draw) {
    model->draw(random, state);
    ASSERT_EQ(state.size(), 9);
    for (std::size_t i = 0; i < model->size(); ++i)
      ASSERT_EQ(std::isnan(at(state, i)), !model->is_present(state, i)) << i;
    ASSERT_TRUE(std::isfinite(model->log_prior(state)));
  }
}

TEST(Model, DrawsEveryVariableFromItsPrior) {
  const auto model = rich_model();
  RandomStream random = stream(22);
  std::vector<std::vector<double>> draws(model->size());
  State state;
  for (int draw = 0; draw < 20000; ++draw) {
    model->draw(random, state);
    for (std::size_t i = 0; i < model->size(); ++i)
      if (model->is_present(state, i)) draws[i].push_back(at(state, i));
  }
  for (std::size_t i = 0; i < model->size(); ++i) {
    const Distribution& prior = model->variables()[i].prior;
    if (prior.kind() == Distribution::Kind::on_off)
      EXPECT_LT(std::abs(z_of_mean(draws[i], prior.mean())), kLargestZ) << i;
    else
      EXPECT_GT(kolmogorov_smirnov_p(draws[i], [&](double value) { return cdf(prior, value); }), kErrorRate)
          << i;
  }
}

TEST(Model, MeanLogPriorOfDrawsIsMinusTheEntropy) {
  // One switch with p = 1/2 and a place uniform on 0.1 m: the entropy is log 2 + log(0.1) / 2.
  const auto model = switch_model(1, 0.1);
  RandomStream random = stream(23);
  State state;
  std::vector<double> log_priors(20000);
  for (double& log_prior : log_priors) {
    model->draw(random, state);
    log_prior = model->log_prior(state);
  }
  EXPECT_LT(std::abs(z_of_mean(log_priors, -std::log(2) - 0.5 * std::log(0.1))), kLargestZ);
}

TEST(Model, InSupportRefusesStatesThatNoPriorCanRefuse) {
  const Model model({{.name = "x", .unit = "m", .prior = Distribution::gaussian(0, 1)},
                     {.name = "y", .unit = "m", .prior = Distribution::gaussian(0, 1)}},
                    [](const State& state) { return state[0] < state[1]; });
  State state(2);
  state << 1, 0;
  EXPECT_EQ(model.log_prior(state), -kInfinity);
  state << 0, 1;
  EXPECT_NEAR(model.log_prior(state), -std::log(2 * M_PI) - 0.5, 1e-14);
  // draw() goes without it, so that misses are seen: half of these lie outside.
  RandomStream random = stream(24);
  double outside = 0;
  for (int draw = 0; draw < 10000; ++draw) {
    model.draw(random, state);
    outside += model.log_prior(state) == -kInfinity;
  }
  EXPECT_LT(std::abs(z_of_share(outside, 10000, 0.5)), kLargestZ);
}

TEST(Model, KnowsWhatEachSwitchGoverns) {
  const auto model = rich_model();
  EXPECT_EQ(model->governed_by(0), (std::vector<std::size_t>{1, 2}));
  EXPECT_EQ(model->governed_by(3), (std::vector<std::size_t>{4}));
  EXPECT_TRUE(model->governed_by(5).empty());
}

TEST(Model, OverridesAreNeitherDrawnNorCounted) {
  const Variable plain{.name = "x", .unit = "", .prior = Distribution::gaussian(0, 1)};
  const Variable override_of_it{
      .name = "o", .unit = "", .prior = Distribution::gaussian(0, 1), .is_override = true};
  const Model model({plain, override_of_it});
  RandomStream random = stream(25);
  State state;
  model.draw(random, state);
  EXPECT_TRUE(std::isnan(state[1]));
  EXPECT_FALSE(model.is_present(state, 1));
  const double log_prior = model.log_prior(state);
  state[1] = 3;
  EXPECT_TRUE(model.is_present(state, 1));
  EXPECT_EQ(model.log_prior(state), log_prior);

  // A redraw of everything takes it away, and a local move leaves it where it is.
  State candidate = state;
  const double log_hastings = Redraw::all(model, Ratios::exact).propose(model, state, candidate, random);
  EXPECT_TRUE(std::isnan(candidate[1]));
  EXPECT_NEAR(log_hastings, model.log_prior(state) - model.log_prior(candidate), 1e-15);
  const LocalMove local(model, {0});
  for (int i = 0; i < 100; ++i) {
    candidate = state;
    local.propose(model, state, candidate, random);
    EXPECT_EQ(candidate[1], 3);
  }
}

TEST(ModelDeathTest, RefusesOverridesBeforeWhatTheyOverride) {
  const Variable plain{.name = "x", .unit = "", .prior = Distribution::gaussian(0, 1)};
  const Variable first{.name = "o", .unit = "", .prior = Distribution::gaussian(0, 1), .is_override = true};
  const Variable as_switch{.name = "s", .unit = "", .prior = Distribution::on_off(0.5), .is_override = true};
  EXPECT_DEATH(Model({first, plain}), "CHECK");
  EXPECT_DEATH(Model({plain, as_switch}), "CHECK");
}

TEST(ModelDeathTest, RefusesASwitchThatCannotGovern) {
  const Variable gaussian{.name = "x", .unit = "", .prior = Distribution::gaussian(0, 1)};
  const Variable governed{.name = "y", .unit = "", .prior = Distribution::gaussian(0, 1), .switch_index = 0};
  EXPECT_DEATH(Model({gaussian, governed}), "CHECK");
  EXPECT_DEATH(Model({governed}), "CHECK");
}

}  // namespace
}  // namespace retake::tests
