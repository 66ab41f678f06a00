// The general constraint terms in the worlds: bounds of real animations under way, scores with and without
// frames, and chains that find what is wished, whether or not they stop early. Seeds are fixed.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"
#include "worlds/bowling/view.h"
#include "worlds/spelling/view.h"

namespace retake::tests {
namespace {

using Eigen::Vector3d;

/// A small scene of a world, and what can be asked of it.
struct Stage {
  std::string world;
  json model;
  std::vector<std::string> movers;
  std::string hit_by;  ///< what the first mover touches
  std::string told;    ///< "rest" or "fall", whichever the last mover tells
  double reach;        ///< [m], of which wishes may be missed by a part
};
const Stage kBall = {"ball2d", json::object(), {"ball"}, "table", "rest", 1};
const Stage kPins = {"bowling", {{"rack", {1, 2, 3}}}, {"pin_1", "ball", "pin_2", "pin_3"}, "ball", "fall",
                     1};
const Stage kBox = {"spelling",
                    {{"columns", 3}, {"rows", 2}, {"balls", 4}, {"interval", 0.05}},
                    {"marble_1", "marble_2", "marble_3", "marble_4"},
                    "partitions",
                    "rest",
                    0.03};

std::shared_ptr<const Scenario> scenario_of(const Stage& stage, const json& constraints) {
  return Scenario::read({{"world", stage.world}, {"model", stage.model}, {"constraints", constraints}});
}

std::unique_ptr<const Term> term_of(const Scenario& scenario, json document) {
  const Parameters model(scenario.document().at("model"));
  for (const TermKind& kind : scenario.world().term_kinds()) {
    if (kind.kind != document.at("kind")) continue;
    std::vector<Fault> faults;
    if (kind.fit) kind.fit(document, model, "", faults);
    const Parameters parameters = kind.parameters.read(document, "", faults, {"kind"});
    EXPECT_TRUE(faults.empty()) << faults[0].pointer << faults[0].detail;
    auto term = kind.make(parameters, model, "", faults);
    EXPECT_TRUE(faults.empty()) << faults[0].pointer << faults[0].detail;
    return term;
  }
  ADD_FAILURE() << document;
  return nullptr;
}

json list_of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
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
    const std::string& last = stage.movers.back();
    return {{"kind", stage.told}, {"body", stage.told == "rest" ? body() : last}};
  };
  json rest = {{"kind", "rest_position"}, {"x", place().x()}, {"sd", stage.reach}};
  if (stage.world != "ball2d") {
    rest["z"] = place().z();
    rest["body"] = body();
  }
  const Vector3d a = place(), b = place();
  return {rest,
          {{"kind", "state_at"},
           {"body", body()},
           {"time", time()},
           {"position", list_of(place())},
           {"velocity", list_of(Vector3d::Zero())},
           {"sd", stage.reach}},
          {{"kind", "contact_at"}, {"body", body()}, {"times", {time(), time()}}, {"sd", 0.2}},
          {{"kind", "contact_at"}, {"bpm", 60 + 200 * random.uniform()}, {"contacts", 4}},
          {{"kind", "contact_at"}, {"bpm", 60}, {"from", "start"}, {"offset", time()}, {"body", body()}},
          {{"kind", "order"}, {"events", json::array({event(), event(), event()})}},
          {{"kind", "inside"},
           {"body", body()},
           {"box", {{"low", list_of(a.cwiseMin(b))}, {"high", list_of(a.cwiseMax(b))}}},
           {"from", 0.2 * time()},
           {"to", animation.duration() + time()},
           {"sd", stage.reach}}};
}

/// An animation as it was at a time, as far as its simulator told.
Animation so_far(const Animation& whole, std::size_t frames, double time) {
  Animation begun = whole;
  begun.frames = frames;
  for (Track& track : begun.tracks) {
    track.positions.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(frames));
    track.rotations.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(frames));
    if (track.settled && *track.settled > time) track.settled.reset();
    if (track.fell && *track.fell > time) track.fell.reset();
    if (!track.settled) track.rest = track.start;
  }
  std::erase_if(begun.events,
                [&](const ContactEvent& event) { return frames == 0 || event.time > begun.duration(); });
  return begun;
}

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
  const auto scenario = scenario_of(stage, json::array());
  const auto performer = scenario->make_performer();
  RandomStream random = stream(seed);
  std::map<std::string, int> telling;
  for (int i = 0; i < animations; ++i) {
    const auto take = performer->perform(draw_state(scenario->model(), random));
    if (!take.complete || take.animation.tracks.empty()) continue;
    for (const json& wish : random_wishes(stage, take.animation, random))
      telling[wish.at("kind")] += expect_bounds_hold(*term_of(*scenario, wish), wish, take.animation);
  }
  for (const char* kind : {"state_at", "contact_at", "order", "inside"})
    EXPECT_GT(telling[kind], 0) << kind << " never said anything before the end";
  if (stage.told == "rest") {
    EXPECT_GT(telling["rest_position"], 0);
  }
}

