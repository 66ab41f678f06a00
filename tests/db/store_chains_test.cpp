// Chains come back as they were put in, and what a chain reports arrives whole.
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using StoreChains = StoreTest;
using StoreProgress = StoreTest;

// --- Chains ------------------------------------------------------------------------------------

TEST_P(StoreChains, a_chain_comes_back_field_by_field) {
  store.add_scenario(make_scenario("s"));
  auto chain = make_chain("c", "s");
  chain.index = 4;
  chain.seed = (std::uint64_t{1} << 63) - 1;
  chain.settings = R"({"beta":0.5})";
  chain.state = ChainState::running;
  chain.lesson = 8;
  chain.stop = {.samples = 100, .counted = 60, .iterations = 2000, .seconds = 1.5, .ess = 50};
  chain.created_at = 99;
  store.add_chains({chain});
  auto progress = make_progress("c", "s", 1, 1);
  ChainCounters& counters = progress.counters;
  counters.iteration = 11;
  counters.accepted = 12;
  counters.samples = 13;
  counters.simulations = 14;
  counters.failed_simulations = 15;
  counters.simulated_seconds = 1.25;
  counters.skipped_seconds = 4.5;
  counters.run_seconds = 2.5;
  counters.iterations_per_second = 3.75;
  counters.kernels = {{"redraw", 21, 22}, {"toggle", 23, 24}};
  counters.first_sample_iteration = 31;
  counters.first_sample_seconds = 0.5;
  counters.is_learning = true;
  counters.odds = {OddsBasis::learned, 41, 42, 0.25, 0.125, 0.0625};
  counters.rungs = {{0, 51, 52}, {0.5, 53, 54}, {1, 0, 0}};
  counters.effective_samples = 61.5;
  counters.counted = 9;
  store.commit(progress).get();

  const auto found = store.chain("c").value();
  EXPECT_EQ(found.scenario, "s");
  EXPECT_EQ(found.index, 4u);
  EXPECT_EQ(found.seed, chain.seed);
  EXPECT_EQ(found.method, "metropolis");
  EXPECT_EQ(found.ratios, "exact");
  EXPECT_EQ(found.settings, chain.settings);
  EXPECT_EQ(found.state, ChainState::running);
  EXPECT_EQ(found.stop.samples, 100u);
  EXPECT_EQ(found.stop.iterations, 2000u);
  EXPECT_EQ(found.stop.seconds, 1.5);
  EXPECT_EQ(found.stop.ess, 50u);
  EXPECT_EQ(found.stop.counted, 60u);
  EXPECT_EQ(found.lesson, 8u);
  EXPECT_EQ(found.counters.counted, 9u);
  EXPECT_EQ(found.created_at, 99);
  EXPECT_EQ(found.counters.iteration, 11u);
  EXPECT_EQ(found.counters.accepted, 12u);
  EXPECT_EQ(found.counters.samples, 13u);
  EXPECT_EQ(found.counters.simulations, 14u);
  EXPECT_EQ(found.counters.failed_simulations, 15u);
  EXPECT_EQ(found.counters.simulated_seconds, 1.25);
  EXPECT_EQ(found.counters.run_seconds, 2.5);
  EXPECT_EQ(found.counters.iterations_per_second, 3.75);
  EXPECT_EQ(found.counters.first_sample_iteration, 31u);
  EXPECT_EQ(found.counters.first_sample_seconds, 0.5);
  ASSERT_EQ(found.counters.kernels.size(), 2u);
  EXPECT_EQ(found.counters.kernels[1].name, "toggle");
  EXPECT_EQ(found.counters.kernels[1].proposed, 23u);
  EXPECT_EQ(found.counters.kernels[1].accepted, 24u);
  EXPECT_TRUE(found.counters.is_learning);
  EXPECT_EQ(found.counters.skipped_seconds, 4.5);
  EXPECT_EQ(found.counters.odds.basis, OddsBasis::learned);
  EXPECT_EQ(found.counters.odds.draws, 41u);
  EXPECT_EQ(found.counters.odds.hits, 42u);
  EXPECT_EQ(found.counters.odds.sum, 0.25);
  EXPECT_EQ(found.counters.odds.squares, 0.125);
  EXPECT_EQ(found.counters.odds.largest, 0.0625);
  ASSERT_EQ(found.counters.rungs.size(), 3u);
  EXPECT_EQ(found.counters.rungs[1].beta, 0.5);
  EXPECT_EQ(found.counters.rungs[1].proposed, 53u);
  EXPECT_EQ(found.counters.rungs[1].accepted, 54u);
  EXPECT_EQ(found.counters.effective_samples, 61.5);
}

