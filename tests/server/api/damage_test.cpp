// A store with one damaged cell: the daemon starts, tells what is damaged, never serves it, and everything
// else goes on.
#include "db/sqlite/connection.h"
#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

class ApiDamage : public ::testing::Test {
 protected:
  /// A scenario with ten samples, one with three, and a chain that will be taken up.
  void SetUp() override {
    Daemon before(folder.path());
    scenario = before.add_stocked_scenario(wish_document(1, 0.2), 10);
    other = before.add_stocked_scenario(wish_document(0.8, 0.2), 3);
    for (const json& sample : before.samples(scenario))
      whole[sample.at("id")] = sample;
    hurt = before.samples(scenario).at(3).at("id");
    vain = before.add_scenario(vain_document());
    running = before.add_chains(vain, {{"seed", 3}}).at(0);
    ASSERT_TRUE(wait_until([&] { return before.chain(running).at("iteration") > 100; }));
    ASSERT_EQ(before.terminate(), 0);
  }
  void damage(const std::string& sql) const {
    database::Connection file((folder / "retake.db").string(), database::Connection::Access::write);
    file.execute("PRAGMA ignore_check_constraints = ON; PRAGMA foreign_keys = OFF;" + sql);
  }
  Ended check() const {
    return run_program(folder.path(), {.arguments = {"check", "--store", "retake.db"}, .input = ""});
  }
  /// Named by `check`, and by the daemon once somebody met it.
  void expect_named(const Daemon& daemon, const std::string& thing, const std::string& column,
                    int rows = 1) const {
    const Answer ready = daemon.get("/readyz");
    EXPECT_EQ(ready.status, 200);
    EXPECT_EQ(differences(ready.json(), "Status"), "");
    EXPECT_NE(ready.json().value("detail", "").find(thing + " is damaged: " + column), std::string::npos)
        << ready.body;
    EXPECT_NE(daemon.get("/metrics").body.find("retake_store_damaged_rows " + std::to_string(rows)),
              std::string::npos);
  }
  void expect_lasting(const Answer& answer, const std::string& thing) const {
    EXPECT_EQ(answer.status, 410) << answer.body;
    EXPECT_EQ(differences(answer.json(), "Problem"), "");
    EXPECT_EQ(answer.json()["type"], "/problems/damaged");
    EXPECT_NE(answer.body.find(thing), std::string::npos) << answer.body;
    EXPECT_EQ(answer.header("retry-after"), "");
    EXPECT_EQ(answer.header("cache-control"), "no-store");
  }
  /// What players are given, with keyframes, until all is seen.
  std::set<std::string> played(const Daemon& daemon) const {
    std::set<std::string> ids;
    for (;;) {
      const Answer answer = daemon.post("/v1/scenarios/" + scenario + "/plays",
                                        {{"player", "a"}, {"repeat", "refuse"}, {"include", "keyframes"}});
      if (answer.status != 201) break;
      const json sample = answer.json().at("sample");
      json known = whole.at(sample.at("id"));
      known["plays"] = sample.at("plays");
      EXPECT_EQ(sample, known);
      EXPECT_TRUE(ids.insert(sample.at("id")).second);
    }
    return ids;
  }
  /// All that is of the other scenario, and the chain that runs, go on.
  void expect_the_rest(const Daemon& daemon) const {
    EXPECT_EQ(daemon.samples(other).size(), 3);
    EXPECT_EQ(daemon.post("/v1/scenarios/" + other + "/plays").status, 201);
    EXPECT_EQ(daemon.get("/v1/scenarios").status, 200);
    EXPECT_EQ(daemon.get("/v1/scenarios/" + other + "/diagnostics").status, 200);
  }

  TemporaryFolder folder;
  std::string scenario, other, vain, running, hurt;
  std::map<std::string, json> whole;
};

TEST_F(ApiDamage, Damaged_samples_are_left_out_and_the_others_are_listed_and_played) {
  damage(
      "UPDATE sample SET measures = '{' WHERE row = 4; UPDATE sample SET weight = -5 WHERE row = 5;"
      "UPDATE sample SET digest = 'none' WHERE row = 6");
  const Ended ended = check();
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_NE(ended.out.find("sample " + hurt + " is damaged: measures"), std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("is damaged: weight"), std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("is damaged: digest"), std::string::npos) << ended.out;
  Daemon daemon(folder.path());
  const std::vector<json> samples = daemon.samples(scenario);
  EXPECT_EQ(samples.size(), 7);
  for (const json& sample : samples)
    EXPECT_EQ(sample["weight"], whole.at(sample["id"])["weight"]);
  expect_lasting(daemon.get("/v1/samples/" + hurt), hurt);
  expect_named(daemon, "sample " + hurt, "measures", 3);
  EXPECT_EQ(played(daemon).size(), 7);
  EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario + "/diagnostics").status, 200);
  expect_the_rest(daemon);
  ASSERT_EQ(daemon.terminate(), 0);
  const std::string log = daemon.process().err();
  const std::size_t told = log.find("sample " + hurt + " is damaged");
  EXPECT_NE(told, std::string::npos) << log;
  EXPECT_EQ(log.find("sample " + hurt + " is damaged", told + 1), std::string::npos) << "told once: " << log;
}

