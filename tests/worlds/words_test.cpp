// Words: numbers, lists and bodies in sentences, and the clause of each kind of term.
#include "worlds/words.h"

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"
#include "tests/worlds/stub_world.h"

namespace retake::tests {
namespace {

TEST(Words, NumbersAreShort) {
  EXPECT_EQ(in_words(1.0), "1");
  EXPECT_EQ(in_words(-0.0), "0");
  EXPECT_EQ(in_words(0.123456), "0.1235");
  EXPECT_EQ(seconds_in_words(0.03), "30 ms");
  EXPECT_EQ(seconds_in_words(1.5), "1.5 s");
  EXPECT_EQ(seconds_in_words(0), "0 s");
  EXPECT_EQ(in_words(std::vector<double>{1, -0.5, 0}), "(1, -0.5, 0)");
}

TEST(Words, ListsAndNamesRead) {
  EXPECT_EQ(list_in_words({}), "");
  EXPECT_EQ(list_in_words({"a"}), "a");
  EXPECT_EQ(list_in_words({"a", "b"}), "a and b");
  EXPECT_EQ(list_in_words({"a", "b", "c"}), "a, b and c");
  EXPECT_EQ(body_in_words("marble_3"), "marble 3");
  EXPECT_EQ(body_in_words("left_gutter"), "the left gutter");
}

/// The clause of a wish as it stands in a document, with every default filled in.
std::string said(const char* world, const json& model, std::string_view constraint) {
  const json constraints = json::array({json::parse(constraint)});
  return wishes_of(
             Scenario::read({{"world", world}, {"model", model}, {"constraints", constraints}})->document())
      .at(0);
}

TEST(Wishes, ThePlaceAndTheStateOfABodyAreSaid) {
  const json none = json::object();
  EXPECT_EQ(said("ball2d", none, R"({"kind":"rest_position","x":1})"),
            "the ball comes to rest at x = 1 m, within 0.1 m");
  EXPECT_EQ(said("spelling", none, R"({"kind":"rest_position","body":"marble_3","x":0.01,"z":-0.02})"),
            "marble 3 comes to rest at x = 0.01 m and z = -0.02 m, within 0.008 m");
  EXPECT_EQ(said("ball2d", none, R"({"kind":"state_at","time":1.5,"position":[1,0.5,0]})"),
            "the ball is at (1, 0.5, 0) m after 1.5 s");
  EXPECT_EQ(said("ball2d", none, R"({"kind":"state_at","time":2,"position":[0,0,0],"velocity":[1,0,0]})"),
            "the ball is at (0, 0, 0) m and moves by (1, 0, 0) m/s after 2 s");
  const std::string box = R"("kind":"inside","box":{"low":[0,0,0],"high":[1,1,1]})";
  EXPECT_EQ(said("ball2d", none, "{" + box + "}"), "the ball stays between (0, 0, 0) m and (1, 1, 1) m");
  EXPECT_EQ(said("ball2d", none, "{" + box + R"(,"from":1,"to":2})"),
            "the ball stays between (0, 0, 0) m and (1, 1, 1) m from 1 s to 2 s");
  EXPECT_EQ(said("ball2d", none, "{" + box + R"(,"from":1})"),
            "the ball stays between (0, 0, 0) m and (1, 1, 1) m from 1 s on");
  EXPECT_EQ(said("ball2d", none, "{" + box + R"(,"to":2})"),
            "the ball stays between (0, 0, 0) m and (1, 1, 1) m until 2 s");
}

TEST(Wishes, ContactsAndTheirOrderAreSaid) {
  const json none = json::object();
  EXPECT_EQ(said("bowling", none, R"({"kind":"contact_at","body":"pin_1","with":"ball","times":[2.4]})"),
            "there is a contact of pin 1 and the ball at 2.4 s, within 30 ms");
  EXPECT_EQ(said("bowling", none, R"({"kind":"contact_at","times":[1,2]})"),
            "there is a contact at 1 s and 2 s, within 30 ms");
  EXPECT_EQ(said("ball2d", none, R"({"kind":"contact_at","body":"ball","bpm":120})"),
            "every contact of the ball is on the beat, 120 a minute, within 30 ms");
  EXPECT_EQ(
      said("bowling", none, R"({"kind":"order","events":[{"kind":"contact","body":"ball","with":"pin_1"},
              {"kind":"contact","body":"pin_2"},{"kind":"fall","body":"pin_1"}]})"),
      "the ball touches pin 1, then pin 2 touches something, then pin 1 falls");
  EXPECT_EQ(said("spelling", none, R"({"kind":"order","events":[{"kind":"contact","body":"any"},
              {"kind":"contact","body":"any","with":"marble_1"},{"kind":"rest","body":"marble_2"}]})"),
            "there is a contact, then marble 1 is touched, then marble 2 comes to rest");
}

TEST(Wishes, WhatAWorldAddsIsSaid) {
  const auto pins = [](const json& rack, const char* down) {
    return said("bowling", {{"rack", rack}}, R"({"kind":"pins","down":)" + std::string(down) + "}");
  };
  const json all = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  EXPECT_EQ(pins(all, "[]"), "every pin stays up");
  EXPECT_EQ(pins(all, "[1,2,3,4,5,6,7,8,9,10]"), "all 10 pins go down");
  EXPECT_EQ(pins({6, 7}, "[6,7]"), "pins 6 and 7 go down");
  EXPECT_EQ(pins({6}, "[6]"), "pin 6 goes down");
  EXPECT_EQ(pins(all, "[1,2,3,4,5,8,9,10]"), "pins 6 and 7 stay up, and every other goes down");
  EXPECT_EQ(pins(all, "[1,2,3,4,5,6,8,9,10]"), "pin 7 stays up, and every other goes down");
  EXPECT_EQ(pins(all, "[7]"), "pin 7 goes down, and no other");
  EXPECT_EQ(said("spelling", json::object(), R"({"kind":"spell","text":"hi"})"), "the marbles spell “HI”");
  EXPECT_EQ(said("spelling", {{"columns", 2}, {"rows", 1}}, R"({"kind":"bins","rows":["#."]})"),
            "the marbles fill the marked bins, and no other");
  EXPECT_EQ(said("dice", {{"dice", 2}}, R"({"kind":"total","sum":7})"), "the dice show 7 together");
  EXPECT_EQ(said("dice", {{"dice", 2}}, R"({"kind":"face_up","body":"die_2","face":6})"),
            "die 2 shows face 6");
}

TEST(Wishes, WhatHasNoSentenceOrCannotBeReadIsSaidByWhatIsKnown) {
  const json document = {{"world", "stub"},
                         {"model", json::object()},
                         {"constraints", json::array({{{"kind", "before"}, {"limit", 3}}})}};
  EXPECT_EQ(wishes_of(document, {&stub_world()}), std::vector<std::string>{"the bead is before a limit"});
  EXPECT_EQ(wishes_of(document, {}), std::vector<std::string>{"before"});
  json faulty = {{"world", "dice"},
                 {"model", json::object()},
                 {"constraints", json::array({{{"kind", "face_up"}, {"side", 6}}, {{"kind", "as_if"}}})}};
  EXPECT_EQ(wishes_of(faulty), (std::vector<std::string>{"face up", "as if"}));
}

}  // namespace
}  // namespace retake::tests
