// Clauses about chains: without physics the prior comes back, margins and joint; with it wishes come true.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/contract/contract.h"
#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests::clauses {
namespace {

/// A constraint that does not constrain, without the cost of physics: what is left is the model and the
/// kernels.
class ConstantSimulator final : public Simulator {
 public:
  SimulationOutcome simulate(const State&, const SimulationRequest&, Score& score) override {
    score.log_constraint = 0;
    score.satisfied = true;
    return {.end = SimulationEnd::complete};
  }
};

/// Compares two sets of independent States, statistic by statistic; all comparisons together err with
/// kErrorRate (Bonferroni).
class Comparison {
 public:
  Comparison(const std::vector<State>& left, const std::vector<State>& right, std::size_t comparisons,
             Faults& faults)
      : left_(left),
        right_(right),
        rate_(kErrorRate / static_cast<double>(comparisons)),
        largest_z_(-normal_quantile(rate_ / 2)),
        faults_(faults) {}

  template <typename Statistic>
  void means(const std::string& what, const Statistic& statistic) const {
    const double z = z_of_means(collect(left_, statistic), collect(right_, statistic));
    faults_.expect(std::abs(z) < largest_z_, what, ": means are ", z, " standard errors apart");
  }
  template <typename Statistic>
  void shapes(const std::string& what, const Statistic& statistic) const {
    const double p = kolmogorov_smirnov_p(collect(left_, statistic), collect(right_, statistic));
    faults_.expect(p > rate_, what, ": distributions differ, p = ", p);
  }

 private:
  /// NaN says that there is none.
  template <typename Statistic>
  static std::vector<double> collect(const std::vector<State>& states, const Statistic& statistic) {
    std::vector<double> values;
    for (const State& state : states)
      if (const double value = statistic(state); !std::isnan(value)) values.push_back(value);
    return values;
  }
  const std::vector<State>&left_, &right_;
  double rate_, largest_z_;
  Faults& faults_;
};

/// Where a present Variable lies in its prior: centred rank of a number, deviation of a switch; 0 where it is
/// absent.
double centred(const Variable& variable, double value) {
  if (std::isnan(value)) return 0;
  if (variable.prior.kind() == Distribution::Kind::on_off)
    return value - std::exp(variable.prior.log_density(1));
  return cdf(variable.prior, value) - 0.5;
}

/// Each Variable by itself: presence, mean and shape. Overrides are no part of it.
void compare_margins(const Model& model, const std::vector<std::size_t>& compared,
                     const Comparison& comparison) {
  for (const std::size_t i : compared) {
    const Variable& variable = model.variables()[i];
    const auto value = [i](const State& state) { return state[static_cast<Eigen::Index>(i)]; };
    comparison.means(variable.name + " is present",
                     [&](const State& state) { return std::isnan(value(state)) ? 0.0 : 1.0; });
    comparison.means(variable.name, value);
    if (variable.prior.kind() != Distribution::Kind::on_off) comparison.shapes(variable.name, value);
  }
}

/// All together: log p_w, which a wrong ratio moves by a little in each Variable; the sum of all centred
/// ranks, which moves if they go together; and products of pairs.
void compare_jointly(const Model& model, const std::vector<std::pair<std::size_t, std::size_t>>& pairs,
                     const Comparison& comparison) {
  const auto log_prior = [&](const State& state) { return model.log_prior(state); };
  comparison.means("jointly, log_prior", log_prior);
  comparison.shapes("jointly, log_prior", log_prior);
  const auto at = [&](const State& state, std::size_t i) {
    return centred(model.variables()[i], state[static_cast<Eigen::Index>(i)]);
  };
  comparison.shapes("jointly, the sum of ranks", [&](const State& state) {
    double sum = 0;
    for (std::size_t i = 0; i < model.size(); ++i)
      if (!model.variables()[i].is_override) sum += at(state, i);
    return sum;
  });
  for (const auto& [i, j] : pairs)
    comparison.means(
        "jointly, " + model.variables()[i].name + " x " + model.variables()[j].name,
        [&, first = i, second = j](const State& state) { return at(state, first) * at(state, second); });
}

void compare(const Model& model, const std::vector<State>& prior, const std::vector<State>& walked,
             Faults& faults) {
  std::vector<std::size_t> compared;
  for (std::size_t i = 0; i < model.size(); ++i)
    if (!model.variables()[i].is_override) compared.push_back(i);
  // Neighbours in the table, and others.
  constexpr std::size_t kMostPairs = 100;  // chosen: pairs cost as much as margins
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  RandomStream random = stream(140);
  for (std::size_t i = 0; i + 1 < compared.size() && pairs.size() < kMostPairs; ++i)
    for (const std::size_t other : {i + 1, static_cast<std::size_t>(random.index(compared.size()))})
      if (other != i) pairs.emplace_back(compared[i], compared[other]);
  const Comparison comparison(prior, walked, 3 * compared.size() + 3 + pairs.size(), faults);
  compare_margins(model, compared, comparison);
  compare_jointly(model, pairs, comparison);
}

/// What a chain has overridden follows the overrides' own priors, or nearly: these may be clamped where one
/// draw in a thousand is.
void check_overrides(const Model& model, const std::vector<State>& prior, const std::vector<State>& walked,
                     Faults& faults) {
  std::vector<double> ranks;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Variable& variable = model.variables()[i];
    if (!variable.is_override) continue;
    for (const State& state : prior)
      faults.expect(std::isnan(state[static_cast<Eigen::Index>(i)]), variable.name, ": the prior draws it");
    for (const State& state : walked)
      if (const double value = state[static_cast<Eigen::Index>(i)];
          !std::isnan(value) && ranks.size() < 20000)
        ranks.push_back(cdf(variable.prior, value));
  }
  if (ranks.empty()) return;
  const double p = kolmogorov_smirnov_p(ranks, [](double rank) { return rank; });
  faults.expect(p > kErrorRate, "overrides do not follow their priors, p = ", p);
}

}  // namespace

