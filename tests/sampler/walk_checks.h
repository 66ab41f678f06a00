// What has to hold of every method of a chain, whatever it does inside.
#pragma once

#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/two_modes.h"

namespace retake::tests {

/// A checkpoint without the four counters that tell how much was simulated.
inline std::string without_work(std::string checkpoint) {
  // version 4, seed 8, index 4, method 1; iteration, accepted, samples 8 each.
  checkpoint.replace(41, 32, 32, '\0');
  return checkpoint;
}

/// Every checkpoint is the same, and every step says the same, with early rejection on and off.
/// `bounds`: the walk asks simulations to stop early.
inline void expect_early_rejection_changes_nothing(const TwoModes& toy, ChainSettings settings,
                                                   int iterations, bool bounds = true) {
  settings.early_rejection = true;
  Chain on(toy.target(), settings);
  settings.early_rejection = false;
  Chain off(toy.target(), settings);
  ToySimulator simulator_on = toy.simulator(), simulator_off = toy.simulator();
  std::uint64_t stops = 0;
  simulator_on.observe = [&](const State&, const SimulationRequest& request) {
    stops += request.needed > -kInfinity;
  };
  simulator_off.observe = [](const State&, const SimulationRequest& request) {
    EXPECT_EQ(request.needed, -kInfinity);
  };
  for (int i = 0; i < iterations; ++i) {
    ASSERT_EQ(on.step(simulator_on), off.step(simulator_off)) << i;
    ASSERT_EQ(on.walker(), off.walker());
    if (i % 61 != 0 && i + 1 != iterations) continue;
    ASSERT_EQ(without_work(on.checkpoint()), without_work(off.checkpoint())) << i;
  }
  EXPECT_FALSE(on.counts().is_learning);
  if (bounds) {
    EXPECT_GT(stops, 0u);
  }
  EXPECT_LE(on.counts().simulations, off.counts().simulations);
  EXPECT_LT(on.counts().simulated_seconds, off.counts().simulated_seconds);
}

/// A chain interrupted before every iteration that `interrupts` names equals one that never was.
template <typename Interrupts>
inline void expect_resumes(const TwoModes& toy, const ChainSettings& settings, int iterations,
                           Interrupts&& interrupts) {
  const auto target = toy.target();
  Chain uninterrupted(target, settings), resumed(target, settings);
  ToySimulator simulator = toy.simulator(), fresh = toy.simulator();
  for (int i = 0; i < iterations; ++i) {
    const bool interrupted = interrupts(i);
    if (interrupted) {
      const std::string bytes = resumed.checkpoint();
      resumed = Chain(target, settings, bytes);
      ASSERT_EQ(resumed.checkpoint(), bytes) << i;
    }
    ASSERT_EQ(uninterrupted.step(simulator), resumed.step(fresh)) << i;
    ASSERT_EQ(uninterrupted.walker(), resumed.walker()) << i;
    const Stay &left = uninterrupted.stay(), &right = resumed.stay();
    ASSERT_EQ(left.iteration, right.iteration) << i;
    ASSERT_EQ(left.weight, right.weight) << i;
    if (interrupted) {
      ASSERT_EQ(uninterrupted.checkpoint(), resumed.checkpoint()) << i;
    }
  }
  EXPECT_EQ(uninterrupted.checkpoint(), resumed.checkpoint());
  EXPECT_FALSE(uninterrupted.counts().is_learning);
}

inline bool refuses(const TwoModes& toy, const ChainSettings& settings, const std::string& bytes) {
  try {
    Chain chain(toy.target(), settings, bytes);
  } catch (const std::runtime_error&) {
    return true;
  }
  return false;
}

/// Of a checkpoint every truncation is refused, and bytes that are damaged do no more than be refused.
/// `stride`: only every so many lengths and places, for long ones.
inline void expect_survives_damage(const TwoModes& toy, const ChainSettings& settings,
                                   const std::string& bytes, std::size_t stride) {
  ASSERT_FALSE(refuses(toy, settings, bytes));
  for (std::size_t length = 0; length < bytes.size(); length += length < 400 ? 1 : stride)
    ASSERT_TRUE(refuses(toy, settings, bytes.substr(0, length))) << length;
  ASSERT_TRUE(refuses(toy, settings, bytes.substr(0, bytes.size() - 1)));
  ASSERT_TRUE(refuses(toy, settings, bytes + '\0'));
  int refused = 0;
  for (std::size_t i = 0; i < bytes.size(); i += i < 400 ? 1 : stride)
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ flip);
      refused += refuses(toy, settings, damaged);
    }
  EXPECT_GE(refused, 3 * 25) << "at least version, seed, index, method and two sizes";
}

/// Largest t of seeds' weighted means against the truth. Requires: as many seeds as the limit below is for.
inline constexpr int kSeeds = 24;
inline constexpr double kLargestT = 6.6;  ///< Student's t with 23 degrees of freedom exceeds it at kErrorRate
inline std::vector<Said> runs_of(const TwoModes& toy, const ChainSettings& settings, int iterations,
                                 int seeds = kSeeds) {
  std::vector<Said> runs;
  for (int seed = 0; seed < seeds; ++seed) {
    ChainSettings with = settings;
    with.seed += static_cast<std::uint64_t>(seed);
    runs.push_back(run_of(toy, with, iterations));
  }
  return runs;
}

