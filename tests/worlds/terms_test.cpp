// The general constraint terms on animations made by hand: what is satisfied, how dense a miss is, what can
// be said of an animation that goes on, and how documents with faults are refused.
#include "worlds/terms/terms.h"

#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

using Eigen::Vector3d;
using namespace terms;

/// Opposite sides add up to seven.
const std::vector<Face> kDieFaces = {{1, {0, 1, 0}},  {6, {0, -1, 0}}, {2, {1, 0, 0}},
                                     {5, {-1, 0, 0}}, {3, {0, 0, 1}},  {4, {0, 0, -1}}};

Setting table_top() {
  return {.roster =
              [](const Parameters&) {
                return Roster{.movers = {{.name = "die", .faces = kDieFaces, .tells_rest = true},
                                         {.name = "cup", .tells_rest = true, .tells_fall = true}},
                              .still = {"table", "wall"}};
              },
          .length = 0.1,
          .speed = 0.5,
          .source = "chosen"};
}
Setting one_ball() {
  return {.roster = [](const Parameters&) { return Roster{.movers = {{.name = "ball"}}, .still = {}}; },
          .only_body = "ball",
          .length = 0.1,
          .speed = 0.5,
          .source = "chosen",
          .flat = 0.6};
}

/// As a scenario reads a constraint.
std::unique_ptr<const Term> read(const TermKind& kind, json document, std::vector<Fault>& faults) {
  const Parameters model{json::object()};
  if (kind.fit) kind.fit(document, model, "/t", faults);
  const Parameters parameters = kind.parameters.read(document, "/t", faults);
  return faults.empty() ? kind.make(parameters, model, "/t", faults) : nullptr;
}
std::unique_ptr<const Term> read(const TermKind& kind, const json& document) {
  std::vector<Fault> faults;
  auto term = read(kind, document, faults);
  EXPECT_TRUE(faults.empty()) << faults[0].pointer << " " << faults[0].detail;
  return term;
}
std::vector<std::string> fault_pointers(const TermKind& kind, const json& document) {
  std::vector<Fault> faults;
  read(kind, document, faults);
  std::vector<std::string> pointers;
  for (const Fault& fault : faults)
    pointers.push_back(fault.pointer);
  return pointers;
}

struct Said {
  double log_density;
  bool satisfied;
  std::vector<double> measures;
};
Said judge(const Term& term, const Animation& animation) {
  std::vector<double> values(term.measures().size(), -1);
  const TermScore score = term.score(animation, values);
  EXPECT_LE(score.log_density, 0);
  if (score.satisfied) {
    EXPECT_GE(score.log_density, term.least_when_satisfied() - 1e-12);
  }
  EXPECT_LE(term.upper_bound(animation), 0);
  EXPECT_GE(term.upper_bound(animation), score.log_density) << "of the whole animation";
  return {score.log_density, score.satisfied, values};
}
double half_square(double z) {
  return -0.5 * z * z;
}

/// Bodies that rest where they are put, without frames.
Animation resting(std::vector<std::pair<std::string, Vector3d>> places) {
  Animation animation;
  for (const auto& [name, place] : places) {
    Track& track = animation.tracks.emplace_back();
    track.name = name;
    track.start.position = {7, 7, 7};
    track.rest.position = place;
  }
  return animation;
}

/// A die that follows a function of time for so many frames.
template <typename Path>
Animation moving(const Path& path, std::size_t frames, double rate = 10) {
  Animation animation;
  animation.rate = rate;
  animation.frames = frames;
  Track& track = animation.tracks.emplace_back();
  track.name = "die";
  track.positions.resize(3, static_cast<Eigen::Index>(frames));
  for (std::size_t i = 0; i < frames; ++i)
    track.positions.col(static_cast<Eigen::Index>(i)) = path(static_cast<double>(i) / rate);
  track.rest.position = track.positions.rightCols<1>();
  return animation;
}

// --- rest_position ---------------------------------------------------------------------------------

