// The constraint terms on when something happens, contacts and the order of events, on animations made by
// hand.
#include <cmath>
#include <vector>

#include "tests/worlds/terms/fixture.h"

namespace retake::tests {
namespace {

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

}  // namespace
}  // namespace retake::tests
