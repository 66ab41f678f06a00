// Samples come back as they were put in, in every order, page by page; draws are spaced by weight.
#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using StoreSamples = StoreTest;
using StoreDraws = StoreTest;

// --- Samples -----------------------------------------------------------------------------------

TEST_P(StoreSamples, a_sample_comes_back_with_its_blobs) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto progress = make_progress("c", "s", 5, 5);
  progress.samples.push_back(make_sample(5, 3, 2));
  progress.samples[0].state = std::string("\0\xff state", 8);
  progress.samples[0].animation = std::string(20'000, '\0');
  progress.samples[1].animation = "";
  store.commit(progress).get();
  const auto sample = store.sample("c-5-2").value();
  EXPECT_EQ(sample.id, "c-5-2");
  EXPECT_EQ(sample.scenario, "s");
  EXPECT_EQ(sample.chain, "c");
  EXPECT_EQ(sample.iteration, 5u);
  EXPECT_EQ(sample.replica, 2u);
  EXPECT_EQ(sample.weight, 3u);
  EXPECT_EQ(sample.log_prior, progress.samples[1].record.log_prior);
  EXPECT_EQ(sample.log_constraint, progress.samples[1].record.log_constraint);
  EXPECT_EQ(sample.duration, 2.5);
  EXPECT_EQ(sample.measures, R"({"pins":10})");
  EXPECT_EQ(sample.digest, "d5");
  EXPECT_EQ(sample.plays, 0u);
  EXPECT_GT(sample.created_at, 1'600'000'000'000);
  EXPECT_EQ(store.sample_state("c-5"), progress.samples[0].state);
  EXPECT_EQ(store.sample_animation("c-5"), progress.samples[0].animation);
  EXPECT_EQ(store.sample_animation("c-5-2"), "");
  for (const char* id : {"c-6", "d-5", "c-5-1", "c", "", "c-05"}) {
    EXPECT_FALSE(store.sample(id)) << id;
    EXPECT_FALSE(store.sample_state(id)) << id;
    EXPECT_FALSE(store.sample_animation(id)) << id;
  }
}

// Reads a listing to its end, by pages of `limit`.
std::vector<SampleRecord> list(const Store& store, SampleOrder order, std::size_t limit) {
  std::vector<SampleRecord> all;
  std::string cursor;
  do {
    auto page = store.samples("s", order, limit, cursor);
    EXPECT_LE(page.records.size(), limit);
    all.insert(all.end(), page.records.begin(), page.records.end());
    cursor = page.next_cursor;
  } while (!cursor.empty());
  return all;
}

TEST_P(StoreSamples, every_order_lists_every_sample_once_whatever_the_limit) {
  fill(store, 60);
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 20)).get();  // must not show up

  auto samples = list(store, SampleOrder::oldest, 100);
  ASSERT_EQ(samples.size(), 60u);
  for (std::size_t index = 0; index < 60; ++index)
    EXPECT_EQ(samples[index].iteration, index + 1);
  auto newest = samples;
  std::reverse(newest.begin(), newest.end());
  auto likely = newest;
  std::stable_sort(likely.begin(), likely.end(), [](const auto& left, const auto& right) {
    return left.log_prior + left.log_constraint > right.log_prior + right.log_constraint;
  });
  for (const std::size_t limit : {1u, 2u, 3u, 7u, 20u, 59u, 60u, 61u}) {
    EXPECT_EQ(ids_of(list(store, SampleOrder::oldest, limit)), ids_of(samples)) << limit;
    EXPECT_EQ(ids_of(list(store, SampleOrder::newest, limit)), ids_of(newest)) << limit;
    EXPECT_EQ(ids_of(list(store, SampleOrder::likely, limit)), ids_of(likely)) << limit;
  }
  EXPECT_TRUE(store.samples("s", SampleOrder::likely, 0, "").records.empty());
  EXPECT_TRUE(store.samples("other", SampleOrder::likely, 10, "").records.empty());
}

