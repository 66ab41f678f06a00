// Kernels: what they change and what they leave, and detailed balance of each under its log_hastings.
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include "sampler/kernel.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

using Shape = Perturb::Shape;

/// Steps from the middle of a wide uniform range.
std::vector<State> steps_of(const Perturb& perturb, const Model& model, const State& current, int count) {
  std::vector<State> steps;
  RandomStream random = stream(41);
  for (int i = 0; i < count; ++i) {
    State candidate = current;
    EXPECT_EQ(perturb.propose(model, current, candidate, random), 0);
    steps.push_back(candidate - current);
  }
  return steps;
}

std::vector<double> column(const std::vector<State>& states, Eigen::Index variable) {
  std::vector<double> values;
  for (const State& state : states)
    values.push_back(state[variable]);
  return values;
}

TEST(Perturb, StepsHaveTheirShape) {
  const auto model = gaussian_model(3);
  State current(3);
  current << 5, -2, 0;
  const auto steps = [&](Shape shape) {
    return steps_of(Perturb({{.variables = {0, 1, 2}, .shape = shape, .size = 0.25}}), *model, current,
                    20000);
  };
  const auto uniform = steps(Shape::uniform), gaussian = steps(Shape::gaussian),
             radial = steps(Shape::radial);
  std::vector<double> distances, uprightness;
  for (const State& step : radial) {
    distances.push_back(step.norm());
    uprightness.push_back(step[2] / step.norm());
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_GT(
        kolmogorov_smirnov_p(column(uniform, i), [](double d) { return std::clamp(2 * d + 0.5, 0.0, 1.0); }),
        kErrorRate);
    EXPECT_GT(kolmogorov_smirnov_p(column(gaussian, i), [](double d) { return normal_cdf(4 * d); }),
              kErrorRate);
  }
  // A Gaussian distance along a direction uniform on the sphere (Archimedes: its height is uniform).
  EXPECT_GT(kolmogorov_smirnov_p(distances, [](double d) { return 2 * normal_cdf(4 * d) - 1; }), kErrorRate);
  EXPECT_GT(kolmogorov_smirnov_p(uprightness, [](double z) { return 0.5 * (1 + z); }), kErrorRate);
}

TEST(Perturb, GroupsMoveTogetherWithTheirProbability) {
  const auto model = gaussian_model(3);
  const Perturb perturb(
      {{.variables = {0, 2}, .size = 1, .probability = 0.3}, {.variables = {1}, .probability = 0.9}});
  double first = 0, second = 0, both = 0;
  for (const State& step : steps_of(perturb, *model, State::Zero(3), 20000)) {
    ASSERT_EQ(step[0] == 0, step[2] == 0);
    first += step[0] != 0;
    second += step[1] != 0;
    both += step[0] != 0 && step[1] != 0;
  }
  EXPECT_LT(std::abs(z_of_share(first, 20000, 0.3)), kLargestZ);
  EXPECT_LT(std::abs(z_of_share(second, 20000, 0.9)), kLargestZ);
  EXPECT_LT(std::abs(z_of_share(both, 20000, 0.27)), kLargestZ);
}

TEST(Perturb, WrapsUniformVariables) {
  const Model model({{.name = "angle", .unit = "rad", .prior = Distribution::uniform(0, 1)}});
  const Perturb perturb({{.variables = {0}, .shape = Shape::uniform, .size = 0.2}});
  State current(1), candidate(1);
  current << 0.95;
  RandomStream random = stream(42);
  double wrapped = 0;
  for (int i = 0; i < 10000; ++i) {
    perturb.propose(model, current, candidate, random);
    ASSERT_TRUE((candidate[0] >= 0.75 && candidate[0] <= 1) || (candidate[0] >= 0 && candidate[0] <= 0.15));
    wrapped += candidate[0] < 0.5;
  }
  EXPECT_LT(std::abs(z_of_share(wrapped, 10000, 0.375)), kLargestZ);
}

