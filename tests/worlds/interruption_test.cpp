// A simulation that takes many steps ends at once when it is interrupted, in every world; the next one, of
// another object, tells what it would have told.
#include <gtest/gtest.h>

#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests {
namespace {

/// Worlds whose animations follow from closed forms, in microseconds.
bool takes_no_steps(const World& world) {
  return world.name() == "ball2d";
}

class InterruptedWorld : public ::testing::TestWithParam<const World*> {};
INSTANTIATE_TEST_SUITE_P(All, InterruptedWorld, ::testing::ValuesIn(worlds()),
                         [](const auto& tested) { return std::string(tested.param->name()); });

TEST_P(InterruptedWorld, Checks_at_every_step) {
  const World& world = *GetParam();
  const OpenScenario open = open_smallest(world);
  Interruption interruption;
  interruption.ask();
  Animation animation;
  std::vector<double> measures(open.scene->measures().size());
  int interrupted = 0, simulated = 0;
  for (const State& state : draw_states(open.model(), 12, 40))
    for (const bool frames : {false, true}) {
      const auto physics = open.scene->make_physics();
      const auto run = physics->make_run();
      try {
        const SimulationOutcome outcome =
            physics->simulate(state, {.frames = frames, .record = run.get(), .interruption = &interruption},
                              animation, measures);
        // In some there is nothing to step, such as a ball that meets no pin.
        simulated += outcome.simulated_seconds > 0;
      } catch (const Interrupted&) {
        ++interrupted;
      }
    }
  if (takes_no_steps(world)) {
    EXPECT_EQ(interrupted, 0);
  } else {
    EXPECT_GT(interrupted, 20);
    EXPECT_EQ(simulated, 0);
  }
}

TEST_P(InterruptedWorld, Is_stopped_by_its_performer_whether_it_is_scored_or_shown) {
  if (takes_no_steps(*GetParam())) return;
  const OpenScenario open = open_smallest(*GetParam());
  int interrupted = 0;
  for (const State& state : draw_states(open.model(), 13, 20)) {
    const auto performer = open.scenario->make_performer();
    Score score;
    score.measures.assign(open.scenario->measures().size(), 0);
    performer->interruption().ask();
    const auto is_interrupted = [](const auto& work) {
      try {
        work();
        return false;
      } catch (const Interrupted&) {
        return true;
      }
    };
    const bool is_scored = is_interrupted([&] { performer->simulate(state, {}, score); });
    const bool is_shown = is_interrupted([&] { performer->perform(state); });
    interrupted += is_scored && is_shown;
  }
  EXPECT_GT(interrupted, 5);
}

}  // namespace
}  // namespace retake::tests