TEST_P(StoreChains, what_is_unset_stays_unset) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  const auto found = store.chain("c").value();
  visit_limits([](const char* name, const auto& limit) { EXPECT_FALSE(limit) << name; }, found.stop);
  EXPECT_EQ(found.lesson, 0u);
  EXPECT_FALSE(found.counters.first_sample_iteration || found.counters.first_sample_seconds);
  EXPECT_FALSE(found.counters.effective_samples || found.counters.is_learning);
  EXPECT_EQ(found.counters.odds.basis, OddsBasis::none);
  EXPECT_FALSE(store.chain("other"));
}

TEST_P(StoreChains, a_stop_rule_may_change) {
  store.add_scenario(make_scenario("s"));
  auto chain = make_chain("c", "s");
  chain.stop = {.samples = 5, .seconds = 1};
  store.add_chains({chain, make_chain("d", "s")});
  store.set_chain_stop("c", {.counted = 7, .ess = 8});
  store.set_chain_stop("gone", {.samples = 1});
  const StopRule stop = store.chain("c")->stop;
  EXPECT_FALSE(stop.samples || stop.iterations || stop.seconds);
  EXPECT_EQ(stop.counted, 7u);
  EXPECT_EQ(stop.ess, 8u);
  EXPECT_FALSE(store.chain("d")->stop.counted);
}

TEST_P(StoreChains, the_same_chain_is_found_the_oldest_first) {
  store.add_scenario(make_scenario("s"));
  store.add_scenario(make_scenario("t"));
  const auto add = [&](const std::string& id, auto change) {
    auto chain = make_chain(id, "s");
    change(chain);
    store.add_chains({chain});
  };
  add("a", [](ChainRecord&) {});
  add("b", [](ChainRecord& chain) { chain.lesson = 2; });
  add("c", [](ChainRecord& chain) { chain.index = 1; });
  add("d", [](ChainRecord& chain) { chain.seed = 8; });
  add("e", [](ChainRecord& chain) { chain.method = "rejection"; });
  add("f", [](ChainRecord& chain) { chain.ratios = "paper"; });
  add("g", [](ChainRecord& chain) { chain.scenario = "t"; });
  const auto same = [&](std::optional<std::uint64_t> lesson, auto change) {
    auto like = make_chain("", "s");
    change(like);
    const auto found = store.same_chain(like, lesson);
    return found ? found->id : "";
  };
  const auto as_it_is = [](ChainRecord&) {};
  EXPECT_EQ(same({}, as_it_is), "a");
  EXPECT_EQ(same(0, as_it_is), "a");
  EXPECT_EQ(same(2, as_it_is), "b");
  EXPECT_EQ(same(1, as_it_is), "");
  EXPECT_EQ(same({}, [](ChainRecord& like) { like.index = 1; }), "c");
  EXPECT_EQ(same({}, [](ChainRecord& like) { like.seed = 8; }), "d");
  EXPECT_EQ(same({}, [](ChainRecord& like) { like.method = "rejection"; }), "e");
  EXPECT_EQ(same({}, [](ChainRecord& like) { like.ratios = "paper"; }), "f");
  EXPECT_EQ(same({}, [](ChainRecord& like) { like.scenario = "t"; }), "g");
  EXPECT_EQ(same({}, [](ChainRecord& like) { like.scenario = "gone"; }), "");
  EXPECT_EQ(same({}, [](ChainRecord& like) { like.seed = 9; }), "");
}