/// One draw of p(A | satisfied) from each of many short chains, which are independent, against closed forms.
/// Requires: no hazards.
inline void expect_last_draws_are_exact(TwoModes::Height height, const ChainSettings& settings, int seeds,
                                        std::uint64_t draws_to_skip) {
  const TwoModes toy{.height = height};
  std::vector<double> slopes, places;
  std::vector<double> parts(4, 0);
  for (int seed = 0; seed < seeds; ++seed) {
    ChainSettings with = settings;
    with.seed += static_cast<std::uint64_t>(seed);
    Chain chain(toy.target(), with);
    ToySimulator simulator = toy.simulator();
    DrawWatcher watcher;
    for (std::uint64_t seen = 0; seen < draws_to_skip;) {
      chain.step(simulator);
      seen += watcher.note(chain);
    }
    const State& state = chain.stay().state;
    ASSERT_TRUE(chain.stay().is_sample);
    const int part = TwoModes::part(state);
    slopes.push_back(state[TwoModes::kSlope]);
    places.push_back(part == 1 ? (state[TwoModes::kY] - 0.1) / 0.1 : (state[TwoModes::kY] - 0.6) / 0.15);
    parts[static_cast<std::size_t>((part - 1) + (state[TwoModes::kSwitch] == 1 ? 2 : 0))] += 1;
  }
  // A prior N(0.5, 1) times exp(-slope^2 / 2) is N(0.25, 1/2).
  const bool sloped = height == TwoModes::Height::sloped;
  const auto slope = Distribution::gaussian(sloped ? 0.25 : 0.5, sloped ? std::sqrt(0.5) : 1);
  EXPECT_GT(kolmogorov_smirnov_p(slopes, [&](double x) { return cdf(slope, x); }), kErrorRate);
  EXPECT_GT(kolmogorov_smirnov_p(places, [](double x) { return std::clamp(x, 0.0, 1.0); }), kErrorRate);
  const double first =
      0.1 * (normal_cdf(1.6) - normal_cdf(1.2)) * (height == TwoModes::Height::stepped ? std::exp(-1.0) : 1);
  const double second = 0.15 * (normal_cdf(-0.7) - normal_cdf(-1.0));
  const double share = first / (first + second), count = seeds;
  EXPECT_GT(chi_square_p(parts, {0.6 * share * count, 0.6 * (1 - share) * count, 0.4 * share * count,
                                 0.4 * (1 - share) * count}),
            kErrorRate);
}

/// With everything satisfied the prior comes back, whatever is walked.
inline void expect_the_prior_back(const ChainSettings& settings, int seeds, int iterations) {
  const auto model = rich_model();
  auto target = std::make_shared<Target>(
      *target_of(model, {{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model, Ratios::exact))}}));
  target->least_satisfied = 0;
  std::vector<std::vector<double>> means(2 * model->size());
  for (int seed = 0; seed < seeds; ++seed) {
    ChainSettings with = settings;
    with.seed += static_cast<std::uint64_t>(seed);
    Chain chain(target, with);
    ToySimulator simulator(constant);
    StayGatherer gatherer;
    RunMoments moments(static_cast<Eigen::Index>(means.size()));
    const auto add = [&](const Stay& stay) {
      Eigen::VectorXd values(static_cast<Eigen::Index>(means.size()));
      for (std::size_t i = 0; i < model->size(); ++i) {
        const double value = at(stay.state, i), filled = std::isnan(value) ? 0 : value;
        at(values, 2 * i) = filled;
        at(values, 2 * i + 1) = filled * filled;
      }
      moments.add(values, static_cast<double>(stay.weight));
    };
    for (int i = 0; i < iterations; ++i) {
      chain.step(simulator);
      gatherer.note(chain, add);
    }
    gatherer.finish(add);
    for (std::size_t f = 0; f < means.size(); ++f)
      means[f].push_back(moments.mean()[static_cast<Eigen::Index>(f)]);
    const auto found = odds(chain.counts().odds);
    ASSERT_TRUE(found);
    EXPECT_GT(found->probability, 0.85);
    EXPECT_GT(found->high, 0.99);
  }
  for (std::size_t i = 0; i < model->size(); ++i) {
    const Variable& variable = model->variables()[i];
    const double mean = variable.prior.mean(), sd = variable.prior.standard_deviation();
    const double present =
        variable.switch_index ? model->variables()[*variable.switch_index].prior.mean() : 1;
    EXPECT_LT(std::abs(z_of_mean(means[2 * i], present * mean)), kLargestT) << variable.name;
    EXPECT_LT(std::abs(z_of_mean(means[2 * i + 1], present * (mean * mean + sd * sd))), kLargestT)
        << variable.name;
  }
}

