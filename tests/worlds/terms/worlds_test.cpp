// The general constraint terms in every world, the minimal one too: bounds of real animations under way,
// scores with and without frames, and chains that find what is wished, whether or not they stop early. Seeds
// are fixed.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests {
namespace {

using Eigen::Vector3d;

/// A small scene of a world, and what can be asked of it.
struct Stage {
  explicit Stage(const World& world)
      : open(open_smallest(world)), performer(open.scenario->make_performer()) {
    const json fields = kind("rest_position").parameters.schema().at("properties");
    reach = 10 * fields.at("sd").at("default").get<double>();
    is_flat = !fields.contains("z");
    names_bodies = fields.contains("body");
    for (const Roster::Mover& mover : open.roster.movers)
      movers.push_back(mover.name);
  }
  const TermKind& kind(const std::string& name) const {
    const auto& kinds = open.world().term_kinds();
    return *std::find_if(kinds.begin(), kinds.end(), [&](const TermKind& each) { return each.kind == name; });
  }
  /// A document of its model with wishes.
  json with(const json& constraints) const {
    return {{"world", open.world().name()},
            {"model", open.scenario->document().at("model")},
            {"constraints", constraints}};
  }
  std::shared_ptr<const Scenario> scenario_with(const json& constraints) const {
    return Scenario::read(with(constraints), {&open.world()});
  }
  const Roster::Mover& mover(const std::string& name) const {
    return *std::find_if(open.roster.movers.begin(), open.roster.movers.end(),
                         [&](const auto& each) { return each.name == name; });
  }
  bool tells_rests() const {
    return std::all_of(open.roster.movers.begin(), open.roster.movers.end(),
                       [](const auto& each) { return each.tells_rest; });
  }