TEST(TermsInWorlds, NoBoundIsBelowWhatComesOfAnAnimation) {
  expect_bounds_hold(kBall, 301, 20);
  expect_bounds_hold(kPins, 302, 12);
  expect_bounds_hold(kBox, 303, 20);
}

/// Scores of candidates and of what is shown are the same bits, also where only the latter has frames.
void expect_scores_agree(const Stage& stage, std::uint64_t seed, int animations) {
  const auto scenario = scenario_of(stage, json::array());
  const auto performer = scenario->make_performer();
  RandomStream random = stream(seed);
  for (int i = 0; i < animations; ++i) {
    const State state = draw_state(scenario->model(), random);
    const auto take = performer->perform(state);
    if (!take.complete || take.animation.tracks.empty()) continue;
    for (const json& wish : random_wishes(stage, take.animation, random)) {
      const auto wished = scenario_of(stage, json::array({wish}));
      const auto judge = wished->make_performer();
      Score score;
      score.measures.resize(wished->measures().size());
      ASSERT_EQ(judge->simulate(state, {}, score).end, SimulationEnd::complete);
      EXPECT_TRUE(identical(score, judge->perform(state).score)) << wish;
    }
  }
}

TEST(TermsInWorlds, ScoresAreTheSameWithAndWithoutFrames) {
  expect_scores_agree(kBall, 311, 3);
  expect_scores_agree(kPins, 312, 2);
  expect_scores_agree(kBox, 313, 3);
}

// --- Chains ------------------------------------------------------------------------------------------

/// Wishes for what happens to the first mover in an animation, which others can come close to.
std::vector<json> wishes_after(const Stage& stage, const Animation& animation) {
  const std::string& body = stage.movers.front();
  const auto track = std::find_if(animation.tracks.begin(), animation.tracks.end(),
                                  [&](const Track& each) { return each.name == body; });
  const std::string other = stage.movers.back();
  const auto hit =
      std::find_if(animation.events.begin(), animation.events.end(), [&](const ContactEvent& event) {
        return std::any_of(event.bodies.begin(), event.bodies.end(),
                           [&](std::size_t index) { return animation.bodies[index].name == body; });
      });
  EXPECT_NE(track, animation.tracks.end());
  EXPECT_NE(hit, animation.events.end());
  const double reach = stage.reach, time = hit->time + 0.1;
  const Vector3d then = track->positions.col(static_cast<Eigen::Index>(time * animation.rate));
  json rest = {
      {"kind", "rest_position"}, {"x", track->rest.position.x()}, {"tolerance", reach}, {"sd", reach}};
  if (stage.world != "ball2d") {
    rest["body"] = body;
    rest["z"] = track->rest.position.z();
  }
  const json last = {{"kind", stage.told}, {"body", other}};
  return {rest,
          {{"kind", "state_at"},
           {"body", body},
           {"time", time},
           {"position", list_of(then)},
           {"tolerance", reach / 2},
           {"sd", reach / 2}},
          {{"kind", "contact_at"}, {"body", body}, {"times", {hit->time}}, {"tolerance", 0.1}, {"sd", 0.1}},
          {{"kind", "contact_at"}, {"body", body}, {"bpm", 300}, {"tolerance", 0.09}, {"sd", 0.1}},
          {{"kind", "order"},
           {"events", json::array({{{"kind", "contact"}, {"body", body}, {"with", stage.hit_by}}, last})}},
          {{"kind", "inside"},
           {"body", body},
           {"box",
            {{"low", list_of(then - Vector3d::Constant(reach))},
             {"high", list_of(then + Vector3d::Constant(reach))}}},
           {"from", time},
           {"to", time + 0.1}}};
}

