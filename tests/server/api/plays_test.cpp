// Plays: a fresh animation for every player, for as long as there is one.
#include <atomic>
#include <set>
#include <thread>

#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

class ApiPlays : public DaemonTest {
 protected:
  Answer play(const std::string& scenario, const json& request, const Fields& fields = {}) const {
    return daemon.post("/v1/scenarios/" + scenario + "/plays", request, fields);
  }
};

TEST_F(ApiPlays, A_player_gets_every_sample_once_and_then_the_one_seen_longest_ago) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 6);
  for (const char* player : {"alice", "bob", "Zoë 😀"}) {
    std::vector<std::string> seen;
    for (int remaining = 5; remaining >= 0; --remaining) {
      const Answer answer = play(scenario, {{"player", player}});
      ASSERT_EQ(answer.status, 201) << answer.body;
      const json given = answer.json();
      EXPECT_EQ(differences(given, "Play"), "");
      EXPECT_EQ(given["repeat"], false);
      EXPECT_EQ(given["remaining"], remaining);
      EXPECT_FALSE(given.contains("keyframes"));
      seen.push_back(given["sample"]["id"]);
    }
    EXPECT_EQ(std::set<std::string>(seen.begin(), seen.end()).size(), 6);
    for (int round = 0; round < 2; ++round)
      for (const std::string& longest_ago : seen) {
        const json given = play(scenario, {{"player", player}}).json();
        EXPECT_EQ(given["repeat"], true);
        EXPECT_EQ(given["remaining"], 0);
        EXPECT_EQ(given["sample"]["id"], longest_ago);
      }
  }
}

TEST_F(ApiPlays, A_sample_that_is_found_later_is_fresh_again) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 2);
  for (int i = 0; i < 3; ++i)
    play(scenario, {{"player", "a"}});
  daemon.add_stocked_scenario(prior_document(), 1, 99);
  const json given = play(scenario, {{"player", "a"}}).json();
  EXPECT_EQ(given["repeat"], false);
  EXPECT_EQ(given["remaining"], 0);
}

TEST_F(ApiPlays, Without_a_player_the_least_played_comes_first) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 4);
  std::set<std::string> first_round;
  for (int i = 0; i < 4; ++i) {
    const json given = play(scenario, json::object()).json();
    first_round.insert(given["sample"]["id"].get<std::string>());
    EXPECT_EQ(given["remaining"], 3 - i);
  }
  EXPECT_EQ(first_round.size(), 4);
  std::set<std::string> second_round;
  for (int i = 0; i < 4; ++i)
    second_round.insert(play(scenario, json::object()).json()["sample"]["id"].get<std::string>());
  EXPECT_EQ(second_round, first_round);
  for (const json& sample : daemon.samples(scenario))
    EXPECT_EQ(sample["plays"], 2);
}

TEST_F(ApiPlays, Players_at_once_never_get_one_sample_twice) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 40);
  std::vector<std::vector<std::string>> given(4);
  std::vector<std::thread> clients;
  for (std::size_t i = 0; i < given.size(); ++i)
    clients.emplace_back([&, i] {  // two players, each from two places
      for (int n = 0; n < 20; ++n)
        given[i].push_back(play(scenario, {{"player", "p" + std::to_string(i % 2)}}).json()["sample"]["id"]);
    });
  for (std::thread& client : clients)
    client.join();
  for (std::size_t player = 0; player < 2; ++player) {
    std::set<std::string> seen(given[player].begin(), given[player].end());
    seen.insert(given[player + 2].begin(), given[player + 2].end());
    EXPECT_EQ(seen.size(), 40) << "player " << player;
  }
}

TEST_F(ApiPlays, An_idempotency_key_gives_the_same_play_again_and_refuses_another_player) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 5);
  const Fields key = {{"Idempotency-Key", "round-1"}};
  const json first = play(scenario, {{"player", "a"}}, key).json();
  const json other = play(scenario, {{"player", "a"}}).json();
  EXPECT_NE(other["sample"]["id"], first["sample"]["id"]);
  const Answer again = play(scenario, {{"player", "a"}}, key);
  EXPECT_EQ(again.status, 201);
  EXPECT_EQ(again.json()["play"], first["play"]);
  EXPECT_EQ(again.json()["sample"]["id"], first["sample"]["id"]);
  EXPECT_EQ(again.json()["repeat"], false);
  for (const json& request : {json({{"player", "b"}}), json::object()}) {
    const Answer conflict = play(scenario, request, key);
    EXPECT_EQ(conflict.status, 409);
    EXPECT_EQ(conflict.json()["type"], "/problems/idempotency-conflict");
  }
  EXPECT_EQ(play(scenario, {{"player", "a"}}, {{"Idempotency-Key", std::string(201, 'k')}}).status, 400);
  int plays = 0;
  for (const json& sample : daemon.samples(scenario))
    plays += sample["plays"].get<int>();
  EXPECT_EQ(plays, 2);

  // A key belongs to its scenario.
  const std::string second = daemon.add_stocked_scenario(prior_document("Another"), 2);
  EXPECT_EQ(play(second, {{"player", "b"}}, key).status, 201);
}