  OpenScenario open;
  std::unique_ptr<Scenario::Performer> performer;
  double reach;                ///< [m], of which wishes may be missed by a part
  bool is_flat, names_bodies;  ///< what `rest_position` takes
  std::vector<std::string> movers;
};

json list_of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

json rest_wish(const Stage& stage, const std::string& body, const Vector3d& place) {
  json wish = {{"kind", "rest_position"}, {"x", place.x()}, {"sd", stage.reach}, {"tolerance", stage.reach}};
  if (!stage.is_flat) wish["z"] = place.z();
  if (stage.names_bodies) wish["body"] = body;
  return wish;
}

/// The event that a mover tells: its rest or its fall; its contacts if it tells neither.
json told_event(const Stage& stage, const std::string& body) {
  const Roster::Mover& mover = stage.mover(body);
  return {{"kind", mover.tells_rest ? "rest" : mover.tells_fall ? "fall" : "contact"}, {"body", body}};
}

/// Wishes of every kind that look around what happened in an animation.
std::vector<json> random_wishes(const Stage& stage, const Animation& animation, RandomStream& random) {
  const auto body = [&] { return stage.movers[random.index(stage.movers.size())]; };
  const auto time = [&] { return 1.1 * animation.duration() * random.uniform(); };
  const auto place = [&] {
    const Track& track = animation.tracks[random.index(animation.tracks.size())];
    const auto frame = static_cast<Eigen::Index>(random.index(animation.frames));
    const Vector3d off(random.gaussian(), random.gaussian(), random.gaussian());
    return Vector3d(track.positions.col(frame) + 0.3 * stage.reach * off);
  };
  const auto event = [&]() -> json {
    if (random.bernoulli(0.5)) return {{"kind", "contact"}, {"body", body()}};
    return told_event(stage, body());
  };
  const auto different_events = [&] {
    json events = json::array();  // one that came twice would be before itself
    for (int draw = 0; draw < 3 || events.size() < 2; ++draw)
      if (json one = event(); std::find(events.begin(), events.end(), one) == events.end())
        events.push_back(std::move(one));
    return events;
  };
  const Vector3d a = place(), b = place();
  return {rest_wish(stage, body(), place()),
          {{"kind", "state_at"},
           {"body", body()},
           {"time", time()},
           {"position", list_of(place())},
           {"velocity", list_of(Vector3d::Zero())},
           {"sd", stage.reach}},
          {{"kind", "contact_at"}, {"body", body()}, {"times", {time(), time()}}, {"sd", 0.2}},
          {{"kind", "contact_at"}, {"bpm", 60 + 200 * random.uniform()}, {"contacts", 4}},
          {{"kind", "contact_at"}, {"bpm", 60}, {"from", "start"}, {"offset", time()}, {"body", body()}},
          {{"kind", "order"}, {"events", different_events()}},
          {{"kind", "inside"},
           {"body", body()},
           {"box", {{"low", list_of(a.cwiseMin(b))}, {"high", list_of(a.cwiseMax(b))}}},
           {"from", 0.2 * time()},
           {"to", animation.duration() + time()},
           {"sd", stage.reach}}};
}

std::unique_ptr<const Term> term_of(const Stage& stage, const json& wish) {
  OpenScenario wished = open_scenario(stage.open.world(), stage.with(json::array({wish})));
  return std::move(wished.terms.front());
}

std::string name_of(const ::testing::TestParamInfo<const World*>& tested) {
  return std::string(tested.param->name());
}

class TermsInWorlds : public ::testing::TestWithParam<const World*> {
 protected:
  const Stage stage{*GetParam()};
};
class SlowTermsInWorlds : public TermsInWorlds {};
INSTANTIATE_TEST_SUITE_P(All, TermsInWorlds, ::testing::ValuesIn(all_worlds()), name_of);
INSTANTIATE_TEST_SUITE_P(Slow, SlowTermsInWorlds, ::testing::ValuesIn(all_worlds()), name_of);

// --- Bounds and scores -------------------------------------------------------------------------------

/// No bound is below what comes of the animation; returns how many said something.
int expect_bounds_hold(const Term& term, const json& document, const Animation& whole) {
  std::vector<double> values(term.measures().size());
  const double score = term.score(whole, values).log_density;
  EXPECT_TRUE(std::isfinite(score));
  int telling = 0;
  const auto check = [&](std::size_t frames, double time) {
    const double bound = term.upper_bound(so_far(whole, frames, time));
    EXPECT_GE(bound, score) << document << " after " << frames << " frames, " << time << " s";
    EXPECT_LE(bound, 0);
    telling += bound < 0 ? 1 : 0;
  };
  for (std::size_t frames = 0; frames <= whole.frames; frames += 5) {
    const double time = frames == 0 ? 0 : static_cast<double>(frames - 1) / whole.rate;
    check(frames, time);
    if (!term.reads_frames()) check(0, time);
  }
  return telling;
}

void expect_bounds_hold(const Stage& stage, std::uint64_t seed, int animations) {
  RandomStream random = stream(seed);
  std::map<std::string, int> telling;
  for (int i = 0; i < animations; ++i) {
    const auto take = stage.performer->perform(draw_state(stage.open.model(), random));
    if (!take.complete || take.animation.tracks.empty()) continue;
    for (const json& wish : random_wishes(stage, take.animation, random))
      telling[wish.at("kind")] += expect_bounds_hold(*term_of(stage, wish), wish, take.animation);
  }
  for (const char* kind : {"state_at", "contact_at", "order", "inside"})
    EXPECT_GT(telling[kind], 0) << kind << " never said anything before the end";
  if (stage.tells_rests()) {
    EXPECT_GT(telling["rest_position"], 0);
  }
}

TEST_P(TermsInWorlds, NoBoundIsBelowWhatComesOfAnAnimation) {
  expect_bounds_hold(stage, 301, 12);
}
TEST_P(SlowTermsInWorlds, NoBoundIsBelowWhatComesOfAnAnimation) {
  expect_bounds_hold(stage, 341, 300);
}

/// Scores of candidates and of what is shown are the same bits, also where only the latter has frames.
TEST_P(TermsInWorlds, ScoresAreTheSameWithAndWithoutFrames) {
  RandomStream random = stream(311);
  for (int i = 0; i < 2; ++i) {
    const State state = draw_state(stage.open.model(), random);
    const auto take = stage.performer->perform(state);
    if (!take.complete || take.animation.tracks.empty()) continue;
    for (const json& wish : random_wishes(stage, take.animation, random)) {
      const auto wished = stage.scenario_with(json::array({wish}));
      const auto judge = wished->make_performer();
      Score score;
      score.measures.resize(wished->measures().size());
      ASSERT_EQ(judge->simulate(state, {}, score).end, SimulationEnd::complete);
      EXPECT_TRUE(identical(score, judge->perform(state).score)) << wish;
    }
  }
}

// --- Chains ------------------------------------------------------------------------------------------

/// The first contact of a mover, after which another one tells its rest or fall; null if there is none.
const ContactEvent* first_hit(const Animation& animation) {
  const bool has_told = std::any_of(animation.tracks.begin(), animation.tracks.end(),
                                    [](const Track& track) { return track.settled || track.fell; });
  return has_told && !animation.events.empty() ? &animation.events.front() : nullptr;
}

/// Wishes for what happens in an animation to the first mover that is hit, which others can come close to.
std::vector<json> wishes_after(const Stage& stage, const Animation& animation) {
  const ContactEvent& hit = *first_hit(animation);
  const Track& track = animation.tracks[std::min(hit.bodies[0], hit.bodies[1])];
  const std::string& body = track.name;
  const std::string& hit_by = animation.bodies[std::max(hit.bodies[0], hit.bodies[1])].name;
  const Track& last = *std::find_if(animation.tracks.rbegin(), animation.tracks.rend(),
                                    [](const Track& each) { return each.settled || each.fell; });
  const double reach = stage.reach, time = std::min(hit.time + 0.1, animation.duration());
  const Vector3d then = track.positions.col(static_cast<Eigen::Index>(time * animation.rate));
  return {rest_wish(stage, body, track.rest.position),
          {{"kind", "state_at"},
           {"body", body},
           {"time", time},
           {"position", list_of(then)},
           {"tolerance", reach / 2},
           {"sd", reach / 2}},
          {{"kind", "contact_at"}, {"body", body}, {"times", {hit.time}}, {"tolerance", 0.1}, {"sd", 0.1}},
          {{"kind", "contact_at"},
           {"body", body},
           {"bpm", 300},
           {"contacts", 1},
           {"tolerance", 0.09},
           {"sd", 0.1}},
          {{"kind", "order"},
           {"events", json::array({{{"kind", "contact"}, {"body", body}, {"with", hit_by}},
                                   told_event(stage, last.name)})}},
          {{"kind", "inside"},
           {"body", body},
           {"box",
            {{"low", list_of(then - Vector3d::Constant(reach))},
             {"high", list_of(then + Vector3d::Constant(reach))}}},
           {"from", time},
           {"to", time + 0.1}}};
}

std::vector<json> wishes_after_a_draw(const Stage& stage, std::uint64_t seed) {
  RandomStream random = stream(seed);
  while (true) {
    const auto take = stage.performer->perform(draw_state(stage.open.model(), random));
    if (take.complete && first_hit(take.animation)) return wishes_after(stage, take.animation);
  }
}

void expect_found(const Scenario& scenario, std::uint64_t seed, std::uint64_t most) {
  const auto performer = scenario.make_performer();
  Chain chain(scenario.target(Ratios::exact), {.seed = seed, .method = scenario.world().default_method()});
  while (chain.counts().samples == 0 && chain.counts().iteration < most)
    chain.step(*performer);
  ASSERT_GT(chain.counts().samples, 0u) << scenario.document();
  const auto take = performer->perform(chain.stay().state);
  EXPECT_TRUE(take.complete && take.score.satisfied) << scenario.document();
  EXPECT_TRUE(identical(take.score, chain.stay().score)) << scenario.document();
}

TEST_P(TermsInWorlds, ChainsFindWhatIsWished) {
  for (const json& wish : wishes_after_a_draw(stage, 321))
    expect_found(*stage.scenario_with(json::array({wish})), 322, 2000);
}

/// Two chains, one of which never stops early, make the same moves.
void expect_equal_chains(const Scenario& scenario, Method method, int steps) {
  const auto one = scenario.make_performer(), other = scenario.make_performer();
  Chain early(scenario.target(Ratios::exact), {.seed = 331, .method = method});
  Chain late(scenario.target(Ratios::exact), {.seed = 331, .method = method, .early_rejection = false});
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(early.step(*one), late.step(*other)) << scenario.document();
    if (early.stay().state.size() == 0 && late.stay().state.size() == 0) continue;
    EXPECT_TRUE(identical(early.stay().state, late.stay().state));
    EXPECT_TRUE(identical(early.stay().score, late.stay().score));
  }
  EXPECT_EQ(early.counts().samples, late.counts().samples);
}

