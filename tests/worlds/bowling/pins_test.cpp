// The term `pins`: its counts on animations made by hand, and that its bound never promises too little.
// Paper, section 5.2.1. Seeds are fixed.
#include "worlds/bowling/pins.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/bowling/fixture.h"
#include "worlds/bowling/view.h"

namespace retake::tests {
namespace {

using namespace bowling;

/// The term of a document's first constraint.
std::unique_ptr<const Term> pins(json rack, json down, double log_lambda) {
  const TermKind kind = pins_term();
  std::vector<Fault> faults;
  const Parameters model =
      find_world("bowling")->model_parameters().read({{"rack", std::move(rack)}}, "/model", faults);
  json term = {{"kind", "pins"}, {"down", std::move(down)}, {"log_lambda", log_lambda}};
  const Parameters parameters = kind.parameters.read(term, "/constraints/0", faults, {"kind"});
  EXPECT_TRUE(faults.empty());
  return kind.make(parameters, model, "/constraints/0", faults);
}

enum class End { stands, slid, slid_little, fell };

Animation ending(const std::vector<End>& ends) {
  Animation animation;
  animation.tracks.resize(kFirstPinTrack + ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    Track& track = animation.tracks[kFirstPinTrack + i];
    track.start.position = track.rest.position = {static_cast<double>(i), 0.147, 0.3};
    if (ends[i] == End::slid) track.rest.position.z() -= 0.0501;
    if (ends[i] == End::slid_little) track.rest.position.x() += 0.0499;
    if (ends[i] == End::fell) track.fell = 1.5;
  }
  return animation;
}

struct Judged {
  int missing;
  bool satisfied;
  std::vector<int> as_wished;
  friend bool operator==(const Judged&, const Judged&) = default;
};
std::ostream& operator<<(std::ostream& out, const Judged& judged) {
  return out << judged.missing << " missing, " << judged.as_wished.size() << " as wished";
}

Judged judge(json rack, json down, const std::vector<End>& ends) {
  constexpr double kLogLambda = 1.75;
  const auto term = pins(std::move(rack), std::move(down), kLogLambda);
  std::array<double, 2> measures{};
  const TermScore score = term->score(ending(ends), measures);
  EXPECT_NEAR(score.log_density, -kLogLambda * measures[1], 1e-12);
  EXPECT_GE(term->upper_bound(ending(ends)), score.log_density);
  EXPECT_LE(term->upper_bound(ending(ends)), 0);
  return {static_cast<int>(measures[1]), score.satisfied, members_of(measures[0])};
}

/// k counts the pins that end as wished, m those that must stand and have not moved far; each lacks from its
/// maximum.
TEST(BowlingPins, CountsWhatIsShortOfTheWish) {
  using enum End;
  // Two shall fall.
  EXPECT_EQ(judge({6, 7}, {6, 7}, {fell, fell}), (Judged{0, true, {6, 7}}));
  EXPECT_EQ(judge({6, 7}, {6, 7}, {fell, stands}), (Judged{1, false, {6}}));
  EXPECT_EQ(judge({6, 7}, {6, 7}, {slid, stands}), (Judged{2, false, {}}))
      << "a pin that wrongly stands earns nothing in m";
  // One shall stay.
  EXPECT_EQ(judge({6, 7}, {6}, {fell, stands}), (Judged{0, true, {6, 7}}));
  EXPECT_EQ(judge({6, 7}, {6}, {fell, slid_little}), (Judged{0, true, {6, 7}}));
  EXPECT_EQ(judge({6, 7}, {6}, {fell, slid}), (Judged{1, false, {6}}));
  EXPECT_EQ(judge({6, 7}, {6}, {fell, fell}), (Judged{2, false, {6}}));
  EXPECT_EQ(judge({6, 7}, {6}, {stands, fell}), (Judged{3, false, {}}));
  // Nothing shall happen.
  EXPECT_EQ(judge({6, 7}, json::array(), {stands, stands}), (Judged{0, true, {6, 7}}));
  EXPECT_EQ(judge({6, 7}, json::array(), {fell, slid}), (Judged{3, false, {}}));
}

TEST(BowlingPins, ThePapersMaximaAreReached) {
  // A strike scores 10 at most, the six-seven leave 12, a spare 2: so many lack if everything goes wrong.
  const auto all = [](std::size_t pins, End end) { return std::vector<End>(pins, end); };
  EXPECT_EQ(judge(kFullRack, kFullRack, all(10, End::stands)).missing, 10);
  const json leave = {1, 2, 3, 4, 5, 8, 9, 10};
  std::vector<End> worst = all(10, End::stands);
  worst[5] = worst[6] = End::fell;
  EXPECT_EQ(judge(kFullRack, leave, worst).missing, 12);
  EXPECT_EQ(judge({6, 7}, {6, 7}, all(2, End::stands)).missing, 2);
  EXPECT_EQ(judge(kFullRack, leave, all(10, End::fell)).missing, 4) << "a strike is not a six-seven leave";
}

/// Every subset of three pins, wished in every way: the bound of what has fallen so far is never below what
/// comes of it.
TEST(BowlingPins, TheBoundIsNeverBelowAnyContinuation) {
  using enum End;
  const std::vector<End> all = {stands, slid, fell};
  for (int wish = 0; wish < 8; ++wish) {
    json down = json::array();
    for (int i = 0; i < 3; ++i)
      if (wish >> i & 1) down.push_back(i + 4);
    const auto term = pins({4, 5, 6}, down, 2);
    for (const End a : all)
      for (const End b : all)
        for (const End c : all) {
          const std::vector<End> final = {a, b, c};
          std::array<double, 2> measures{};
          const double score = term->score(ending(final), measures).log_density;
          for (int so_far = 0; so_far < 8; ++so_far) {
            std::vector<End> now(3, stands);
            bool leads_there = true;
            for (std::size_t i = 0; i < 3; ++i)
              if (so_far >> i & 1) {
                now[i] = fell;
                leads_there &= final[i] == fell;
              }
            if (leads_there) {
              EXPECT_GE(term->upper_bound(ending(now)), score);
            }
          }
        }
  }
}

// --- Real throws
// ---------------------------------------------------------------------------------------------

/// Every throw that was stopped because it could no longer be what is needed is played to its end: it was
/// not.
void expect_stops_are_right(int wishes, int throws) {
  RandomStream random = stream(261);
  int stopped = 0, wrong = 0, simulated = 0;
  for (int wish = 0; wish < wishes; ++wish) {
    json down = json::array();
    for (int pin = 1; pin <= 10; ++pin)
      if (random.bernoulli(0.5)) down.push_back(pin);
    const auto scenario = bowling_scenario(json::object(), down);
    const auto performer = scenario->make_performer();
    Score score, whole;
    score.measures.resize(scenario->measures().size());
    whole.measures.resize(scenario->measures().size());
    for (const State& state :
         draw_states(scenario->model(), 262 + static_cast<std::uint64_t>(wish), throws)) {
      const double needed = -2.5 * static_cast<double>(random.index(13)) - 0.1;
      const auto outcome = performer->simulate(state, {.needed = needed}, score);
      ++simulated;
      if (outcome.end != SimulationEnd::stopped) continue;
      ++stopped;
      if (performer->simulate(state, {}, whole).end != SimulationEnd::complete) continue;
      wrong += whole.log_constraint > needed;
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(stopped, simulated / 20);
  std::printf("%d of %d throws were stopped, %d of them wrongly\n", stopped, simulated, wrong);
}
TEST(BowlingPins, NoThrowIsStoppedWrongly) {
  expect_stops_are_right(10, 40);
}
TEST(SlowBowlingPins, NoThrowIsStoppedWrongly) {
  expect_stops_are_right(40, 300);
}

}  // namespace
}  // namespace retake::tests
