// Terms that exclude each other are refused at once, at the places of all that have a part in it; and what
// can be met is never refused, shown by animations of every world. Seeds are fixed.
#include "worlds/contradictions.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests {
namespace {

using Eigen::Vector3d;
using Places = std::vector<std::string>;

Places places_of(const std::string& world, const json& model, const json& constraints) {
  return pointers(faults_of([&] {
    Scenario::read({{"world", world}, {"model", model}, {"constraints", constraints}});
  }));
}
Places places_in(const std::string& world, const std::string& model, const std::string& constraints) {
  return places_of(world, json::parse(model), json::parse(constraints));
}

// --- What is refused ---------------------------------------------------------------------------------

TEST(Contradictions, ADieShowsOneFace) {
  EXPECT_EQ(places_in("dice", "{}", R"([{"kind":"face_up","face":1},{"kind":"face_up","face":6}])"),
            (Places{"/constraints/0/face", "/constraints/1/face"}));
  EXPECT_EQ(places_in("dice", "{}", R"([{"kind":"face_up","face":6},{"kind":"face_up","face":6}])"),
            Places{});
  EXPECT_EQ(places_in("dice", R"({"dice":2})", R"([{"kind":"face_up","body":"die_1","face":1},
              {"kind":"face_up","body":"die_2","face":6},{"kind":"face_up","body":"die_2","face":5}])"),
            (Places{"/constraints/1/face", "/constraints/2/face"}));
}

TEST(Contradictions, AFaultNamesTheOthersWithWhatTheyWish) {
  const auto faults = faults_of([] {
    Scenario::read(json::parse(
        R"({"world":"dice","constraints":[{"kind":"face_up","face":1},{"kind":"face_up","face":6}]})"));
  });
  ASSERT_EQ(faults.size(), 2u);
  EXPECT_EQ(faults.find("/constraints/0/face")->second,
            "cannot come true together with /constraints/1/face (die 1 shows face 6)");
  EXPECT_EQ(faults.find("/constraints/1/face")->second,
            "cannot come true together with /constraints/0/face (die 1 shows face 1)");
}

TEST(Contradictions, ATotalThatFixedFacesCannotReach) {
  const auto total = [](int dice, int sum, const std::vector<int>& faces) {
    json wishes = json::array({{{"kind", "total"}, {"sum", sum}}});
    for (std::size_t die = 0; die < faces.size(); ++die)
      wishes.push_back(
          {{"kind", "face_up"}, {"body", "die_" + std::to_string(die + 1)}, {"face", faces[die]}});
    return places_of("dice", {{"dice", dice}}, wishes);
  };
  // Every total of two and of three dice, beside every face of the first and of both.
  for (int dice = 2; dice <= 3; ++dice)
    for (int sum = dice; sum <= 6 * dice; ++sum)
      for (int first = 1; first <= 6; ++first) {
        const int rest = sum - first;
        EXPECT_EQ(total(dice, sum, {first}).empty(), rest >= dice - 1 && rest <= 6 * (dice - 1))
            << dice << " dice, " << sum << " with " << first;
        for (int second = 1; second <= 6; ++second)
          EXPECT_EQ(total(dice, sum, {first, second}).empty(),
                    rest - second >= dice - 2 && rest - second <= 6 * (dice - 2))
              << dice << " dice, " << sum << " with " << first << " and " << second;
      }
  EXPECT_EQ(total(2, 12, {5}), (Places{"/constraints/0/sum", "/constraints/1/face"}));
  EXPECT_EQ(total(3, 18, {6, 5}), (Places{"/constraints/0/sum", "/constraints/2/face"}))
      << "the six has no part in it";
  EXPECT_EQ(total(2, 13, {}), Places{"/constraints/0/sum"}) << "too many for so many dice";
  EXPECT_EQ(places_in("dice", R"({"dice":2})", R"([{"kind":"total","sum":7},{"kind":"total","sum":8}])"),
            (Places{"/constraints/0/sum", "/constraints/1/sum"}));
}

/// `order` of falls of pins.
json falls_in_order(const std::vector<int>& pins) {
  json events = json::array();
  for (const int pin : pins)
    events.push_back({{"kind", "fall"}, {"body", "pin_" + std::to_string(pin)}});
  return {{"kind", "order"}, {"events", std::move(events)}};
}

