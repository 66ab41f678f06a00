// What the tests of the world bowling share: documents, draws, and throws on a deck of given settings.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"
#include "worlds/bowling/release.h"
#include "worlds/bowling/throw.h"

namespace retake::tests {

inline const std::vector<int> kFullRack = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};

inline json bowling_document(json model, json down) {
  return {{"world", "bowling"},
          {"model", std::move(model)},
          {"constraints", {{{"kind", "pins"}, {"down", std::move(down)}}}}};
}
inline std::shared_ptr<const Scenario> bowling_scenario(json model, json down) {
  return Scenario::read(bowling_document(std::move(model), std::move(down)));
}
inline std::shared_ptr<const Scenario> strike() {
  return bowling_scenario(json::object(), kFullRack);
}
inline std::shared_ptr<const Scenario> leave_six_seven() {
  return bowling_scenario(json::object(), {1, 2, 3, 4, 5, 8, 9, 10});
}

inline std::vector<State> draw_states(const Model& model, std::uint64_t seed, int count) {
  RandomStream random = stream(seed);
  std::vector<State> states;
  for (int i = 0; i < count; ++i)
    states.push_back(draw_state(model, random));
  return states;
}

/// Which of Scenario::measures() has a name.
inline std::size_t measure_index(const Scenario& scenario, std::string_view name) {
  for (std::size_t i = 0; i < scenario.measures().size(); ++i)
    if (scenario.measures()[i].name == name) return i;
  ADD_FAILURE() << "no measure " << name;
  return 0;
}

/// The ball where the deck takes over, some 0.4 m before the first pin.
inline bowling::Deck::Throw arriving(const bowling::Release& release, const bowling::Roll& roll, int rate,
                                     double x = -0.4) {
  const auto start = static_cast<std::int64_t>(std::ceil(roll.time_at(x) * rate));
  return {.ball = release.ball,
          .motion = roll.at(static_cast<double>(start) / rate),
          .start = start,
          .offsets = release.offsets};
}

/// Throws of the prior that reach the pins of a full rack, ready for a deck.
inline std::vector<bowling::Deck::Throw> throws_at_pins(std::uint64_t seed, int count, int rate = 480) {
  const bowling::ReleaseModel releases(bowling::ReleaseStyle::paper, kFullRack);
  RandomStream random = stream(seed);
  std::vector<bowling::Deck::Throw> throws;
  while (static_cast<int>(throws.size()) < count) {
    const bowling::Release release = releases.read(draw_state(*releases.model(), random));
    const bowling::Roll roll(release.ball, release.motion, {0.12, 0.12, bowling::kFoulLine});
    if (roll.time_at(-0.4) < roll.gutter_time()) throws.push_back(arriving(release, roll, rate));
  }
  return throws;
}

}  // namespace retake::tests
