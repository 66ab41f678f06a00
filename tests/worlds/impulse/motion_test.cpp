// How motions are written, copied and compared.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/impulse/fixture.h"
#include "worlds/impulse/motion_writer.h"

namespace retake::tests {
namespace {

using namespace impulse;

/// One step that meets bodies 3 and 5 and hits the latter, after one that meets nobody.
struct Example {
  SphereState state{.position = {1, 2, 3}};
  std::vector<std::int32_t> partners = {3, 5};
  std::vector<Impact> impacts = {{1, 5, 0.25, {1, 2, 4}, {0, 0, -1}}};
  MotionWriter::Step step() const { return {state, 7, partners, impacts, false}; }

  std::shared_ptr<const Motion> motion() const {
    MotionWriter writer(SphereState{.position = {0, 2, 3}});
    writer.append({SphereState{.position = {0.5, 2, 3}}, 7, {}, {}, false});
    writer.append(step());
    return writer.finish({});
  }
};

TEST(ImpulseMotion, AStepIsKnownByItsStatePartnersAndImpacts) {
  const Example example;
  const auto motion = example.motion();
  ASSERT_TRUE(has_step(*motion, 1, example.step()));
  EXPECT_FALSE(has_step(*motion, 0, example.step()));
  EXPECT_FALSE(has_step(*motion, 2, example.step()));
  const auto has = [&](const auto& alter) {
    Example other;
    alter(other);
    return has_step(*motion, 1, other.step());
  };
  EXPECT_TRUE(has([](Example&) {}));
  EXPECT_FALSE(has([](Example& it) { it.state.position.x() = 1 + 1e-15; }));
  EXPECT_FALSE(has([](Example& it) { it.state.angular_velocity.x() = -0.0; }));
  EXPECT_FALSE(has([](Example& it) { it.state.quiet_steps = 1; }));
  EXPECT_FALSE(has([](Example& it) { it.partners = {3, 6}; }));
  EXPECT_FALSE(has([](Example& it) { it.partners = {3}; }));
  EXPECT_FALSE(has([](Example& it) { it.partners = {3, 4, 5}; }));
  EXPECT_FALSE(has([](Example& it) { it.impacts[0].other = 3; }));
  EXPECT_FALSE(has([](Example& it) { it.impacts[0].impulse = 0.26; }));
  EXPECT_FALSE(has([](Example& it) { it.impacts.clear(); }));
  MotionWriter::Step rests = example.step();
  rests.rests = true;
  EXPECT_FALSE(has_step(*motion, 1, rests));
}

/// Whether steps are appended or copied in pieces, the bits are the same; and meetings and stays are whole.
TEST(ImpulseMotion, AMotionCopiedInPiecesIsTheSame) {
  const Marbles marbles = crowded();
  Resimulation resimulation({}, marbles.box.make_surface());
  RandomStream random = stream(581);
  impulse::Run run;
  resimulation.simulate(draw_scene(marbles, random), nullptr, &run);
  std::size_t meetings = 0;
  for (const auto& motion : run.motions) {
    MotionWriter writer;
    for (std::int32_t end = 0; end < motion->step_count();) {
      end = std::min(end + static_cast<std::int32_t>(random.index(40)), motion->step_count());
      writer.copy(*motion, end);
    }
    EXPECT_TRUE(same_bits(*motion, *writer.finish(resimulation.settings())));
    for (std::size_t i = 1; i < motion->stays.size(); ++i)
      EXPECT_NE(motion->stays[i - 1].region, motion->stays[i].region);
    for (const Meeting& a : motion->meetings)
      for (const Meeting& b : motion->meetings)
        EXPECT_FALSE(a.other == b.other && a.end == b.begin);
    meetings += motion->meetings.size();
  }
  EXPECT_GT(meetings, 10u);
}

}  // namespace
}  // namespace retake::tests
