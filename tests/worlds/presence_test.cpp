// Presence: what a viewer sees of bodies that are released one after the other, in all examples - each where
// it is let go, when it is let go, and none inside another. Seeds are fixed.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/dice/fixture.h"
#include "worlds/impulse/sphere.h"

namespace retake::tests {
namespace {

using Eigen::Vector3d;

/// Calls `look` with the title and a recorded animation of a few draws of the prior of every example of a
/// world, or of all; of dice, of those alone that have several if one would be no pair.
template <typename Look>
void look_at_examples(int draws, std::string_view only_world, bool pairs, const Look& look) {
  std::uint64_t number = 0;
  for (const World* world : worlds())
    for (const json& example : world->examples()) {
      RandomStream random = stream(731, number++);
      if (!only_world.empty() && world->name() != only_world) continue;
      if (pairs && world->name() == "dice" && example.value(json::json_pointer("/model/dice"), 1) == 1)
        continue;
      const auto scenario = Scenario::read(example);
      const auto performer = scenario->make_performer();
      for (int draw = 0; draw < draws; ++draw) {
        const auto take = performer->perform(draw_state(scenario->model(), random));
        if (take.complete) look(scenario->title(), take.animation);
      }
    }
}

Vector3d place(const Track& track, Eigen::Index frame) {
  return track.positions.col(frame);
}
Eigen::Matrix3d turn(const Track& track, Eigen::Index frame) {
  return Eigen::Quaterniond(Eigen::Vector4d(track.rotations.col(frame))).toRotationMatrix();
}

/// How far two spheres are in each other [m].
double overlap_of_spheres(const Animation& animation, std::size_t a, std::size_t b, Eigen::Index frame) {
  const auto radius = [&](std::size_t body) { return std::get<Sphere>(animation.bodies[body].shape).radius; };
  return radius(a) + radius(b) -
         (place(animation.tracks[a], frame) - place(animation.tracks[b], frame)).norm();
}

/// How far features of one die are in the rounded box of another [m], as the engine holds them against it.
double overlap_of_dice(const Animation& animation, std::size_t a, std::size_t b, Eigen::Index frame) {
  const dice::DieShape shape = die_shape();
  const Track &one = animation.tracks[a], &box = animation.tracks[b];
  const Vector3d apart = place(one, frame) - place(box, frame);
  const double reach = 2 * (shape.reach() + shape.rounding());
  if (apart.squaredNorm() >= reach * reach) return 0;
  const Vector3d core = shape.half_extents() - Vector3d::Constant(shape.rounding());
  const Eigen::Matrix3d to_box = turn(box, frame).transpose(), turned = turn(one, frame);
  double deepest = 0;
  for (const Vector3d& feature : shape.features()) {
    const Vector3d centre = to_box * (apart + turned * feature);
    const double beside = (centre - centre.cwiseMax(-core).cwiseMin(core)).norm();
    const double within = std::max((core - centre.cwiseAbs()).minCoeff(), 0.0);
    deepest = std::max(deepest, 2 * shape.rounding() - beside + within);
  }
  return deepest;
}

struct Deepest {
  double overlap = 0;     ///< [m]
  std::size_t pairs = 0;  ///< of bodies that are there, in all frames
};

/// The deepest overlap of two bodies that are there, over all frames.
template <typename Overlap>
void look_for_overlaps(const Animation& animation, const Overlap& overlap, Deepest& deepest) {
  for (Eigen::Index frame = 0; frame < static_cast<Eigen::Index>(animation.frames); ++frame) {
    const double time = static_cast<double>(frame) / animation.rate;
    std::vector<std::size_t> there;
    for (std::size_t track = 0; track < animation.tracks.size(); ++track)
      if (animation.tracks[track].from <= time) there.push_back(track);
    for (std::size_t i = 0; i < there.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        deepest.overlap = std::max(deepest.overlap, overlap(animation, there[i], there[j], frame));
        ++deepest.pairs;
      }
  }
}

/// What the engines leave of an overlap, and what a step may add to it before a contact is seen: its length
/// times how fast two bodies come together at most.
double engine_slop(double permitted_overlap, double time_step, double closing_speed) {
  return permitted_overlap + time_step * closing_speed;
}

TEST(Presence, NoMarbleIsInsideAnother) {
  const impulse::Settings engine;
  const double fall = std::sqrt(2 * engine.gravity * 0.072);  // [m/s], the fastest that a marble gets
  Deepest deepest;
  look_at_examples(2, "spelling", true, [&](const std::string& title, const Animation& animation) {
    Deepest here;
    look_for_overlaps(animation, overlap_of_spheres, here);
    EXPECT_LE(here.overlap, engine_slop(engine.permitted_overlap, engine.time_step, fall)) << title;
    deepest = {.overlap = std::max(deepest.overlap, here.overlap), .pairs = deepest.pairs + here.pairs};
  });
  std::printf("deepest overlap %.3f mm of %zu pairs\n", 1000 * deepest.overlap, deepest.pairs);
  EXPECT_GT(deepest.overlap, 0) << "marbles do touch";
  EXPECT_GT(deepest.pairs, 100000u);
}

TEST(Presence, NoDieIsInsideAnother) {
  const dice::EngineSettings engine;
  const double fall = std::sqrt(2 * engine.gravity * 0.13) + 0.5;  // [m/s], with how it is thrown
  Deepest deepest;
  look_at_examples(20, "dice", true, [&](const std::string& title, const Animation& animation) {
    Deepest here;
    look_for_overlaps(
        animation,
        [](const Animation& shown, std::size_t a, std::size_t b, Eigen::Index frame) {
          return std::max(overlap_of_dice(shown, a, b, frame), overlap_of_dice(shown, b, a, frame));
        },
        here);
    EXPECT_LE(here.overlap, engine_slop(engine.permitted_overlap, engine.time_step, fall)) << title;
    deepest = {.overlap = std::max(deepest.overlap, here.overlap), .pairs = deepest.pairs + here.pairs};
  });
  std::printf("deepest overlap %.3f mm of %zu pairs\n", 1000 * deepest.overlap, deepest.pairs);
  EXPECT_GT(deepest.overlap, 0) << "dice do touch";
  EXPECT_GT(deepest.pairs, 1000u);
}

TEST(Presence, NothingHappensToABodyBeforeItIsThere) {
  std::size_t late = 0;
  look_at_examples(1, "", false, [&](const std::string& title, const Animation& animation) {
    for (const Track& track : animation.tracks) {
      ASSERT_GE(track.from, 0) << title;
      ASSERT_LT(track.from, animation.duration()) << title;
      late += track.from > 0 ? 1 : 0;
      for (Eigen::Index frame = 0; static_cast<double>(frame) / animation.rate < track.from; ++frame) {
        ASSERT_EQ(track.positions.col(frame), track.start.position) << title << ", " << track.name;
        ASSERT_EQ(track.rotations.col(frame), track.start.rotation.coeffs()) << title << ", " << track.name;
      }
    }
    for (const ContactEvent& event : animation.events)
      for (const std::size_t body : event.bodies)
        if (const auto track = animation.bodies[body].track) {
          EXPECT_GE(event.time, animation.tracks[*track].from)
              << title << ", " << animation.bodies[body].name;
        }
  });
  EXPECT_GT(late, 50u);
}

TEST(Presence, ADigestTellsFromWhenOnABodyIsThere) {
  Animation animation;
  animation.tracks.emplace_back();
  const std::string from_the_start = digest(State(0), animation);
  animation.tracks[0].from = 0.5;
  EXPECT_NE(digest(State(0), animation), from_the_start);
}

}  // namespace
}  // namespace retake::tests
