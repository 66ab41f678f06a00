// Moves of dice that end where it is wished: exact beside rejection, reversible, and quick to a first one.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/worlds/dice/fixture.h"
#include "worlds/dice/tumble.h"
#include "worlds/scenario.h"

namespace retake::tests {
namespace {

using nlohmann::json;

/// Dice that are to come to rest side by side, showing their own numbers if they are to show some.
std::shared_ptr<const Scenario> row(int dice, double tolerance, bool with_faces, json model) {
  json wishes = json::array();
  for (int die = 1; die <= dice; ++die) {
    const std::string body = "die_" + std::to_string(die);
    wishes.push_back({{"kind", "rest_position"},
                      {"body", body},
                      {"x", 0.12},
                      {"z", 0.024 * (die - 0.5 * (dice + 1))},
                      {"sd", tolerance},
                      {"tolerance", tolerance}});
    if (with_faces) wishes.push_back({{"kind", "face_up"}, {"body", body}, {"face", die}});
  }
  model["dice"] = dice;
  return Scenario::read({{"world", "dice"}, {"model", std::move(model)}, {"constraints", wishes}});
}

double measure(const Scenario& scenario, const Score& score, const std::string& name) {
  for (std::size_t i = 0; i < scenario.measures().size(); ++i)
    if (scenario.measures()[i].name == name) return score.measures[i];
  ADD_FAILURE() << name;
  return kAbsent;
}

TEST(DiceMoves, BringDiceToTheirPlacesWithTheirFaces) {
  for (const char* pose : {"random", "fixed"}) {
    const auto scenario = row(2, 0.004, true, {{"pose", pose}});
    const auto performer = scenario->make_performer();
    Chain chain(scenario->target(Ratios::exact), {.seed = 71, .method = Method::conditional});
    for (int i = 0; i < 20'000 && chain.counts().samples == 0; ++i)
      chain.step(*performer);
    ASSERT_EQ(chain.counts().samples, 1u) << pose;
    const Score& score = chain.stay().score;
    EXPECT_TRUE(score.satisfied);
    for (const int die : {1, 2}) {
      const std::string number = "_" + std::to_string(die);
      EXPECT_LE(std::hypot(measure(*scenario, score, "rest_x" + number) - 0.12,
                           measure(*scenario, score, "rest_z" + number) - (die == 1 ? -0.012 : 0.012)),
                0.004);
      EXPECT_EQ(measure(*scenario, score, "top_face" + number), die);
    }
  }
}

/// What a chain's step does, kernel by kernel: what is proposed, and how it weighs.
struct Proposals {
  explicit Proposals(std::shared_ptr<const Scenario> of)
      : scenario(std::move(of)),
        performer(scenario->make_performer()),
        target(scenario->target(Ratios::exact)) {}

  /// Simulates, from scratch.
  void simulate(const State& state, Score& score, std::unique_ptr<retake::Run>& run) {
    score.measures.resize(scenario->measures().size());
    if (!run) run = performer->make_run();
    ASSERT_EQ(performer->simulate(state, {.record = run.get()}, score).end, SimulationEnd::complete);
  }

  std::shared_ptr<const Scenario> scenario;
  std::unique_ptr<Simulator> performer;
  std::shared_ptr<const Target> target;
};

TEST(DiceMoves, TheWayBackWeighsTheOpposite) {
  // Wide wishes, so that nothing else is in the way; dice that meet often.
  Proposals proposals(row(2, 0.3, false, {{"interval", 0.1}}));
  const Guide& guide = *proposals.target->guide;
  const Model& model = proposals.scenario->model();
  for (const auto& row : guide.kernels().rows()) {
    int weighed = 0, impossible = 0;
    for (std::uint64_t i = 0; i < 60; ++i) {
      RandomStream random({.seed = 72, .iteration = i});
      const State current = draw_state(model, random);
      Score score, candidate_score;
      std::unique_ptr<retake::Run> run, candidate_run;
      proposals.simulate(current, score, run);
      State candidate = current;
      const double bound = row.kernel->propose(model, {current, score, run.get()}, candidate, random);
      if (identical(candidate, current) || !model.in_support(candidate)) continue;
      proposals.simulate(candidate, candidate_score, candidate_run);
      const Simulated from{current, score, run.get()}, to{candidate, candidate_score, candidate_run.get()};
      const double there = row.kernel->log_hastings(model, from, to);
      EXPECT_LE(there, bound + 1e-9) << row.name;
      if (std::isinf(there)) {
        ++impossible;
        continue;
      }
      ++weighed;
      EXPECT_NEAR(row.kernel->log_hastings(model, to, from), -there, 1e-9) << row.name;
    }
    EXPECT_GT(weighed, 15) << row.name;
    // Only these may not meet.
    EXPECT_TRUE(impossible == 0 || row.name == "alone" || row.name == "later") << row.name;
  }
}

TEST(DiceMoves, ThrowsDifferWhereSomeDieIsSeenElsewhere) {
  Proposals proposals(row(2, 0.3, false, {{"paint", "random"}}));
  const Guide& guide = *proposals.target->guide;
  const Model& model = proposals.scenario->model();
  const auto differ = [&](const State& a, const State& b) {
    Score of_a, of_b;
    std::unique_ptr<retake::Run> run_a, run_b;
    proposals.simulate(a, of_a, run_a);
    proposals.simulate(b, of_b, run_b);
    return guide.differ(model, {a, of_a, run_a.get()}, {b, of_b, run_b.get()});
  };
  const auto kernel_of = [&](const std::string& name) -> const ScoredKernel& {
    for (const auto& row : guide.kernels().rows())
      if (row.name == name) return *row.kernel;
    throw std::runtime_error(name);
  };
  int paints = 0, poses = 0;
  for (std::uint64_t i = 0; i < 10; ++i) {
    RandomStream random({.seed = 74, .iteration = i});
    const State first = draw_state(model, random), second = draw_state(model, random);
    EXPECT_FALSE(differ(first, first));
    EXPECT_TRUE(differ(first, second));
    // Another paint is the same motion; another pose of grid and dice is one elsewhere.
    State other = first;
    for (Eigen::Index variable = 0; variable < other.size(); ++variable) {
      const Variable& what = model.variables()[static_cast<std::size_t>(variable)];
      if (what.name.find("paint") == std::string::npos) continue;
      other[variable] = what.prior.draw(random);
      ++paints;
    }
    EXPECT_FALSE(differ(first, other));
    Score score;
    std::unique_ptr<retake::Run> run;
    proposals.simulate(first, score, run);
    other = first;
    kernel_of("pose").propose(model, {first, score, run.get()}, other, random);
    poses += differ(first, other) ? 1 : 0;
  }
  EXPECT_EQ(paints, 20);
  EXPECT_GT(poses, 0);
  EXPECT_LT(poses, 10) << "most poses are moved by little";
}

TEST(DiceMoves, WhatMovesAloneLeavesTheOthersAlone) {
  Proposals proposals(row(3, 0.3, false, json::object()));
  const Guide& guide = *proposals.target->guide;
  const Model& model = proposals.scenario->model();
  int moved = 0;
  for (const auto& row : guide.kernels().rows()) {
    if (row.name != "alone" && row.name != "later") continue;
    for (std::uint64_t i = 0; i < 80; ++i) {
      RandomStream random({.seed = 73, .iteration = i});
      const State current = draw_state(model, random);
      Score score, candidate_score;
      std::unique_ptr<retake::Run> run, candidate_run;
      proposals.simulate(current, score, run);
      State candidate = current;
      row.kernel->propose(model, {current, score, run.get()}, candidate, random);
      if (identical(candidate, current) || !model.in_support(candidate)) continue;
      proposals.simulate(candidate, candidate_score, candidate_run);
      const Simulated from{current, score, run.get()}, to{candidate, candidate_score, candidate_run.get()};
      if (std::isinf(row.kernel->log_hastings(model, from, to))) continue;
      const auto& before = static_cast<const dice::Tumble&>(*run);
      const auto& after = static_cast<const dice::Tumble&>(*candidate_run);
      int changed = 0;
      for (std::size_t die = 0; die < 3; ++die) {
        const auto &a = before.paths[die]->states, &b = after.paths[die]->states;
        const bool is_same =
            a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                               [](const auto& x, const auto& y) { return x.same_bits(y); });
        changed += is_same ? 0 : 1;
      }
      EXPECT_LE(changed, 1) << row.name;
      moved += changed;
    }
  }
  EXPECT_GT(moved, 20);
}

TEST(DiceMoves, DiceAndGridMoveTogetherWithoutSimulation) {
  Proposals proposals(row(3, 0.3, false, json::object()));
  const Model& model = proposals.scenario->model();
  int moved = 0;
  double stepped = 0;
  for (const auto& row : proposals.target->guide->kernels().rows()) {
    if (row.name != "pose") continue;
    for (std::uint64_t i = 0; i < 40; ++i) {
      RandomStream random({.seed = 74, .iteration = i});
      const State current = draw_state(model, random);
      Score score, candidate_score;
      std::unique_ptr<retake::Run> run;
      proposals.simulate(current, score, run);
      State candidate = current;
      row.kernel->propose(model, {current, score, run.get()}, candidate, random);
      if (!model.in_support(candidate)) continue;
      candidate_score.measures.resize(score.measures.size());
      const auto outcome = proposals.performer->simulate(
          candidate, {.current_state = &current, .current_run = run.get()}, candidate_score);
      ++moved;
      stepped += outcome.simulated_seconds;
      const std::string name = "rest_x_1";
      EXPECT_NE(measure(*proposals.scenario, score, name),
                measure(*proposals.scenario, candidate_score, name));
      // Distances between dice stay.
      const auto apart = [&](const Score& of) {
        return std::hypot(
            measure(*proposals.scenario, of, "rest_x_1") - measure(*proposals.scenario, of, "rest_x_3"),
            measure(*proposals.scenario, of, "rest_z_1") - measure(*proposals.scenario, of, "rest_z_3"));
      };
      EXPECT_NEAR(apart(score), apart(candidate_score), 1e-12);
    }
  }
  EXPECT_GT(moved, 10);
  EXPECT_EQ(stepped, 0);
}

// --- Beside rejection ----------------------------------------------------------------------------------

/// Numbers of a throw, of all kinds that moves set or depend on.
std::vector<double> numbers(const Scenario& scenario, const State& state, const Score& score, int dice) {
  std::vector<double> all = {measure(scenario, score, "dice_met"), measure(scenario, score, "touched_points"),
                             measure(scenario, score, "settling_time")};
  const auto& variables = scenario.model().variables();
  for (int die = 1; die <= dice; ++die) {
    const std::string name = "die_" + std::to_string(die);
    const std::string number = dice == 1 ? "" : "_" + std::to_string(die);
    const double x = measure(scenario, score, "rest_x" + number),
                 z = measure(scenario, score, "rest_z" + number);
    all.push_back(std::hypot(x - 0.12, z - 0.024 * (die - 0.5 * (dice + 1))));
    for (std::size_t i = 0; i < variables.size(); ++i)
      for (const char* what : {"_x", "_height", "_velocity_x", "_velocity_z"})
        if (variables[i].name == name + what) all.push_back(state[static_cast<Eigen::Index>(i)]);
  }
  return all;
}

/// Means of many chains against those of draws that came out as wished.
void expect_exact(const Scenario& scenario, int dice, std::uint64_t hits, std::uint64_t chains,
                  std::uint64_t iterations) {
  const auto performer = scenario.make_performer();
  std::vector<std::vector<double>> plain;
  Chain rejection(scenario.target(Ratios::exact), {.seed = 81, .method = Method::rejection});
  while (plain.size() < hits)
    if (rejection.step(*performer) && rejection.stay().score.satisfied)
      plain.push_back(numbers(scenario, rejection.stay().state, rejection.stay().score, dice));

  std::vector<std::vector<double>> means;
  for (std::uint64_t c = 0; c < chains; ++c) {
    Chain chain(scenario.target(Ratios::exact), {.seed = 82 + c, .method = Method::conditional});
    std::vector<double> sum(plain[0].size(), 0);
    double weight = 0;
    std::vector<double> now;
    std::uint64_t stood = 0;
    const auto leave = [&] {
      for (std::size_t k = 0; k < sum.size() && !now.empty(); ++k)
        sum[k] += static_cast<double>(stood) * now[k];
      weight += now.empty() ? 0 : static_cast<double>(stood);
    };
    for (std::uint64_t i = 0; i < iterations; ++i) {
      if (chain.step(*performer)) {
        leave();
        now = numbers(scenario, chain.stay().state, chain.stay().score, dice);
      }
      stood = chain.stay().weight;
    }
    leave();
    for (double& each : sum)
      each /= weight;
    means.push_back(std::move(sum));
  }

  double largest = 0, squares = 0;
  for (std::size_t k = 0; k < plain[0].size(); ++k) {
    std::vector<double> left, right;
    for (const auto& each : plain)
      left.push_back(each[k]);
    for (const auto& each : means)
      right.push_back(each[k]);
    const double z = z_of_means(left, right);
    std::printf("number %2zu: %.5f by rejection, %.5f by chains, z %.2f\n", k, moments(left).mean,
                moments(right).mean, z);
    largest = std::max(largest, std::abs(z));
    squares += z * z;
  }
  std::printf("%zu numbers: sum of z^2 %.1f, largest |z| %.2f\n", plain[0].size(), squares, largest);
  EXPECT_LT(largest, kLargestZ);
}

TEST(SlowDiceMoves, AreExactForTwoDiceWithinFiveCentimetres) {
  expect_exact(*row(2, 0.05, false, json::object()), 2, 1500, 24, 40'000);
}
TEST(SlowDiceMoves, AreExactForTwoDiceThatMeetOften) {
  expect_exact(*row(2, 0.1, false, {{"interval", 0.1}, {"pose", "fixed"}}), 2, 4000, 24, 30'000);
}
TEST(SlowDiceMoves, AreExactForThreeDiceWithinSixCentimetres) {
  expect_exact(*row(3, 0.06, false, {{"interval", 0.15}}), 3, 2000, 24, 40'000);
}
TEST(SlowDiceMoves, AreExactForOneDieOnATableThatIsGlued) {
  expect_exact(*row(1, 0.02, false, {{"pose", "fixed"}}), 1, 4000, 24, 60'000);
}

}  // namespace
}  // namespace retake::tests
