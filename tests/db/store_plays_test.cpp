// Which sample a play hands out, against the words of store.h and against a model that counts everything
// anew.
#include <cmath>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/db/conformance.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

class StorePlays : public StoreTest {
 protected:
  std::string play(const std::string& player) { return store.play("s", player, "").value().sample.id; }
};

TEST_P(StorePlays, nothing_is_handed_out_where_there_is_nothing) {
  EXPECT_FALSE(store.play("s", "alice", ""));
  store.add_scenario(make_scenario("s"));
  EXPECT_FALSE(store.play("s", "alice", ""));
  EXPECT_FALSE(store.play("s", "", "key"));
  EXPECT_EQ(store.totals().plays, 0u);
}

TEST_P(StorePlays, a_player_sees_every_sample_once_then_the_one_seen_longest_ago) {
  fill(store, 3);
  for (std::uint64_t turn = 0; turn < 3; ++turn) {
    const auto played = store.play("s", "alice", "").value();
    EXPECT_EQ(played.sample.id, "c-" + std::to_string(turn + 1));
    EXPECT_EQ(played.sample.plays, 1u);
    EXPECT_FALSE(played.repeat);
    EXPECT_FALSE(played.replayed);
    EXPECT_EQ(played.remaining, 2 - turn);
  }
  EXPECT_FALSE(store.play("s", "alice", "", Repeats::refused));
  for (const char* id : {"c-1", "c-2", "c-3", "c-1"}) {
    const auto played = store.play("s", "alice", "").value();
    EXPECT_EQ(played.sample.id, id);
    EXPECT_TRUE(played.repeat);
    EXPECT_EQ(played.remaining, 0u);
    EXPECT_EQ(played.sample.plays, 1u) << "it is nothing new";
  }
  EXPECT_EQ(store.totals().plays, 3u);
  store.commit(make_progress("c", "s", 4, 4)).get();
  const auto fresh = store.play("s", "alice", "").value();
  EXPECT_EQ(fresh.sample.id, "c-4");
  EXPECT_FALSE(fresh.repeat);
}

TEST_P(StorePlays, without_a_player_each_comes_once_before_any_comes_again) {
  fill(store, 3);
  for (int round = 0; round < 3; ++round) {
    std::set<std::string> given;
    for (std::uint64_t turn = 0; turn < 3; ++turn) {
      const auto played = store.play("s", "", "").value();
      given.insert(played.sample.id);
      EXPECT_EQ(played.remaining, round == 0 ? 2 - turn : 0);
      EXPECT_FALSE(played.repeat);
    }
    EXPECT_EQ(given.size(), 3u);
  }
  EXPECT_EQ(store.totals().plays, 9u);
}

TEST_P(StorePlays, players_share_the_stock_evenly) {
  fill(store, 4);
  EXPECT_EQ(play("alice"), "c-1");
  EXPECT_EQ(play("bob"), "c-2");
  EXPECT_EQ(play("carol"), "c-3");
  EXPECT_EQ(play("bob"), "c-4");
  EXPECT_EQ(play("alice"), "c-2");
  EXPECT_EQ(play("bob"), "c-1");
}

TEST_P(StorePlays, a_players_views_are_kept_by_scenario) {
  fill(store, 2);
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 2)).get();
  EXPECT_EQ(play("alice"), "c-1");
  const auto played = store.play("t", "alice", "").value();
  EXPECT_EQ(played.sample.id, "d-1");
  EXPECT_EQ(played.remaining, 1u);
}

TEST_P(StorePlays, the_same_key_gives_the_same_play) {
  fill(store, 3);
  const auto first = store.play("s", "alice", "key").value();
  store.play("s", "alice", "");
  const auto again = store.play("s", "alice", "key").value();
  EXPECT_FALSE(first.replayed);
  EXPECT_TRUE(again.replayed);
  EXPECT_EQ(again.id, first.id);
  EXPECT_EQ(again.sample.id, first.sample.id);
  EXPECT_EQ(again.repeat, first.repeat);
  EXPECT_EQ(again.remaining, first.remaining);
  EXPECT_EQ(store.totals().plays, 2u);
  EXPECT_NE(store.play("s", "alice", "key 2")->id, first.id);
}

TEST_P(StorePlays, a_key_belongs_to_one_player_and_one_scenario) {
  fill(store, 3);
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 2)).get();
  store.play("s", "alice", "key");
  EXPECT_THROW(store.play("s", "bob", "key"), IdempotencyConflict);
  EXPECT_THROW(store.play("s", "", "key"), IdempotencyConflict);
  EXPECT_FALSE(store.play("t", "bob", "key")->replayed);
  EXPECT_EQ(store.totals().plays, 2u);
  EXPECT_EQ(store.last_error(), "");  // the caller's mistake, not ours
  EXPECT_EQ(store.totals().failed_commits, 0u);
}

