// Lessons come back by their numbers, and the next chain of a kind begins from the right one.
#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

class StoreLessons : public StoreTest {
 protected:
  void add(const std::string& id, std::uint64_t lesson = 0, const std::string& method = "metropolis") {
    auto chain = make_chain(id, "s");
    chain.lesson = lesson;
    chain.method = method;
    store.add_chains({chain});
  }
  void teach(const std::string& chain, LessonKind kind, const std::string& bytes = "bytes",
             std::uint32_t version = kLessonVersion) {
    auto progress = make_progress(chain, "s", 1, 1);
    progress.lesson = Lesson{.kind = kind, .version = version, .bytes = bytes};
    store.commit(std::move(progress)).get();
  }
  std::uint64_t next(const std::vector<std::uint64_t>& taken = {}, const std::string& method = "metropolis") {
    return store.next_lesson("s", method, "exact", taken);
  }
};

TEST_P(StoreLessons, come_back_by_their_numbers) {
  store.add_scenario(make_scenario("s"));
  store.add_scenario(make_scenario("t"));
  add("a");
  add("b", 0, "tempering");
  auto other = make_chain("z", "t");
  store.add_chains({other});
  teach("a", LessonKind::proposal, std::string("by\0es", 5));
  auto foreign = make_progress("z", "t", 1, 1);
  foreign.lesson = Lesson{.bytes = "foreign"};
  store.commit(std::move(foreign)).get();
  teach("b", LessonKind::place, "place");
  const auto lessons = store.lessons("s");
  ASSERT_EQ(lessons.size(), 2u);
  EXPECT_EQ(lessons[0].number, 1u);
  EXPECT_EQ(lessons[0].chain, "a");
  EXPECT_EQ(lessons[0].method, "metropolis");
  EXPECT_EQ(lessons[0].ratios, "exact");
  EXPECT_EQ(lessons[0].version, kLessonVersion);
  EXPECT_EQ(lessons[0].kind, LessonKind::proposal);
  EXPECT_GT(lessons[0].created_at, 1'600'000'000'000);
  EXPECT_EQ(lessons[1].number, 2u);
  EXPECT_EQ(lessons[1].method, "tempering");
  EXPECT_EQ(lessons[1].kind, LessonKind::place);
  EXPECT_EQ(store.lesson("s", 1)->bytes, std::string("by\0es", 5));
  EXPECT_EQ(store.lesson("s", 2)->bytes, "place");
  EXPECT_EQ(store.lesson("s", 2)->kind, LessonKind::place);
  EXPECT_EQ(store.lesson("t", 1)->bytes, "foreign");
  EXPECT_FALSE(store.lesson("s", 3));
  EXPECT_FALSE(store.lesson("gone", 1));
  EXPECT_TRUE(store.lessons("gone").empty());
  EXPECT_TRUE(store.check().empty());
  store.delete_scenario("s");
  EXPECT_FALSE(store.lesson("s", 1));
  EXPECT_EQ(store.next_lesson("t", "metropolis", "exact", {}), 1u);
}

TEST_P(StoreLessons, the_newest_of_a_kind_serves_any_number_of_chains) {
  store.add_scenario(make_scenario("s"));
  EXPECT_EQ(next(), 0u);
  add("a");
  teach("a", LessonKind::proposal);
  EXPECT_EQ(next(), 1u);
  add("b", 1);
  teach("b", LessonKind::proposal);
  EXPECT_EQ(next({2}), 2u);
  teach("b", LessonKind::proposal, "of another version", kLessonVersion + 1);
  EXPECT_EQ(next(), 2u);
  add("c", 2);
  EXPECT_EQ(next(), 2u);
  EXPECT_EQ(next({}, "tempering"), 0u);
  EXPECT_EQ(store.next_lesson("s", "metropolis", "paper", {}), 0u);
  EXPECT_EQ(store.next_lesson("gone", "metropolis", "exact", {}), 0u);
}

TEST_P(StoreLessons, from_a_place_one_chain_goes_on) {
  store.add_scenario(make_scenario("s"));
  for (const char* id : {"a", "b", "c"}) {
    add(id);
    teach(id, LessonKind::place);
  }
  EXPECT_EQ(next(), 1u) << "the one that waits longest";
  EXPECT_EQ(next({1, 2}), 3u) << "chains of one request go on from one each";
  EXPECT_EQ(next({1, 2, 3}), 0u);
  add("d", 1);
  EXPECT_EQ(next(), 2u);
  add("e", 2);
  add("f", 3);
  EXPECT_EQ(next(), 0u);
  // One that ended before it found anything gives its place back.
  store.set_chain_state("e", ChainState::finished, "stop", "");
  EXPECT_EQ(next(), 2u);
  auto found = make_progress("f", "s", 1, 3);
  found.state = ChainState::finished;
  store.commit(std::move(found)).get();
  EXPECT_EQ(next({2}), 0u) << "what it began from was used";
  // What is unfinished comes after the places, and before nothing.
  teach("a", LessonKind::unfinished);
  teach("a", LessonKind::unfinished);
  EXPECT_EQ(next({2}), 5u);
  EXPECT_EQ(next(), 2u);
  auto nothing = make_progress("d", "s", 1, 0);
  nothing.state = ChainState::finished;
  store.commit(std::move(nothing)).get();
  EXPECT_EQ(next({2}), 1u);
  teach("b", LessonKind::proposal);
  teach("a", LessonKind::unfinished);
  EXPECT_EQ(next(), 6u) << "a proposal before everything else";
}

RETAKE_FOR_EVERY_STORE(StoreLessons);

}  // namespace
}  // namespace retake::test
