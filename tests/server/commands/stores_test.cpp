// Commands that work without a daemon, or on the store of one that runs: sample, verify, export, backup,
// check.
#include <algorithm>
#include <set>
#include <sstream>

#include <sqlite3.h>

#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;
using Arguments = std::vector<std::string>;

class SampleCommand : public ::testing::Test {
 protected:
  void SetUp() override { write_text(folder / "wish.json", wish_document(1, 0.05).dump()); }
  Ended run(const Arguments& arguments, const std::string& input = "") const {
    return run_program(folder.path(), {.arguments = arguments, .input = input});
  }
  static std::vector<json> lines(const std::string& text) {
    std::vector<json> parsed;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
      parsed.push_back(json::parse(line));
    return parsed;
  }
  TemporaryFolder folder;
};

TEST_F(SampleCommand, It_writes_whole_keyframe_documents_and_a_line_for_each) {
  const Ended ended =
      run({"sample", "wish.json", "--count", "4", "--seed", "3", "--out", "new/folder", "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const std::vector<json> told = lines(ended.out);
  ASSERT_EQ(told.size(), 5);
  EXPECT_EQ(told.back()["ended_by"], "counted");
  EXPECT_EQ(differences(told.back()["odds"], "Odds"), "");
  EXPECT_EQ(differences(told.back()["chain"], "Chain"), "/created_at is missing\n") << "nobody stored it";
  EXPECT_EQ(told.back()["chain"]["state"], "finished");
  std::set<std::string> files;
  for (std::size_t i = 0; i < 4; ++i) {
    json stored = told[i];
    stored.erase("file");
    EXPECT_EQ(differences(stored, "Sample"), "/created_at is missing\n/plays is missing\n");
    EXPECT_EQ(told[i]["weight"], 1) << "of independent draws";
    EXPECT_EQ(told[i]["learning"], false);
    files.insert(told[i]["file"].get<std::string>());
    const json document = json::parse(read_text(folder / told[i]["file"].get<std::string>()));
    EXPECT_EQ(differences(document, "Keyframes"), "");
    EXPECT_EQ(document["sample"], told[i]["id"]);
    EXPECT_EQ(document["tracks"][0]["position"].size(), 3 * document["frames"].get<std::size_t>());
    EXPECT_EQ(document["rate"], 60);
  }
  EXPECT_EQ(files.size(), 4);
  run({"sample", "wish.json", "--count", "1", "--seed", "3", "--out", "slow", "--rate", "30"});
  for (const auto& each : std::filesystem::directory_iterator(folder / "slow"))
    EXPECT_EQ(json::parse(read_text(each.path()))["rate"], 30);
}

TEST_F(SampleCommand, The_same_seed_prints_the_same_lines_and_another_one_others) {
  const auto digests = [&](const std::string& seed, const std::string& method,
                           const std::string& index = "0") {
    std::vector<std::string> found;
    for (const json& line : lines(run({"sample", "wish.json", "--count", "20", "--seed", seed, "--method",
                                       method, "--index", index, "--json"})
                                      .out))
      found.push_back(line.value("digest", ""));
    EXPECT_EQ(found.size(), 21);
    return found;
  };
  for (const char* method : {"metropolis", "rejection"}) {
    EXPECT_EQ(digests("1", method), digests("1", method));
    EXPECT_NE(digests("1", method), digests("2", method));
    EXPECT_NE(digests("1", method), digests("1", method, "1"));
  }
  EXPECT_NE(digests("1", "metropolis"), digests("1", "rejection"));
  EXPECT_EQ(digests("1", "auto"), digests("1", "rejection")) << "the stub's default";
}

TEST_F(SampleCommand, A_line_says_what_its_sample_weighs_in_the_end) {
  const std::vector<json> told = lines(
      run({"sample", "wish.json", "--count", "40", "--seed", "5", "--method", "metropolis", "--json"}).out);
  ASSERT_EQ(told.size(), 41);
  // A walk stays where it is for some iterations, and each of them counts.
  std::uint64_t most = 0;
  for (std::size_t i = 0; i + 1 < 40; ++i) {
    EXPECT_LT(told[i]["iteration"], told[i + 1]["iteration"]);
    EXPECT_LE(told[i]["weight"].get<std::uint64_t>(),
              told[i + 1]["iteration"].get<std::uint64_t>() - told[i]["iteration"].get<std::uint64_t>());
    most = std::max(most, told[i]["weight"].get<std::uint64_t>());
  }
  EXPECT_GT(most, 1);
  EXPECT_EQ(told[39]["weight"], 1) << "the chain ended where it was found";
}

TEST_F(SampleCommand, What_it_finds_while_learning_is_told_and_not_counted) {
  write_text(folder / "rare.json", wish_document(1, 0.01).dump());
  const std::vector<json> told = lines(
      run({"sample", "rare.json", "--count", "5", "--seed", "5", "--method", "conditional", "--json"}).out);
  std::size_t learning = 0, counted = 0;
  for (std::size_t i = 0; i + 1 < told.size(); ++i) {
    EXPECT_EQ(told[i]["learning"], told[i]["weight"] == 0);
    (told[i]["learning"] == true ? learning : counted) += 1;
  }
  EXPECT_GT(learning, 20);
  EXPECT_EQ(counted, 5);
  EXPECT_EQ(told.back()["chain"]["counted"], 5);
  EXPECT_EQ(told.back()["ended_by"], "counted");
}

TEST_F(SampleCommand, It_reads_standard_input) {
  const Ended ended = run({"sample", "-", "--count", "1", "--json"}, wish_document(1, 0.1).dump());
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(lines(ended.out).size(), 2);
}

TEST_F(SampleCommand, It_gives_up_with_6_and_says_how_far_it_came) {
  write_text(folder / "never.json", wish_document(900, 0.001).dump());
  const Ended ended = run({"sample", "never.json", "--count", "5", "--iterations", "1000", "--seed", "1"});
  EXPECT_EQ(ended.exit_code, 6);
  EXPECT_NE(ended.err.find("0 of 5"), std::string::npos) << ended.err;
  EXPECT_EQ(run({"sample", "never.json", "--seconds", "0.05"}).exit_code, 6);
}

TEST_F(SampleCommand, A_bad_scenario_is_refused_with_every_fault_and_a_code_of_its_own) {
  write_text(folder / "bad.json",
             R"({"world":"ball2d","title":"","model":{"mass":1},"constraints":[{"kind":"pins"}]})");
  const Ended ended = run({"sample", "bad.json"});
  EXPECT_EQ(ended.exit_code, 8);
  for (const char* pointer : {"/title", "/model/mass", "/constraints/0/kind"})
    EXPECT_NE(ended.err.find(pointer), std::string::npos) << pointer << "\n" << ended.err;
  write_text(folder / "broken.json", "{");
  EXPECT_EQ(run({"sample", "broken.json"}).exit_code, 7);
  EXPECT_EQ(run({"sample", "missing.json"}).exit_code, 1);
}

TEST_F(SampleCommand, What_cannot_be_written_ends_with_9) {
  write_text(folder / "file", "");
  const Ended ended = run({"sample", "wish.json", "--count", "1", "--out", "file/below"});
  EXPECT_EQ(ended.exit_code, 9);
  EXPECT_NE(ended.err.find("file/below"), std::string::npos) << ended.err;
}

class StoreCommands : public DaemonTest {
 protected:
  Ended run(const Arguments& arguments) const { return run_program(folder.path(), {.arguments = arguments}); }
  const std::string store = (folder / "retake.db").string();
};

TEST_F(StoreCommands, They_work_on_the_store_of_a_daemon_whose_chains_run) {
  const std::string scenario = daemon.add_stocked_scenario(wish_document(1, 0.1), 30);
  const std::string chain =
      daemon.add_chains(daemon.add_scenario(wish_document(0, 0.001)), json::object()).at(0);

  const Ended check = run({"check", "--store", store});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_NE(check.out.find("0 faults"), std::string::npos);
  const std::vector<json> samples = daemon.samples(scenario);
  const Ended verify = run(
      {"verify", "--store", store, samples[0]["id"].get<std::string>(), samples[1]["id"].get<std::string>()});
  EXPECT_EQ(verify.exit_code, 0) << verify.out << verify.err;
  EXPECT_NE(run({"verify", "--store", store, "nosuch-1"}).exit_code, 0);

  const Ended exported = run({"export", scenario, "--store", store, "--out", "all"});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  std::size_t count = 0;
  for (const auto& each : std::filesystem::directory_iterator(folder / "all")) {
    const json document = json::parse(read_text(each.path()));
    EXPECT_EQ(document,
              daemon.get("/v1/samples/" + document["sample"].get<std::string>() + "/keyframes").json());
    ++count;
  }
  EXPECT_EQ(count, 30);
  EXPECT_EQ(run({"export", scenario, "--store", store, "--out", "some", "--limit", "7"}).exit_code, 0);
  const std::filesystem::directory_iterator some(folder / "some");
  EXPECT_EQ(std::distance(begin(some), end(some)), 7);
  EXPECT_EQ(run({"export", "nosuch", "--store", store, "--out", "none"}).exit_code, 1);

  const Ended backup = run({"backup", "copy.db", "--store", store});
  EXPECT_EQ(backup.exit_code, 0) << backup.err;
  EXPECT_EQ(run({"backup", "copy.db", "--store", store}).exit_code, 4)
      << "an existing file is not overwritten";
  EXPECT_EQ(daemon.chain(chain)["state"], "running");

  // The copy is a store like the first, and serves.
  EXPECT_EQ(run({"check", "--store", "copy.db"}).exit_code, 0);
  const Daemon second(folder.path(), {.store = "copy.db"});
  EXPECT_EQ(second.samples(scenario).size(), 30);
  EXPECT_EQ(second.samples(scenario)[0]["digest"], samples[0]["digest"]);
}

TEST_F(StoreCommands, Damage_is_found_by_check_and_verify_and_never_served) {
  const std::string scenario = daemon.add_stocked_scenario(wish_document(1, 0.1), 10);
  ASSERT_EQ(daemon.terminate(), 0);
  // One byte of each stored blob is bent.
  sqlite3* file = nullptr;
  ASSERT_EQ(sqlite3_open(store.c_str(), &file), SQLITE_OK);
  const auto execute = [&](const std::string& sql) {
    char* fault = nullptr;
    const int result = sqlite3_exec(file, sql.c_str(), nullptr, nullptr, &fault);
    EXPECT_EQ(result, SQLITE_OK) << sql << ": " << (fault ? fault : "");
  };
  std::string table;
  sqlite3_exec(
      file,
      "SELECT m.name FROM sqlite_master m, pragma_table_info(m.name) c WHERE m.type='table' AND "
      "c.name='animation'",
      [](void* into, int, char** values, char**) {
        *static_cast<std::string*>(into) = values[0];
        return 0;
      },
      &table, nullptr);
  ASSERT_FALSE(table.empty()) << "the schema has no column animation any more";
  execute("UPDATE " + table +
          " SET animation = CAST(substr(animation, 1, 40) || x'5a5a5a' || substr(animation, 44) AS BLOB)");
  sqlite3_close(file);

  const Ended check = run({"check", "--store", store});
  EXPECT_EQ(check.exit_code, 1) << check.out;
  EXPECT_NE(check.out.find("10 faults"), std::string::npos) << check.out;
  const Daemon next(folder.path());
  const std::vector<json> samples = next.samples(scenario);
  ASSERT_EQ(samples.size(), 10);
  const Answer answer = next.get("/v1/samples/" + samples[0]["id"].get<std::string>() + "/keyframes");
  EXPECT_EQ(answer.status, 500);
  EXPECT_EQ(differences(answer.json(), "Problem"), "");
  EXPECT_EQ(answer.json()["type"], "/problems/damaged-sample");
  EXPECT_EQ(answer.header("cache-control"), "no-store") << "a failure must not be kept for a year";
}

}  // namespace
}  // namespace retake