TEST(Contradictions, CirclesOfAnOrderOfAnyLength) {
  const auto places = [](const json& wishes) { return places_of("bowling", json::object(), wishes); };
  EXPECT_EQ(places({falls_in_order({1, 2}), falls_in_order({2, 1})}),
            (Places{"/constraints/0/events/1", "/constraints/1/events/1"}));
  EXPECT_EQ(places(json::array({falls_in_order({1, 2, 1})})),
            (Places{"/constraints/0/events/1", "/constraints/0/events/2"}));
  EXPECT_EQ(places(json::array({falls_in_order({1, 1})})), Places{"/constraints/0/events/1"});
  EXPECT_EQ(places({falls_in_order({1, 2, 5, 7}), falls_in_order({1, 3, 7})}), Places{});
  for (int length = 3; length <= 10; ++length) {
    json wishes = json::array();
    for (int pin = 1; pin <= length; ++pin)
      wishes.push_back(falls_in_order({pin, pin % length + 1}));
    const auto faults = faults_of([&] { Scenario::read({{"world", "bowling"}, {"constraints", wishes}}); });
    EXPECT_EQ(faults.size(), static_cast<std::size_t>(length)) << "each has a part in it";
    for (int pin = 1; pin <= length; ++pin)
      EXPECT_NE(faults.begin()->second.find("pin " + std::to_string(pin) + " falls"), std::string::npos)
          << faults.begin()->second;
    wishes.erase(wishes.begin());
    EXPECT_EQ(places(wishes), Places{}) << "without one step there is no circle";
  }
}

TEST(Contradictions, TheFirstTouchOfAnythingIsNotAfterOneOfSomething) {
  const auto places = [](const char* before, const char* after) {
    return places_of(
        "bowling", json::object(),
        json::array({{{"kind", "order"}, {"events", {json::parse(before), json::parse(after)}}}}));
  };
  const char *any = R"({"kind":"contact","body":"pin_1"})",
             *ball = R"({"kind":"contact","body":"ball","with":"pin_1"})",
             *same = R"({"kind":"contact","body":"pin_1","with":"ball"})";
  EXPECT_EQ(places(ball, any), Places{"/constraints/0/events/1"});
  EXPECT_EQ(places(ball, same), Places{"/constraints/0/events/1"});
  EXPECT_EQ(places(any, ball), Places{}) << "another pin may hit it first";
}

TEST(Contradictions, WhatStandsDoesNotFallAndLeavesExcludeEachOther) {
  const auto places = [](const json& wishes) { return places_of("bowling", json::object(), wishes); };
  const json strike = {{"kind", "pins"}, {"down", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}}},
             split = {{"kind", "pins"}, {"down", {1, 2, 3, 4, 5, 6, 8, 9}}};
  EXPECT_EQ(places({strike, split}), (Places{"/constraints/0/down", "/constraints/1/down"}));
  EXPECT_EQ(places({split, split}), Places{});
  EXPECT_EQ(places({split, falls_in_order({1, 7})}),
            (Places{"/constraints/0/down", "/constraints/1/events/1"}));
  EXPECT_EQ(places({split, falls_in_order({1, 5})}), Places{});
  const auto rests = [](const char* pin, double x, double z) {
    return json{{"kind", "rest_position"}, {"body", pin}, {"x", x}, {"z", z}, {"tolerance", 0.02}};
  };
  EXPECT_EQ(places({split, rests("pin_7", 2, 0)}), (Places{"/constraints/0/down", "/constraints/1/x"}))
      << "it stands where it stood";
  EXPECT_EQ(places({split, rests("pin_7", 0.79, -0.45)}), Places{});
  EXPECT_EQ(places({split, rests("pin_1", 1.5, 0)}), Places{});
}