std::vector<json> wishes_after_a_draw(const Stage& stage, std::uint64_t seed) {
  const auto scenario = scenario_of(stage, json::array());
  const auto performer = scenario->make_performer();
  const auto others = scenario_of(
      stage,
      json::array(
          {{{"kind", "contact_at"}, {"body", stage.movers.front()}, {"times", {0}}, {"tolerance", 100}}}));
  const auto judge = others->make_performer();
  RandomStream random = stream(seed);
  while (true) {
    const State state = draw_state(scenario->model(), random);
    if (judge->perform(state).score.satisfied)
      return wishes_after(stage, performer->perform(state).animation);
  }
}

void expect_found(const Stage& stage, const json& wish, std::uint64_t seed, std::uint64_t most) {
  const auto scenario = scenario_of(stage, json::array({wish}));
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = seed, .method = scenario->world().default_method()});
  while (chain.counts().samples == 0 && chain.counts().iteration < most)
    chain.step(*performer);
  ASSERT_GT(chain.counts().samples, 0u) << stage.world << " " << wish;
  const auto take = performer->perform(chain.stay().state);
  EXPECT_TRUE(take.complete && take.score.satisfied) << wish;
  EXPECT_TRUE(identical(take.score, chain.stay().score)) << wish;
}

TEST(TermsInWorlds, ChainsFindWhatIsWished) {
  for (const Stage* stage : {&kBall, &kPins, &kBox})
    for (const json& wish : wishes_after_a_draw(*stage, 321))
      expect_found(*stage, wish, 322, 2000);
}

/// Two chains, one of which never stops early, make the same moves. Returns how many simulations were
/// stopped.
std::uint64_t expect_equal_chains(const Scenario& scenario, Method method, int steps) {
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
  return late.counts().simulated_seconds > early.counts().simulated_seconds ? 1 : 0;
}

void expect_equal_chains(const Stage& stage, int steps) {
  std::uint64_t saved = 0;
  std::vector<json> wishes = wishes_after_a_draw(stage, 332);
  for (const json& wish : wishes)
    for (const Method method :
         {Method::metropolis, stage.world == "ball2d" ? Method::rejection : Method::conditional})
      saved += expect_equal_chains(*scenario_of(stage, json::array({wish})), method, steps);
  // All at once.
  saved += expect_equal_chains(*scenario_of(stage, json(wishes)), Method::metropolis, steps);
  if (stage.world != "ball2d") {
    EXPECT_GT(saved, 0u) << "nothing was stopped early";
  }
}

TEST(TermsInWorlds, ChainsAreTheSameWhetherTheyStopEarlyOrNot) {
  expect_equal_chains(kBall, 100);
  expect_equal_chains(kPins, 8);
  expect_equal_chains(kBox, 30);
}

TEST(SlowTermsInWorlds, ChainsAreTheSameWhetherTheyStopEarlyOrNot) {
  expect_equal_chains(kBall, 3000);
  expect_equal_chains(kPins, 50);
  expect_equal_chains(kBox, 400);
}

TEST(SlowTermsInWorlds, NoBoundIsBelowWhatComesOfAnAnimation) {
  expect_bounds_hold(kBall, 341, 500);
  expect_bounds_hold(kPins, 342, 200);
  expect_bounds_hold(kBox, 343, 400);
}

