// Commands that work without a daemon, or on the store of one that runs: sample, verify, export, backup,
// check.
#include <algorithm>
#include <iterator>
#include <random>
#include <set>
#include <sstream>
#include <thread>

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

TEST_F(SampleCommand, A_wish_that_excludes_itself_is_refused_with_8_and_both_places) {
  json twice = wish_document(1, 0.1);
  twice["constraints"].push_back({{"kind", "rest_position"}, {"x", 2}});
  write_text(folder / "twice.json", twice.dump());
  const Ended ended = run({"sample", "twice.json"});
  EXPECT_EQ(ended.exit_code, 8);
  for (const char* pointer : {"/constraints/0/x: ", "/constraints/1/x: "})
    EXPECT_NE(ended.err.find(pointer), std::string::npos) << pointer << "\n" << ended.err;
}

TEST_F(SampleCommand, How_far_it_is_stands_on_standard_error_if_wished) {
  const Arguments asked = {"sample", "wish.json", "--count", "3", "--seed", "3", "--json"};
  EXPECT_EQ(run(asked).err, "") << "no terminal, and nobody asked";
  Arguments wished = asked;
  wished.push_back("--progress");
  const Ended ended = run(wished);
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_NE(ended.err.find("3 of 3 samples"), std::string::npos) << ended.err;
  EXPECT_EQ(lines(ended.out).size(), 4) << "and the lines are as without";
}

TEST_F(SampleCommand, Lines_are_there_as_soon_as_they_are_found) {
  write_text(folder / "often.json", wish_document(1, 0.5).dump());
  ChildProcess process(folder.path(),
                       {.arguments = {"sample", "often.json", "--count", "1000000000", "--json"}});
  EXPECT_TRUE(wait_until([&] {
    const std::string out = process.out();
    return std::count(out.begin(), out.end(), '\n') > 10;
  }));
  EXPECT_FALSE(process.has_ended());
}

/// Keyframe documents of a folder, by name; nothing else may be in it.
std::map<std::string, std::string> documents_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> all;
  for (const auto& each : std::filesystem::directory_iterator(folder)) {
    EXPECT_EQ(each.path().extension(), ".json") << each.path();
    all[each.path().filename()] = read_text(each.path());
  }
  return all;
}

std::size_t files_in(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder)) return 0;
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

/// The lines of samples, without the folder; and of the last one what does not go by the clock.
std::vector<json> timeless(std::vector<json> told) {
  for (json& line : told) {
    if (line.contains("file"))
      line["file"] = std::filesystem::path(line["file"].get<std::string>()).filename().string();
    if (!line.contains("chain") || !line["chain"].is_object()) continue;
    for (const char* by_the_clock : {"run_seconds", "iterations_per_second"})
      line["chain"].erase(by_the_clock);
    line["chain"]["first_sample"].erase("seconds");
  }
  return told;
}

/// How wide the wish is, and how it is sampled; some seconds each.
struct CutRun {
  std::string name;
  double width;
  Arguments arguments;
};
void PrintTo(const CutRun& run, std::ostream* out) {
  *out << run.name;
}
class ResumedSample : public SampleCommand, public ::testing::WithParamInterface<CutRun> {};
INSTANTIATE_TEST_SUITE_P(
    Methods, ResumedSample,
    ::testing::Values(
        CutRun{"Rejection", 0.001, {"--method", "rejection", "--count", "300"}},
        CutRun{"Metropolis", 0.01, {"--method", "metropolis", "--count", "2000"}},
        CutRun{"MetropolisByEffectiveSamples", 1, {"--method", "metropolis", "--ess", "24"}},
        CutRun{"Conditional", 0.0003, {"--method", "conditional", "--count", "40", "--index", "2"}},
        CutRun{"ConditionalByEffectiveSamples", 0.02, {"--method", "conditional", "--ess", "60"}},
        CutRun{"Tempering", 0.01, {"--method", "tempering", "--count", "1500", "--ratios", "paper"}}),
    [](const auto& tested) { return tested.param.name; });