TEST(TermRestPosition, IsAGaussianOfTheDistanceOnTheFloor) {
  const auto term = read(rest_position_term(table_top()),
                         {{"body", "die"}, {"x", 1}, {"z", -2}, {"sd", 0.2}, {"tolerance", 0.5}});
  EXPECT_FALSE(term->reads_frames());
  const Said near = judge(*term, resting({{"cup", {0, 0, 0}}, {"die", {1.3, 9, -2.4}}}));
  EXPECT_NEAR(near.measures[0], 0.5, 1e-12);
  EXPECT_NEAR(near.log_density, half_square(2.5), 1e-9);
  const Said nearer = judge(*term, resting({{"die", {1.3, 9, -2.39}}}));
  EXPECT_TRUE(nearer.satisfied);
  EXPECT_NEAR(nearer.log_density, half_square(std::hypot(0.3, 0.39) / 0.2), 1e-9);
  EXPECT_FALSE(judge(*term, resting({{"die", {1.3, 9, -2.41}}})).satisfied);
  EXPECT_NEAR(term->least_when_satisfied(), half_square(2.5), 1e-12);
}

TEST(TermRestPosition, ABodyThatTakesNoPartIsFarAway) {
  const auto term = read(rest_position_term(table_top()), {{"body", "die"}, {"x", 0}, {"z", 0}});
  const Animation without = resting({{"cup", {0, 0, 0}}});
  const Said said = judge(*term, without);
  EXPECT_FALSE(said.satisfied);
  EXPECT_TRUE(std::isnan(said.measures[0]));
  EXPECT_LT(said.log_density, judge(*term, resting({{"die", {50, 0, 50}}})).log_density);
  EXPECT_EQ(term->upper_bound(without), said.log_density);
}

TEST(TermRestPosition, IsKnownOnceItHasSettled) {
  const auto term = read(rest_position_term(table_top()), {{"body", "die"}, {"x", 0}, {"z", 0}});
  Animation animation = resting({{"die", {0.3, 0, 0.4}}});
  EXPECT_EQ(term->upper_bound(animation), 0) << "it may still move";
  animation.tracks[0].settled = 1.5;
  EXPECT_EQ(term->upper_bound(animation), judge(*term, animation).log_density);
}

TEST(TermRestPosition, InAFlatWorldIsOfXAloneAndOnlyThat) {
  const auto term = read(rest_position_term(one_ball()), {{"x", 1}});
  const Said said = judge(*term, resting({{"ball", {0.95, 3, 8}}}));
  EXPECT_NEAR(said.measures[0], -0.05, 1e-12) << "to the left";
  EXPECT_NEAR(said.log_density, half_square(0.5), 1e-9);
  EXPECT_TRUE(said.satisfied);
  EXPECT_EQ(fault_pointers(rest_position_term(one_ball()), {{"x", 1}, {"z", 1}}),
            std::vector<std::string>{"/t/z"});
}

/// The greatest distance of a mark's points from its middle on the floor that is less than `limit`.
double reach(const Body& mark, double limit = 1e9) {
  const Mesh& mesh = std::get<Mesh>(mark.shape);
  double farthest = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
    const double distance = std::hypot(mesh.positions[i], mesh.positions[i + 2]);
    if (distance < limit) farthest = std::max(farthest, distance);
  }
  return farthest;
}

TEST(TermRestPosition, MarksThePlaceWithADotACircleAndARing) {
  const auto marks_for = [](double tolerance) {
    const json term = {{"body", "die"}, {"x", 1}, {"z", 2}, {"tolerance", tolerance}};
    return read(rest_position_term(table_top()), term)->markers(resting({{"die", {0, 0, 0}}}));
  };
  // Lengths are 0.1 m on the table top.
  const auto marks = marks_for(0.1);
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_EQ(marks[0].pose.position, Vector3d(1, 0, 2));
  EXPECT_NEAR(reach(marks[0], 0.05), 0.02, 1e-12) << "the dot";
  EXPECT_NEAR(reach(marks[0], 0.2), 0.1, 1e-12) << "the circle is as wide as the tolerance";
  EXPECT_NEAR(reach(marks[0]), 0.41, 1e-12);
  const auto tiny = marks_for(1e-4);
  EXPECT_NEAR(reach(tiny[0], 0.2), 0.02, 1e-12) << "it can be seen";
  EXPECT_NEAR(reach(tiny[0]), 0.3101, 1e-12);
  EXPECT_NEAR(reach(marks_for(0.5)[0]), 0.5, 1e-12) << "a wide one is found without a ring";
  // It looks up, and lies a little above the floor.
  const Mesh& mesh = std::get<Mesh>(marks[0].shape);
  const auto vertex = [&](std::uint32_t index) { return Vector3d(&mesh.positions[3 * index]); };
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vector3d a = vertex(mesh.indices[i]);
    ASSERT_GE((vertex(mesh.indices[i + 1]) - a).cross(vertex(mesh.indices[i + 2]) - a).y(), 0);
    ASSERT_EQ(a.y(), table_top().mark_height);
  }
}