TEST_P(StorePlays, plays_outlive_the_store) {
  fill(store, 3);
  const auto first = store.play("s", "alice", "key").value();
  store.backup(directory.file("copy.db"));
  const auto copy = open({}, "copy.db");
  EXPECT_EQ(copy->play("s", "alice", "key")->id, first.id);
  EXPECT_EQ(copy->play("s", "alice", "")->sample.id, "c-2");
}

// Behind the place where the search for alice begins there are first a few, then many new samples.
TEST_P(StorePlays, new_samples_that_others_took_first_are_found) {
  fill(store, 200);
  const auto play_times = [&](const std::string& player, int times) {
    std::string last;
    for (int turn = 0; turn < times; ++turn)
      last = play(player);
    return last;
  };
  play_times("carol", 200);
  play_times("alice", 100);
  play_times("dave", 100);
  EXPECT_EQ(play("alice"), "c-101");  // all were played twice
  store.commit(make_progress("c", "s", 201, 210)).get();
  play_times("bob", 10);
  EXPECT_EQ(play("alice"), "c-201");
  EXPECT_EQ(play_times("alice", 9), "c-210");
  EXPECT_EQ(play("alice"), "c-102");
  store.commit(make_progress("c", "s", 211, 810)).get();
  EXPECT_EQ(play_times("alice", 300), "c-510");
  EXPECT_EQ(play_times("bob", 300), "c-810");
  EXPECT_EQ(play("alice"), "c-511");
}

// --- By weight ---------------------------------------------------------------------------------

/// Samples of iterations 1, 2, … with these weights.
ChainProgress weighing(const std::string& chain, const std::vector<std::uint64_t>& weights,
                       std::uint64_t first = 1) {
  ChainProgress progress = make_progress(chain, "s", 1, 0);
  for (std::size_t i = 0; i < weights.size(); ++i)
    progress.samples.push_back(make_sample(first + i, weights[i]));
  progress.counters.iteration = first + weights.size() - 1;
  return progress;
}

/// As the weights of a learned redraw are: most of them small, few of them large, and tied to something that
/// can be seen of a sample, here whether its iteration is odd. A third of the samples are, and two thirds of
/// the weight.
std::vector<std::uint64_t> uneven(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint64_t> weights(count);
  for (std::size_t i = 0; i < count; ++i) {
    const bool heavy = i % 3 == 0;
    weights[i] = (heavy ? 4 : 1) * (1 + random() % 3) + (heavy && random() % 40 == 0 ? 30 : 0);
  }
  return weights;
}
bool is_heavy(const SampleRecord& sample) {
  return (sample.iteration - 1) % 3 == 0;
}

class StorePlaysByWeight : public StoreTest {
 protected:
  PlayRecord play_of(const std::string& player) { return store.play("s", player, "").value(); }
  void stock(const std::vector<std::uint64_t>& weights) {
    fill(store, 0);
    for (std::size_t first = 0; first < weights.size(); first += 100) {
      const auto last = std::min(first + 100, weights.size());
      store
          .commit(weighing("c",
                           {weights.begin() + static_cast<std::ptrdiff_t>(first),
                            weights.begin() + static_cast<std::ptrdiff_t>(last)},
                           first + 1))
          .get();
    }
  }
};

TEST_P(StorePlaysByWeight, without_a_player_every_sample_comes_as_often_as_it_weighs) {
  const auto weights = uneven(60, 1);
  stock(weights);
  std::uint64_t sum = 0;
  for (const std::uint64_t weight : weights)
    sum += weight;
  std::vector<std::uint64_t> given(weights.size());
  for (std::uint64_t turn = 0; turn < 3 * sum; ++turn)
    ++given[store.play("s", "", "")->sample.iteration - 1];
  for (std::size_t i = 0; i < weights.size(); ++i)
    EXPECT_NEAR(static_cast<double>(given[i]), 3.0 * static_cast<double>(weights[i]), 1.01) << i;
  EXPECT_TRUE(store.check().empty());
}

TEST_P(StorePlaysByWeight, without_a_player_what_comes_late_is_not_made_up_for) {
  stock({1, 1, 1});
  for (int turn = 0; turn < 30; ++turn)
    store.play("s", "", "");
  store.commit(weighing("c", {1}, 4)).get();
  int given = 0;
  for (int turn = 0; turn < 12; ++turn)
    given += store.play("s", "", "")->sample.iteration == 4;
  EXPECT_NEAR(given, 3, 1);
}

