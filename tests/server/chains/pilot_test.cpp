// The Pilot on a real Store: every scenario is looked at once, whatever comes in between.
#include "server/chains/pilot.h"

#include <algorithm>
#include <atomic>

#include <gtest/gtest.h>

#include "db/open_store.h"
#include "sampler/check.h"
#include "server/api/views.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

class ThreadsPilot : public ::testing::Test {
 protected:
  struct Parts {
    explicit Parts(const std::string& path) : opened(open_store(path)), library(store) {}
    std::unique_ptr<Store> opened;
    Store& store = *opened;
    ScenarioLibrary library;
    EventHub events;
  };
  /// Every draw that a rejection chain keeps is a hit.
  static OddsTally kept_draws(const ChainCounts& counts) {
    const double hits = static_cast<double>(counts.samples);
    return {.basis = OddsBasis::rejection,
            .draws = counts.iteration,
            .hits = counts.samples,
            .sum = hits,
            .squares = hits,
            .largest = 1};
  }
  static std::string add_scenario(Parts& parts, const json& document) {
    return parts.store.add_scenario(new_scenario_record(*Scenario::read(document))).scenario.id;
  }
  static std::optional<PilotTally> pilot_of(const Parts& parts, const std::string& id) {
    const auto record = parts.store.scenario(id);
    return record ? record->pilot : std::nullopt;
  }
  static bool told(EventHub& events, const std::string& id) {
    const auto scenarios = events.changes_since(0, std::chrono::milliseconds(0)).scenarios;
    return std::find(scenarios.begin(), scenarios.end(), id) != scenarios.end();
  }

  const Pilot::Settings settings{.seconds = 0.2, .most_hits = 1000, .tally = kept_draws};
  /// A look that never ends by itself.
  const Pilot::Settings endless{.seconds = 1e9, .most_hits = 1000, .tally = kept_draws};
  const json common = wish_document(0, 1), impossible = wish_document(1000, 1e-6);
  TemporaryFolder folder;
  Parts parts{(folder / "retake.db").string()};
};

TEST_F(ThreadsPilot, A_common_wish_ends_by_its_hits_and_a_hopeless_one_by_its_time) {
  Pilot pilot(parts.store, parts.library, parts.events, settings);
  const std::string easy = add_scenario(parts, common), hard = add_scenario(parts, impossible);
  pilot.add(easy);
  pilot.add(hard);
  ASSERT_TRUE(wait_until([&] { return pilot_of(parts, easy) && pilot_of(parts, hard); }));
  const auto found = *pilot_of(parts, easy), nothing = *pilot_of(parts, hard);
  EXPECT_EQ(found.hits, 1000);
  EXPECT_GT(found.draws, found.hits);
  EXPECT_LT(found.draws, 1000 * 100);
  EXPECT_GT(found.seconds, 0);
  EXPECT_EQ(nothing.hits, 0);
  EXPECT_GT(nothing.draws, 0);
  EXPECT_GE(nothing.seconds, 0.2);
  EXPECT_TRUE(wait_until([&] { return told(parts.events, easy) && told(parts.events, hard); }));
  EXPECT_EQ(difficulty_json(found)["verdict"], "common");
  EXPECT_EQ(difficulty_json(nothing)["verdict"], "nothing-yet");
}

TEST_F(ThreadsPilot, The_same_wish_is_found_as_often_each_time) {
  std::vector<std::uint64_t> draws;
  for (const char* name : {"a.db", "b.db"}) {
    Parts own((folder / name).string());
    Pilot pilot(own.store, own.library, own.events, settings);
    const std::string id = add_scenario(own, common);
    pilot.add(id);
    ASSERT_TRUE(wait_until([&] { return pilot_of(own, id).has_value(); }));
    draws.push_back(pilot_of(own, id)->draws);
  }
  EXPECT_EQ(draws[0], draws[1]);
}

TEST_F(ThreadsPilot, Those_that_have_none_are_looked_at_at_the_start_and_the_others_not_again) {
  const std::string done = add_scenario(parts, common), missing = add_scenario(parts, impossible);
  parts.store.set_pilot(done, {.draws = 5, .hits = 1, .seconds = 0.5});
  Pilot pilot(parts.store, parts.library, parts.events, settings);
  pilot.add_missing();
  ASSERT_TRUE(wait_until([&] { return pilot_of(parts, missing).has_value(); }));
  EXPECT_EQ(pilot_of(parts, done)->draws, 5);
}