TEST(TermRestPosition, TheMarkLiesOnBumpyGround) {
  Animation shown = resting({{"die", {0, 0, 0}}});
  // A slope of 1 in 10 along the world's -z, which is the field's x.
  Body slope{.name = "slope", .shape = HeightField{2, 2, 10, {0, 0, 1, 1}, {}}, .colour = "#000000"};
  slope.pose = {.position = {-5, 0.5, 5},
                .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()))};
  shown.bodies.push_back(slope);
  const json term = {{"body", "die"}, {"x", 1}, {"z", 2}};
  const auto marks = read(rest_position_term(table_top()), term)->markers(shown);
  const Mesh& mesh = std::get<Mesh>(marks.at(0).shape);
  for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
    const double z = 2 + mesh.positions[i + 2];
    ASSERT_NEAR(mesh.positions[i + 1], 0.5 + 0.1 * (5 - z) + table_top().mark_height, 1e-9);
  }
}

TEST(TermRestPosition, AStripeMarksThePlaceInAFlatWorld) {
  const auto stripe = read(rest_position_term(one_ball()), {{"x", 1}})->markers({});
  EXPECT_EQ(std::get<Box>(stripe.at(0).shape).half_extents, Vector3d(0.1, 0.001, 0.6));
  EXPECT_EQ(stripe[0].pose.position, Vector3d(1, 0.001, 0));
}

// --- face_up ---------------------------------------------------------------------------------------

TEST(TermFaceUp, IsTheSideThatPointsUpMost) {
  for (const Face& face : kDieFaces) {
    // Upright, turned about the vertical and then tilted a little.
    const Eigen::Quaterniond up = Eigen::Quaterniond::FromTwoVectors(face.normal, Vector3d::UnitY());
    const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.6, Vector3d(1, 0, 0.5).normalized()));
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.1, Vector3d::UnitY()));
    Animation animation = resting({{"die", {0, 0, 0}}});
    animation.tracks[0].rest.rotation = tilt * turn * up;
    for (const Face& wished : kDieFaces) {
      const auto term = read(face_up_term(table_top()), {{"body", "die"}, {"face", wished.number}});
      const Said said = judge(*term, animation);
      EXPECT_EQ(said.measures[0], face.number);
      EXPECT_EQ(said.satisfied, wished.number == face.number);
      EXPECT_EQ(said.log_density, wished.number == face.number ? 0 : -6);
      EXPECT_EQ(term->upper_bound(animation), 0) << "it may still turn";
      animation.tracks[0].settled = 2;
      EXPECT_EQ(term->upper_bound(animation), said.log_density);
      animation.tracks[0].settled.reset();
    }
  }
}

TEST(TermFaceUp, NeedsABodyThatHasTheFace) {
  const TermKind kind = face_up_term(table_top());
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(fault_pointers(kind, {{"body", "die"}, {"face", 7}}), Pointers{"/t/face"});
  EXPECT_EQ(fault_pointers(kind, {{"body", "cup"}, {"face", 1}}), Pointers{"/t/body"});
  EXPECT_EQ(fault_pointers(kind, {{"body", "dice"}, {"face", 1}}), Pointers{"/t/body"});
  EXPECT_EQ(fault_pointers(kind, {{"face", 1}}), Pointers{"/t/body"}) << "there are two";
  const auto term = read(kind, {{"body", "die"}, {"face", 1}});
  const Animation without = resting({{"cup", {0, 0, 0}}});
  EXPECT_FALSE(judge(*term, without).satisfied);
  EXPECT_EQ(term->upper_bound(without), -6);
}

// --- state_at --------------------------------------------------------------------------------------

Vector3d thrown(double t) {
  return {2 * t, 1 + 3 * t - 4.905 * t * t, -t};
}