TEST(Contradictions, ABodyIsInOnePlaceAtATime) {
  const auto places = [](const std::string& wishes) { return places_in("dice", "{}", wishes); };
  const std::string here = R"({"kind":"rest_position","x":0.1,"z":0,"tolerance":0.01})";
  const auto box = [](double low, double high, const std::string& while_ = "") {
    return R"({"kind":"inside","box":{"low":[)" + std::to_string(low) + R"(,-1,-1],"high":[)" +
           std::to_string(high) + R"(,1,1]})" + while_ + "}";
  };
  EXPECT_EQ(places("[" + here + R"(,{"kind":"rest_position","x":0.13,"z":0,"tolerance":0.01}])"),
            (Places{"/constraints/0/x", "/constraints/1/x"}));
  EXPECT_EQ(places("[" + here + R"(,{"kind":"rest_position","x":0.13,"z":0,"tolerance":0.03}])"), Places{});
  EXPECT_EQ(places("[" + here + "," + box(0.2, 0.3) + "]"),
            (Places{"/constraints/0/x", "/constraints/1/box"}))
      << "it is there to the end";
  EXPECT_EQ(places("[" + here + "," + box(0.105, 0.3) + "]"), Places{});
  EXPECT_EQ(places("[" + here + "," + box(0.2, 0.3, R"(,"to":0.5)") + "]"), Places{}) << "it may leave";
  EXPECT_EQ(places("[" + box(0, 0.1, R"(,"to":0.5)") + "," + box(0.2, 0.3, R"(,"from":0.4)") + "]"),
            (Places{"/constraints/0/box", "/constraints/1/box"}));
  EXPECT_EQ(places("[" + box(0, 0.1, R"(,"to":0.4)") + "," + box(0.2, 0.3, R"(,"from":0.5)") + "]"),
            Places{});
  const auto at = [](double time, double x, double tolerance = 0.01) {
    return R"({"kind":"state_at","time":)" + std::to_string(time) + R"(,"position":[)" + std::to_string(x) +
           R"(,0.1,0],"tolerance":)" + std::to_string(tolerance) + "}";
  };
  EXPECT_EQ(places("[" + at(0.2, 0) + "," + at(0.2, 0.1) + "]"),
            (Places{"/constraints/0/position", "/constraints/1/position"}));
  EXPECT_EQ(places("[" + at(0.2, 0) + "," + at(0.21, 0.1) + "]"), Places{});
  EXPECT_EQ(places("[" + at(0.2, 0) + "," + box(0.1, 0.3, R"(,"from":0.1,"to":0.3)") + "]"),
            (Places{"/constraints/0/position", "/constraints/1/box"}));
  EXPECT_EQ(places("[" + here + "," + at(3600, 0.3) + "]"),
            (Places{"/constraints/0/x", "/constraints/1/position"}));
  EXPECT_EQ(places(R"([{"kind":"state_at","time":0.2,"velocity":[1,0,0]},
                       {"kind":"state_at","time":0.2,"velocity":[0,0,0]}])"),
            (Places{"/constraints/0/velocity", "/constraints/1/velocity"}));
  EXPECT_EQ(places_in("ball2d", "{}", R"([{"kind":"rest_position","x":1,"tolerance":0.1},
                       {"kind":"inside","box":{"low":[2,0,-1],"high":[3,9,1]}}])"),
            (Places{"/constraints/0/x", "/constraints/1/box"}));
}

TEST(Contradictions, TouchesThatNoBeatAllows) {
  const auto places = [](const std::string& beat, const std::string& times) {
    return places_in("ball2d", "{}",
                     R"([{"kind":"contact_at","body":"ball","tolerance":0.02,)" + beat +
                         R"(},{"kind":"contact_at","tolerance":0.02,"with":"ball",)" + times + "}]");
  };
  const Places both = {"/constraints/0/bpm", "/constraints/1/times/0"};
  const std::string from_start = R"("bpm":60,"from":"start","offset":0.5)";
  EXPECT_EQ(places(from_start, R"("times":[1.2])"), both);
  EXPECT_EQ(places(from_start, R"("times":[1.53])"), Places{});
  EXPECT_EQ(places(from_start + R"(,"least_impulse":1)", R"("times":[1.2])"), Places{})
      << "it may be a soft one";
  EXPECT_EQ(places(R"("bpm":60)", R"("times":[1.2])"), Places{}) << "the first one says when beats are";
  EXPECT_EQ(places(R"("bpm":60)", R"("times":[1.2,1.6])"),
            (Places{"/constraints/0/bpm", "/constraints/1/times/0", "/constraints/1/times/1"}));
  EXPECT_EQ(places(R"("bpm":60)", R"("times":[1.2,3.23])"), Places{});
}