TEST_P(ResumedSample, A_run_that_was_cut_anywhere_finds_what_an_uncut_one_finds) {
  write_text(folder / "rare.json", wish_document(1, GetParam().width).dump());
  const auto arguments = [&](const std::string& out, const Arguments& more) {
    Arguments all = {"sample", "rare.json", "--json", "--seed", "11", "--out", out};
    all.insert(all.end(), GetParam().arguments.begin(), GetParam().arguments.end());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const Ended uncut = run(arguments("uncut", {}));
  ASSERT_EQ(uncut.exit_code, 0) << uncut.err;

  // Cut each time as soon as it has found something more, whatever it is just writing.
  std::mt19937 random(5);
  int cuts = 0;
  for (std::size_t found = 0; cuts < 5; ++cuts) {
    ChildProcess process(folder.path(), {.arguments = arguments("cut", {"--resume"})});
    const auto has_more = [&] { return files_in(folder / "cut") > found + 1; };
    ASSERT_TRUE(wait_until([&] { return process.has_ended() || has_more(); }));
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 60));
    if (process.has_ended()) break;
    process.kill();
    found = files_in(folder / "cut");
  }
  EXPECT_GT(cuts, 1) << "it was over before it could be cut";
  const Ended resumed = run(arguments("cut", {"--resume"}));
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(documents_in(folder / "cut"), documents_in(folder / "uncut"));
  EXPECT_EQ(timeless(lines(resumed.out)), timeless(lines(uncut.out))) << "the earlier ones come again";
}

TEST_F(SampleCommand, A_run_that_gave_up_goes_on_with_more_and_forgets_itself_when_done) {
  const Arguments asked = {"sample", "wish.json", "--seed", "4", "--out", "run", "--count", "20"};
  Arguments short_run = asked;
  short_run.insert(short_run.end(), {"--iterations", "30"});
  EXPECT_EQ(run(short_run).exit_code, 6);
  EXPECT_TRUE(std::filesystem::exists(folder / "run" / "run.db"));
  EXPECT_EQ(run({"check", "--store", "run/run.db"}).exit_code, 0) << "it is a store like any other";
  // The seed need not be said again.
  const Ended resumed = run({"sample", "wish.json", "--out", "run", "--count", "20", "--resume"});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "run" / "run.db"));
  EXPECT_EQ(run({"sample", "wish.json", "--seed", "4", "--out", "whole", "--count", "20"}).exit_code, 0);
  EXPECT_EQ(documents_in(folder / "run"), documents_in(folder / "whole"));
}

TEST_F(SampleCommand, Another_run_is_not_gone_on_with_and_what_differs_is_named) {
  const Arguments asked = {"sample", "wish.json",    "--seed", "4",        "--out",
                           "run",    "--iterations", "30",     "--method", "metropolis"};
  ASSERT_EQ(run(asked).exit_code, 6);
  const auto refusal = [&](const Arguments& more) {
    Arguments other = {"sample", "wish.json", "--out", "run", "--resume", "--iterations", "30"};
    other.insert(other.end(), more.begin(), more.end());
    const Ended ended = run(other);
    EXPECT_EQ(ended.exit_code, 3) << ended.err;
    return ended.err;
  };
  EXPECT_NE(refusal({"--seed", "5", "--method", "metropolis"}).find("the seed (4, not 5)"),
            std::string::npos);
  EXPECT_NE(refusal({"--method", "rejection"}).find("the method (\"metropolis\", not \"rejection\")"),
            std::string::npos);
  const std::string both = refusal({"--method", "metropolis", "--ratios", "paper", "--index", "1"});
  EXPECT_NE(both.find("the index (0, not 1) and the ratios"), std::string::npos) << both;
  write_text(folder / "wish.json", wish_document(1.5, 0.05).dump());
  EXPECT_NE(refusal({"--method", "metropolis"}).find("the scenario (/constraints/0/x)"), std::string::npos);
  EXPECT_EQ(run({"sample", "wish.json", "--resume"}).exit_code, 2) << "there is no folder to go on in";
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
  EXPECT_EQ(answer.status, 410);
  EXPECT_EQ(differences(answer.json(), "Problem"), "");
  EXPECT_EQ(answer.json()["type"], "/problems/damaged");
  EXPECT_EQ(answer.header("cache-control"), "no-store") << "a failure must not be kept for a year";
}

}  // namespace
}  // namespace retake