/// A strike whose head pin is hit at 2.4 s.
TEST(SlowTermsInWorlds, AStrikeCanBeSetToMusic) {
  const Stage lane = {"bowling", json::object(), {}, "", "", 1};
  const auto scenario = scenario_of(
      lane, json::array({{{"kind", "pins"}, {"down", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}}},
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

// --- A word and more ---------------------------------------------------------------------------------

/// HI, and the third marble at rest before the first.
TEST(TermsInWorlds, AWordIsFoundTogetherWithOtherWishes) {
  const json spell = {{"kind", "spell"}, {"text", "HI"}};
  const json order = {{"kind", "order"},
                      {"events", json::array({{{"kind", "rest"}, {"body", "marble_3"}},
                                              {{"kind", "rest"}, {"body", "marble_1"}}})}};
  const Stage box = {"spelling", json::object(), {}, "", "", 1};
  expect_found(box, spell, 371, 2000);
  const auto scenario = scenario_of(box, json::array({spell, order}));
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 372, .method = Method::conditional});
  while (chain.counts().samples == 0 && chain.counts().iteration < 5000)
    chain.step(*performer);
  ASSERT_EQ(chain.counts().samples, 1u);
  EXPECT_TRUE(performer->perform(chain.stay().state).score.satisfied);
}

/// Chains by the guide sample what rejection samples: a word of two bins, in which the second marble rests
/// first and the first one near a place, so that log p_c is not constant.
TEST(SlowTermsInWorlds, AWordWithOtherWishesIsSampledExactly) {
  constexpr int kChains = 120, kSteps = 1200;
  const Stage box = {"spelling", {{"columns", 2}, {"rows", 1}, {"balls", 2}, {"interval", 0.02}}, {}, "", "",
                     1};
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
  const auto scenario = scenario_of(box, wishes);
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

// --- Rosters -------------------------------------------------------------------------------------------

/// What can be named is what animations have, in the order in which contacts count it.
void expect_roster(const Stage& stage, const terms::Roster& roster) {
  const auto scenario = scenario_of(stage, json::array());
  const auto performer = scenario->make_performer();
  RandomStream random = stream(361);
  for (int i = 0; i < 5; ++i) {
    const auto take = performer->perform(draw_state(scenario->model(), random));
    if (!take.complete) continue;
    const Animation& animation = take.animation;
    for (const Track& track : animation.tracks) {
      const auto mover = std::find_if(roster.movers.begin(), roster.movers.end(),
                                      [&](const auto& each) { return each.name == track.name; });
      ASSERT_NE(mover, roster.movers.end()) << track.name;
      EXPECT_EQ(track.settled.has_value(), mover->tells_rest);
      EXPECT_TRUE(!track.fell || mover->tells_fall);
    }
    ASSERT_GE(animation.bodies.size(), animation.tracks.size() + roster.still.size());
    for (std::size_t still = 0; still < roster.still.size(); ++still)
      EXPECT_EQ(animation.bodies[animation.tracks.size() + still].name, roster.still[still]);
    for (const ContactEvent& event : animation.events)
      for (const std::size_t body : event.bodies)
        EXPECT_LT(body, animation.tracks.size() + roster.still.size());
  }
}

TEST(TermsInWorlds, RostersNameWhatAnimationsHave) {
  expect_roster(kBall, {.movers = {{.name = "ball", .tells_rest = true}}, .still = {"table"}});
  expect_roster(kPins, bowling::roster({1, 2, 3}));
  expect_roster(kBox, spelling::roster(4));
}

TEST(TermsInWorlds, BodiesThatTheSceneDoesNotHaveAreRefused) {
  const auto faults = [](const Stage& stage, const json& wish) {
    return pointers(faults_of([&] { scenario_of(stage, json::array({wish})); }));
  };
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(faults(kPins, {{"kind", "contact_at"}, {"body", "pin_7"}, {"times", {2.4}}}),
            Pointers{"/constraints/0/body"})
      << "it is not in the rack";
  EXPECT_EQ(faults(kBox, {{"kind", "rest_position"}, {"body", "marble_5"}, {"x", 0}, {"z", 0}}),
            Pointers{"/constraints/0/body"});
  EXPECT_EQ(faults(kBox, {{"kind", "rest_position"}, {"x", 0}, {"z", 0}}), Pointers{"/constraints/0/body"});
  EXPECT_EQ(faults(kPins, {{"kind", "order"},
                           {"events", json::array({{{"kind", "rest"}, {"body", "pin_1"}},
                                                   {{"kind", "fall"}, {"body", "ball"}}})}}),
            (Pointers{"/constraints/0/events/0/kind", "/constraints/0/events/1/kind"}));
  EXPECT_TRUE(faults(kBall, {{"kind", "inside"}, {"box", {{"low", {0, 0, 0}}, {"high", {1, 1, 1}}}}}).empty())
      << "the only body";
}

/// Equal wishes of before are equal documents.
TEST(TermsInWorlds, TheBallsRestPositionHasTheFieldsThatItAlwaysHad) {
  const auto scenario = scenario_of(kBall, json::array({{{"kind", "rest_position"}, {"x", 1}}}));
  EXPECT_EQ(scenario->document().at("constraints").dump(),
            R"([{"kind":"rest_position","sd":0.1,"tolerance":0.1,"x":1.0}])");
}

}  // namespace
}  // namespace retake::tests
