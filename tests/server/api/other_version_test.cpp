// A store whose scenarios were made for another version of their world: what was found plays on, says that it
// cannot be verified, and no chain walks on by other physics.
#include "db/sqlite/connection.h"
#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

class ApiOtherVersion : public ::testing::Test {
 protected:
  /// A scenario with five samples, a chain that runs and one that is paused, of a version that no build has.
  void SetUp() override {
    Daemon before(folder.path());
    scenario = before.add_stocked_scenario(wish_document(1, 0.2), 5);
    sample = before.samples(scenario).at(0)["id"];
    const std::vector<std::string> chains = before.add_chains(before.add_scenario(wish_document(1, 1e-6)),
                                                              json::parse(R"({"count":2,"seed":3})"));
    running = chains[0];
    paused = chains[1];
    ASSERT_EQ(before.post("/v1/chains/" + paused + "/pause").status, 200);
    ASSERT_EQ(before.terminate(), 0);
    database::Connection file((folder / "retake.db").string(), database::Connection::Access::write);
    file.execute("UPDATE scenario SET world_version = 1000, seal = reseal(seal, 2, 1000)");
  }

  TemporaryFolder folder;
  std::string scenario, sample, running, paused;
};

TEST_F(ApiOtherVersion, Its_chains_are_finished_with_a_reason) {
  const Daemon daemon(folder.path());
  for (const std::string& id : {running, paused}) {
    const json chain = daemon.chain(id);
    EXPECT_EQ(differences(chain, "Chain"), "");
    EXPECT_EQ(chain["state"], "finished");
    EXPECT_EQ(chain["ended_by"], "world_version");
    EXPECT_EQ(daemon.post("/v1/chains/" + id + "/resume").status, 409);
  }
}

TEST_F(ApiOtherVersion, Its_samples_play_on) {
  const Daemon daemon(folder.path());
  EXPECT_EQ(daemon.samples(scenario).size(), 5);
  const json keyframes = daemon.get("/v1/samples/" + sample + "/keyframes").json();
  EXPECT_EQ(differences(keyframes, "Keyframes"), "");
  EXPECT_EQ(keyframes["world_version"], 1000) << "which motion it is";
  for (int play = 0; play < 5; ++play) {
    const Answer answer = daemon.post("/v1/scenarios/" + scenario + "/plays",
                                      {{"player", "a"}, {"include", "keyframes"}, {"low_water", 100}});
    ASSERT_EQ(answer.status, 201) << answer.body;
    EXPECT_EQ(answer.json()["repeat"], false);
    EXPECT_EQ(answer.json()["keyframes"]["world_version"], 1000);
  }
  EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).json()["chains"]["running"], 0)
      << "nothing to refill from";
}

TEST_F(ApiOtherVersion, They_say_that_they_cannot_be_verified) {
  const Daemon daemon(folder.path());
  const json one = daemon.get("/v1/samples/" + sample).json();
  EXPECT_EQ(differences(one, "Sample"), "");
  EXPECT_EQ(one["verifiable"], false);
  EXPECT_FALSE(one.contains("variables"));
  const auto expect_refused = [](const Answer& answer) {
    EXPECT_EQ(answer.status, 409) << answer.body;
    EXPECT_EQ(differences(answer.json(), "Problem"), "");
    EXPECT_EQ(answer.json()["type"], "/problems/other-world-version");
    EXPECT_NE(answer.body.find("version 1000"), std::string::npos) << answer.body;
  };
  expect_refused(daemon.post("/v1/samples/" + sample + "/verify"));
  expect_refused(daemon.post("/v1/scenarios/" + scenario + "/chains"));
  expect_refused(daemon.get("/v1/scenarios/" + scenario + "/diagnostics"));
  expect_refused(daemon.get("/v1/chains/" + running + "/trace"));
}

TEST(ApiRefusedDocument, A_document_that_is_refused_now_is_a_reason_that_lasts_and_its_samples_play_on) {
  const TemporaryFolder folder;
  std::string scenario, sample;
  {
    Daemon before(folder.path());
    scenario = before.add_stocked_scenario(wish_document(1, 0.2), 3);
    sample = before.samples(scenario).at(0)["id"];
    ASSERT_EQ(before.terminate(), 0);
  }
  database::Connection((folder / "retake.db").string(), database::Connection::Access::write)
      .execute(
          "UPDATE scenario SET document = replace(document, 'rest_position', 'rest_nowhere');"
          "UPDATE scenario SET seal = reseal(seal, 4, document)");
  const Daemon daemon(folder.path());
  for (const Answer& answer : {daemon.post("/v1/scenarios/" + scenario + "/chains"),
                               daemon.post("/v1/samples/" + sample + "/verify"),
                               daemon.get("/v1/scenarios/" + scenario + "/diagnostics")}) {
    EXPECT_EQ(answer.status, 409) << answer.body;
    EXPECT_EQ(answer.json()["type"], "/problems/refused-document");
    EXPECT_EQ(answer.header("retry-after"), "");
  }
  EXPECT_EQ(daemon.post("/v1/scenarios/" + scenario + "/plays", {{"include", "keyframes"}}).status, 201);
  EXPECT_EQ(daemon.get("/v1/samples/" + sample + "/keyframes").status, 200);
}

TEST_F(ApiOtherVersion, The_command_that_verifies_counts_them_apart) {
  const Ended ended =
      run_program(folder.path(), {.arguments = {"verify", "--store", "retake.db"}, .input = ""});
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_NE(ended.out.find("0 identical, 0 different, 5 of other versions"), std::string::npos) << ended.out;
}

}  // namespace
}  // namespace retake