/// A target whose prior never lies in its support.
inline void expect_nowhere_throws(const ChainSettings& settings) {
  const auto nowhere = std::make_shared<const Model>(
      std::vector<Variable>{{.name = "x", .unit = "", .prior = Distribution::uniform(0, 1)}},
      [](const State&) { return false; });
  Chain chain(target_of(nowhere, {{"redraw", 1,
                                   std::make_shared<const Redraw>(Redraw::all(*nowhere, Ratios::exact))}}),
              settings);
  ToySimulator simulator(constant);
  EXPECT_THROW(chain.step(simulator), std::runtime_error);
}

/// What was found while learning is satisfied and weighs nothing, and learning ends.
inline void expect_learning_weighs_nothing(const TwoModes& toy, const ChainSettings& settings,
                                           int most_iterations, std::uint64_t least_found = 20) {
  Chain chain(toy.target(), settings);
  ToySimulator simulator = toy.simulator();
  std::uint64_t found = 0, samples = 0;
  int i = 0;
  for (; i < most_iterations; ++i) {
    const bool told = chain.step(simulator);
    if (!chain.counts().is_learning) break;
    const Stay& stay = chain.stay();
    if (!told || !stay.is_sample) continue;
    ++found;
    ASSERT_EQ(stay.weight, 0u);
    ASSERT_TRUE(stay.score.satisfied);
    ASSERT_NE(TwoModes::part(stay.state), 0);
    ASSERT_EQ(stay.iteration, chain.counts().iteration);
    samples = chain.counts().samples;
    ASSERT_EQ(samples, found);
  }
  EXPECT_LT(i, most_iterations) << "learning ended";
  EXPECT_GE(found, least_found);
}

// --- Lessons ------------------------------------------------------------------------------------

/// What a chain knows after its learning and `iterations` more.
inline Lesson lesson_of(const TwoModes& toy, const ChainSettings& settings, int iterations = 0) {
  Chain chain(toy.target(), settings);
  ToySimulator simulator = toy.simulator();
  EXPECT_FALSE(chain.lesson()) << "it knows nothing yet";
  do
    chain.step(simulator);
  while (chain.counts().is_learning);
  for (int i = 0; i < iterations; ++i)
    chain.step(simulator);
  return chain.lesson().value();
}

/// `settings`, but with what another chain of another seed has learned.
inline ChainSettings taught(const TwoModes& toy, const ChainSettings& settings) {
  ChainSettings teacher = settings, with = settings;
  teacher.seed += 100'000;
  with.lesson = lesson_of(toy, teacher, 1000).bytes;
  return with;
}

/// Runs as runs_of gives them, each of a chain that never learned but begins from another one's lesson.
inline std::vector<Said> taught_runs_of(const TwoModes& toy, const ChainSettings& settings, int iterations) {
  std::vector<Said> runs;
  for (int seed = 0; seed < kSeeds; ++seed) {
    ChainSettings with = settings;
    with.seed += static_cast<std::uint64_t>(seed);
    runs.push_back(run_of(toy, taught(toy, with), iterations));
  }
  return runs;
}

/// A chain that begins from a lesson never learns: all that it finds counts. Seed and lesson decide it, bit
/// for bit, whatever interrupts it; and what it knows is of the same kind.
inline void expect_lessons_take_the_place_of_learning(const TwoModes& toy, const ChainSettings& settings,
                                                      LessonKind kind) {
  EXPECT_EQ(lesson_of(toy, settings).kind, kind);
  const ChainSettings with = taught(toy, settings);
  Chain chain(toy.target(), with), same(toy.target(), with);
  ChainSettings other_seed = with;
  other_seed.seed += 1;
  Chain other(toy.target(), other_seed);
  ToySimulator simulator = toy.simulator();
  std::uint64_t found = 0;
  for (int i = 0; i < 3000; ++i) {
    ASSERT_FALSE(chain.counts().is_learning) << i;
    const bool told = chain.step(simulator);
    ASSERT_EQ(told, same.step(simulator)) << i;
    other.step(simulator);
    if (!told || !chain.stay().is_sample) continue;
    ++found;
    ASSERT_GT(chain.stay().weight, 0u) << i;
    ASSERT_TRUE(chain.stay().score.satisfied);
  }
  EXPECT_GE(found, 20u);
  EXPECT_EQ(chain.checkpoint(), same.checkpoint());
  EXPECT_NE(chain.stay().state, other.stay().state);
  EXPECT_EQ(chain.lesson()->kind, kind);
  // The first States of a ladder's replicas are simulated in its first round.
  expect_resumes(toy, with, 400, [](int) { return true; });

  ChainSettings damaged = with;
  for (std::size_t length = 1; length < with.lesson.size(); length += length < 100 ? 1 : 97) {
    damaged.lesson = with.lesson.substr(0, length);
    EXPECT_THROW(Chain(toy.target(), damaged), std::runtime_error) << length;
  }
  damaged.lesson = with.lesson + '\0';
  EXPECT_THROW(Chain(toy.target(), damaged), std::runtime_error);
  damaged.lesson = with.lesson;
  damaged.method = Method::metropolis;
  EXPECT_THROW(Chain(toy.target(), damaged), std::runtime_error) << "it belongs to another method";
}

}  // namespace retake::tests