TEST_P(StoreChains, a_ladder_may_change_its_rungs) {
  store.add_scenario(make_scenario("s"));
  auto chain = make_chain("c", "s");
  chain.counters.rungs = {{0, 1, 1}, {0.25, 2, 2}, {1, 0, 0}};
  store.add_chains({chain, make_chain("d", "s")});
  EXPECT_EQ(store.chain("c")->counters.rungs.size(), 3u);
  auto progress = make_progress("c", "s", 1, 1);
  progress.counters.rungs = {{0, 3, 1}, {1, 0, 0}};
  store.commit(progress).get();
  const auto rungs = store.chain("c")->counters.rungs;
  ASSERT_EQ(rungs.size(), 2u);
  EXPECT_EQ(rungs[0].proposed, 3u);
  EXPECT_EQ(rungs[1].beta, 1);
  EXPECT_TRUE(store.chain("d")->counters.rungs.empty());
}

TEST_P(StoreChains, kernels_that_are_gone_are_forgotten) {
  store.add_scenario(make_scenario("s"));
  auto chain = make_chain("c", "s");
  chain.counters.kernels = {{"a", 1, 1}, {"b", 2, 2}, {"c", 3, 3}};
  store.add_chains({chain});
  EXPECT_EQ(store.chain("c")->counters.kernels.size(), 3u);
  auto progress = make_progress("c", "s", 1, 1);
  progress.counters.kernels = {{"d", 4, 4}};
  store.commit(progress).get();
  const auto kernels = store.chain("c")->counters.kernels;
  ASSERT_EQ(kernels.size(), 1u);
  EXPECT_EQ(kernels[0].name, "d");
}

TEST_P(StoreChains, chains_are_listed_in_the_order_in_which_they_were_added) {
  store.add_scenario(make_scenario("s"));
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("z", "s"), make_chain("a", "t"), make_chain("m", "s")});
  store.add_chains({make_chain("b", "s")});
  store.set_chain_state("m", ChainState::paused, "", "");
  std::string ids;
  for (const auto& chain : store.chains("s"))
    ids += chain.id;
  EXPECT_EQ(ids, "zmb");
  ids.clear();
  for (const auto& chain : store.chains_in_states({ChainState::paused, ChainState::queued}))
    ids += chain.id;
  EXPECT_EQ(ids, "zamb");
  ids.clear();
  for (const auto& chain : store.chains_in_states({ChainState::queued}))
    ids += chain.id;
  EXPECT_EQ(ids, "zab");
  EXPECT_TRUE(store.chains_in_states({}).empty());
  EXPECT_TRUE(store.chains("other").empty());
}

TEST_P(StoreChains, chains_come_page_by_page_whatever_is_added_meanwhile) {
  store.add_scenario(make_scenario("s"));
  store.add_scenario(make_scenario("t"));
  for (const char* id : {"c1", "c2", "c3", "c4", "c5"})
    store.add_chains({make_chain(id, "s"), make_chain(std::string(id) + "t", "t")});
  std::string ids, cursor;
  int pages = 0;
  do {
    const auto page = store.chains("s", 2, cursor);
    EXPECT_LE(page.records.size(), 2u);
    for (const auto& chain : page.records)
      ids += chain.id + " ";
    cursor = page.next_cursor;
    if (++pages == 2) store.add_chains({make_chain("late", "s")});
  } while (!cursor.empty());
  EXPECT_EQ(ids, "c1 c2 c3 c4 c5 late ");
  EXPECT_EQ(store.chains("s", 10, "").records[1].counters.kernels.size(),
            store.chain("c2")->counters.kernels.size());
  EXPECT_TRUE(store.chains("t", 5, "").next_cursor.empty()) << "a page that holds the last one";
  EXPECT_FALSE(store.chains("t", 4, "").next_cursor.empty());
  EXPECT_TRUE(store.chains("nosuch", 4, "").records.empty());
  EXPECT_TRUE(store.chains("s", 0, "").records.empty());

  const auto of_t = store.chains("t", 2, "").next_cursor;
  EXPECT_THROW(store.chains("s", 2, of_t), BadCursor) << "another scenario's";
  EXPECT_THROW(store.chains("s", 2, store.scenarios(1, "").next_cursor), BadCursor);
  EXPECT_THROW(store.samples("t", SampleOrder::oldest, 2, of_t), BadCursor);
  EXPECT_THROW(store.chains("s", 2, of_t + "0"), BadCursor);
}

