// The general constraint terms on animations made by hand: what is satisfied, how dense a miss is, what can
// be said of an animation that goes on, and how documents with faults are refused.
#include <cmath>
#include <map>
#include <vector>

#include "tests/worlds/terms/fixture.h"

namespace retake::tests {
namespace {

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

TEST(TermStateAt, ABodyIsNowhereBeforeItIsThere) {
  // It waits until 0.5 s, then it goes along x.
  Animation whole = moving([](double t) { return Vector3d(std::max(0.0, t - 0.5), 0, 0); }, 11);
  whole.tracks[0].from = 0.5;
  const auto said = [&](double time) {
    const auto term =
        read(state_at_term(table_top()),
             {{"body", "die"}, {"time", time}, {"position", {0, 0, 0}}, {"velocity", {1, 0, 0}}});
    Animation nothing = whole;
    nothing.frames = 0;
    const Said now = judge(*term, whole);
    EXPECT_EQ(term->upper_bound(nothing), time < 0.5 ? now.log_density : 0) << "known before it begins";
    return now;
  };
  for (const double time : {0.0, 0.3, 0.4999}) {
    EXPECT_TRUE(std::isnan(said(time).measures[0]) && std::isnan(said(time).measures[1])) << time;
    EXPECT_NEAR(said(time).log_density, half_square(1000), 1e-6) << "as far away as what takes no part";
    EXPECT_FALSE(said(time).satisfied);
  }
  EXPECT_TRUE(said(0.5).satisfied);
  EXPECT_NEAR(said(0.5).measures[0], 0, 1e-12);
  EXPECT_NEAR(said(0.5).measures[1], 0, 1e-12) << "frames in which it waited say nothing of its velocity";
  EXPECT_NEAR(said(0.55).measures[1], 0, 1e-12);
}

TEST(TermStateAt, IsBoundedByNoLessThanComesOfABodyThatAppearsBetweenFrames) {
  Animation whole = moving([](double t) { return Vector3d(std::max(0.0, t - 0.45), 0, 0); }, 11);
  whole.tracks[0].from = 0.45;
  for (const double time : {0.45, 0.48, 0.5, 0.97, 2.0}) {
    const auto term =
        read(state_at_term(table_top()), {{"body", "die"}, {"time", time}, {"velocity", {5, 0, 0}}});
    const double score = judge(*term, whole).log_density;
    for (std::size_t frames = 0; frames < 11; ++frames) {
      Animation so_far = whole;
      so_far.frames = frames;
      so_far.tracks[0].positions.rightCols(static_cast<Eigen::Index>(11 - frames)).setConstant(-100);
      EXPECT_GE(term->upper_bound(so_far), score) << time << " after " << frames;
    }
  }
  // One that appears with the last frame only rests.
  whole.tracks[0].from = 1;
  const auto term = read(state_at_term(table_top()), {{"body", "die"}, {"time", 1}, {"velocity", {0, 0, 0}}});
  EXPECT_TRUE(judge(*term, whole).satisfied);
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

TEST(TermInside, ABodyIsInAndOutOfNothingBeforeItIsThere) {
  // It waits outside until 0.95 s, and then goes in.
  Animation whole = moving([](double t) { return Vector3d(std::max(0.0, 10 * (t - 0.95)), 2 - t, 0.5); }, 16);
  whole.tracks[0].from = 1;
  const auto term_of = [](double from, double to) {
    return read(inside_term(table_top()), {{"body", "die"}, {"box", kCube}, {"from", from}, {"to", to}});
  };
  EXPECT_TRUE(judge(*term_of(0, 1.04), whole).satisfied);
  EXPECT_NEAR(judge(*term_of(0, 1.1), whole).measures[0], 0.5, 1e-12);
  EXPECT_TRUE(judge(*term_of(1, 1), whole).satisfied);
  // It cannot stay anywhere as long as it is not there.
  const Said never = judge(*term_of(0, 0.99), whole);
  EXPECT_TRUE(std::isnan(never.measures[0]));
  EXPECT_FALSE(never.satisfied);
  EXPECT_NEAR(never.log_density, half_square(1000), 1e-6);
  Animation nothing = whole;
  nothing.frames = 0;
  EXPECT_EQ(term_of(0, 0.99)->upper_bound(nothing), never.log_density) << "known before it begins";
  EXPECT_EQ(term_of(0, 1)->upper_bound(nothing), 0);
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