TEST_F(ApiDamage, A_damaged_state_or_animation_is_never_served) {
  damage("UPDATE sample_blob SET state = CAST('~' || substr(state, 2) AS BLOB) WHERE sample = 4");
  EXPECT_NE(check().out.find("sample " + hurt + " is damaged: state"), std::string::npos);
  const Daemon daemon(folder.path());
  expect_lasting(daemon.get("/v1/samples/" + hurt), hurt);
  expect_lasting(daemon.post("/v1/samples/" + hurt + "/verify"), hurt);
  expect_named(daemon, "sample " + hurt, "state");
  EXPECT_EQ(played(daemon).size(), 9);
  expect_the_rest(daemon);
}

TEST_F(ApiDamage, A_keyed_play_of_a_damaged_sample_is_gone_with_a_reason) {
  std::string sample;
  const Fields key{{"Idempotency-Key", "k"}};
  {
    Daemon daemon(folder.path());
    sample =
        daemon.post("/v1/scenarios/" + scenario + "/plays", {{"player", "a"}}, key).json()["sample"]["id"];
    ASSERT_EQ(daemon.terminate(), 0);
  }
  damage(
      "UPDATE sample_blob SET animation = x'00' WHERE sample = (SELECT sample FROM play ORDER BY row DESC"
      " LIMIT 1)");
  const Daemon daemon(folder.path());
  expect_lasting(daemon.post("/v1/scenarios/" + scenario + "/plays", {{"player", "a"}}, key), sample);
  expect_lasting(daemon.get("/v1/samples/" + sample + "/keyframes"), sample);
  EXPECT_EQ(daemon.post("/v1/scenarios/" + scenario + "/plays", {{"player", "a"}}).status, 201);
}

TEST_F(ApiDamage, A_damaged_document_stops_neither_the_start_nor_the_plays) {
  damage("UPDATE scenario SET document = '{' WHERE id = '" + scenario + "'");
  EXPECT_NE(check().out.find("scenario " + scenario + " is damaged: document"), std::string::npos);
  const Daemon daemon(folder.path());
  EXPECT_EQ(daemon.get("/v1/scenarios").json()["scenarios"].size(), 2);
  expect_lasting(daemon.get("/v1/scenarios/" + scenario), scenario);
  expect_lasting(daemon.post("/v1/scenarios/" + scenario + "/chains"), scenario);
  expect_named(daemon, "scenario " + scenario, "document");
  EXPECT_EQ(daemon.samples(scenario).size(), 10);
  EXPECT_EQ(played(daemon).size(), 10);
  expect_the_rest(daemon);
}

TEST_F(ApiDamage, A_damaged_chain_is_not_taken_up_and_nothing_waits_for_it) {
  damage("UPDATE chain SET method = 'metropolix' WHERE id = '" + running + "'");
  EXPECT_NE(check().out.find("chain " + running + " is damaged: method"), std::string::npos);
  const Daemon daemon(folder.path());
  expect_lasting(daemon.get("/v1/chains/" + running), running);
  EXPECT_EQ(daemon.get("/v1/scenarios/" + vain + "/chains").json()["chains"].size(), 0);
  EXPECT_EQ(daemon.get("/v1/scenarios/" + vain).json()["chains"]["failed"], 1);
  expect_named(daemon, "chain " + running, "method");
  expect_the_rest(daemon);
}

TEST_F(ApiDamage, A_chain_with_a_damaged_checkpoint_fails_with_the_reason) {
  damage(
      "UPDATE checkpoint SET bytes = CAST(substr(bytes, 1, 40) || '~' || substr(bytes, 42) AS BLOB)"
      " WHERE chain = (SELECT row FROM chain WHERE id = '" +
      running + "')");
  EXPECT_NE(check().out.find("checkpoint of chain " + running + " is damaged: bytes"), std::string::npos);
  const Daemon daemon(folder.path());
  const json chain = daemon.chain(running);
  EXPECT_EQ(chain["state"], "failed");
  EXPECT_NE(chain["error"].get<std::string>().find("checkpoint"), std::string::npos) << chain["error"];
  expect_lasting(daemon.post("/v1/chains/" + running + "/resume"), running);
  expect_the_rest(daemon);
}

}  // namespace
}  // namespace retake