TEST(TermStateAt, ReadsPositionsAsTheyArePlayedAndVelocitiesAsTheyAre) {
  const Animation animation = moving(thrown, 11);
  const auto misses = [&](double time, const json& position, const json& velocity) {
    return judge(*read(state_at_term(table_top()),
                       {{"body", "die"}, {"time", time}, {"position", position}, {"velocity", velocity}}),
                 animation)
        .measures;
  };
  const auto list = [](const Vector3d& v) { return json{v.x(), v.y(), v.z()}; };
  // At a frame, between two, and in the first of them.
  EXPECT_NEAR(misses(0.4, list(thrown(0.4)), {2, 3 - 9.81 * 0.4, -1})[0], 0, 1e-12);
  EXPECT_NEAR(misses(0.4, list(thrown(0.4)), {2, 3 - 9.81 * 0.4, -1})[1], 0, 1e-9);
  EXPECT_NEAR(misses(0.45, list((thrown(0.4) + thrown(0.5)) / 2), {2, 3 - 9.81 * 0.45, -1})[0], 0, 1e-12);
  EXPECT_NEAR(misses(0.45, {0, 0, 0}, {2, 3 - 9.81 * 0.45, -1})[1], 0, 1e-9);
  EXPECT_NEAR(misses(0.03, {0, 0, 0}, {2, 3 - 9.81 * 0.03, -1})[1], 0, 1e-9);
  EXPECT_NEAR(misses(0.2, list(thrown(0.2) + Vector3d(0, 0.3, 0.4)), {2, 0, -1})[0], 0.5, 1e-12);
  // After the end it rests.
  EXPECT_NEAR(misses(1.0, list(thrown(1)), {0, 0, 0})[1], 0, 1e-12);
  EXPECT_NEAR(misses(3000, list(thrown(1)), {0, 0, 0})[0], 0, 1e-12);
}

TEST(TermStateAt, IsAGaussianOfBothMisses) {
  const Animation animation = moving([](double t) { return Vector3d(t, 0, 0); }, 21);
  const json base = {{"body", "die"}, {"time", 1}};
  json place = base, speed = base, both = base;
  place["position"] = both["position"] = {1.05, 0, 0};
  speed["velocity"] = both["velocity"] = {1, 0.75, 0};
  const auto term_of = [](const json& document) { return read(state_at_term(table_top()), document); };
  EXPECT_NEAR(judge(*term_of(place), animation).log_density, half_square(0.5), 1e-9);
  EXPECT_TRUE(judge(*term_of(place), animation).satisfied);
  EXPECT_NEAR(judge(*term_of(speed), animation).log_density, half_square(1.5), 1e-9);
  EXPECT_FALSE(judge(*term_of(speed), animation).satisfied);
  EXPECT_NEAR(judge(*term_of(both), animation).log_density, half_square(0.5) + half_square(1.5), 1e-9);
  EXPECT_FALSE(judge(*term_of(both), animation).satisfied);
  EXPECT_EQ(term_of(both)->measures().size(), 2u);
  EXPECT_TRUE(term_of(both)->reads_frames());
  EXPECT_NEAR(term_of(both)->least_when_satisfied(), -1, 1e-12);
  EXPECT_NEAR(term_of(place)->least_when_satisfied(), -0.5, 1e-12);
}

TEST(TermStateAt, IsKnownOnceTheFramesAroundAre) {
  const Animation whole = moving(thrown, 11);
  const auto term = read(state_at_term(table_top()),
                         {{"body", "die"}, {"time", 0.42}, {"position", {0, 0, 0}}, {"velocity", {0, 0, 0}}});
  const double score = judge(*term, whole).log_density;
  for (std::size_t frames = 0; frames < 11; ++frames) {
    Animation so_far = whole;
    so_far.frames = frames;
    // Frame 6 enters the velocity of frame 5.
    EXPECT_EQ(term->upper_bound(so_far), frames >= 7 ? score : 0) << frames;
  }
}

TEST(TermStateAt, RefusesHalfAVectorAndNoneAtAll) {
  const TermKind kind = state_at_term(table_top());
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(fault_pointers(kind, {{"body", "die"}, {"time", 1}, {"position", {1, 2}}}),
            Pointers{"/t/position"});
  EXPECT_EQ(fault_pointers(kind, {{"body", "die"}, {"time", 1}}), Pointers{"/t/position"});
  EXPECT_EQ(fault_pointers(kind, {{"body", "table"}, {"time", 1}, {"velocity", {1, "a", 2000}}}),
            (Pointers{"/t/velocity/1", "/t/velocity/2"}));
  EXPECT_EQ(fault_pointers(kind, {{"body", "table"}, {"time", 1}, {"velocity", {1, 2, 3}}}),
            Pointers{"/t/body"});
}

// --- contact_at ------------------------------------------------------------------------------------