TEST_F(ApiPlays, A_key_and_what_a_player_saw_survive_a_killed_daemon) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 3);
  const Fields key = {{"Idempotency-Key", "k"}};
  const json first = play(scenario, {{"player", "a"}}, key).json();
  daemon.kill();
  const Daemon next(folder.path());
  const std::string path = "/v1/scenarios/" + scenario + "/plays";
  EXPECT_EQ(next.post(path, {{"player", "a"}}, key).json()["play"], first["play"]);
  std::set<json> seen{first["sample"]["id"]};
  for (int i = 0; i < 2; ++i)
    seen.insert(next.post(path, {{"player", "a"}}).json()["sample"]["id"]);
  EXPECT_EQ(seen.size(), 3);
}

TEST_F(ApiPlays, Keyframes_come_along_when_asked_for) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 1);
  const json given = play(scenario, {{"player", "a"}, {"include", "keyframes"}}).json();
  EXPECT_EQ(differences(given["keyframes"], "Keyframes"), "");
  EXPECT_EQ(given["keyframes"],
            daemon.get("/v1/samples/" + given["sample"]["id"].get<std::string>() + "/keyframes").json());
}

TEST_F(ApiPlays, An_empty_stock_is_said_at_once_and_when_to_ask_again) {
  const std::string scenario = daemon.add_scenario(wish_document(1, 1e-6));
  const Answer idle = play(scenario, {{"player", "a"}});
  EXPECT_EQ(idle.status, 503);
  EXPECT_EQ(idle.json()["type"], "/problems/no-samples-yet");
  EXPECT_EQ(differences(idle.json(), "Problem"), "");
  EXPECT_GE(std::stoi(idle.header("retry-after")), 1);
  EXPECT_NE(idle.json()["detail"].get<std::string>().find("No chain of this scenario is running"),
            std::string::npos);
  daemon.add_chains(scenario, json::parse(R"({"method":"rejection"})"));
  const Answer busy = play(scenario, {{"player", "a"}});
  if (busy.status != 201) {
    EXPECT_EQ(busy.status, 503);
    EXPECT_NE(busy.json()["detail"].get<std::string>().find("try again"), std::string::npos);
  }
}

TEST_F(ApiPlays, A_repeat_can_be_refused) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 2);
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(play(scenario, {{"player", "a"}, {"repeat", "refuse"}}).status, 201);
  const Answer refused = play(scenario, {{"player", "a"}, {"repeat", "refuse"}});
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.json()["type"], "/problems/no-new-samples");
  EXPECT_NE(refused.header("retry-after"), "");
  EXPECT_EQ(play(scenario, {{"player", "a"}, {"repeat", "allow"}}).json()["repeat"], true);
  EXPECT_EQ(play(scenario, {{"player", "b"}, {"repeat", "refuse"}}).status, 201);
  // With a chain that fills it up the same request gets something new.
  EXPECT_EQ(play(scenario, {{"player", "a"}, {"repeat", "refuse"}, {"low_water", 1}}).status, 503);
  EXPECT_TRUE(wait_until([&] {
    const Answer again = play(scenario, {{"player", "a"}, {"repeat", "refuse"}});
    return again.status == 201 && again.json()["repeat"] == false;
  }));
}

TEST_F(ApiPlays, What_is_refused_says_what_may_be_expected) {
  const std::string scenario = daemon.add_scenario(vain_document());
  ASSERT_TRUE(wait_until([&] { return play(scenario, json::object()).json().contains("verdict"); }))
      << "once the pilot has looked";
  EXPECT_FALSE(play(scenario, json::object()).json().contains("eta_seconds")) << "nobody is looking";
  daemon.add_chains(scenario, json::parse(R"({"method":"rejection","stop":{"iterations":30000000}})"));
  json refused;
  EXPECT_TRUE(wait_until([&] {
    refused = play(scenario, json::object()).json();
    return refused.contains("eta_seconds") && refused.contains("odds");
  })) << refused;
  EXPECT_EQ(differences(refused, "Problem"), "");
  EXPECT_GT(refused["eta_seconds"], 0);

  // Of a player that has seen all: by how fast the chains find what counts.
  const std::string common = daemon.add_stocked_scenario(prior_document(), 2);
  daemon.add_chains(common, json::parse(R"({"seed":5,"stop":{"samples":1}})"));
  const Answer seen_all = play(common, {{"player", "a"}, {"repeat", "refuse"}});
  EXPECT_TRUE(seen_all.status == 201 || seen_all.status == 503);
}