TEST_P(StoreChains, chains_are_added_all_or_none) {
  store.add_scenario(make_scenario("s"));
  EXPECT_THROW(store.add_chains({make_chain("c", "s"), make_chain("d", "gone")}), StoreError);
  EXPECT_FALSE(store.chain("c"));
  store.add_chains({make_chain("c", "s")});
  EXPECT_THROW(store.add_chains({make_chain("d", "s"), make_chain("c", "s")}), StoreError);
  EXPECT_FALSE(store.chain("d"));
}

TEST_P(StoreChains, an_id_that_could_not_be_told_from_a_samples_is_our_own_mistake) {
  store.add_scenario(make_scenario("s"));
  EXPECT_THROW(store.add_chains({make_chain("c-1", "s")}), std::logic_error);
  EXPECT_THROW(store.add_chains({make_chain("", "s")}), std::logic_error);
}

TEST_P(StoreChains, the_state_is_set_with_its_reason) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  store.set_chain_state("c", ChainState::failed, "", "the disk is full");
  EXPECT_EQ(store.chain("c")->state, ChainState::failed);
  EXPECT_EQ(store.chain("c")->error, "the disk is full");
  store.set_chain_state("c", ChainState::finished, "samples", "");
  EXPECT_EQ(store.chain("c")->ended_by, "samples");
  EXPECT_EQ(store.chain("c")->error, "");
  store.set_chain_state("gone", ChainState::finished, "samples", "");
}

TEST_P(StoreChains, attempts_are_counted_until_there_is_progress) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s"), make_chain("d", "s")});
  EXPECT_EQ(store.chain("c")->attempts, 0);
  for (std::uint64_t attempt = 1; attempt <= 3; ++attempt) {
    store.set_chain_state("c", ChainState::running, "", "");
    EXPECT_EQ(store.chain("c")->attempts, attempt);
  }
  store.set_chain_state("c", ChainState::failed, "", "it is at an end");
  EXPECT_EQ(store.chain("c")->attempts, 3);
  EXPECT_EQ(store.chain("d")->attempts, 0);
  store.commit(make_progress("c", "s", 1, 2)).get();
  EXPECT_EQ(store.chain("c")->attempts, 0);
}

// --- Progress ----------------------------------------------------------------------------------

TEST_P(StoreProgress, samples_counters_checkpoint_and_trace_arrive_together) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  EXPECT_EQ(store.checkpoint("c"), "");
  auto progress = make_progress("c", "s", 1, 3);
  progress.trace_block = "block 1";
  progress.checkpoint = std::string("a\0b", 3);
  EXPECT_EQ(store.commit(progress).get(), 3u);
  EXPECT_EQ(store.checkpoint("c"), std::string("a\0b", 3));
  EXPECT_EQ(store.trace("c"), (std::vector<std::string>{"block 1"}));
  EXPECT_EQ(store.sample_count("s"), 3u);
  EXPECT_EQ(store.scenario("s")->samples, 3u);
  EXPECT_EQ(store.chain("c")->counters.iteration, 3u);
  EXPECT_EQ(store.sample_count("other"), 0u);
}