struct Touch {
  double time;
  std::size_t one, other;  ///< 0 the die, 1 the cup, 2 the table, 3 the wall
  double impulse = 1;
};
Animation touching(const std::vector<Touch>& touches, double duration = 4) {
  Animation animation = resting({{"die", {0, 0, 0}}, {"cup", {0, 0, 0}}});
  animation.rate = 10;
  animation.frames = static_cast<std::size_t>(10 * duration) + 1;
  for (const Touch& touch : touches)
    animation.events.push_back(
        {.time = touch.time, .bodies = {touch.one, touch.other}, .impulse = touch.impulse});
  return animation;
}
Said contacts(const json& document, const Animation& animation) {
  return judge(*read(contact_at_term(table_top()), document), animation);
}

TEST(TermContactAt, EveryTimeHasAContactNearbyAndOthersAreFree) {
  const json wish = {{"body", "die"}, {"times", {1, 2}}, {"sd", 0.1}, {"tolerance", 0.2}};
  const Said good = contacts(wish, touching({{0.4, 0, 2}, {1.1, 0, 2}, {1.8, 3, 0}, {3, 0, 1}}));
  EXPECT_TRUE(good.satisfied);
  EXPECT_NEAR(good.log_density, half_square(1) + half_square(2), 1e-9);
  EXPECT_NEAR(good.measures[0], 0.2, 1e-12);
  EXPECT_EQ(good.measures[1], 4);
  const Said late = contacts(wish, touching({{1, 0, 2}, {2.3, 0, 2}}));
  EXPECT_FALSE(late.satisfied);
  EXPECT_NEAR(late.log_density, half_square(3), 1e-9);
  EXPECT_FALSE(contacts(wish, touching({{1, 1, 2}, {2, 1, 2}})).satisfied) << "of another body";
}

TEST(TermContactAt, NoContactIsMissedByTheMostThatOneCouldMiss) {
  const json wish = {{"body", "die"}, {"times", {1, 3.5}}, {"sd", 1}, {"tolerance", 1000}};
  const Said none = contacts(wish, touching({}));
  EXPECT_FALSE(none.satisfied) << "whatever the tolerance";
  EXPECT_NEAR(none.log_density, half_square(3) + half_square(3.5), 1e-9);
  EXPECT_LE(none.log_density, contacts(wish, touching({{4, 0, 2}})).log_density);
  EXPECT_LE(none.log_density, contacts(wish, touching({{0, 0, 2}})).log_density);
}

TEST(TermContactAt, CountsTheContactsThatAreMeant) {
  const Animation animation = touching({{1, 0, 2, 0.5}, {2, 1, 0, 2}, {3, 1, 3, 3}});
  const auto count = [&](json more) {
    more["times"] = {1};
    return contacts(more, animation).measures[1];
  };
  EXPECT_EQ(count({}), 3);
  EXPECT_EQ(count({{"body", "any"}, {"with", "die"}}), 2);
  EXPECT_EQ(count({{"body", "cup"}, {"with", "die"}}), 1);
  EXPECT_EQ(count({{"body", "wall"}}), 1);
  EXPECT_EQ(count({{"body", "die"}, {"with", "wall"}}), 0);
  EXPECT_EQ(count({{"least_impulse", 2}}), 2);
}

TEST(TermContactAt, EveryContactFallsOnABeatAfterTheFirst) {
  const json wish = {{"body", "die"}, {"bpm", 60}, {"contacts", 3}, {"sd", 0.1}, {"tolerance", 0.15}};
  const Said good = contacts(wish, touching({{0.7, 0, 2}, {1.8, 0, 2}, {3.6, 0, 2}}));
  EXPECT_TRUE(good.satisfied);
  EXPECT_NEAR(good.log_density, 2 * half_square(1), 1e-9);
  EXPECT_NEAR(good.measures[0], 0.1, 1e-12);
  EXPECT_FALSE(contacts(wish, touching({{0.7, 0, 2}, {1.7, 0, 2}, {2.9, 0, 2}})).satisfied);
  const Said few = contacts(wish, touching({{0.7, 0, 2}, {1.7, 0, 2}}));
  EXPECT_FALSE(few.satisfied);
  EXPECT_NEAR(few.log_density, half_square(5), 1e-9) << "one is lacking, between two beats";
  const Said none = contacts(wish, touching({}));
  EXPECT_TRUE(std::isnan(none.measures[0]));
  EXPECT_NEAR(none.log_density, 3 * half_square(5), 1e-9);
}