TEST_P(StoreSamples, pages_stay_put_while_samples_are_added) {
  fill(store, 20);
  const auto before = ids_of(list(store, SampleOrder::newest, 100));
  const auto first = store.samples("s", SampleOrder::newest, 10, "");
  store.commit(make_progress("c", "s", 21, 40)).get();
  auto both = ids_of(first.records);
  const auto second = store.samples("s", SampleOrder::newest, 10, first.next_cursor);
  for (const auto& id : ids_of(second.records))
    both.push_back(id);
  EXPECT_EQ(both, before);
  EXPECT_TRUE(second.next_cursor.empty());
}

TEST_P(StoreSamples, impossible_and_extreme_likelihoods_are_listed) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto progress = make_progress("c", "s", 1, 4);
  const double infinity = std::numeric_limits<double>::infinity();
  progress.samples[0].record.log_prior = -infinity;
  progress.samples[1].record.log_prior = 1e300;
  progress.samples[2].record.log_prior = infinity;
  store.commit(progress).get();
  EXPECT_EQ(ids_of(list(store, SampleOrder::likely, 1)),
            (std::vector<std::string>{"c-3", "c-2", "c-4", "c-1"}));
}

TEST_P(StoreSamples, a_likelihood_that_is_not_a_number_is_refused) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  auto progress = make_progress("c", "s", 1, 1);
  progress.samples[0].record.log_prior = std::nan("");
  EXPECT_THROW(store.commit(progress).get(), StoreError);
  EXPECT_NE(store.last_error(), "");
  EXPECT_EQ(store.totals().failed_commits, 1u);
  EXPECT_EQ(store.commit(make_progress("c", "s", 1, 1)).get(), 1u);
  EXPECT_EQ(store.last_error(), "");
}

TEST_P(StoreSamples, a_cursor_serves_only_the_listing_that_gave_it) {
  fill(store, 9);
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 9)).get();
  const auto newest = store.samples("s", SampleOrder::newest, 3, "").next_cursor;
  const auto likely = store.samples("s", SampleOrder::likely, 3, "").next_cursor;
  const auto scenarios = store.scenarios(1, "").next_cursor;
  EXPECT_THROW(store.samples("s", SampleOrder::oldest, 3, newest), BadCursor);
  EXPECT_THROW(store.samples("s", SampleOrder::likely, 3, newest), BadCursor);
  EXPECT_THROW(store.samples("s", SampleOrder::newest, 3, likely), BadCursor);
  EXPECT_THROW(store.samples("s", SampleOrder::newest, 3, scenarios), BadCursor);
  EXPECT_THROW(store.samples("t", SampleOrder::newest, 3, newest), BadCursor);
  EXPECT_THROW(store.samples("gone", SampleOrder::newest, 3, newest), BadCursor);
  EXPECT_THROW(store.scenarios(3, newest), BadCursor);
  for (const char* text : {"x", "n", "0", "' OR 1=1"}) {
    EXPECT_THROW(store.samples("s", SampleOrder::newest, 3, text), BadCursor) << text;
    EXPECT_THROW(store.scenarios(3, text), BadCursor) << text;
  }
}

TEST_P(StoreSamples, a_cursor_with_any_letter_changed_is_refused) {
  fill(store, 9);
  const auto cursor = store.samples("s", SampleOrder::likely, 3, "").next_cursor;
  for (std::size_t index = 0; index < cursor.size(); ++index) {
    auto mangled = cursor;
    mangled[index] = mangled[index] == '0' ? '1' : '0';
    EXPECT_THROW(store.samples("s", SampleOrder::likely, 3, mangled), BadCursor) << index;
  }
  EXPECT_THROW(store.samples("s", SampleOrder::likely, 3, cursor + "0"), BadCursor);
  EXPECT_THROW(store.samples("s", SampleOrder::likely, 3, cursor.substr(1)), BadCursor);
}

// --- Draws -------------------------------------------------------------------------------------

// A chain with these weights at iterations 10, 20, ….
void add_weighted(Store& store, const std::vector<std::uint64_t>& weights) {
  store.add_scenario(make_scenario("s"));
  store.add_chains({make_chain("c", "s")});
  ChainProgress progress = make_progress("c", "s", 1, 0);
  for (std::size_t index = 0; index < weights.size(); ++index) {
    progress.samples.push_back(make_sample(10 * (index + 1), weights[index]));
  }
  store.commit(progress).get();
}