TEST(Perturb, LeavesAbsentVariablesAbsentAndOthersAlone) {
  const auto model = switch_model(2, 1);
  const Perturb perturb({{.variables = {1, 3}, .shape = Shape::radial, .size = 1}});
  State current(4), candidate;
  current << 1, 0.5, 0, kAbsent;
  RandomStream random = stream(43);
  for (int i = 0; i < 1000; ++i) {
    candidate = current;
    perturb.propose(*model, current, candidate, random);
    ASSERT_NE(candidate[1], 0.5);
    ASSERT_EQ(candidate[0], 1);
    ASSERT_EQ(candidate[2], 0);
    ASSERT_TRUE(std::isnan(candidate[3]));
  }
}

TEST(Redraw, ChangesItsBlockAloneAndFollowsTheSwitch) {
  const auto model = rich_model();
  const Redraw redraw(*model, {0, 1, 2, 5}, Ratios::exact);
  RandomStream random = stream(44);
  State current, candidate;
  std::vector<double> angles;
  for (int i = 0; i < 5000; ++i) {
    model->draw(random, current);
    candidate = current;
    redraw.propose(*model, current, candidate, random);
    for (std::size_t other : {3, 4, 6, 7, 8})
      ASSERT_TRUE(at(candidate, other) == at(current, other) || std::isnan(at(current, other))) << other;
    for (std::size_t governed : {1, 2})
      ASSERT_EQ(std::isnan(at(candidate, governed)), candidate[0] == 0);
    ASSERT_NE(candidate[5], current[5]);
    angles.push_back(candidate[5]);
  }
  EXPECT_GT(kolmogorov_smirnov_p(angles, [](double u) { return u; }), kErrorRate);
}

TEST(Redraw, TheOrderOfItsBlockDoesNotMatter) {
  // What a switch governs, named before the switch.
  const auto model = switch_model(2, 0.1);
  const Redraw redraw(*model, {3, 1, 2, 0}, Ratios::exact);
  RandomStream random = stream(45);
  State current, candidate;
  for (int i = 0; i < 1000; ++i) {
    model->draw(random, current);
    candidate = current;
    const double log_hastings = redraw.propose(*model, current, candidate, random);
    for (std::size_t governed : {1, 3})
      ASSERT_EQ(std::isnan(at(candidate, governed)), at(candidate, governed - 1) == 0) << governed;
    ASSERT_NEAR(log_hastings, model->log_prior(current) - model->log_prior(candidate), 1e-12);
  }
}

TEST(Toggle, DrawsWhatItTurnsOnFromThePriorAndBlanksWhatItTurnsOff) {
  const auto model = switch_model(3, 0.2);
  const Toggle toggle(*model, switches_of(*model), 0.5, Ratios::exact);
  RandomStream random = stream(46);
  State current(6), candidate;
  current << 1, 0.05, 0, kAbsent, 0, kAbsent;
  std::vector<double> places;
  double turned_off = 0;
  for (int i = 0; i < 20000; ++i) {
    candidate = current;
    toggle.propose(*model, current, candidate, random);
    for (std::size_t ball : {0, 2, 4})
      ASSERT_EQ(std::isnan(at(candidate, ball + 1)), at(candidate, ball) == 0);
    ASSERT_TRUE(candidate[0] == 0 || candidate[1] == 0.05);
    turned_off += candidate[0] == 0;
    if (candidate[2] == 1) places.push_back(candidate[3]);
  }
  EXPECT_LT(std::abs(z_of_share(turned_off, 20000, 0.25)), kLargestZ);
  EXPECT_LT(std::abs(z_of_share(static_cast<double>(places.size()), 20000, 0.25)), kLargestZ);
  EXPECT_GT(kolmogorov_smirnov_p(places, [](double place) { return place / 0.2; }), kErrorRate);
}

