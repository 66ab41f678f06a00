// A seed decides everything: thread counts, pauses, kills and the program that runs a chain change nothing.
// doc/design.md, section 3, "Randomness".
#include <map>
#include <random>
#include <sstream>

#include "tests/server/walks.h"

namespace retake {
namespace {

using namespace test;

/// What a chain found: iteration -> weight and digest.
using Found = std::map<std::uint64_t, std::pair<std::uint64_t, std::string>>;

Found found_by(const Daemon& daemon, const std::string& scenario, const std::string& chain) {
  Found found;
  for (const json& sample : daemon.samples(scenario)) {
    if (sample.at("chain") != chain) continue;
    const std::pair<std::uint64_t, std::string> rest(sample.at("weight"), sample.at("digest"));
    EXPECT_TRUE(found.emplace(sample.at("iteration").get<std::uint64_t>(), rest).second);
  }
  return found;
}

/// Runs a walk on a daemon of its own, nothing disturbing it.
Found undisturbed(const WalkCase& walk, const std::string& threads = "2") {
  TemporaryFolder folder;
  const Daemon daemon(folder.path(), {.flags = {"--no-examples", "--threads", threads}});
  const std::string scenario = daemon.add_scenario(walk.scenario);
  const std::string chain = daemon.add_chains(scenario, walk.chain).at(0);
  const json ended = daemon.wait_for_end(chain);
  EXPECT_EQ(ended["ended_by"], "iterations");
  Found found = found_by(daemon, scenario, chain);
  EXPECT_EQ(found.size(), ended["samples"]);
  EXPECT_GT(found.size(), walk.fewest);
  return found;
}

class Determinism : public ::testing::TestWithParam<std::size_t> {
 protected:
  const WalkCase walk = walks()[GetParam()];
};
INSTANTIATE_TEST_SUITE_P(Methods, Determinism, ::testing::Range<std::size_t>(0, walks().size()),
                         [](const auto& parameter) { return std::string(walks()[parameter.param].name); });

TEST_P(Determinism, The_number_of_threads_and_of_other_chains_changes_nothing) {
  const Found alone = undisturbed(walk, "1");
  TemporaryFolder folder;
  const Daemon daemon(folder.path());
  const std::string scenario = daemon.add_scenario(walk.scenario);
  json request = walk.chain;
  request["count"] = 2;
  const auto chains = daemon.add_chains(scenario, request);
  daemon.add_chains(daemon.add_scenario(wish_document(0, 0.0001)), {{"count", 2}});
  for (const std::string& chain : chains)
    ASSERT_EQ(daemon.wait_for_end(chain)["state"], "finished");
  EXPECT_EQ(found_by(daemon, scenario, chains[0]), alone);
  EXPECT_NE(found_by(daemon, scenario, chains[1]), alone) << "another index is another chain";
}

TEST_P(Determinism, Pausing_at_random_moments_changes_nothing) {
  TemporaryFolder folder;
  const Daemon daemon(folder.path());
  const std::string scenario = daemon.add_scenario(walk.scenario);
  const std::string chain = daemon.add_chains(scenario, walk.chain).at(0);
  std::mt19937 random(1);
  int pauses = 0;
  for (; pauses < 100; ++pauses) {
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 40));
    const Answer paused = daemon.post("/v1/chains/" + chain + "/pause");
    if (paused.json()["state"] == "finished") break;
    ASSERT_EQ(paused.json()["state"], "paused");
    ASSERT_EQ(daemon.post("/v1/chains/" + chain + "/resume").json()["state"], "running");
  }
  EXPECT_GE(pauses, 3);
  ASSERT_EQ(daemon.wait_for_end(chain)["state"], "finished");
  EXPECT_EQ(found_by(daemon, scenario, chain), undisturbed(walk));
}

/// Killed three times in a row before it could commit anything, a chain is not taken up by itself.
json taken_up(const Daemon& daemon, const std::string& chain) {
  const json now = daemon.chain(chain);
  if (now["state"] != "failed") return now;
  EXPECT_NE(now["error"].get<std::string>().find("times while it was running"), std::string::npos) << now;
  return daemon.post("/v1/chains/" + chain + "/resume").json();
}

TEST_P(Determinism, A_daemon_killed_at_random_moments_loses_nothing_and_adds_nothing) {
  TemporaryFolder folder;
  std::string scenario, chain;
  std::mt19937 random(2);
  constexpr int kKills = 20;
  std::uint64_t before = 0;
  int kills_while_running = 0;
  for (int kill = 0; kill <= kKills; ++kill) {
    Daemon daemon(folder.path());
    if (kill == 0) {
      scenario = daemon.add_scenario(walk.scenario);
      chain = daemon.add_chains(scenario, walk.chain).at(0);
    }
    const json now = taken_up(daemon, chain);
    EXPECT_GE(now["iteration"], before) << "what was acknowledged is lost";
    before = now["iteration"];
    if (kill == kKills) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 150));
    kills_while_running += daemon.chain(chain)["state"] == "running";
    daemon.kill();
    const Ended check =
        run_program(folder.path(), {.arguments = {"check", "--store", (folder / "retake.db").string()}});
    ASSERT_EQ(check.exit_code, 0) << check.out << check.err;
  }
  EXPECT_GE(kills_while_running, 3);
  const Daemon daemon(folder.path());
  taken_up(daemon, chain);
  EXPECT_EQ(daemon.wait_for_end(chain)["ended_by"], "iterations");
  EXPECT_EQ(found_by(daemon, scenario, chain), undisturbed(walk));
  const Ended verify =
      run_program(folder.path(), {.arguments = {"verify", "--store", (folder / "retake.db").string()}});
  EXPECT_EQ(verify.exit_code, 0) << verify.out << verify.err;
}