// Of many scenarios' first plays the share of the sample that weighs nine times the other is 0.9; errs with
// probability 1e-4.
TEST_P(StorePlaysByWeight, each_moments_next_is_any_of_them_by_its_weight) {
  const int scenarios = 600;
  int heavy = 0;
  for (int i = 0; i < scenarios; ++i) {
    const std::string id = "s" + std::to_string(i), chain = "c" + std::to_string(i);
    store.add_scenario(make_scenario(id));
    store.add_chains({make_chain(chain, id)});
    ChainProgress progress = weighing(chain, {1, 9});
    progress.scenario = id;
    store.commit(progress).get();
    heavy += store.play(id, "", "")->sample.weight == 9;
  }
  EXPECT_NEAR(heavy, 0.9 * scenarios, 4 * std::sqrt(0.09 * scenarios));
}

// A player who goes on and on gets no other share than one who plays once. Errs with probability 1e-4.
TEST_P(StorePlaysByWeight, what_a_player_is_given_follows_the_weights) {
  const auto weights = uneven(3000, 2);
  stock(weights);
  double all = 0, heavy = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    all += static_cast<double>(weights[i]);
    heavy += i % 3 == 0 ? static_cast<double>(weights[i]) : 0;
  }
  const double share = heavy / all;
  std::set<std::string> seen;
  double given = 0, plays = 0;
  for (std::uint64_t left = 1; left > 0; ++plays) {
    const auto played = store.play("s", "alice", "").value();
    ASSERT_FALSE(played.repeat);
    EXPECT_TRUE(seen.insert(played.sample.id).second);
    given += is_heavy(played.sample);
    left = played.even_remaining;
  }
  EXPECT_GT(plays, 300) << "of 3,000";
  EXPECT_NEAR(given / plays, share, 4 * std::sqrt(share * (1 - share) / plays) + 0.01);
  EXPECT_GT(share, 0.6);
  // Then come the others, each once.
  while (seen.size() < weights.size())
    ASSERT_TRUE(seen.insert(store.play("s", "alice", "", Repeats::refused).value().sample.id).second);
  EXPECT_FALSE(store.play("s", "alice", "", Repeats::refused));
  EXPECT_TRUE(store.check().empty());
}

TEST_P(StorePlaysByWeight, samples_come_and_change_their_weight_between_plays) {
  fill(store, 0);
  std::map<std::string, std::set<std::string>> seen;
  std::mt19937 random(3);
  std::uint64_t samples = 0;
  for (int round = 0; round < 120; ++round) {
    const auto more = uneven(1 + random() % 12, static_cast<unsigned>(random()));
    ChainProgress progress = weighing("c", more, samples + 1);
    if (samples > 0)
      progress.weights = {{1 + random() % samples, 0, random() % 60 + (round % 20 == 0 ? 0 : 1)}};
    samples += more.size();
    store.commit(progress).get();
    for (const std::string player : {"alice", "bob", "carol"}) {
      if (random() % 2 == 0) continue;
      const auto played = store.play("s", player, "").value();
      EXPECT_EQ(seen[player].insert(played.sample.id).second, !played.repeat) << round;
    }
    ASSERT_EQ(store.check(), std::vector<std::string>{}) << round;
  }
  // What came to weigh nothing is not handed out any more.
  std::uint64_t left = 1;
  while (left > 0) {
    const auto played = store.play("s", "alice", "").value();
    ASSERT_FALSE(played.repeat) << seen["alice"].size();
    ASSERT_GT(played.sample.weight, 0u);
    ASSERT_TRUE(seen["alice"].insert(played.sample.id).second);
    left = played.remaining;
  }
  EXPECT_FALSE(store.play("s", "alice", "", Repeats::refused));
  EXPECT_GT(seen["alice"].size(), 500u);
}

TEST_P(StorePlaysByWeight, what_was_found_while_learning_comes_only_as_long_as_nothing_counts) {
  stock({0, 0, 0});
  const auto first = store.play("s", "alice", "").value();
  EXPECT_EQ(first.sample.weight, 0u);
  EXPECT_EQ(first.remaining, 2u);
  EXPECT_EQ(first.even_remaining, 0u);
  EXPECT_EQ(store.play("s", "", "")->remaining, 1u);
  store.commit(weighing("c", {5}, 4)).get();
  EXPECT_EQ(play_of("alice").sample.id, "c-4");
  EXPECT_EQ(play_of("").sample.id, "c-4");
  const auto again = play_of("alice");
  EXPECT_TRUE(again.repeat);
  EXPECT_EQ(again.sample.id, "c-4");
  EXPECT_FALSE(store.play("s", "alice", "", Repeats::refused));
  EXPECT_TRUE(store.check().empty());
}