TEST(Contradictions, BinsAndSpellAtOdds) {
  const auto places = [](const std::string& wishes, const std::string& model = "{}") {
    return places_in("spelling", model, wishes);
  };
  const std::string hi = R"({"kind":"spell","text":"HI"})";
  const std::string other = R"({"kind":"bins","rows":["#......",".......",".......",".......","......."]})";
  const std::string as_hi = R"({"kind":"bins","rows":[".......",".#.#.#.",".###.#.",".#.#.#.","......."]})";
  EXPECT_EQ(places("[" + hi + "," + other + "]"), (Places{"/constraints/0/text", "/constraints/1/rows"}));
  EXPECT_EQ(places("[" + hi + "," + as_hi + "]"), Places{});
  EXPECT_EQ(places("[" + hi + R"(,{"kind":"spell","text":"I"}])"),
            (Places{"/constraints/0/text", "/constraints/1/text"}));
  // A marble that is to end where none may lie, and more marbles than bins.
  EXPECT_EQ(places("[" + other + R"(,{"kind":"rest_position","body":"marble_1","x":0.05,"z":0.03}])"),
            (Places{"/constraints/0/rows", "/constraints/1/x"}));
  EXPECT_EQ(places("[" + other + R"(,{"kind":"rest_position","body":"marble_1","x":-0.066,"z":-0.044}])"),
            Places{});
  const std::string touched = R"({"kind":"contact_at","body":"marble_1","with":"marble_2","times":[1]})";
  EXPECT_EQ(places("[" + other + "," + touched + "]", R"({"balls":3})"),
            (Places{"/constraints/0/rows", "/constraints/1"}));
  EXPECT_EQ(places("[" + as_hi + "," + touched + "]"), Places{});
}

TEST(Contradictions, AreFoundBesideOtherFaultsAndTheFirstFewAreTold) {
  EXPECT_EQ(places_in("dice", "{}", R"([{"kind":"face_up","face":1},{"kind":"face_up","face":6},
              {"kind":"face_up","face":7}])"),
            (Places{"/constraints/0/face", "/constraints/1/face", "/constraints/2/face"}));
  json wishes = json::array();
  for (int i = 0; i < 32; ++i)
    wishes.push_back({{"kind", "face_up"}, {"face", i % 6 + 1}});
  const Places places = places_of("dice", json::object(), wishes);
  EXPECT_GE(places.size(), 2u);
  EXPECT_LE(places.size(), 16u);
}

// --- What is not refused -----------------------------------------------------------------------------

/// A scene of a world with animations of draws from its prior, and wishes around what happens in them.
class Trial {
 public:
  Trial(const World& world, const json& model, std::uint64_t seed, std::size_t animations)
      : open_(open_scenario(world,
                            {{"world", world.name()}, {"model", model}, {"constraints", json::array()}})),
        random_(stream(seed)) {
    const auto performer = open_.scenario->make_performer();
    while (animations_.size() < animations) {
      auto take = performer->perform(draw_state(open_.model(), random_));
      if (take.complete && !take.animation.tracks.empty()) animations_.push_back(take.animation);
    }
  }

  const std::vector<Animation>& animations() const { return animations_; }
  std::size_t any(std::size_t count) { return static_cast<std::size_t>(random_.index(count)); }

  /// One that this animation fulfils, or comes close to.
  json wish(const Animation& animation) {
    std::vector<json> wishes = general(animation);
    const json own = own_wish(animation);
    if (!own.is_null() && random_.bernoulli(0.4)) return own;
    return wishes[any(wishes.size())];
  }
  /// Null if it has a fault by itself.
  std::unique_ptr<const Term> term(const json& wish) const {
    std::vector<Fault> faults;
    json document = wish;
    const Parameters model(open_.scenario->document().at("model"));
    for (const TermKind& kind : open_.world().term_kinds()) {
      if (kind.kind != wish.at("kind")) continue;
      if (kind.fit) kind.fit(document, model, "", faults);
      const Parameters parameters = kind.parameters.read(document, "", faults, {"kind"});
      auto made = faults.empty() ? kind.make(parameters, model, "", faults) : nullptr;
      return faults.empty() ? std::move(made) : nullptr;
    }
    return nullptr;
  }

