// The keyframe document: resampling keeps the motion, the end and the contract's counts.
#include "worlds/formats/keyframes.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/contract/open_scenario.h"
#include "worlds/formats/recorded.h"
#include "worlds/scenario.h"

namespace retake {
namespace {

using nlohmann::json;

Animation ball_animation() {
  const auto scenario = Scenario::read({{"world", "ball2d"}, {"constraints", json::array()}});
  RandomStream draws({.seed = 11, .iteration = 3});
  State state;
  scenario->model().draw(draws, state);
  return scenario->make_performer()->perform(state).animation;
}

const KeyframeHead kHead{.sample = "chain-1", .world = "ball2d", .world_version = 1};

TEST(Keyframes, HaveThreeAndFourNumbersAFrame) {
  const json document = keyframes_json(ball_animation(), kHead);
  const std::size_t frames = document["frames"];
  EXPECT_EQ(document["format"], "retake.keyframes/1");
  EXPECT_EQ(document["tracks"][0]["position"].size(), 3 * frames);
  EXPECT_EQ(document["tracks"][0]["rotation"].size(), 4 * frames);
  EXPECT_DOUBLE_EQ(document["duration"].get<double>(), static_cast<double>(frames - 1) / 60);
}

TEST(Keyframes, AreRoundedToATenthOfTheirPrecision) {
  const Animation animation = ball_animation();
  const json document = keyframes_json(animation, kHead);
  for (Eigen::Index i = 0; i < animation.tracks[0].positions.size(); ++i)
    EXPECT_NEAR(document["tracks"][0]["position"][static_cast<std::size_t>(i)].get<double>(),
                animation.tracks[0].positions(i), 0.5e-5);
}

TEST(Keyframes, AtHalfTheRateAreEverySecondFrame) {
  const Animation animation = ball_animation();
  const json document = keyframes_json(animation, kHead, 30);
  EXPECT_EQ(document["rate"], 30);
  const json& position = document["tracks"][0]["position"];
  for (std::size_t frame = 0; 2 * frame < animation.frames; ++frame)
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(position[3 * frame + axis].get<double>(),
                  animation.tracks[0].positions(static_cast<Eigen::Index>(axis),
                                                static_cast<Eigen::Index>(2 * frame)),
                  1e-5);
}

/// A long flight of a few spinning bodies, which nobody simulated.
Animation long_animation(std::size_t frames, std::size_t tracks) {
  Animation animation;
  animation.rate = 60;
  animation.frames = frames;
  const auto count = static_cast<Eigen::Index>(frames);
  for (std::size_t t = 0; t < tracks; ++t) {
    const std::string name = "body" + std::to_string(t);
    animation.bodies.push_back({.name = name, .shape = Sphere{1}, .colour = "#000000", .track = t});
    Track& track = animation.tracks.emplace_back();
    track.name = name;
    track.positions.resize(3, count);
    track.rotations.resize(4, count);
    for (Eigen::Index frame = 0; frame < count; ++frame) {
      const double angle = 0.2 * static_cast<double>(frame) + static_cast<double>(t);
      track.positions.col(frame) = Eigen::Vector3d(std::cos(angle), angle, std::sin(angle));
      track.rotations.col(frame) = Eigen::Vector4d(0, std::sin(angle / 2), 0, std::cos(angle / 2));
    }
  }
  return animation;
}

TEST(Keyframes, AreWrittenInPiecesThatDoNotGrowWithTheDocument) {
  for (const double rate : {0.0, 7.0, 240.0}) {
    const Animation animation = long_animation(5000, 3);
    std::string text;
    std::size_t largest = 0, pieces = 0;
    EXPECT_TRUE(write_keyframes(animation, kHead, rate, [&](std::string_view piece) {
      text += piece;
      largest = std::max(largest, piece.size());
      ++pieces;
      return true;
    }));
    EXPECT_LT(largest, 200'000u) << rate;
    EXPECT_GE(pieces, text.size() / 200'000) << rate;
    const json document = json::parse(text);
    EXPECT_EQ(text, document.dump()) << "keys in order, numbers as everywhere";
    std::size_t numbers = 0;
    for (const json& track : document["tracks"])
      numbers += track["position"].size() + track["rotation"].size();
    EXPECT_EQ(keyframe_numbers(animation, rate), numbers) << rate;
    EXPECT_EQ(document["tracks"].size(), 3u);
  }
  int pieces = 0;
  EXPECT_FALSE(
      write_keyframes(long_animation(50'000, 3), kHead, 0, [&](std::string_view) { return ++pieces < 3; }));
  EXPECT_EQ(pieces, 3) << "it goes on though nobody wants more";
}

TEST(Keyframes, SuccessiveRotationsLieInOneHemisphereAtAnyRate) {
  const Animation animation = long_animation(600, 1);
  for (const double rate : {0.0, 1.0, 5.0, 12.0, 24.0, 59.0, 240.0}) {
    const json track = keyframes_json(animation, kHead, rate)["tracks"][0];
    const auto numbers = track["rotation"].get<std::vector<double>>();
    for (std::size_t i = 4; i < numbers.size(); i += 4) {
      double dot = 0;
      for (std::size_t k = 0; k < 4; ++k)
        dot += numbers[i + k] * numbers[i + k - 4];
      ASSERT_GE(dot, -1e-5) << rate << " at " << i / 4;
    }
  }
}

TEST(Keyframes, EndInTheRestAtAnyRate) {
  const Animation animation = ball_animation();
  for (const double rate : {1.0, 7.0, 24.0, 59.0, 61.0, 240.0}) {
    const json document = keyframes_json(animation, kHead, rate);
    const std::size_t frames = document["frames"];
    const json& position = document["tracks"][0]["position"];
    ASSERT_EQ(position.size(), 3 * frames);
    EXPECT_GE(document["duration"].get<double>(), animation.duration() - 1e-9) << rate;
    EXPECT_LT(document["duration"].get<double>(), animation.duration() + 1 / rate) << rate;
    EXPECT_NEAR(position[3 * frames - 3].get<double>(), animation.tracks[0].rest.position.x(), 1e-5) << rate;
  }
}

/// Whole rates, those of films and of nobody.
std::vector<double> rates_of_all_kinds() {
  std::vector<double> rates = {0.3, 7.5, 12.5, 23.976, 29.97, 59.94, 61.8034, 119.88};
  for (int rate = 1; rate <= 240; ++rate)
    rates.push_back(rate);
  return rates;
}

/// The least product of two successive rotations of a document.
double least_cosine(const json& document) {
  double least = 1;
  for (const json& track : document.at("tracks")) {
    const std::vector<double> rotation = track.at("rotation");
    for (std::size_t i = 4; i < rotation.size(); i += 4) {
      double cosine = 0;
      for (std::size_t k = 0; k < 4; ++k)
        cosine += rotation[i + k] * rotation[i - 4 + k];
      least = std::min(least, cosine);
    }
  }
  return least;
}

constexpr double kOfRounding = -1e-15;  // two rotations half a turn apart

TEST(Keyframes, SuccessiveRotationsLieInOneHemisphereAtEveryRateInEveryWorld) {
  for (const World* world : tests::all_worlds()) {
    const auto open = tests::open_smallest(*world);
    RandomStream draws({.seed = 407});
    const auto performer = open.scenario->make_performer();
    Animation animation;
    while (animation.frames == 0)
      if (const auto take = performer->perform(tests::draw_state(open.model(), draws)); take.complete)
        animation = decode_animation(encode_animation(take.animation));
    // What stands still has no motion, and takes most of the time.
    std::erase_if(animation.bodies, [](const Body& body) { return !body.track; });
    animation.events.clear();
    for (const double rate : rates_of_all_kinds())
      ASSERT_GE(least_cosine(keyframes_json(animation, kHead, rate)), kOfRounding)
          << world->name() << " at " << rate;
  }
}

TEST(Keyframes, SuccessiveRotationsLieInOneHemisphereHoweverABodyTumbles) {
  RandomStream draws({.seed = 409});
  Animation animation = ball_animation();
  Track& track = animation.tracks[0];
  for (int tumble = 0; tumble < 6; ++tumble) {
    for (Eigen::Index frame = 0; frame < track.rotations.cols(); ++frame)
      for (Eigen::Index row = 0; row < 4; ++row)
        track.rotations(row, frame) = draws.gaussian();
    track.rotations.colwise().normalize();
    put_in_one_hemisphere(track.rotations);
    const Animation stored = decode_animation(encode_animation(animation));
    for (const double rate : rates_of_all_kinds())
      ASSERT_GE(least_cosine(keyframes_json(stored, kHead, rate)), kOfRounding) << rate;
    ASSERT_GE(least_cosine(keyframes_json(stored, kHead)), kOfRounding);
  }
}

TEST(Keyframes, NameTheBodiesOfEveryContactInOrderOfTime) {
  const json document = keyframes_json(ball_animation(), kHead);
  double last = 0;
  ASSERT_FALSE(document["events"].empty());
  for (const json& event : document["events"]) {
    EXPECT_EQ(event["bodies"], json({"ball", "table"}));
    EXPECT_GT(event["impulse"].get<double>(), 0);
    EXPECT_GE(event["time"].get<double>(), last);
    last = event["time"];
  }
}

TEST(Keyframes, SayFromWhenOnABodyIsThereIfItIsNotThereFromTheStart) {
  Animation animation = ball_animation();
  EXPECT_FALSE(keyframes_json(animation, kHead)["tracks"][0].contains("from"));
  animation.tracks[0].from = 0.4503;
  EXPECT_EQ(keyframes_json(animation, kHead)["tracks"][0].at("from"), 0.4503);
  EXPECT_EQ(keyframes_json(animation, kHead, 7)["tracks"][0].at("from"), 0.4503) << "at any rate";
}

TEST(Keyframes, SayWhereToLookIfTheWorldDoes) {
  KeyframeHead head = kHead;
  EXPECT_FALSE(keyframes_json(ball_animation(), head).contains("view"));
  head.viewpoint =
      Viewpoint{.center = {1, 2, -3}, .half_extents = {4, 5, 6.5}, .azimuth = -0.25, .elevation = 1.0 / 3};
  const json view = {
      {"center", {1, 2, -3}}, {"half_extents", {4, 5, 6.5}}, {"azimuth", -0.25}, {"elevation", 0.333333}};
  EXPECT_EQ(keyframes_json(ball_animation(), head).at("view"), view);
  EXPECT_EQ(keyframes_json(ball_animation(), head, 7).at("view"), view) << "at any rate";
}

TEST(Keyframes, TellTheSurfaceOfEveryBody) {
  Animation animation = ball_animation();
  std::vector<std::string> told;
  for (std::size_t number = 0; number < kSurfaces; ++number)
    animation.bodies.push_back({.name = "tile " + std::to_string(number),
                                .shape = Box{{1, 1, 1}},
                                .colour = "#123456",
                                .surface = static_cast<Surface>(number)});
  const json document = keyframes_json(animation, kHead);
  EXPECT_EQ(document["bodies"][0]["surface"], "rubber") << "the ball's";
  for (const json& body : document["bodies"])
    told.push_back(body.at("surface"));
  EXPECT_EQ(std::vector<std::string>(told.end() - kSurfaces, told.end()),
            (std::vector<std::string>{"plain", "wood", "boards", "varnished", "felt", "cloth", "plastic",
                                      "polished", "glass", "metal", "rubber", "stone", "plaster", "marking",
                                      "lamp", "shade"}));
}

TEST(Keyframes, ShowAHeightFieldAsAMeshWithWhatItIsLike) {
  Animation animation = ball_animation();
  animation.bodies.push_back(
      {.name = "ground",
       .shape = HeightField{.rows = 2,
                            .columns = 3,
                            .spacing = 0.5,
                            .heights = {0, 0.1, 0.2, 0.3, 0.4, 0.5},
                            .attributes = {{"friction", {0.123, 0.2, 0, 1, 0.5, 0.999}}}},
       .colour = "#123456",
       .pose = {}});
  const json shape = keyframes_json(animation, kHead)["bodies"].back()["shape"];
  const json expected = {
      {"type", "mesh"},
      {"positions", {0, 0, 0, 0, 0.1, 0.5, 0, 0.2, 1, 0.5, 0.3, 0, 0.5, 0.4, 0.5, 0.5, 0.5, 1}},
      {"indices", {0, 4, 3, 0, 1, 4, 1, 5, 4, 1, 2, 5}},
      {"attributes", {{"friction", {0.12, 0.2, 0, 1, 0.5, 1}}}}};
  EXPECT_EQ(shape, expected);
}

TEST(Keyframes, AreMadeOfSamplesWhoseWorldIsNotInThisBuild) {
  const KeyframeHead head = keyframe_head(ball_animation(), "chain-1", "chess", 3);
  EXPECT_EQ(head.sample, "chain-1");
  EXPECT_EQ(head.world, "chess");
  EXPECT_EQ(head.world_version, 3);
  EXPECT_FALSE(head.viewpoint);
}

}  // namespace
}  // namespace retake