void expect_equal_chains(const Stage& stage, int steps) {
  const std::vector<json> wishes = wishes_after_a_draw(stage, 332);
  for (const json& wish : wishes)
    for (const Method method : {Method::metropolis, stage.open.world().default_method()})
      expect_equal_chains(*stage.scenario_with(json::array({wish})), method, steps);
  // All at once.
  expect_equal_chains(*stage.scenario_with(json(wishes)), Method::metropolis, steps);
}

TEST_P(TermsInWorlds, ChainsAreTheSameWhetherTheyStopEarlyOrNot) {
  expect_equal_chains(stage, 10);
}
TEST_P(SlowTermsInWorlds, ChainsAreTheSameWhetherTheyStopEarlyOrNot) {
  expect_equal_chains(stage, 100);
}

// --- What some worlds alone have ---------------------------------------------------------------------

std::shared_ptr<const Scenario> scenario_of(const char* world, const json& model, const json& constraints) {
  return Scenario::read({{"world", world}, {"model", model}, {"constraints", constraints}});
}

/// A strike whose head pin is hit at 2.4 s.
TEST(SlowTermsInOneWorld, AStrikeCanBeSetToMusic) {
  const auto scenario = scenario_of(
      "bowling", json::object(),
      json::array({{{"kind", "pins"}, {"down", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}}},
                   {{"kind", "contact_at"}, {"body", "pin_1"}, {"with", "ball"}, {"times", {2.4}}}}));
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 351, .method = Method::conditional});
  while (chain.counts().samples < 3 && chain.counts().iteration < 20000)
    chain.step(*performer);
  ASSERT_EQ(chain.counts().samples, 3u);
  const auto take = performer->perform(chain.stay().state);
  const auto hit = std::find_if(take.animation.events.begin(), take.animation.events.end(),
                                [&](const ContactEvent& event) {
                                  return take.animation.bodies[event.bodies[0]].name == "ball" &&
                                         take.animation.bodies[event.bodies[1]].name == "pin_1";
                                });
  ASSERT_NE(hit, take.animation.events.end());
  EXPECT_NEAR(hit->time, 2.4, 0.03);
  for (std::size_t pin = 1; pin <= 10; ++pin)
    EXPECT_TRUE(take.animation.tracks[pin].fell);
  RecordProperty("iterations", static_cast<int>(chain.counts().iteration));
}