TEST_F(ThreadsPilot, What_was_created_last_comes_first) {
  std::vector<std::string> ids, order;
  for (int i = 0; i < 4; ++i)
    ids.push_back(add_scenario(parts, wish_document(1, 0.1, std::to_string(i))));
  // The first look waits until the others are queued.
  std::atomic<bool> has_begun = false, may_go_on = false;
  Pilot::Settings slow = settings;
  slow.tally = [&](const ChainCounts& counts) {
    if (counts.iteration == 1) order.emplace_back(check_context().scenario);
    has_begun = true;
    may_go_on.wait(false);
    return kept_draws(counts);
  };
  Pilot pilot(parts.store, parts.library, parts.events, slow);
  pilot.add(ids[0]);
  ASSERT_TRUE(wait_until([&] { return has_begun.load(); }));
  for (std::size_t i = 1; i < 4; ++i)
    pilot.add(ids[i]);
  may_go_on = true;
  may_go_on.notify_all();
  ASSERT_TRUE(wait_until([&] { return parts.store.scenarios_without_pilot().empty(); }));
  pilot.drain();
  EXPECT_EQ(order, (std::vector<std::string>{ids[0], ids[3], ids[2], ids[1]}));
}

TEST_F(ThreadsPilot, A_scenario_that_is_deleted_or_never_was_is_passed_over) {
  const std::string gone = add_scenario(parts, impossible), kept = add_scenario(parts, common);
  Pilot pilot(parts.store, parts.library, parts.events, settings);
  pilot.add(kept);
  pilot.add("nosuch");
  pilot.add(gone);
  parts.store.delete_scenario(gone);
  parts.library.forget(gone);
  ASSERT_TRUE(wait_until([&] { return pilot_of(parts, kept).has_value(); }));
  EXPECT_FALSE(parts.store.scenario(gone));
  EXPECT_FALSE(told(parts.events, gone));
}

TEST_F(ThreadsPilot, Draining_gives_up_the_look_under_way_and_the_next_start_takes_it_up) {
  const std::string id = add_scenario(parts, impossible);
  {
    Pilot pilot(parts.store, parts.library, parts.events, endless);
    pilot.add(id);
    pilot.drain();
    pilot.drain();
  }
  EXPECT_FALSE(pilot_of(parts, id));
  Pilot pilot(parts.store, parts.library, parts.events, settings);
  pilot.add_missing();
  EXPECT_TRUE(wait_until([&] { return pilot_of(parts, id).has_value(); }));
}

TEST_F(ThreadsPilot, A_store_that_cannot_write_or_a_world_that_is_gone_costs_one_look) {
  // A document that this build cannot run.
  ScenarioRecord foreign = new_scenario_record(*Scenario::read(common));
  foreign.id = "foreign";
  foreign.world_version += 1000;
  parts.store.add_scenario(foreign);
  const std::string id = add_scenario(parts, common);
  Pilot pilot(parts.store, parts.library, parts.events, settings);
  pilot.add(id);
  pilot.add("foreign");
  ASSERT_TRUE(wait_until([&] { return pilot_of(parts, id).has_value(); }));
  EXPECT_FALSE(pilot_of(parts, "foreign"));

  // A store that is open for reading refuses what was found.
  const auto opened = open_store((folder / "retake.db").string(), {.read_only = true});
  Store& reader = *opened;
  ScenarioLibrary library(reader);
  const std::string other = add_scenario(parts, wish_document(1, 0.2));
  std::atomic<int> looks = 0;
  Pilot::Settings counted = settings;
  counted.tally = [&](const ChainCounts& counts) {
    if (counts.iteration == 1) ++looks;
    return kept_draws(counts);
  };
  EventHub events;
  Pilot unlucky(reader, library, events, counted);
  unlucky.add(other);
  unlucky.add(other);
  EXPECT_TRUE(wait_until([&] { return looks == 2; })) << "the first failure ended it";
  unlucky.drain();
  EXPECT_FALSE(pilot_of(parts, other));
  EXPECT_FALSE(told(events, other));
}

}  // namespace
}  // namespace retake