TEST(TermContactAt, BeatsCanBeCountedFromTheStart) {
  const json wish = {{"bpm", 120}, {"from", "start"}, {"offset", 0.2}, {"sd", 0.1}, {"tolerance", 0.15}};
  const Said said = contacts(wish, touching({{0.3, 0, 2}, {1.7, 1, 2}}));
  EXPECT_TRUE(said.satisfied);
  EXPECT_NEAR(said.log_density, half_square(1), 1e-9);
  EXPECT_FALSE(contacts(wish, touching({{0.45, 0, 2}, {1.7, 1, 2}})).satisfied);
}

TEST(TermContactAt, WhatIsToComeIsLaterThanWhatIsKnown) {
  const auto at = read(contact_at_term(table_top()), {{"body", "die"}, {"times", {1, 2}}, {"sd", 0.1}});
  EXPECT_EQ(at->upper_bound(touching({}, 0.9)), 0);
  EXPECT_NEAR(at->upper_bound(touching({}, 1.5)), half_square(5), 1e-9) << "the first is late for good";
  EXPECT_NEAR(at->upper_bound(touching({{0.9, 0, 2}}, 1.5)), half_square(1), 1e-9);
  const auto beat = read(contact_at_term(table_top()), {{"body", "die"}, {"bpm", 60}, {"sd", 0.1}});
  EXPECT_EQ(beat->upper_bound(touching({}, 3)), 0);
  EXPECT_NEAR(beat->upper_bound(touching({{1, 0, 2}, {2.3, 0, 2}}, 3)), half_square(3), 1e-9);
  for (const auto* term : {&at, &beat}) {
    Animation nothing = touching({{1, 0, 2}, {1.3, 0, 2}}, 3);
    nothing.frames = 0;
    EXPECT_EQ((*term)->upper_bound(nothing), 0) << "without frames nothing is known of contacts";
  }
}

TEST(TermContactAt, TakesTimesOrABeatOfBodiesThatExist) {
  const TermKind kind = contact_at_term(table_top());
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(fault_pointers(kind, json::object()), Pointers{"/t/times"});
  EXPECT_EQ(fault_pointers(kind, {{"times", {1}}, {"bpm", 60}}), Pointers{"/t/bpm"});
  EXPECT_EQ(fault_pointers(kind, {{"times", {1}}, {"body", "dice"}, {"with", "floor"}}),
            (Pointers{"/t/body", "/t/with"}));
  EXPECT_EQ(fault_pointers(kind, {{"bpm", 60}, {"offset", 1}}), Pointers{"/t/offset"});
  EXPECT_EQ(fault_pointers(kind, {{"times", {1, -2}}, {"from", "end"}}), (Pointers{"/t/times/1", "/t/from"}));
}

// --- order -----------------------------------------------------------------------------------------

const json kStory = {{{"kind", "contact"}, {"body", "die"}, {"with", "cup"}},
                     {{"kind", "fall"}, {"body", "cup"}},
                     {{"kind", "rest"}, {"body", "die"}}};

Animation story(double hit, double fall, double rest, double duration = 4) {
  Animation animation = touching({}, duration);
  if (hit >= 0) animation.events.push_back({.time = hit, .bodies = {1, 0}});
  if (fall >= 0) animation.tracks[1].fell = fall;
  if (rest >= 0) animation.tracks[0].settled = rest;
  return animation;
}

TEST(TermOrder, CountsEventsThatAreNotBeforeTheNext) {
  const auto term = read(order_term(table_top()), {{"events", kStory}});
  EXPECT_TRUE(term->reads_frames());
  EXPECT_EQ(term->least_when_satisfied(), 0);
  const auto said = [&](double hit, double fall, double rest) {
    return judge(*term, story(hit, fall, rest));
  };
  EXPECT_TRUE(said(1, 2, 3).satisfied);
  EXPECT_EQ(said(1, 2, 3).log_density, 0);
  EXPECT_EQ(said(1, 2, 3).measures, (std::vector<double>{0, 1, 2, 3}));
  EXPECT_EQ(said(2, 1, 3).log_density, -2.5);
  EXPECT_EQ(said(3, 2, 1).log_density, -5);
  EXPECT_EQ(said(1, 1, 3).log_density, -2.5) << "at once is not before";
  EXPECT_EQ(said(1, -1, 3).log_density, -5) << "what never happens is not before and not after";
  EXPECT_FALSE(said(1, 2, -1).satisfied);
  EXPECT_TRUE(std::isnan(said(1, 2, -1).measures[3]));
}

