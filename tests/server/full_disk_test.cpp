// A disk that is full: the daemon lives, says so, reads on, and its chains go on once there is room.
#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

class FullDisk : public ::testing::Test {
 protected:
  /// A store with some samples, and a limit a little above its size.
  void SetUp() override {
    Daemon daemon(folder.path());
    scenario = daemon.add_stocked_scenario(prior_document(), 20);
    sample = daemon.samples(scenario).at(0)["id"];
    ASSERT_EQ(daemon.terminate(), 0);
    std::uintmax_t largest = 0;
    for (const auto& each : std::filesystem::directory_iterator(folder.path()))
      largest = std::max(largest, each.file_size());
    limit = largest + 100 * 1024;
  }

  TemporaryFolder folder;
  std::string scenario, sample;
  rlim_t limit = 0;
};

TEST_F(FullDisk, Chains_fail_with_a_message_and_go_on_from_their_checkpoint_once_there_is_room) {
  std::string chain;
  json failed;
  {
    Daemon daemon(folder.path(), {.most_file_bytes = limit});
    chain = daemon.add_chains(scenario, json::parse(R"({"seed":5,"stop":{"samples":3000}})")).at(0);
    failed = daemon.wait_for_end(chain);
    ASSERT_EQ(failed["state"], "failed");
    EXPECT_FALSE(failed["error"].is_null());

    // Reading goes on.
    EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).json()["chains"]["failed"].get<int>() +
                  daemon.get("/v1/scenarios/" + scenario).json()["chains"]["running"].get<int>(),
              1);
    EXPECT_EQ(daemon.get("/v1/samples/" + sample + "/keyframes").status, 200);
    EXPECT_EQ(daemon.post("/v1/samples/" + sample + "/verify").json()["identical"], true);
    EXPECT_GE(daemon.samples(scenario).size(), 20);
    EXPECT_EQ(daemon.get("/metrics").status, 200);

    // Writes are refused as long as there is no room, or done; never anything else.
    int refused = 0, unready = 0;
    for (int i = 0; i < 300 && (refused < 3 || unready == 0); ++i) {
      const Answer answer = daemon.post(
          "/v1/scenarios", prior_document(std::string(200, 'x').replace(0, 4, std::to_string(1000 + i))));
      ASSERT_TRUE(answer.status == 201 || answer.status == 503) << answer.status << answer.body;
      if (answer.status != 503) continue;
      ++refused;
      const Answer ready = daemon.get("/readyz");
      // A smaller write, such as a first look's, may have found room meanwhile.
      ASSERT_TRUE(ready.status == 200 || ready.status == 503) << ready.status;
      unready += ready.status == 503;
      if (ready.status == 503) {
        EXPECT_EQ(differences(ready.json(), "Problem"), "");
      }
      EXPECT_EQ(daemon.get("/healthz").status, 200);
      EXPECT_EQ(differences(answer.json(), "Problem"), "");
      EXPECT_FALSE(answer.header("retry-after").empty());
      for (const char* secret : {"SQL", "sqlite", "/tmp", "retake.db", "disk I/O"})
        EXPECT_EQ(answer.body.find(secret), std::string::npos) << answer.body;
    }
    EXPECT_GT(refused, 0);
    EXPECT_GT(unready, 0);
    EXPECT_FALSE(daemon.process().has_ended());
    EXPECT_EQ(daemon.terminate(), 0) << daemon.process().err();
  }

  // With room again, the chain goes on by itself or when asked, and finds what it would have found.
  const Daemon daemon(folder.path());
  if (daemon.chain(chain)["state"] == "failed") daemon.post("/v1/chains/" + chain + "/resume");
  const json ended = daemon.wait_for_end(chain);
  EXPECT_EQ(ended["state"], "finished");
  EXPECT_TRUE(ended["error"].is_null());
  EXPECT_EQ(ended["samples"], 3000);
  EXPECT_EQ(daemon.samples(scenario).size(), 20 + 3000);
  const Ended check =
      run_program(folder.path(), {.arguments = {"check", "--store", (folder / "retake.db").string()}});
  EXPECT_EQ(check.exit_code, 0) << check.out;
  // The same chain elsewhere, which nothing disturbed.
  const std::string elsewhere = daemon.add_scenario(prior_document("Elsewhere"));
  const std::string again =
      daemon.add_chains(elsewhere, json::parse(R"({"seed":5,"stop":{"samples":3000}})")).at(0);
  ASSERT_EQ(daemon.wait_for_end(again)["state"], "finished");
  std::vector<std::string> digests, digests_again;
  for (const json& each : daemon.samples(scenario))
    if (each["chain"] == chain) digests.push_back(each["digest"]);
  for (const json& each : daemon.samples(elsewhere))
    digests_again.push_back(each["digest"]);
  EXPECT_EQ(digests, digests_again);
}

TEST_F(FullDisk, A_failed_chain_is_resumed_by_a_request_when_the_same_daemon_has_room_again) {
  Daemon daemon(folder.path());
  const std::string chain =
      daemon.add_chains(scenario, json::parse(R"({"seed":6,"stop":{"samples":40000}})")).at(0);
  // The limit of a running process can be lowered and raised from outside.
  rlimit unlimited{};
  ASSERT_EQ(prlimit(daemon.process().pid(), RLIMIT_FSIZE, nullptr, &unlimited), 0);
  const rlimit full{1, unlimited.rlim_max};
  ASSERT_EQ(prlimit(daemon.process().pid(), RLIMIT_FSIZE, &full, nullptr), 0);
  const json failed = daemon.wait_for_end(chain);
  ASSERT_EQ(failed["state"], "failed");
  EXPECT_EQ(daemon.get("/readyz").status, 503);
  EXPECT_EQ(daemon.post("/v1/chains/" + chain + "/resume").status, 503) << "there is no room yet";
  EXPECT_EQ(daemon.chain(chain)["state"], "failed") << "it stays failed until it is resumed";
  EXPECT_EQ(daemon.post("/v1/scenarios/" + scenario + "/plays", {{"player", "a"}}).status, 503);

  ASSERT_EQ(prlimit(daemon.process().pid(), RLIMIT_FSIZE, &unlimited, nullptr), 0);
  EXPECT_EQ(daemon.chain(chain)["state"], "failed") << "sticky";
  const Answer resumed = daemon.post("/v1/chains/" + chain + "/resume");
  EXPECT_EQ(resumed.status, 200) << resumed.body;
  EXPECT_TRUE(resumed.json()["error"].is_null());
  const json ended = daemon.wait_for_end(chain);
  EXPECT_EQ(ended["state"], "finished");
  EXPECT_EQ(ended["samples"], 40000);
  EXPECT_EQ(daemon.get("/readyz").status, 200);
}

}  // namespace
}  // namespace retake