/// Every chain begins at a draw of the prior and its end is one too, whether it mixes or not; ends of chains
/// with different indices are independent.
void prior_comes_back(const World& world, int chains, Faults& faults) {
  constexpr int kIterations = 60;
  std::vector<OpenScenario> all = open_examples(world);
  all.push_back(open_without_wishes(world, world.examples().at(0)));
  std::set<std::string> walked_on;
  for (const OpenScenario& open : all) {
    // Wishes matter to proposals that look at Scores alone.
    const auto target = open.scenario->target(Ratios::exact);
    const std::string walk =
        (target->scored_kernels ? open.scenario->document() : open.scenario->document().at("model")).dump();
    if (!walked_on.insert(walk).second) continue;

    const auto count = static_cast<std::size_t>(chains);
    ConstantSimulator simulator;
    std::vector<State> walked, kept;
    std::uint64_t moves = 0;
    for (std::uint32_t index = 0; index < count; ++index) {
      Chain chain(target, {.seed = 142, .index = index});
      for (int i = 0; i < kIterations; ++i)
        moves += chain.step(simulator);
      walked.push_back(chain.stay().state);
    }
    faults.expect(moves > count * kIterations / 20, "chains hardly move: ", moves);
    Chain rejection(target, {.seed = 143, .method = Method::rejection});
    while (kept.size() < count)
      if (rejection.step(simulator)) kept.push_back(rejection.stay().state);
    const std::vector<State> prior = draw_states(open.model(), 141, chains);
    compare(open.model(), prior, walked, faults);
    compare(open.model(), prior, kept, faults);
    check_overrides(open.model(), prior, walked, faults);
  }
}

/// The default method of the world satisfies every example.
void satisfies_its_examples(const World& world, int most_iterations, Faults& faults) {
  for (const OpenScenario& open : open_examples(world)) {
    const auto performer = open.scenario->make_performer();
    Chain chain(open.scenario->target(Ratios::exact), {.seed = 149, .method = world.default_method()});
    while (chain.counts().samples == 0 &&
           chain.counts().iteration < static_cast<std::uint64_t>(most_iterations))
      chain.step(*performer);
    if (!faults.expect(chain.counts().samples > 0, open.scenario->title(), ": is not satisfied")) continue;
    const auto take = performer->perform(chain.stay().state);
    faults.expect(take.complete && take.score.satisfied && identical(take.score, chain.stay().score),
                  open.scenario->title(), ": a sample is not what it was");
  }
}

}  // namespace retake::tests::clauses