TEST_P(StorePlaysByWeight, what_follows_the_papers_ratios_is_never_handed_out) {
  fill(store, 0);
  ChainRecord chain = make_chain("paper", "s");
  chain.ratios = "paper";
  store.add_chains({chain});
  store.commit(weighing("paper", {1, 2, 3})).get();
  ChainProgress longer = weighing("paper", {}, 4);
  longer.weights = {{3, 0, 5}};
  store.commit(longer).get();
  EXPECT_FALSE(store.play("s", "alice", ""));
  EXPECT_FALSE(store.play("s", "", ""));
  EXPECT_EQ(store.sample_count("s"), 3u);
  store.commit(weighing("c", {1})).get();
  EXPECT_EQ(store.play("s", "alice", "")->sample.id, "c-1");
  EXPECT_EQ(store.play("s", "", "")->sample.id, "c-1");
  EXPECT_TRUE(store.check().empty());
}

// --- Against a model ---------------------------------------------------------------------------

struct ModelSample {
  std::uint64_t plays = 0;
  std::map<std::string, int> seen;  // player -> turn
};

struct Expected {
  std::size_t index = 0;
  bool repeat = false;
  std::uint64_t remaining = 0;
};

// What store.h says, by looking at every sample.
Expected choose(std::vector<ModelSample>& samples, const std::string& player, int turn) {
  Expected expected;
  const auto unseen = [&](const ModelSample& sample) { return !sample.seen.contains(player); };
  expected.repeat = std::none_of(samples.begin(), samples.end(), unseen);
  bool found = false;
  for (std::size_t index = 0; index < samples.size(); ++index) {
    const auto& best = samples[expected.index];
    const auto& sample = samples[index];
    const bool better = !found || (expected.repeat ? sample.seen.at(player) < best.seen.at(player)
                                                   : sample.plays < best.plays);
    if ((expected.repeat || unseen(sample)) && better) {
      expected.index = index;
      found = true;
    }
  }
  auto& chosen = samples[expected.index];
  chosen.plays += expected.repeat ? 0 : 1;
  chosen.seen[player] = turn;
  for (const auto& sample : samples)
    expected.remaining += !sample.seen.contains(player);
  return expected;
}

// Players of very different appetite, samples that come in between, in bursts or one by one, and a store that
// is closed and opened: the searches that start half-way have to find what the search from the start would.
class StorePlaysModel : public EveryStore {
 protected:
  void play_as_the_model(unsigned seed);
};

void StorePlaysModel::play_as_the_model(unsigned seed) {
  std::mt19937 random(seed);
  const auto below = [&](unsigned bound) { return random() % bound; };
  const std::string name = "retake-" + std::to_string(seed) + ".db";
  auto store = open(prompt(), name);
  std::vector<ModelSample> model(150);
  fill(*store, model.size());

  for (int turn = 1; turn <= 1500; ++turn) {
    if (below(8) == 0) {
      const std::uint64_t more = below(40) == 0 ? 300 : 1 + below(3);
      if (model.size() + more <= 900) {
        store->commit(make_progress("c", "s", model.size() + 1, model.size() + more)).get();
        model.resize(model.size() + more);
      }
    }
    if (below(400) == 0) {
      store.reset();
      store = open(prompt(), name);
    }
    const auto die = below(20);
    const std::string player = die < 7    ? "keen"
                               : die < 12 ? "bob"
                               : die < 18 ? "p" + std::to_string(below(30))
                                          : "";
    const auto played = store->play("s", player, "").value();
    if (player.empty()) {
      // Any may come; those that it came to are the players' more played ones.
      ++model[played.sample.iteration - 1].plays;
      continue;
    }
    const auto expected = choose(model, player, turn);
    ASSERT_EQ(played.sample.iteration, expected.index + 1) << "turn " << turn << ", " << player;
    ASSERT_EQ(played.repeat, expected.repeat) << "turn " << turn;
    ASSERT_EQ(played.remaining, expected.remaining) << "turn " << turn << ", " << player;
    ASSERT_EQ(played.sample.plays, model[expected.index].plays);
  }
  EXPECT_TRUE(store->check().empty());
}

TEST_P(StorePlaysModel, every_play_is_the_one_that_counting_everything_gives) {
  for (unsigned seed = 1; seed < 7; ++seed) {
    SCOPED_TRACE(seed);
    play_as_the_model(seed);
    if (HasFatalFailure()) return;
  }
}

RETAKE_FOR_EVERY_STORE(StorePlays);
RETAKE_FOR_EVERY_STORE(StorePlaysByWeight);
RETAKE_FOR_EVERY_STORE(StorePlaysModel);

}  // namespace
}  // namespace retake::test
