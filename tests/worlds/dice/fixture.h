// What the tests of the dice share: scenes drawn from the prior.
#pragma once

#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"
#include "worlds/dice/dice_model.h"
#include "worlds/dice/tumble.h"

namespace retake::tests {

inline constexpr double kDieSide = 0.016;       // [m]
inline constexpr double kDieRounding = 0.0012;  // [m]
inline constexpr double kDieDensity = 1180;     // [kg/m3]

/// A die that is shorter along x by a share of its side.
inline dice::DieShape die_shape(double shortening = 0) {
  return dice::DieShape({kDieSide * (1 - shortening), kDieSide, kDieSide}, kDieRounding, kDieDensity);
}

/// Throws of one kind: a model, and what is needed to simulate its draws.
struct DiceTable {
  explicit DiceTable(const dice::DiceSettings& settings = {}, const dice::EngineSettings& engine = {},
                     const dice::DieShape& shape = die_shape())
      : model(settings, engine, shape), tumbler(engine, shape, settings.table) {}

  State draw(std::uint64_t seed, std::uint64_t number) const {
    RandomStream random = stream(seed, number);
    return draw_state(*model.model(), random);
  }
  dice::TumbleScene draw_scene(std::uint64_t seed, std::uint64_t number) const {
    return model.read(draw(seed, number)).scene;
  }

  dice::DiceModel model;
  dice::Tumbler tumbler;
};

}  // namespace retake::tests