TEST_F(ApiPlays, A_play_may_wait_for_a_first_animation) {
  // Found after a while, by draws of the prior.
  const std::string scenario = daemon.add_scenario(wish_document(1, 1e-5));
  const auto took = [&](const json& request) {
    const auto begin = std::chrono::steady_clock::now();
    const Answer answer = play(scenario, request);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    return std::pair(answer.status, seconds.count());
  };
  // Without a chain there is nothing to wait for.
  const auto [without, at_once] = took({{"wait_ms", 5000}});
  EXPECT_EQ(without, 503);
  EXPECT_LT(at_once, 4);
  const std::string chain =
      daemon.add_chains(scenario, json::parse(R"({"method":"rejection","seed":1,"stop":{"samples":1}})"))
          .at(0);
  int status = 503;
  for (int tries = 0; tries < 20 && status == 503; ++tries)
    status = took({{"wait_ms", 5000}}).first;
  EXPECT_EQ(status, 201);
  EXPECT_EQ(daemon.wait_for_end(chain)["samples"], 1);
  // The end of the only chain ends the wait too.
  EXPECT_EQ(took({{"player", "a"}, {"wait_ms", 5000}}).first, 201);
  const std::string vain = daemon.add_scenario(vain_document());
  const std::string runs = daemon.add_chains(vain, json::parse(R"({"method":"rejection"})")).at(0);
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    daemon.post("/v1/chains/" + runs + "/stop");
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(play(vain, {{"wait_ms", 5000}}).status, 503);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(4500));
  stopper.join();
}

TEST_F(ApiPlays, Waiting_is_bounded_and_ends_with_the_daemon) {
  const std::string scenario = daemon.add_scenario(vain_document());
  daemon.add_chains(scenario, json::parse(R"({"method":"rejection"})"));
  std::atomic<int> at_once{0}, refused{0};
  std::vector<std::thread> clients;
  const auto begin = std::chrono::steady_clock::now();
  for (int client = 0; client < 24; ++client)
    clients.emplace_back([&] {
      const Answer answer = play(scenario, {{"wait_ms", 5000}});
      refused += answer.status == 503;
      at_once += std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(3000);
    });
  // Others are served meanwhile.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).status, 200);
  for (std::thread& client : clients)
    client.join();
  EXPECT_EQ(refused, 24);
  EXPECT_EQ(at_once, 8) << "sixteen wait";

  std::thread client([&] {
    try {
      play(scenario, {{"wait_ms", 5000}});
    } catch (const std::exception&) {
      // The daemon may cut the connection as it ends.
    }
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto end = std::chrono::steady_clock::now();
  EXPECT_EQ(daemon.terminate(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - end, std::chrono::seconds(4));
  client.join();
}

TEST_F(ApiPlays, Low_stock_starts_a_chain_again_only_if_asked_for) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 6);
  const auto chains = [&] {
    return daemon.get("/v1/scenarios/" + scenario + "/chains").json()["chains"].size();
  };
  EXPECT_EQ(play(scenario, {{"player", "a"}, {"low_water", 5}}).json()["remaining"], 5);
  EXPECT_EQ(chains(), 1) << "five are left, which is not fewer than five";
  for (int i = 0; i < 10; ++i)
    play(scenario, {{"player", "b"}});
  EXPECT_EQ(chains(), 1) << "off by default";
  EXPECT_EQ(play(scenario, {{"player", "a"}, {"low_water", 5}}).json()["remaining"], 4);
  EXPECT_EQ(chains(), 2);
  EXPECT_TRUE(wait_until([&] { return daemon.get("/v1/scenarios/" + scenario).json()["samples"] >= 6 + 5; }));
  ASSERT_TRUE(
      wait_until([&] { return daemon.get("/v1/scenarios/" + scenario).json()["chains"]["running"] == 0; }));
  EXPECT_GE(play(scenario, {{"player", "a"}, {"low_water", 5}}).json()["remaining"], 5);
  EXPECT_EQ(chains(), 2) << "there is enough again";
}

TEST_F(ApiPlays, Low_water_on_an_empty_stock_starts_a_chain_and_says_that_samples_are_coming) {
  const std::string scenario = daemon.add_scenario(prior_document());
  const Answer none = play(scenario, {{"player", "a"}, {"low_water", 5}});
  EXPECT_EQ(none.status, 503);
  EXPECT_NE(none.json()["detail"].get<std::string>().find("try again"), std::string::npos) << none.body;
  EXPECT_TRUE(wait_until([&] { return play(scenario, {{"player", "a"}}).status == 201; }));
}

TEST_F(ApiPlays, Many_players_at_low_water_start_one_chain_not_many) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 1);
  std::vector<std::thread> clients;
  std::atomic<int> given = 0;
  for (int i = 0; i < 8; ++i)
    clients.emplace_back([&, i] {
      given += play(scenario, {{"player", "p" + std::to_string(i)}, {"low_water", 1000000}}).status == 201;
    });
  for (std::thread& client : clients)
    client.join();
  EXPECT_EQ(given, 8);
  EXPECT_LE(daemon.get("/v1/scenarios/" + scenario + "/chains").json()["chains"].size(), 2);
}

}  // namespace
}  // namespace retake