 private:
  Vector3d off(double size) {
    return size * Vector3d(random_.gaussian(), random_.gaussian(), random_.gaussian());
  }
  static json list(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

  std::vector<json> general(const Animation& animation) {
    constexpr double kTimes[] = {0, 0.3, 0.6, kEnd};
    const Track& track = animation.tracks[any(animation.tracks.size())];
    const std::string body = track.name, other = animation.bodies[any(animation.bodies.size())].name;
    const double size = (track.rest.position - track.start.position).norm() + 0.01;
    const double near = size * (random_.bernoulli(0.5) ? 0.02 : 0.3), time = kTimes[any(4)];
    const auto at = [&](double when) -> Vector3d {
      const auto frame = static_cast<std::size_t>(when * animation.rate);
      return frame + 1 < animation.frames ? Vector3d(track.positions.col(static_cast<Eigen::Index>(frame)))
                                          : track.rest.position;
    };
    json rest = {{"kind", "rest_position"},
                 {"x", track.rest.position.x() + near * random_.gaussian()},
                 {"tolerance", near}};
    if (open_.world().name() != "ball2d") {
      rest["body"] = body;
      rest["z"] = track.rest.position.z() + near * random_.gaussian();
    }
    const double from = kTimes[any(3)], to = random_.bernoulli(0.5) ? kEnd : from + 0.3;
    const Vector3d one = at(from) + off(near), last = at(to) + off(near),
                   half = at((from + std::min(to, 2.0)) / 2);
    json events = json::array();
    for (std::size_t i = 0; i < 2 + any(2); ++i)
      events.push_back(event(animation));
    json contact = {
        {"kind", "contact_at"}, {"body", random_.bernoulli(0.5) ? body : "any"}, {"tolerance", 0.05}};
    json beat = contact;
    if (random_.bernoulli(0.5)) contact["with"] = name_of_partner(other);
    contact["times"] = {happening(animation), happening(animation)};
    beat["bpm"] = 60 + 600 * random_.uniform();
    beat["contacts"] = 1;
    if (random_.bernoulli(0.7)) {
      beat["from"] = "start";
      beat["offset"] = happening(animation);
    }
    return {std::move(rest),
            {{"kind", "state_at"},
             {"body", body},
             {"time", time},
             {"position", list(at(time) + off(near))},
             {"tolerance", near}},
            {{"kind", "state_at"},
             {"body", body},
             {"time", time},
             {"velocity", list(off(1))},
             {"velocity_tolerance", 1.5}},
            {{"kind", "inside"},
             {"body", body},
             {"from", from},
             {"to", to},
             {"box",
              {{"low", list(one.cwiseMin(last).cwiseMin(half) - Vector3d::Constant(near))},
               {"high", list(one.cwiseMax(last).cwiseMax(half) + Vector3d::Constant(near))}}}},
            {{"kind", "order"}, {"events", std::move(events)}},
            std::move(contact),
            std::move(beat)};
  }

  std::string name_of_partner(const std::string& name) const {
    const auto& still = open_.roster.still;
    const bool is_mover = std::any_of(open_.roster.movers.begin(), open_.roster.movers.end(),
                                      [&](const auto& mover) { return mover.name == name; });
    return is_mover || std::find(still.begin(), still.end(), name) != still.end() ? name : "any";
  }

  double happening(const Animation& animation) {
    return animation.events.empty()
               ? 0.5
               : animation.events[any(std::min<std::size_t>(animation.events.size(), 12))].time;
  }

  json event(const Animation& animation) {
    const Roster::Mover& mover = open_.roster.movers[any(open_.roster.movers.size())];
    if (random_.bernoulli(0.5) && (mover.tells_rest || mover.tells_fall))
      return {{"kind", mover.tells_rest ? "rest" : "fall"}, {"body", mover.name}};
    if (animation.events.empty()) return {{"kind", "contact"}, {"body", mover.name}};
    const ContactEvent& contact = animation.events[any(animation.events.size())];
    json told = {{"kind", "contact"}, {"body", name_of_partner(animation.bodies[contact.bodies[0]].name)}};
    if (random_.bernoulli(0.5)) told["with"] = name_of_partner(animation.bodies[contact.bodies[1]].name);
    return told;
  }

  /// Of the world's own kinds: as it is in the animation, or by chance.
  json own_wish(const Animation& animation) {
    const std::string_view world = open_.world().name();
    if (world == "bowling") {
      json down = json::array();
      for (int pin = 1; pin <= 10; ++pin)
        if (animation.tracks[static_cast<std::size_t>(pin)].fell) down.push_back(pin);
      if (random_.bernoulli(0.3)) down.push_back(10);
      if (std::count(down.begin(), down.end(), 10) > 1) down.erase(down.size() - 1);
      return {{"kind", "pins"}, {"down", std::move(down)}};
    }
    if (world == "dice") {
      if (random_.bernoulli(0.4)) return {{"kind", "total"}, {"sum", 2 + any(11)}};
      return {{"kind", "face_up"}, {"body", "die_" + std::to_string(1 + any(2))}, {"face", 1 + any(6)}};
    }
    if (world == "spelling") {
      const double pitch = 0.022;
      std::vector<std::string> rows(2, "...");
      for (const Track& track : animation.tracks) {
        const auto column =
            static_cast<std::size_t>(std::clamp((track.rest.position.x() + 1.5 * pitch) / pitch, 0.0, 2.0));
        rows[track.rest.position.z() > 0 ? 1 : 0][column] = '#';
      }
      if (random_.bernoulli(0.3)) rows[any(2)][any(3)] = '#';
      return {{"kind", "bins"}, {"rows", rows}};
    }
    return nullptr;
  }

  OpenScenario open_;
  RandomStream random_;
  std::vector<Animation> animations_;
};

bool is_satisfied(const Term& term, const Animation& animation) {
  std::vector<double> values(term.measures().size());
  return term.score(animation, values).satisfied;
}

std::string refusal(const std::vector<const Term*>& terms) {
  std::vector<Claimant> claimants;
  for (const Term* term : terms)
    claimants.push_back({"/" + std::to_string(claimants.size()), "", term->claims()});
  std::vector<Fault> faults;
  find_contradictions(claimants, faults);
  std::string text;
  for (const Fault& fault : faults)
    text += fault.pointer + " " + fault.detail + "\n";
  return text;
}

struct Counted {
  int refused = 0, taken = 0, satisfied = 0;
  std::map<std::string, int> kinds;  ///< that were satisfied
};

Counted expect_only_the_impossible_is_refused(Trial trial, int wishes) {
  Counted counted;
  std::vector<json> documents;
  std::vector<std::unique_ptr<const Term>> terms;
  std::vector<std::vector<bool>> satisfied;  // by wish and animation
  const auto& animations = trial.animations();
  while (static_cast<int>(terms.size()) < wishes) {
    const json wish = trial.wish(animations[trial.any(animations.size())]);
    auto term = trial.term(wish);
    if (!term) continue;
    std::vector<bool> by_animation;
    for (const Animation& animation : animations)
      by_animation.push_back(is_satisfied(*term, animation));
    if (std::count(by_animation.begin(), by_animation.end(), true) > 0) ++counted.kinds[wish.at("kind")];
    documents.push_back(wish);
    satisfied.push_back(std::move(by_animation));
    terms.push_back(std::move(term));
  }
  // Pairs: of what is refused no animation satisfies both.
  for (std::size_t i = 0; i < terms.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const std::string why = refusal({terms[k].get(), terms[i].get()});
      ++(why.empty() ? counted.taken : counted.refused);
      if (why.empty()) continue;
      for (std::size_t a = 0; a < animations.size(); ++a)
        EXPECT_FALSE(satisfied[i][a] && satisfied[k][a]) << documents[k] << "\n"
                                                         << documents[i] << "\n"
                                                         << why;
    }
  // All that one animation satisfies.
  for (std::size_t a = 0; a < animations.size(); ++a) {
    std::vector<const Term*> met;
    json said = json::array();
    for (std::size_t i = 0; i < terms.size() && met.size() < 32; ++i)
      if (satisfied[i][a]) {
        met.push_back(terms[i].get());
        said.push_back(documents[i]);
      }
    counted.satisfied += static_cast<int>(met.size());
    EXPECT_EQ(refusal(met), "") << said;
  }
  return counted;
}

TEST(Contradictions, NothingIsRefusedThatCanBeMetInAnyWorld) {
  std::map<std::string, json> models = {{"spelling", {{"columns", 3}, {"rows", 2}, {"balls", 4}}},
                                        {"dice", {{"dice", 2}}}};
  for (const World* world : all_worlds()) {
    const std::string name(world->name());
    const auto model = models.find(name);
    const Counted counted = expect_only_the_impossible_is_refused(
        Trial(*world, model == models.end() ? json::object() : model->second, 411, 40), 250);
    std::printf("%s: %d pairs refused, %d taken; %d times satisfied\n", name.c_str(), counted.refused,
                counted.taken, counted.satisfied);
    EXPECT_GT(counted.refused, 100) << name;
    EXPECT_GT(counted.satisfied, 100) << name;
    for (const char* kind : {"rest_position", "state_at", "inside", "contact_at", "order"})
      EXPECT_TRUE(counted.kinds.contains(kind)) << name << " never satisfied " << kind;
  }
}

}  // namespace
}  // namespace retake::tests
