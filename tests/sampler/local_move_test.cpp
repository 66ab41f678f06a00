// LocalMove: it leaves the prior as it is, its ratio is that of a reversible step, and switches stay.
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/toys.h"

namespace retake::tests {
namespace {

/// Blocks of rich_model(): one Variable, some, and all that may be in one.
const std::vector<std::vector<std::size_t>> kBlocks = {{5}, {6, 7}, {5, 6, 7, 8}};

TEST(LocalMove, LeavesSwitchesAndWhatIsAbsent) {
  const auto model = rich_model();
  RandomStream random = stream(501);
  State current, candidate;
  std::vector<int> moved(model->size(), 0);
  for (const auto& block : kBlocks) {
    const LocalMove move(*model, block);
    for (int i = 0; i < 5000; ++i) {
      model->draw(random, current);
      candidate = current;
      move.propose(*model, current, candidate, random);
      for (std::size_t v = 0; v < model->size(); ++v) {
        if (!model->is_present(current, v)) {
          ASSERT_TRUE(std::isnan(at(candidate, v)));
          continue;
        }
        if (model->variables()[v].prior.kind() == Distribution::Kind::on_off) {
          ASSERT_EQ(at(candidate, v), at(current, v));
        }
        moved[v] += at(candidate, v) != at(current, v);
      }
      ASSERT_NE(model->log_prior(candidate), -kInfinity) << "uniform Variables wrap";
    }
  }
  for (std::size_t v = 0; v < model->size(); ++v)
    EXPECT_EQ(moved[v] > 500, model->variables()[v].prior.kind() != Distribution::Kind::on_off) << v;
}

TEST(LocalMove, ItsRatioCancelsThePriors) {
  const auto model = rich_model();
  RandomStream random = stream(502);
  State current, candidate;
  for (const auto& block : kBlocks) {
    const LocalMove move(*model, block);
    for (int i = 0; i < 20000; ++i) {
      model->draw(random, current);
      candidate = current;
      const double log_hastings = move.propose(*model, current, candidate, random);
      ASSERT_NEAR(log_hastings, model->log_prior(current) - model->log_prior(candidate), 1e-9);
    }
  }
}

TEST(LocalMove, FromThePriorTheWayBackIsAsLikely) {
  // (current, candidate) has the distribution of (candidate, current), so that functions that change their
  // sign with the order have mean 0.
  const auto model = rich_model();
  for (const auto& block : kBlocks) {
    const LocalMove move(*model, block);
    std::vector<std::vector<double>> odd(3 * model->size());
    State current, candidate;
    for (std::uint64_t i = 0; i < 40000; ++i) {
      RandomStream random = stream(503, i);
      model->draw(random, current);
      candidate = current;
      move.propose(*model, current, candidate, random);
      for (std::size_t v = 0; v < model->size(); ++v) {
        const double x = model->is_present(current, v) ? at(current, v) : 0;
        const double y = model->is_present(candidate, v) ? at(candidate, v) : 0;
        odd[3 * v].push_back(x - y);
        odd[3 * v + 1].push_back(x * x - y * y);
        odd[3 * v + 2].push_back(x * x * y - y * y * x);
      }
    }
    for (std::size_t f = 0; f < odd.size(); ++f)
      EXPECT_LT(std::abs(z_of_mean(odd[f], 0)), kLargestZ) << f;
  }
}

TEST(LocalMove, AloneItLeavesThePriorInvariant) {
  // Chains that begin at draws of the prior are at draws of it after any number of steps.
  const auto model = rich_model();
  for (const auto& block : kBlocks) {
    const auto target = target_of(model, {{"local", 1, std::make_shared<const LocalMove>(*model, block)}});
    std::vector<std::vector<double>> values(model->size());
    std::uint64_t accepted = 0, proposed = 0;
    for (std::uint32_t index = 0; index < 2000; ++index) {
      Chain chain(target, {.seed = 504, .index = index});
      ToySimulator simulator(constant);
      for (int i = 0; i < 40; ++i)
        chain.step(simulator);
      accepted += chain.counts().accepted;
      proposed += chain.counts().iteration;
      for (std::size_t v = 0; v < model->size(); ++v)
        if (model->is_present(chain.stay().state, v)) values[v].push_back(at(chain.stay().state, v));
    }
    EXPECT_EQ(accepted, proposed) << "acceptance depends on p_c alone";
    for (std::size_t v = 0; v < model->size(); ++v) {
      const Distribution& prior = model->variables()[v].prior;
      if (prior.kind() == Distribution::Kind::on_off) continue;
      EXPECT_GT(kolmogorov_smirnov_p(values[v], [&](double x) { return cdf(prior, x); }), kErrorRate) << v;
    }
  }
}

TEST(LocalMove, ReachesEveryScale) {
  // Steps of a Gaussian Variable in standard deviations: from the hundredth part to a draw anew.
  const auto model = gaussian_model(1, 3);
  const LocalMove move(*model, {0});
  RandomStream random = stream(505);
  State current, candidate;
  int small = 0, large = 0;
  for (int i = 0; i < 10000; ++i) {
    model->draw(random, current);
    candidate = current;
    move.propose(*model, current, candidate, random);
    const double step = std::abs(candidate[0] - current[0]) / 3;
    small += step > 0 && step < 0.03;
    large += step > 0.5;
  }
  EXPECT_GT(small, 1000);
  EXPECT_GT(large, 500);
}

}  // namespace
}  // namespace retake::tests
