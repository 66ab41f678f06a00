// The program: exit codes, where options come from, what `serve` and `sample` do for an operator.
#include "server/commands/command_line.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <sqlite3.h>

#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;
using Arguments = std::vector<std::string>;

class CommandLine : public ::testing::Test {
 protected:
  Ended run(const Arguments& arguments, const Fields& environment = {}, const std::string& input = "") const {
    return run_program(folder.path(), {.arguments = arguments, .environment = environment, .input = input});
  }
  /// Expects an exit code and, for a fault, one or two lines on stderr that say what is wrong.
  void expect_exit(int code, const Arguments& arguments, const Fields& environment = {}) const {
    std::string text;
    for (const std::string& argument : arguments)
      text += argument + " ";
    const Ended ended = run(arguments, environment);
    EXPECT_EQ(ended.exit_code, code) << text << "\n" << ended.out << ended.err;
    if (code == 0) return;
    EXPECT_FALSE(ended.err.empty()) << text;
    EXPECT_LE(std::count(ended.err.begin(), ended.err.end(), '\n'), 3) << text << "\n" << ended.err;
    EXPECT_EQ(ended.err.find("terminate"), std::string::npos) << ended.err;
  }
  static Arguments serve(const Arguments& more) {
    Arguments arguments = {"serve", "--no-examples", "--listen", "127.0.0.1:0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  TemporaryFolder folder;
};

const std::vector<std::string> kCommands = {"serve",  "sample", "worlds", "verify",
                                            "export", "backup", "check",  "version"};

TEST_F(CommandLine, Help_is_given_for_the_program_and_every_command_with_an_example) {
  const Ended all = run({"--help"});
  EXPECT_EQ(all.exit_code, 0);
  for (const std::string& command : kCommands) {
    EXPECT_NE(all.out.find("  " + command + " "), std::string::npos) << command;
    const Ended one = run({command, "--help"});
    EXPECT_EQ(one.exit_code, 0);
    EXPECT_NE(one.out.find("Example: retake " + command), std::string::npos) << one.out;
    EXPECT_EQ(one.err, "");
  }
  for (int code = 0; code <= static_cast<int>(Exit::unwritable); ++code)
    EXPECT_NE(all.out.find(" " + std::to_string(code) + " "), std::string::npos)
        << "no word of exit code " << code;
  EXPECT_NE(run({"version"}).out.find("retake "), std::string::npos);
  EXPECT_TRUE(json::parse(run({"version", "--json"}).out).contains("version"));
}

TEST_F(CommandLine, What_is_used_wrongly_ends_with_2) {
  for (const Arguments& arguments : std::vector<Arguments>{{},
                                                           {"dance"},
                                                           {"serve", "--nonsense"},
                                                           {"serve", "extra"},
                                                           {"serve", "--threads", "abc"},
                                                           {"serve", "--threads", "-1"},
                                                           {"serve", "--threads"},
                                                           {"serve", "--max-samples", "0"},
                                                           {"serve", "--low-water", "-1"},
                                                           {"serve", "--low-water", "99999999999999999999"},
                                                           {"serve", "--refill", "-5"},
                                                           {"serve", "--refill", "0"},
                                                           {"serve", "--allow-origin", "a.example"},
                                                           {"serve", "--allow-origin", "https://a.example/"},
                                                           {"serve", "--allow-origin", "https://a.example,*"},
                                                           {"serve", "--allow-host", "https://a.example"},
                                                           {"sample"},
                                                           {"sample", "a.json", "--count", "0"},
                                                           {"sample", "a.json", "--ess", "0"},
                                                           {"sample", "a.json", "--ess", "1001"},
                                                           {"sample", "a.json", "--seed", "-1"},
                                                           {"sample", "a.json", "--seed", "x"},
                                                           {"sample", "a.json", "--iterations", "-5"},
                                                           {"sample", "a.json", "--seconds", "-1"},
                                                           {"sample", "a.json", "--rate", "241"},
                                                           {"sample", "a.json", "--index", "-1"},
                                                           {"sample", "a.json", "--index", "4294967296"},
                                                           {"sample", "a.json", "--method", "guess"},
                                                           {"sample", "a.json", "--ratios", "no"},
                                                           {"export"},
                                                           {"export", "id"},
                                                           {"backup"},
                                                           {"check", "x", "y"},
                                                           {"worlds", "--jsn"}})
    expect_exit(2, arguments);
}

TEST_F(CommandLine, What_is_configured_wrongly_ends_with_3) {
  expect_exit(3, serve({}), {{"RETAKE_THREADS", "abc"}});
  expect_exit(3, serve({}), {{"RETAKE_LOW_WATER", "-1"}});
  expect_exit(3, {"serve", "--listen", "127.0.0.1:0"}, {{"RETAKE_NO_EXAMPLES", "perhaps"}});
  expect_exit(3, {"serve", "--listen", "0.0.0.0:0"});
  expect_exit(3, {"serve", "--listen", "[::]:0"});
  expect_exit(3, {"serve", "--listen", "example.org:80"});
  expect_exit(3, {"serve", "--listen", "127.0.0.1"});
  expect_exit(3, {"serve", "--listen", "127.0.0.1:65536"});
  expect_exit(3, {"serve", "--listen", "127.0.0.1:-1"});
  expect_exit(3, {"serve"}, {{"RETAKE_LISTEN", "0.0.0.0:0"}});
  expect_exit(3, serve({}), {{"RETAKE_ALLOW_ORIGIN", "https://a.example/"}});
  EXPECT_NE(run(serve({"--allow-origin", "a.example"})).err.find("https://game.example"), std::string::npos)
      << "the form of an origin";
  expect_exit(3, serve({"--token", "two words"}));
  expect_exit(3, serve({"--token-file", "missing"}));
  write_text(folder / "empty", "");
  expect_exit(3, serve({"--token-file", "empty"}));

  expect_exit(3, {"--config", "missing.toml", "serve"});
  for (const std::string& text :
       std::vector<std::string>{"[serve]\nthreads = \"abc\"\n", "[serve]\nnonsense = 3\n", "nonsense = 3\n",
                                "[serve]\nlisten = \"0.0.0.0:0\"\n", "[nonsense]\na = 1\n"}) {
    write_text(folder / "bad.toml", text);
    expect_exit(3, {"--config", "bad.toml", "serve"});
  }
}

TEST_F(CommandLine, A_store_that_cannot_be_used_ends_with_4) {
  write_text(folder / "text.db", "This is not a database, however long it is. " + std::string(2000, '.'));
  for (const char* command : {"check", "verify"}) {
    expect_exit(4, {command, "--store", "missing.db"});
    expect_exit(4, {command, "--store", "text.db"});
  }
  expect_exit(4, serve({"--store", "text.db"}));
  expect_exit(4, serve({"--store", "missing/folder/retake.db"}));
  std::filesystem::create_directory(folder / "folder");
  expect_exit(4, serve({"--store", "folder"}));
  expect_exit(4, {"backup", "copy.db", "--store", "missing.db"});
  EXPECT_FALSE(std::filesystem::exists(folder / "missing.db")) << "looking at a store must not make one";

  // Held by another daemon, at whatever address.
  Daemon daemon(folder.path());
  expect_exit(4, serve({"--store", (folder / "retake.db").string()}));
  EXPECT_EQ(daemon.get("/healthz").status, 200);
  EXPECT_EQ(daemon.terminate(), 0);

  // Made by a newer program.
  sqlite3* file = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "retake.db").c_str(), &file), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(file, "PRAGMA user_version = 9999", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(file);
  expect_exit(4, serve({"--store", "retake.db"}));
  expect_exit(4, {"check", "--store", "retake.db"});
}

TEST_F(CommandLine, An_address_that_cannot_be_had_ends_with_5_and_touches_no_store) {
  const Daemon daemon(folder.path());
  expect_exit(5, {"serve", "--listen", "127.0.0.1:" + std::to_string(daemon.port()), "--store", "second.db"});
  EXPECT_FALSE(std::filesystem::exists(folder / "second.db"));
}

TEST_F(CommandLine, A_flag_beats_the_environment_which_beats_the_file_which_beats_the_default) {
  write_text(folder / "retake.toml", "[serve]\nlow-water = 7\nrefill = 70\nmax-samples = 700\n");
  const auto limits = [&](const Arguments& flags, const Fields& environment, bool with_file) {
    Daemon daemon(folder.path(),
                  {.flags = flags,
                   .before_command = with_file ? Arguments{"--config", "retake.toml"} : Arguments{},
                   .environment = environment});
    const json told = daemon.get("/v1/limits").json();
    return std::vector<int>{told["low_water"], told["refill"], told["samples_per_scenario"]};
  };
  const Arguments quiet = {"--no-examples"};
  const Fields environment = {{"RETAKE_LOW_WATER", "8"}, {"RETAKE_REFILL", "80"}};
  EXPECT_EQ(limits(quiet, {}, false), (std::vector{0, 100, 1000000}));
  EXPECT_EQ(limits(quiet, {}, true), (std::vector{7, 70, 700}));
  EXPECT_EQ(limits(quiet, environment, false), (std::vector{8, 80, 1000000}));
  EXPECT_EQ(limits(quiet, environment, true), (std::vector{8, 80, 700}));
  EXPECT_EQ(limits({"--no-examples", "--low-water", "9"}, environment, true), (std::vector{9, 80, 700}));
  EXPECT_EQ(limits({"--low-water", "9"}, {{"RETAKE_NO_EXAMPLES", "true"}}, true), (std::vector{9, 70, 700}));
}

TEST_F(CommandLine, A_token_is_asked_for_on_every_route_but_health) {
  write_text(folder / "token", "from-the-file\n");
  const Daemon daemon(folder.path(), {.flags = {"--no-examples", "--token-file", "token"}});
  EXPECT_EQ(daemon.get("/v1/scenarios").status, 401);
  EXPECT_EQ(daemon.get("/v1/scenarios", {{"Authorization", "Bearer wrong"}}).status, 401);
  EXPECT_EQ(daemon.get("/v1/scenarios", {{"Authorization", "Bearer from-the-file"}}).status, 200);
  EXPECT_EQ(daemon.get("/healthz").status, 200);
}

TEST_F(CommandLine, Worlds_as_JSON_is_what_the_daemon_lists) {
  const Daemon daemon(folder.path());
  const Ended ended = run({"worlds", "--json"});
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_EQ(json::parse(ended.out), daemon.get("/v1/worlds").json());
  const Ended text = run({"worlds"});
  for (const json& world : elements(json::parse(ended.out)["worlds"]))
    EXPECT_NE(text.out.find(world["name"].get<std::string>()), std::string::npos);
}

TEST_F(CommandLine, An_empty_store_gets_the_examples_once_and_only_once) {
  std::size_t examples = 0;
  {
    Daemon daemon(folder.path(), {.flags = {}});
    std::vector<std::string> titles, listed;
    for (const json& world : elements(daemon.get("/v1/worlds").json()["worlds"]))
      for (const json& example : elements(world["examples"]))
        titles.push_back(example["title"]);
    for (const json& scenario : elements(daemon.get("/v1/scenarios?limit=100").json()["scenarios"]))
      listed.push_back(scenario["title"]);
    EXPECT_EQ(listed, titles) << "not in the order in which a person should meet them";
    examples = listed.size();
    EXPECT_GT(examples, 0);
    const std::string id = daemon.get("/v1/scenarios").json()["scenarios"][0]["id"];
    EXPECT_GT(daemon.get("/v1/scenarios/" + id + "/chains").json()["chains"].size(), 0);
    EXPECT_EQ(daemon.terminate(), 0);
  }
  std::size_t chains = 0;
  for (int start = 0; start < 2; ++start) {
    const Daemon daemon(folder.path(), {.flags = {}});
    const json scenarios = daemon.get("/v1/scenarios").json()["scenarios"];
    EXPECT_EQ(scenarios.size(), examples);
    std::size_t now = 0;
    for (const json& scenario : scenarios)
      now += daemon.get("/v1/scenarios/" + scenario["id"].get<std::string>() + "/chains")
                 .json()["chains"]
                 .size();
    EXPECT_TRUE(start == 0 || now == chains) << now << " chains instead of " << chains;
    chains = now;
  }
  TemporaryFolder empty;
  EXPECT_EQ(
      Daemon(empty.path(), {.flags = {"--no-examples"}}).get("/v1/scenarios").json()["scenarios"].size(), 0);
}

TEST_F(CommandLine, SIGTERM_and_SIGINT_drain_and_the_next_start_goes_on) {
  std::string running, paused;
  std::uint64_t reached = 0;
  {
    Daemon daemon(folder.path());
    const std::string scenario = daemon.add_scenario(wish_document(1, 1e-6));
    const auto chains = daemon.add_chains(scenario, {{"count", 2}});
    running = chains[0];
    paused = chains[1];
    daemon.post("/v1/chains/" + paused + "/pause");
    ASSERT_TRUE(wait_until([&] { return daemon.chain(running)["iteration"] > 0; }));
    reached = daemon.chain(running)["iteration"];
    EXPECT_EQ(daemon.terminate(), 0) << daemon.process().err();
  }
  {
    Daemon daemon(folder.path());
    EXPECT_EQ(daemon.chain(running)["state"], "running");
    EXPECT_EQ(daemon.chain(paused)["state"], "paused");
    EXPECT_GE(daemon.chain(running)["iteration"], reached);
    EXPECT_TRUE(wait_until([&] { return daemon.chain(running)["iteration"] > reached; }));
    daemon.process().signal_with(SIGINT);
    EXPECT_EQ(daemon.process().wait(), 0);
  }
  for (int i = 0; i < 5; ++i) {  // at once after its start
    Daemon daemon(folder.path());
    EXPECT_EQ(daemon.terminate(), 0) << daemon.process().err();
  }
}

}  // namespace
}  // namespace retake