TEST(TermOrder, OnlyTheFirstContactCounts) {
  const auto term =
      read(order_term(table_top()), {{"events",
                                      {{{"kind", "contact"}, {"body", "die"}, {"with", "table"}},
                                       {{"kind", "contact"}, {"body", "die"}, {"with", "wall"}}}}});
  EXPECT_TRUE(judge(*term, touching({{1, 0, 2}, {2, 0, 3}, {3, 0, 2}})).satisfied);
  EXPECT_FALSE(judge(*term, touching({{1, 0, 3}, {2, 0, 2}, {3, 0, 3}})).satisfied);
}

TEST(TermOrder, WhatWouldBeKnownAndIsNotComesLater) {
  const auto term = read(order_term(table_top()), {{"events", kStory}});
  EXPECT_EQ(term->upper_bound(story(-1, -1, -1, 0)), 0);
  EXPECT_EQ(term->upper_bound(story(1, -1, -1, 3)), 0);
  EXPECT_EQ(term->upper_bound(story(-1, 1, -1, 3)), -2.5) << "the fall came before any hit";
  EXPECT_EQ(term->upper_bound(story(-1, 1, -1, 0.5)), 0) << "contacts are not known as far as that";
  EXPECT_EQ(term->upper_bound(story(-1, -1, 2, 3)), 0) << "falls are told on their own";
  const auto rests =
      read(order_term(table_top()),
           {{"events", {{{"kind", "rest"}, {"body", "cup"}}, {{"kind", "rest"}, {"body", "die"}}}}});
  EXPECT_FALSE(rests->reads_frames());
  EXPECT_EQ(rests->upper_bound(story(-1, -1, 2, 0)), -2.5) << "the cup still moves";
  Animation both = story(-1, -1, 2, 0);
  both.tracks[1].settled = 1;
  EXPECT_EQ(rests->upper_bound(both), 0);
}

TEST(TermOrder, RefusesEventsThatCannotBe) {
  const TermKind kind = order_term(table_top());
  const auto pointers_of = [&](const json& event) {
    return fault_pointers(kind, {{"events", json::array({event, {{"kind", "fall"}, {"body", "cup"}}})}});
  };
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(pointers_of({{"kind", "fall"}, {"body", "die"}}), Pointers{"/t/events/0/kind"});
  EXPECT_EQ(pointers_of({{"kind", "rest"}, {"body", "table"}}), Pointers{"/t/events/0/body"});
  EXPECT_EQ(pointers_of({{"kind", "rest"}, {"body", "die"}, {"with", "cup"}}), Pointers{"/t/events/0/with"});
  EXPECT_EQ(pointers_of({{"kind", "contact"}, {"body", "dice"}}), Pointers{"/t/events/0/body"});
  EXPECT_EQ(pointers_of({{"kind", "hit"}, {"colour", 1}}),
            (Pointers{"/t/events/0/kind", "/t/events/0/body", "/t/events/0/colour"}));
  EXPECT_EQ(pointers_of(7), Pointers{"/t/events/0"});
  EXPECT_EQ(fault_pointers(kind, {{"events", json::array({{{"kind", "fall"}, {"body", "cup"}}})}}),
            Pointers{"/t/events"});
}

// --- inside ----------------------------------------------------------------------------------------

const json kCube = {{"low", {0, 0, 0}}, {"high", {1, 1, 1}}};

TEST(TermInside, IsAGaussianOfTheFarthestExcursion) {
  // Along x from -1 to 2 in three seconds.
  const Animation animation = moving([](double t) { return Vector3d(t - 1, 0.5, 0.5); }, 31);
  const auto said = [&](double from, double to) {
    return judge(
        *read(inside_term(table_top()), {{"body", "die"}, {"box", kCube}, {"from", from}, {"to", to}}),
        animation);
  };
  EXPECT_TRUE(said(1, 2).satisfied);
  EXPECT_EQ(said(1, 2).log_density, 0);
  EXPECT_NEAR(said(0.75, 2).measures[0], 0.25, 1e-12) << "between two frames";
  EXPECT_NEAR(said(0.75, 2).log_density, half_square(2.5), 1e-9);
  EXPECT_FALSE(said(0.75, 2).satisfied);
  EXPECT_NEAR(said(1, 2.04).measures[0], 0.04, 1e-12);
  EXPECT_NEAR(said(0, 3600).measures[0], 1, 1e-12);
  EXPECT_NEAR(said(10, 20).measures[0], 1, 1e-12) << "where it rests";
  const auto corner = moving([](double) { return Vector3d(1.3, -0.4, 0.5); }, 3);
  EXPECT_NEAR(judge(*read(inside_term(table_top()), {{"body", "die"}, {"box", kCube}}), corner).measures[0],
              0.5, 1e-12);
}