std::vector<std::uint64_t> iterations_of(const std::vector<DrawRecord>& draws) {
  std::vector<std::uint64_t> iterations;
  for (const auto& draw : draws)
    iterations.push_back(draw.iteration);
  return iterations;
}

TEST_P(StoreDraws, a_heavy_sample_comes_up_as_often_as_it_weighs) {
  add_weighted(store, {1, 6, 1, 2});
  EXPECT_EQ(iterations_of(store.draws("c", 10)),
            (std::vector<std::uint64_t>{10, 20, 20, 20, 20, 20, 20, 30, 40, 40}));
  EXPECT_EQ(iterations_of(store.draws("c", 5)), (std::vector<std::uint64_t>{20, 20, 20, 30, 40}));
  EXPECT_EQ(iterations_of(store.draws("c", 1)), (std::vector<std::uint64_t>{20}));
}

TEST_P(StoreDraws, there_are_no_more_draws_than_satisfied_iterations) {
  add_weighted(store, {1, 2});
  EXPECT_EQ(iterations_of(store.draws("c", 1000)), (std::vector<std::uint64_t>{10, 20, 20}));
}

TEST_P(StoreDraws, draws_begin_after_an_iteration) {
  add_weighted(store, {1, 1, 1, 1});
  EXPECT_EQ(iterations_of(store.draws("c", 10, 20)), (std::vector<std::uint64_t>{30, 40}));
  EXPECT_EQ(iterations_of(store.draws("c", 10, 19)), (std::vector<std::uint64_t>{20, 30, 40}));
  EXPECT_TRUE(store.draws("c", 10, 40).empty());
  EXPECT_TRUE(store.draws("other", 10).empty());
  EXPECT_TRUE(store.draws("c", 0).empty());
}

TEST_P(StoreDraws, samples_of_weight_0_are_passed_over) {
  add_weighted(store, {0, 0, 2, 0, 1, 0, 3, 0});
  EXPECT_EQ(iterations_of(store.draws("c", 100)), (std::vector<std::uint64_t>{30, 30, 50, 70, 70, 70}));
  for (std::size_t most = 1; most < 6; ++most)
    for (const auto iteration : iterations_of(store.draws("c", most)))
      EXPECT_TRUE(iteration == 30 || iteration == 50 || iteration == 70) << iteration << " of " << most;
  EXPECT_TRUE(store.draws("c", 100, 70).empty());
}

TEST_P(StoreDraws, a_chain_that_only_learned_has_no_draws) {
  add_weighted(store, {0, 0, 0});
  EXPECT_TRUE(store.draws("c", 100).empty());
}

TEST_P(StoreDraws, draws_are_evenly_spaced_over_many_samples) {
  std::vector<std::uint64_t> weights;
  for (std::uint64_t index = 0; index < 500; ++index)
    weights.push_back(1 + index * 7919 % 40);
  add_weighted(store, weights);
  std::vector<std::uint64_t> stands;  // where the chain stood at each satisfied iteration
  for (std::size_t index = 0; index < weights.size(); ++index) {
    stands.insert(stands.end(), weights[index], 10 * (index + 1));
  }
  const std::size_t most = 97;
  const auto draws = store.draws("c", most);
  ASSERT_EQ(draws.size(), most);
  for (std::size_t k = 0; k < most; ++k) {
    EXPECT_EQ(draws[k].iteration, stands[(2 * k + 1) * stands.size() / (2 * most)]) << k;
    EXPECT_EQ(draws[k].state, "state of " + std::to_string(draws[k].iteration));
    EXPECT_EQ(draws[k].measures, R"({"pins":10})");
    EXPECT_EQ(draws[k].log_prior, make_sample(draws[k].iteration).record.log_prior);
    EXPECT_EQ(draws[k].log_constraint, make_sample(draws[k].iteration).record.log_constraint);
  }
}

TEST_P(StoreDraws, enormous_weights_do_not_overflow) {
  add_weighted(store, {std::uint64_t{1} << 60, std::uint64_t{1} << 60});
  EXPECT_EQ(iterations_of(store.draws("c", 4)), (std::vector<std::uint64_t>{10, 10, 20, 20}));
}

RETAKE_FOR_EVERY_STORE(StoreSamples);
RETAKE_FOR_EVERY_STORE(StoreDraws);

}  // namespace
}  // namespace retake::test