/// HI, and the third marble at rest before the first.
TEST(TermsInOneWorld, AWordIsFoundTogetherWithOtherWishes) {
  const json spell = {{"kind", "spell"}, {"text", "HI"}};
  const json order = {{"kind", "order"},
                      {"events", json::array({{{"kind", "rest"}, {"body", "marble_3"}},
                                              {{"kind", "rest"}, {"body", "marble_1"}}})}};
  expect_found(*scenario_of("spelling", json::object(), json::array({spell})), 371, 2000);
  const auto scenario = scenario_of("spelling", json::object(), json::array({spell, order}));
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 372, .method = Method::conditional});
  while (chain.counts().samples == 0 && chain.counts().iteration < 5000)
    chain.step(*performer);
  ASSERT_EQ(chain.counts().samples, 1u);
  EXPECT_TRUE(performer->perform(chain.stay().state).score.satisfied);
}

/// Chains by the guide sample what rejection samples: a word of two bins, in which the second marble rests
/// first and the first one near a place, so that log p_c is not constant.
TEST(SlowTermsInOneWorld, AWordWithOtherWishesIsSampledExactly) {
  constexpr int kChains = 120, kSteps = 1200;
  const json box = {{"columns", 2}, {"rows", 1}, {"balls", 2}, {"interval", 0.02}};
  const json wishes = json::array({{{"kind", "bins"}, {"rows", {"##"}}},
                                   {{"kind", "order"},
                                    {"events", json::array({{{"kind", "rest"}, {"body", "marble_2"}},
                                                            {{"kind", "rest"}, {"body", "marble_1"}}})}},
                                   {{"kind", "rest_position"},
                                    {"body", "marble_1"},
                                    {"x", 0.01},
                                    {"z", 0},
                                    {"sd", 0.01},
                                    {"tolerance", 0.1}}});
  const auto scenario = scenario_of("spelling", box, wishes);
  const auto performer = scenario->make_performer();
  const auto& names = scenario->target(Ratios::exact)->measure_names;
  const auto miss = static_cast<std::size_t>(std::find(names.begin(), names.end(), "miss") - names.begin());
  ASSERT_LT(miss, names.size());
  // The miss, where the marbles were dropped, and how long it took.
  const auto say = [&](const Stay& stay, std::vector<std::vector<double>>& all) {
    all.resize(6);
    const auto value = [&](Eigen::Index index) { return stay.state[index]; };
    const double said[] = {stay.score.measures[miss], value(1), value(2), value(4), value(5),
                           stay.score.measures[2]};
    for (std::size_t i = 0; i < 6; ++i)
      all[i].push_back(said[i]);
  };
  std::vector<std::vector<double>> kept, walked;
  Chain rejection(scenario->target(Ratios::exact), {.seed = 381, .method = Method::rejection});
  while (rejection.counts().samples < 4 * kChains)
    if (rejection.step(*performer) && rejection.stay().score.satisfied) say(rejection.stay(), kept);
  for (std::uint32_t index = 0; index < kChains; ++index) {
    Chain chain(scenario->target(Ratios::exact),
                {.seed = 382, .index = index, .method = Method::conditional});
    for (int i = 0; i < kSteps; ++i)
      chain.step(*performer);
    ASSERT_FALSE(chain.counts().is_learning);
    say(chain.stay(), walked);
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_LT(std::abs(z_of_means(kept[i], walked[i])), kLargestZ) << i;
    EXPECT_GT(kolmogorov_smirnov_p(kept[i], walked[i]), kErrorRate) << i;
  }
}

