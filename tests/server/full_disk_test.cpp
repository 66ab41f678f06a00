// A disk that is full, a store that is gone, few descriptors: the daemon lives, says so, reads on, and its
// chains go on once they can.
#include <algorithm>
#include <memory>

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

TEST_F(FullDisk, Chains_wait_and_go_on_from_their_last_commit_once_there_is_room) {
  std::string chain;
  {
    Daemon daemon(folder.path(), {.most_file_bytes = limit});
    chain = daemon.add_chains(scenario, json::parse(R"({"seed":5,"stop":{"samples":3000}})")).at(0);
    ASSERT_TRUE(wait_until([&] { return daemon.get("/readyz").status == 503; }));

    // Reading goes on.
    EXPECT_EQ(daemon.chain(chain)["state"], "running");
    EXPECT_TRUE(daemon.chain(chain)["error"].is_null());
    EXPECT_LT(daemon.chain(chain)["samples"], 3000);
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

  // With room again, the chain goes on by itself, and finds what it would have found.
  const Daemon daemon(folder.path());
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

/// How large files of a running process may become can be changed from outside.
void limit_files(Daemon& daemon, rlim_t most_bytes) {
  rlimit limit{};
  ASSERT_EQ(prlimit(daemon.process().pid(), RLIMIT_FSIZE, nullptr, &limit), 0);
  limit.rlim_cur = most_bytes;
  ASSERT_EQ(prlimit(daemon.process().pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
}

TEST_F(FullDisk, The_same_daemon_and_its_chains_go_on_by_themselves_when_there_is_room_again) {
  Daemon daemon(folder.path());
  const std::string chain =
      daemon.add_chains(scenario, json::parse(R"({"seed":6,"stop":{"samples":40000}})")).at(0);
  limit_files(daemon, 1);
  ASSERT_TRUE(wait_until([&] { return daemon.get("/readyz").status == 503; }));
  const json ready = daemon.get("/readyz").json();
  EXPECT_EQ(differences(ready, "Problem"), "");
  EXPECT_NE(ready["detail"].get<std::string>().find("File too large"), std::string::npos) << ready;
  EXPECT_EQ(daemon.post("/v1/scenarios/" + scenario + "/plays", {{"player", "a"}}).status, 503);
  for (const char* verb : {"pause", "stop"})
    EXPECT_EQ(daemon.post("/v1/chains/" + chain + "/" + verb).status, 503) << "it could not be stored";
  EXPECT_EQ(daemon.chain(chain)["state"], "running");

  limit_files(daemon, RLIM_INFINITY);
  EXPECT_TRUE(wait_until([&] { return daemon.get("/readyz").status == 200; }))
      << "without a request that writes";
  const json ended = daemon.wait_for_end(chain);
  EXPECT_EQ(ended["state"], "finished");
  EXPECT_EQ(ended["samples"], 40000);
}

TEST_F(FullDisk, A_daemon_starts_on_it_serves_what_it_has_and_goes_on_when_there_is_room) {
  std::string chain;
  {
    Daemon daemon(folder.path());
    chain = daemon.add_chains(scenario, json::parse(R"({"seed":7,"stop":{"samples":20000}})")).at(0);
    ASSERT_TRUE(wait_until([&] { return daemon.chain(chain)["samples"] > 0; }));
    daemon.kill();
  }
  // Room for what it prints, but not for the memory that SQLite shares.
  Daemon daemon(folder.path(), {.most_file_bytes = 16'000});
  EXPECT_EQ(daemon.get("/healthz").status, 200);
  EXPECT_EQ(daemon.get("/readyz").status, 503);
  EXPECT_EQ(daemon.get("/metrics").status, 200);
  EXPECT_EQ(daemon.get("/v1/samples/" + sample + "/keyframes").status, 200);
  EXPECT_GT(daemon.samples(scenario).size(), 20);
  EXPECT_EQ(daemon.post("/v1/scenarios", prior_document("Another")).status, 503);
  EXPECT_EQ(daemon.post("/v1/chains/" + chain + "/pause").status, 503);
  EXPECT_EQ(daemon.chain(chain)["state"], "running");
  EXPECT_NE(daemon.process().err().find("retake: store: cannot commit to "), std::string::npos)
      << daemon.process().err();

  limit_files(daemon, RLIM_INFINITY);
  EXPECT_TRUE(wait_until([&] { return daemon.get("/readyz").status == 200; }));
  EXPECT_EQ(daemon.wait_for_end(chain)["state"], "finished");
  EXPECT_EQ(daemon.chain(chain)["samples"], 20000);
  EXPECT_NE(daemon.process().err().find("the store can be written again"), std::string::npos);
  EXPECT_EQ(daemon.terminate(), 0);
  const Ended check =
      run_program(folder.path(), {.arguments = {"check", "--store", (folder / "retake.db").string()}});
  EXPECT_EQ(check.exit_code, 0) << check.out;
}

TEST_F(FullDisk, A_store_that_was_taken_away_is_told_and_waited_for) {
  Daemon daemon(folder.path());
  const std::string chain =
      daemon.add_chains(scenario, json::parse(R"({"seed":8,"stop":{"samples":40000}})")).at(0);
  const auto store = folder / "retake.db", elsewhere = folder / "elsewhere.db";
  std::filesystem::rename(store, elsewhere);
  ASSERT_TRUE(wait_until([&] { return daemon.get("/readyz").status == 503; }));
  EXPECT_NE(daemon.get("/readyz").json()["detail"].get<std::string>().find("the file was removed"),
            std::string::npos);
  EXPECT_EQ(daemon.post("/v1/scenarios", prior_document("Another")).status, 503);
  EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).status, 200);
  EXPECT_NE(daemon.process().err().find("the file was removed"), std::string::npos);
  std::filesystem::rename(elsewhere, store);
  EXPECT_TRUE(wait_until([&] { return daemon.get("/readyz").status == 200; }));
  EXPECT_EQ(daemon.wait_for_end(chain)["state"], "finished");
  EXPECT_EQ(daemon.samples(scenario).size(), 20 + 40000);
}

// --- Few descriptors ----------------------------------------------------------------------------

TEST(FewDescriptors, Too_few_are_told_at_the_start) {
  TemporaryFolder folder;
  const Ended ended = run_program(folder.path(), {.arguments = {"serve", "--listen", "127.0.0.1:0", "--store",
                                                                (folder / "retake.db").string()},
                                                  .most_descriptors = 100});
  EXPECT_EQ(ended.exit_code, 3);
  EXPECT_NE(ended.err.find("needs 400 file descriptors and may open 100: raise its limit (ulimit -n)"),
            std::string::npos)
      << ended.err;
  EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "retake.db"));
}

TEST(FewDescriptors, A_flood_of_connections_fails_no_chain) {
  TemporaryFolder folder;
  Daemon daemon(folder.path(), {.most_descriptors = 400});
  const std::string scenario = daemon.add_scenario(prior_document());
  const std::string chain =
      daemon.add_chains(scenario, json::parse(R"({"seed":9,"stop":{"samples":20000}})")).at(0);
  std::vector<std::unique_ptr<RawClient>> flood;
  for (int i = 0; i < 450; ++i)
    flood.push_back(std::make_unique<RawClient>(daemon.port()));
  std::this_thread::sleep_for(std::chrono::seconds(1));
  flood.clear();
  const json ended = daemon.wait_for_end(chain);
  EXPECT_EQ(ended["state"], "finished");
  EXPECT_EQ(ended["samples"], 20000);
  EXPECT_EQ(daemon.get("/readyz").status, 200);
}

}  // namespace
}  // namespace retake
