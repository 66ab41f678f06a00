// What every registered world promises: World, Scene, Physics and Simulator, checked for all of worlds().
// Seeds are fixed; each statistical comparison errs with probability 1e-6.
#include <cmath>
#include <set>
#include <thread>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"
#include "worlds/formats/recorded.h"

namespace retake::tests {
namespace {

std::string name_of(const ::testing::TestParamInfo<const World*>& tested) {
  return std::string(tested.param->name());
}

class WorldContract : public ::testing::TestWithParam<const World*> {
 protected:
  const World& world = *GetParam();

  std::vector<std::shared_ptr<const Scenario>> examples() const {
    std::vector<std::shared_ptr<const Scenario>> scenarios;
    for (const json& example : world.examples())
      scenarios.push_back(Scenario::read(example));
    return scenarios;
  }
  /// The first example's model without any wish.
  std::shared_ptr<const Scenario> without_constraints() const {
    json document = world.examples().at(0);
    document["constraints"] = json::array();
    return Scenario::read(document);
  }
  static std::vector<State> draw_states(const Scenario& scenario, std::uint64_t seed, int count) {
    RandomStream random = stream(seed);
    std::vector<State> states;
    for (int i = 0; i < count; ++i)
      states.push_back(draw_state(scenario.model(), random));
    return states;
  }
  static std::string digest_of(Scenario::Performer& performer, const State& state) {
    const auto take = performer.perform(state);
    return take.complete ? digest(state, take.animation) : "failed";
  }
  void expect_scores_agree(int count) const;
};

class ThreadsWorldContract : public WorldContract {};
class SlowWorldContract : public WorldContract {};
INSTANTIATE_TEST_SUITE_P(All, WorldContract, ::testing::ValuesIn(worlds()), name_of);

// --- Documents -----------------------------------------------------------------------------------

void expect_schema_is_complete(const json& schema, const std::string& where);

/// The type of a field, with what the type needs.
void expect_type_is_complete(const json& property, const std::string& where) {
  const std::string type = property.at("type");
  if (type == "array" && property.contains("uniqueItems")) {
    EXPECT_EQ(property.at("uniqueItems"), true) << where;
    EXPECT_GE(property.at("minItems"), 0) << where;
    EXPECT_EQ(property.at("items").at("type"), "integer") << where;
    EXPECT_TRUE(property.at("items").contains("minimum") && property.at("items").contains("maximum"))
        << where;
  } else if (type == "array") {
    EXPECT_GT(property.at("maxItems"), 0) << where;
    expect_type_is_complete(property.at("items"), where + "/items");
  } else if (type == "object") {
    expect_schema_is_complete(property, where + "/");
  } else if (type == "string") {
    EXPECT_NE(property.contains("enum"), property.contains("maxLength")) << where;
    if (property.contains("maxLength")) {
      EXPECT_GT(property.at("maxLength"), 0) << where;
    }
  } else {
    EXPECT_TRUE(type == "number" || type == "integer" || type == "boolean") << where << ": " << type;
  }
}

void expect_schema_is_complete(const json& schema, const std::string& where) {
  EXPECT_EQ(schema.at("type"), "object") << where;
  EXPECT_EQ(schema.at("additionalProperties"), false) << where;
  for (const auto& [name, property] : schema.at("properties").items()) {
    expect_type_is_complete(property, where + name);
    EXPECT_FALSE(property.at("description").get<std::string>().empty()) << where << name;
    const json required = schema.value("required", json::array());
    const bool is_required = std::find(required.begin(), required.end(), name) != required.end();
    EXPECT_NE(is_required, property.contains("default")) << where << name;
    if (property.contains("default")) {
      EXPECT_TRUE(property.contains("x-source")) << where << name;
    }
  }
}

TEST_P(WorldContract, DescribesItselfWhole) {
  EXPECT_EQ(find_world(world.name()), &world);
  EXPECT_GE(world.version(), 1);
  EXPECT_FALSE(world.summary().empty());
  expect_schema_is_complete(world.model_parameters().schema(), "/model/");
  EXPECT_FALSE(world.term_kinds().empty());
  std::set<std::string> kinds;
  for (const TermKind& kind : world.term_kinds()) {
    EXPECT_TRUE(kinds.insert(kind.kind).second) << kind.kind;
    EXPECT_FALSE(kind.summary.empty()) << kind.kind;
    expect_schema_is_complete(kind.parameters.schema(), kind.kind + "/");
  }
}

TEST_P(WorldContract, EveryModelParameterHasADefault) {
  EXPECT_TRUE(faults_of([&] {
                Scenario::read({{"world", world.name()}, {"constraints", json::array()}});
              }).empty());
}

TEST_P(WorldContract, ExamplesAreReadAndNamed) {
  ASSERT_FALSE(world.examples().empty());
  for (const auto& scenario : examples()) {
    EXPECT_EQ(&scenario->world(), &world);
    EXPECT_FALSE(scenario->title().empty());
    EXPECT_FALSE(scenario->document().at("constraints").empty());
    std::set<std::string> names;
    for (const Measure& measure : scenario->measures())
      EXPECT_TRUE(names.insert(measure.name).second) << measure.name;
    for (const Ratios ratios : {Ratios::exact, Ratios::paper})
      EXPECT_FALSE(scenario->target(ratios)->kernels.rows().empty());
  }
}

// --- The prior comes back ------------------------------------------------------------------------

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

/// Two sets of independent States follow one distribution: presence, mean and shape of every
/// Variable. Overrides are no part of it.
void expect_same_distribution(const Model& model, const std::vector<State>& left,
                              const std::vector<State>& right) {
  // Three comparisons a Variable share the error rate (Bonferroni).
  const double rate = kErrorRate / static_cast<double>(3 * model.size());
  const double largest_z = -normal_quantile(rate / 2);
  for (std::size_t i = 0; i < model.size(); ++i) {
    if (model.variables()[i].is_override) continue;
    const auto collect = [&](const std::vector<State>& states, auto&& of) {
      std::vector<double> values;
      for (const State& state : states)
        of(values, state[static_cast<Eigen::Index>(i)]);
      return values;
    };
    const auto presence = [](std::vector<double>& values, double value) {
      values.push_back(std::isnan(value) ? 0 : 1);
    };
    const auto present = [](std::vector<double>& values, double value) {
      if (!std::isnan(value)) values.push_back(value);
    };
    const Variable& variable = model.variables()[i];
    EXPECT_LT(std::abs(z_of_means(collect(left, presence), collect(right, presence))), largest_z)
        << variable.name;
    const auto a = collect(left, present), b = collect(right, present);
    EXPECT_LT(std::abs(z_of_means(a, b)), largest_z) << variable.name;
    if (variable.prior.kind() != Distribution::Kind::on_off) {
      EXPECT_GT(kolmogorov_smirnov_p(a, b), rate) << variable.name;
    }
  }
}

/// What a chain has overridden follows the overrides' own priors, or nearly: these may be clamped where one
/// draw in a thousand is.
void expect_overrides_follow_their_prior(const Model& model, const std::vector<State>& prior,
                                         const std::vector<State>& walked) {
  std::vector<double> ranks;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Variable& variable = model.variables()[i];
    if (!variable.is_override) continue;
    for (const State& state : prior)
      EXPECT_TRUE(std::isnan(state[static_cast<Eigen::Index>(i)])) << variable.name;
    for (const State& state : walked)
      if (const double value = state[static_cast<Eigen::Index>(i)];
          !std::isnan(value) && ranks.size() < 20000)
        ranks.push_back(cdf(variable.prior, value));
  }
  if (ranks.empty()) return;
  EXPECT_GT(kolmogorov_smirnov_p(ranks, [](double rank) { return rank; }), kErrorRate);
}

TEST_P(WorldContract, AConstantConstraintGivesThePriorBack) {
  // Every chain begins at a draw of the prior and its end is one too, whether it mixes or not; ends of chains
  // with different indices are independent.
  constexpr int kChains = 3000, kIterations = 60;
  std::vector<std::shared_ptr<const Scenario>> scenarios = examples();
  scenarios.push_back(without_constraints());
  for (const auto& scenario : scenarios) {
    const Model& model = scenario->model();
    std::vector<State> prior = draw_states(*scenario, 141, kChains), walked, kept;
    ConstantSimulator simulator;
    std::uint64_t moves = 0;
    for (std::uint32_t index = 0; index < kChains; ++index) {
      Chain chain(scenario->target(Ratios::exact), {.seed = 142, .index = index});
      for (int i = 0; i < kIterations; ++i)
        moves += chain.step(simulator);
      walked.push_back(chain.stay().state);
    }
    Chain rejection(scenario->target(Ratios::exact), {.seed = 143, .method = Method::rejection});
    while (kept.size() < kChains)
      if (rejection.step(simulator)) kept.push_back(rejection.stay().state);
    EXPECT_GT(moves, kChains * kIterations / 20u);
    expect_same_distribution(model, prior, walked);
    expect_same_distribution(model, prior, kept);
    expect_overrides_follow_their_prior(model, prior, walked);
  }
}

TEST_P(WorldContract, WithoutConstraintsEverySimulationThatEndsIsPerfect) {
  const auto scenario = without_constraints();
  const auto performer = scenario->make_performer();
  Score score;
  score.measures.resize(scenario->measures().size());
  int complete = 0;
  for (const State& state : draw_states(*scenario, 144, 30)) {
    const SimulationOutcome outcome = performer->simulate(state, {}, score);
    ASSERT_NE(outcome.end, SimulationEnd::stopped);
    if (outcome.end == SimulationEnd::failed) continue;
    ++complete;
    EXPECT_EQ(score.log_constraint, 0);
    EXPECT_TRUE(score.satisfied);
  }
  EXPECT_GT(complete, 24) << "simulations that fail should be rare";
}

// --- Determinism -----------------------------------------------------------------------------------

TEST_P(WorldContract, EqualStatesGiveEqualAnimationsWhateverRanBefore) {
  for (const auto& scenario : examples()) {
    const std::vector<State> states = draw_states(*scenario, 145, 8);
    const auto first = scenario->make_performer(), second = scenario->make_performer();
    std::vector<std::string> digests;
    for (const State& state : states)
      digests.push_back(digest_of(*first, state));
    EXPECT_GT(std::set<std::string>(digests.begin(), digests.end()).size(), 4u) << "different states differ";
    Score score;
    score.measures.resize(scenario->measures().size());
    for (std::size_t i = states.size(); i-- > 0;) {
      second->simulate(states[(i + 3) % states.size()], {}, score);
      EXPECT_EQ(digest_of(*second, states[i]), digests[i]);
      EXPECT_EQ(digest_of(*first, states[i]), digests[i]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, ThreadsWorldContract, ::testing::ValuesIn(worlds()), name_of);

TEST_P(ThreadsWorldContract, FourThreadsGiveTheSameAnimationsAndChainsAsOne) {
  const auto scenario = examples().at(0);
  const std::vector<State> states = draw_states(*scenario, 146, 6);
  const auto work = [&](std::vector<std::string>& results) {
    const auto performer = scenario->make_performer();
    for (const State& state : states)
      results.push_back(digest_of(*performer, state));
    Chain chain(scenario->target(Ratios::exact), {.seed = 147, .method = world.default_method()});
    for (int i = 0; i < 40; ++i)
      chain.step(*performer);
    results.push_back(chain.checkpoint());
  };
  std::vector<std::string> alone;
  work(alone);
  std::vector<std::vector<std::string>> together(4);
  {
    std::vector<std::jthread> threads;
    for (auto& results : together)
      threads.emplace_back([&] { work(results); });
  }
  for (const auto& results : together)
    EXPECT_EQ(results, alone);
}

// --- Viewpoint -----------------------------------------------------------------------------------------

TEST_P(WorldContract, AViewpointIsABoxSeenFromTheSideOrAbove) {
  for (const auto& scenario : examples()) {
    const auto performer = scenario->make_performer();
    const auto take = performer->perform(draw_states(*scenario, 151, 1).front());
    if (!take.complete) continue;
    const auto viewpoint = world.viewpoint(take.animation);
    if (!viewpoint) continue;
    EXPECT_TRUE(viewpoint->center.allFinite());
    EXPECT_TRUE(viewpoint->half_extents.allFinite());
    EXPECT_GE(viewpoint->half_extents.minCoeff(), 0);
    EXPECT_GT(viewpoint->half_extents.maxCoeff(), 0);
    EXPECT_LE(std::abs(viewpoint->azimuth), 3.15);
    EXPECT_GE(viewpoint->elevation, 0);
    EXPECT_LT(viewpoint->elevation, 1.57);
  }
}

// --- Scores ------------------------------------------------------------------------------------------

void expect_value_of_kind(const Measure& measure, double value) {
  if (std::isnan(value)) return;
  if (measure.kind == Measure::Kind::flag) {
    EXPECT_TRUE(value == 0 || value == 1) << measure.name << " is " << value;
  }
  if (measure.kind == Measure::Kind::integer_set) {
    EXPECT_EQ(set_of(members_of(value)), value) << measure.name;
  }
}

void WorldContract::expect_scores_agree(int count) const {
  for (const auto& scenario : examples()) {
    const auto performer = scenario->make_performer();
    Score score;
    score.measures.assign(scenario->measures().size(), kAbsent);
    for (const State& state : draw_states(*scenario, 148, count)) {
      const bool complete = performer->simulate(state, {}, score).end == SimulationEnd::complete;
      const auto take = performer->perform(state);
      ASSERT_EQ(complete, take.complete);
      if (!complete) continue;
      ASSERT_TRUE(identical(score, take.score))
          << score.log_constraint << " and " << take.score.log_constraint;
      ASSERT_LE(score.log_constraint, 0);
      for (std::size_t i = 0; i < score.measures.size(); ++i)
        expect_value_of_kind(scenario->measures()[i], score.measures[i]);
      // Stopping early is allowed exactly where the score does not exceed what is needed.
      Score other = score;
      const double needed = score.log_constraint - 1e-9;
      ASSERT_EQ(performer->simulate(state, {.needed = needed}, other).end, SimulationEnd::complete);
      ASSERT_TRUE(identical(score, other)) << "`needed` changed the score";
    }
  }
}

TEST_P(WorldContract, PerformedAndSimulatedScoresAgreeBitForBit) {
  expect_scores_agree(100);
}

INSTANTIATE_TEST_SUITE_P(Slow, SlowWorldContract, ::testing::ValuesIn(worlds()), name_of);
TEST_P(SlowWorldContract, PerformedAndSimulatedScoresAgreeBitForBit) {
  expect_scores_agree(2000);
}

TEST_P(WorldContract, ExamplesAreSatisfiedByTheirDefaultMethod) {
  constexpr std::uint64_t kMostIterations = 60000;  // a wish of 1 in 2,500 draws fails once in 10^10
  for (const auto& scenario : examples()) {
    const auto performer = scenario->make_performer();
    Chain chain(scenario->target(Ratios::exact), {.seed = 149, .method = world.default_method()});
    while (chain.counts().samples == 0 && chain.counts().iteration < kMostIterations)
      chain.step(*performer);
    EXPECT_GT(chain.counts().samples, 0u) << scenario->title();
  }
}

// --- Animations ----------------------------------------------------------------------------------------

void expect_consistent(const Animation& animation) {
  ASSERT_GE(animation.frames, 1u);
  ASSERT_GT(animation.rate, 0);
  ASSERT_GE(animation.bodies.size(), animation.tracks.size());
  for (std::size_t track = 0; track < animation.tracks.size(); ++track) {
    EXPECT_EQ(animation.bodies[track].track, track) << "the bodies of the tracks come first";
    EXPECT_EQ(animation.bodies[track].name, animation.tracks[track].name);
  }
  std::vector<int> followers(animation.tracks.size(), 0);
  for (const Body& body : animation.bodies) {
    EXPECT_FALSE(body.name.empty());
    EXPECT_EQ(body.colour.size(), 7u) << body.colour;
    EXPECT_EQ(body.colour.find_first_not_of("0123456789abcdef", 1), std::string::npos) << body.colour;
    EXPECT_NE(body.surface, Surface::plain) << body.name << " does not tell its surface";
    if (body.track) {
      ASSERT_LT(*body.track, animation.tracks.size());
      ++followers[*body.track];
    } else {
      EXPECT_NEAR(body.pose.rotation.norm(), 1, 1e-9);
      EXPECT_TRUE(body.pose.position.allFinite());
    }
  }
  for (const int count : followers)
    EXPECT_GE(count, 1) << "a track that nothing follows";
  for (const Track& track : animation.tracks) {
    ASSERT_EQ(track.positions.cols(), static_cast<Eigen::Index>(animation.frames));
    ASSERT_EQ(track.rotations.cols(), static_cast<Eigen::Index>(animation.frames));
    ASSERT_TRUE(track.positions.allFinite());
    for (Eigen::Index frame = 0; frame < track.rotations.cols(); ++frame) {
      ASSERT_NEAR(track.rotations.col(frame).norm(), 1, 1e-6);
      if (frame == 0) continue;
      ASSERT_GT(track.rotations.col(frame).dot(track.rotations.col(frame - 1)), 0)
          << "two hemispheres at " << frame;
    }
    EXPECT_LT((track.positions.rightCols(1) - track.rest.position).norm(), 1e-3) << "does not end at rest";
    EXPECT_LT(1 - std::abs(track.rotations.rightCols(1).col(0).dot(track.rest.rotation.coeffs())), 1e-4);
  }
  double time = 0;
  for (const ContactEvent& event : animation.events) {
    EXPECT_GE(event.time, time) << "events out of order";
    time = event.time;
    EXPECT_LE(event.time, animation.duration() + 1e-9);
    EXPECT_NE(event.bodies[0], event.bodies[1]);
    for (const std::size_t body : event.bodies)
      ASSERT_LT(body, animation.bodies.size());
    EXPECT_TRUE(animation.bodies[event.bodies[0]].track || animation.bodies[event.bodies[1]].track);
    EXPECT_GE(event.impulse, 0);
    EXPECT_NEAR(event.normal.norm(), 1, 1e-6);
    EXPECT_TRUE(event.position.allFinite());
  }
}

TEST_P(WorldContract, AnimationsAreConsistentAndCanBeRecorded) {
  for (const auto& scenario : examples()) {
    const auto performer = scenario->make_performer();
    for (const State& state : draw_states(*scenario, 150, 20)) {
      EXPECT_TRUE(identical(decode_state(encode_state(state)), state));
      const auto take = performer->perform(state);
      if (!take.complete) continue;
      expect_consistent(take.animation);
      const Animation decoded = decode_animation(encode_animation(take.animation));
      expect_consistent(decoded);
      EXPECT_EQ(decoded.bodies.size(), take.animation.bodies.size());
      EXPECT_EQ(decoded.events.size(), take.animation.events.size());
    }
  }
}

}  // namespace
}  // namespace retake::tests