TEST(KernelTable, ChoosesInProportionToTheWeights) {
  const auto model = gaussian_model(1);
  const auto kernel = std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact));
  const KernelTable table({{"a", 1, kernel}, {"b", 2, kernel}, {"c", 5, kernel}});
  for (const double u : {1e-300, 0.01, 0.1249})
    EXPECT_EQ(table.choose(u), 0u);
  for (const double u : {0.1251, 0.25, 0.3749})
    EXPECT_EQ(table.choose(u), 1u);
  for (const double u : {0.3751, 0.5, 1 - 1e-16})
    EXPECT_EQ(table.choose(u), 2u);

  Chain chain(target_of(model, table.rows()), {.seed = 47});
  ToySimulator simulator(constant);
  for (int i = 0; i < 20000; ++i)
    chain.step(simulator);
  std::vector<double> proposed;
  for (const KernelCounter& counter : chain.counts().kernels) {
    proposed.push_back(static_cast<double>(counter.proposed));
    EXPECT_EQ(counter.accepted, counter.proposed);
  }
  EXPECT_GT(chi_square_p(proposed, {2500, 5000, 12500}), kErrorRate);
}

TEST(KernelDeathTest, RefusesWhatCannotBeExact) {
  const auto model = switch_model(1, 1);
  EXPECT_DEATH(Redraw(*model, {0}, Ratios::exact), "CHECK") << "without what the switch governs";
  EXPECT_DEATH(Toggle(*model, {1}, 0.5, Ratios::exact), "CHECK") << "not a switch";
  EXPECT_DEATH(Perturb({{.variables = {1}, .shape = Shape::radial}}), "CHECK");
  EXPECT_DEATH(KernelTable(std::vector<WeightedKernel>{}), "CHECK");
}

// --- Detailed balance --------------------------------------------------------------------------

/// Which of 108 classes a State of rich_model() belongs to: switches, and coarse bins of three Variables.
int class_of(const State& state) {
  const auto third = [](double z) { return z < -0.43 ? 0 : z < 0.43 ? 1 : 2; };
  const int place = std::isnan(state[1]) ? 0 : state[1] < 0.8 ? 0 : 1;
  const int angle = std::min(2, static_cast<int>(3 * state[5]));
  return (((state[0] == 1) * 2 + (state[3] == 1)) * 2 + place) * 9 + angle * 3 + third(2 * state[6]);
}

double soft_constraint(const State& state) {
  return -0.5 * std::pow(sum_of_present(state) - 1.5, 2);
}

/// p-value of "moves from class i to class j are as frequent as moves back", from States drawn exactly from
/// p_w p_c.
double balance_p(const Kernel& kernel, const Model& model, std::uint64_t seed) {
  RandomStream random = stream(seed);
  std::map<std::pair<int, int>, double> net, total;
  State state;
  for (int i = 0; i < 200000; ++i) {
    do
      model.draw(random, state);
    while (std::log(random.uniform()) >= soft_constraint(state));
    const int before = class_of(state);
    if (!metropolis_step(model, kernel, soft_constraint, state, random)) continue;
    const int after = class_of(state);
    if (before == after) continue;
    const std::pair pair = std::minmax(before, after);
    net[pair] += before < after ? 1 : -1;
    ++total[pair];
  }
  double statistic = 0, degrees = 0, rest_net = 0, rest_total = 0;
  for (const auto& [pair, moves] : total) {
    if (moves >= 20) {
      statistic += net[pair] * net[pair] / moves;
      ++degrees;
    } else {
      rest_net += net[pair];
      rest_total += moves;
    }
  }
  if (rest_total > 0) statistic += rest_net * rest_net / rest_total, ++degrees;
  EXPECT_GT(degrees, 8) << "the kernel hardly moves";
  return chi_square_p(statistic, degrees);
}

TEST(DetailedBalance, HoldsForEveryKernel) {
  const auto model = rich_model();
  std::uint64_t seed = 50;
  for (const WeightedKernel& row : rich_kernels(*model, Ratios::exact))
    EXPECT_GT(balance_p(*row.kernel, *model, ++seed), kErrorRate) << row.name;
}

TEST(DetailedBalance, FailsForThePapersRatios) {
  const auto model = rich_model();
  for (const WeightedKernel& row : rich_kernels(*model, Ratios::paper)) {
    if (row.name.starts_with("perturb")) continue;  // symmetric, whatever the ratios
    EXPECT_LT(balance_p(*row.kernel, *model, 60), 1e-12) << row.name;
  }
}

}  // namespace
}  // namespace retake::tests