TEST_P(StoreProgress, the_state_changes_only_if_it_is_set) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  store.set_chain_state("c", ChainState::running, "", "");
  store.commit(make_progress("c", "s", 1, 1)).get();
  EXPECT_EQ(store.chain("c")->state, ChainState::running);
  auto progress = make_progress("c", "s", 2, 2);
  progress.state = ChainState::finished;
  progress.ended_by = "iterations";
  store.commit(progress).get();
  EXPECT_EQ(store.chain("c")->state, ChainState::finished);
  EXPECT_EQ(store.chain("c")->ended_by, "iterations");
}

TEST_P(StoreProgress, traces_grow_by_blocks_or_are_replaced) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s"), make_chain("d", "s")});
  const auto commit = [&](const char* block, bool replace) {
    auto progress = make_progress("c", "s", 1, 1);
    progress.trace_block = block;
    progress.replace_trace = replace;
    store.commit(progress).get();
  };
  commit("1", false);
  commit("2", false);
  commit("", false);
  EXPECT_EQ(store.trace("c"), (std::vector<std::string>{"1", "2"}));
  commit("3", true);
  commit("4", false);
  EXPECT_EQ(store.trace("c"), (std::vector<std::string>{"3", "4"}));
  commit("", true);
  EXPECT_TRUE(store.trace("c").empty());
  EXPECT_TRUE(store.trace("d").empty());
}

TEST_P(StoreProgress, a_sample_that_comes_again_keeps_its_row_and_plays_and_takes_the_weight) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto first = make_progress("c", "s", 1, 2);
  first.samples[0].record.created_at = 77;
  store.commit(first).get();
  store.play("s", "alice", "");
  auto again = make_progress("c", "s", 1, 3);
  again.samples[0].record.weight = 9;
  EXPECT_EQ(store.commit(again).get(), 3u);
  const auto sample = store.sample("c-1").value();
  EXPECT_EQ(sample.weight, 9u);
  EXPECT_EQ(sample.plays, 1u);
  EXPECT_EQ(sample.created_at, 77);
  EXPECT_EQ(ids_of(store.samples("s", SampleOrder::oldest, 10, "").records),
            (std::vector<std::string>{"c-1", "c-2", "c-3"}));
  EXPECT_TRUE(store.check().empty());
}

TEST_P(StoreProgress, weights_of_earlier_samples_grow) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto progress = make_progress("c", "s", 1, 1);
  progress.samples.push_back(make_sample(1, 1, 2));
  store.commit(progress).get();
  ChainProgress later = make_progress("c", "s", 2, 2);
  later.weights = {{1, 2, 5}, {2, 0, 6}};  // also of a sample of the same progress
  store.commit(later).get();
  EXPECT_EQ(store.sample("c-1")->weight, 1u);
  EXPECT_EQ(store.sample("c-1-2")->weight, 5u);
  EXPECT_EQ(store.sample("c-2")->weight, 6u);
}

TEST_P(StoreProgress, a_weight_of_a_sample_that_is_not_there_fails_the_whole_progress) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto progress = make_progress("c", "s", 1, 1);
  progress.weights = {{5, 0, 2}};
  EXPECT_THROW(store.commit(progress).get(), StoreError);
  EXPECT_FALSE(store.sample("c-1"));
  EXPECT_EQ(store.checkpoint("c"), "");
  EXPECT_EQ(store.sample_count("s"), 0u);
}

TEST_P(StoreProgress, progress_of_a_chain_that_is_gone_is_dropped) {
  EXPECT_EQ(store.commit(make_progress("c", "s", 1, 3)).get(), 0u);
  fill(store, 3);
  store.delete_scenario("s");
  EXPECT_EQ(store.commit(make_progress("c", "s", 4, 5)).get(), 0u);
  EXPECT_EQ(store.totals().samples, 0u);
  EXPECT_EQ(store.last_error(), "");
}

RETAKE_FOR_EVERY_STORE(StoreChains);
RETAKE_FOR_EVERY_STORE(StoreProgress);

}  // namespace
}  // namespace retake::test