TEST_P(Determinism, A_drained_daemon_goes_on_where_it_was) {
  TemporaryFolder folder;
  std::string scenario, chain;
  for (int start = 0; start < 4; ++start) {
    Daemon daemon(folder.path());
    if (start == 0) {
      scenario = daemon.add_scenario(walk.scenario);
      chain = daemon.add_chains(scenario, walk.chain).at(0);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    EXPECT_EQ(daemon.terminate(), 0) << daemon.process().err();
  }
  const Daemon daemon(folder.path());
  EXPECT_EQ(daemon.wait_for_end(chain)["ended_by"], "iterations");
  EXPECT_EQ(found_by(daemon, scenario, chain), undisturbed(walk));
}

TEST_P(Determinism, The_command_line_finds_the_same_samples_as_the_daemon) {
  TemporaryFolder folder;
  const Daemon daemon(folder.path());
  const std::string scenario = daemon.add_scenario(walk.scenario);
  json request = walk.chain;
  request["count"] = 2;
  const auto chains = daemon.add_chains(scenario, request);
  write_text(folder / "scenario.json", walk.scenario.dump());
  std::size_t found = 0;
  for (std::size_t index = 0; index < 2; ++index) {
    ASSERT_EQ(daemon.wait_for_end(chains[index])["ended_by"], "iterations");
    std::map<std::uint64_t, std::string> of_daemon, of_command;
    for (const auto& [iteration, rest] : found_by(daemon, scenario, chains[index]))
      of_daemon[iteration] = rest.second;
    const Ended ended = run_program(
        folder.path(),
        {.arguments = {"sample", "scenario.json", "--json", "--seed", walk.chain["seed"].dump(), "--count",
                       "1000000", "--iterations", walk.chain["stop"]["iterations"].dump(), "--index",
                       std::to_string(index), "--method", walk.chain["method"].get<std::string>()}});
    ASSERT_EQ(ended.exit_code, 6) << ended.err;
    std::istringstream lines(ended.out);
    for (std::string line; std::getline(lines, line);)
      if (const json each = json::parse(line); each.contains("digest"))
        of_command[each["iteration"].get<std::uint64_t>()] = each["digest"];
    EXPECT_EQ(of_command, of_daemon) << "index " << index;
    found += of_command.size();
  }
  EXPECT_GT(found, walk.fewest);
}

TEST(DeterminismOfEss, Restarts_pauses_and_the_command_line_end_a_walk_at_the_same_sample) {
  const json wish = wish_document(1, 0.05);
  const json request = json::parse(R"({"seed":21,"method":"metropolis","stop":{"ess":60}})");
  TemporaryFolder folder;
  std::string scenario, chain;
  json ended;
  std::mt19937 random(4);
  for (int kill = 0; kill < 12; ++kill) {
    Daemon daemon(folder.path());
    if (kill == 0) {
      scenario = daemon.add_scenario(wish);
      chain = daemon.add_chains(scenario, request).at(0);
    }
    daemon.post("/v1/chains/" + chain + "/pause");
    daemon.post("/v1/chains/" + chain + "/resume");
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 60));
    daemon.kill();
  }
  const Daemon daemon(folder.path());
  ended = daemon.wait_for_end(chain);
  ASSERT_EQ(ended["ended_by"], "ess");
  const Found disturbed = found_by(daemon, scenario, chain);
  // The same chain elsewhere, which nothing disturbed.
  const std::string elsewhere = daemon.add_scenario(wish_document(1, 0.05, "Elsewhere"));
  const std::string again = daemon.add_chains(elsewhere, request).at(0);
  EXPECT_EQ(daemon.wait_for_end(again)["effective_samples"], ended["effective_samples"]);
  EXPECT_EQ(found_by(daemon, elsewhere, again), disturbed);

  write_text(folder / "scenario.json", wish.dump());
  const Ended command =
      run_program(folder.path(), {.arguments = {"sample", "scenario.json", "--json", "--seed", "21", "--ess",
                                                "60", "--method", "metropolis"}});
  ASSERT_EQ(command.exit_code, 0) << command.err;
  std::map<std::uint64_t, std::string> of_daemon, of_command;
  for (const auto& [iteration, rest] : disturbed)
    of_daemon[iteration] = rest.second;
  std::istringstream lines(command.out);
  for (std::string line; std::getline(lines, line);) {
    const json each = json::parse(line);
    if (each.contains("digest")) of_command[each["iteration"].get<std::uint64_t>()] = each["digest"];
    if (each.contains("ended_by")) {
      EXPECT_EQ(each["ended_by"], "ess");
      EXPECT_EQ(each["chain"]["effective_samples"], ended["effective_samples"]);
    }
  }
  EXPECT_EQ(of_command, of_daemon);
  EXPECT_GT(of_command.size(), 60);
}

}  // namespace
}  // namespace retake