TEST(TermsInOneWorld, BodiesThatTheSceneDoesNotHaveAreRefused) {
  const auto faults = [](const char* world, const json& model, const json& wish) {
    return pointers(faults_of([&] { scenario_of(world, model, json::array({wish})); }));
  };
  const json pins = {{"rack", {1, 2, 3}}}, box = {{"columns", 3}, {"rows", 2}, {"balls", 4}};
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(faults("bowling", pins, {{"kind", "contact_at"}, {"body", "pin_7"}, {"times", {2.4}}}),
            Pointers{"/constraints/0/body"})
      << "it is not in the rack";
  EXPECT_EQ(faults("spelling", box, {{"kind", "rest_position"}, {"body", "marble_5"}, {"x", 0}, {"z", 0}}),
            Pointers{"/constraints/0/body"});
  EXPECT_EQ(faults("spelling", box, {{"kind", "rest_position"}, {"x", 0}, {"z", 0}}),
            Pointers{"/constraints/0/body"});
  EXPECT_EQ(faults("bowling", pins,
                   {{"kind", "order"},
                    {"events", json::array({{{"kind", "rest"}, {"body", "pin_1"}},
                                            {{"kind", "fall"}, {"body", "ball"}}})}}),
            (Pointers{"/constraints/0/events/0/kind", "/constraints/0/events/1/kind"}));
  EXPECT_TRUE(faults("ball2d", json::object(),
                     {{"kind", "inside"}, {"box", {{"low", {0, 0, 0}}, {"high", {1, 1, 1}}}}})
                  .empty())
      << "the only body";
}

/// Equal wishes of before are equal documents.
TEST(TermsInOneWorld, TheBallsRestPositionHasTheFieldsThatItAlwaysHad) {
  const auto scenario =
      scenario_of("ball2d", json::object(), json::array({{{"kind", "rest_position"}, {"x", 1}}}));
  EXPECT_EQ(scenario->document().at("constraints").dump(),
            R"([{"kind":"rest_position","sd":0.1,"tolerance":0.1,"x":1.0}])");
}

}  // namespace
}  // namespace retake::tests