TEST(TermInside, AnExcursionIsForGood) {
  const Animation whole = moving([](double t) { return Vector3d(t - 1, 0.5, 0.5); }, 31);
  const auto term = read(inside_term(table_top()), {{"body", "die"}, {"box", kCube}, {"from", 1}});
  const auto bound = [&](std::size_t frames) {
    Animation so_far = whole;
    so_far.frames = frames;
    return term->upper_bound(so_far);
  };
  EXPECT_EQ(bound(0), 0);
  EXPECT_EQ(bound(21), 0);
  EXPECT_NEAR(bound(23), half_square(2), 1e-9);
  EXPECT_NEAR(bound(31), half_square(10), 1e-9);
}

TEST(TermInside, RefusesBoxesAndTimesTheWrongWayRound) {
  const TermKind kind = inside_term(table_top());
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(
      fault_pointers(
          kind,
          {{"body", "die"}, {"box", {{"low", {0, 2, 0}}, {"high", {1, 1, 1}}}}, {"from", 2}, {"to", 1}}),
      (Pointers{"/t/box/high/1", "/t/to"}));
  EXPECT_EQ(fault_pointers(kind, {{"body", "die"}, {"box", {{"low", {0, 2}}, {"top", 1}}}}),
            (Pointers{"/t/box/low", "/t/box/high", "/t/box/top"}));
  EXPECT_EQ(fault_pointers(kind, {{"body", "die"}, {"box", 3}}), Pointers{"/t/box"});
  EXPECT_EQ(fault_pointers(kind, {{"body", "die"}}), Pointers{"/t/box"});
}

TEST(TermInside, MarksTheEdgesOfItsBox) {
  const auto marks = read(inside_term(table_top()), {{"body", "die"}, {"box", kCube}})->markers({});
  ASSERT_EQ(marks.size(), 1u);
  const Mesh& mesh = std::get<Mesh>(marks[0].shape);
  EXPECT_EQ(mesh.indices.size(), 12u * 36u);
  // Every side is shared by two triangles that go around it in opposite ways: a closed surface.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  double volume = 0;
  const auto vertex = [&](std::uint32_t index) { return Vector3d(&mesh.positions[3 * index]); };
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k)
      ++sides[{mesh.indices[i + k], mesh.indices[i + (k + 1) % 3]}];
    volume += vertex(mesh.indices[i]).cross(vertex(mesh.indices[i + 1])).dot(vertex(mesh.indices[i + 2])) / 6;
  }
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(sides.contains({side.second, side.first}));
  }
  EXPECT_NEAR(volume, 12 * 1.004 * 0.004 * 0.004, 1e-9) << "counter-clockwise from outside";
  const json hall = {{"low", {-1000, 0, 0}}, {"high", {1000, 1, 1}}};
  EXPECT_TRUE(read(inside_term(table_top()), {{"body", "die"}, {"box", hall}})->markers({}).empty());
}

// --- What all of them share --------------------------------------------------------------------------

TEST(Terms, TheOnlyBodyNeedNotBeNamed) {
  Setting setting = table_top();
  setting.roster = [](const Parameters&) { return Roster{.movers = {{.name = "die"}}, .still = {}}; };
  EXPECT_TRUE(fault_pointers(rest_position_term(setting), {{"x", 1}, {"z", 1}}).empty());
  setting = table_top();
  setting.only_body = "die";
  EXPECT_EQ(fault_pointers(rest_position_term(setting), {{"x", 1}, {"z", 1}}),
            std::vector<std::string>{"/t/body"})
      << "this scene has two";
}

TEST(Terms, AnUnknownBodyIsToldTheOthers) {
  std::vector<Fault> faults;
  read(rest_position_term(table_top()), {{"body", "dice"}, {"x", 1}, {"z", 1}}, faults);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].detail, "there is no body \"dice\" here; there are die, cup");
  faults.clear();
  read(rest_position_term(table_top()), {{"body", "table"}, {"x", 1}, {"z", 1}}, faults);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].detail, "table stands still; what moves are die, cup");
}

}  // namespace
}  // namespace retake::tests
