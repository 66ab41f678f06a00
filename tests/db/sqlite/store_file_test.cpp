// Whose file it is, who may open it, how it is migrated, copied and checked.
#include <fcntl.h>
#include <fstream>
#include <sys/wait.h>

#include <gtest/gtest.h>

#include "db/sqlite/schema.h"
#include "db/sqlite/sqlite_store.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using database::Connection;

// What the message of the StoreError says, or "opened".
std::string refusal(const std::string& path, bool read_only = false) {
  try {
    StoreOptions options;
    options.read_only = read_only;
    database::SqliteStore store(path, options);
    return "opened";
  } catch (const StoreError& error) {
    return error.what();
  }
}

void expect_refusal(const std::string& path, const std::string& reason, bool read_only = false) {
  const auto message = refusal(path, read_only);
  EXPECT_NE(message.find(reason), std::string::npos) << message;
  EXPECT_NE(message.find(path), std::string::npos) << message;
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void execute(const std::string& path, const std::string& script) {
  Connection connection(path, Connection::Access::create);
  connection.execute(script);
}

// --- Whose file --------------------------------------------------------------------------------

TEST(StoreFile, a_new_file_bears_our_marks) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file());
  EXPECT_EQ(number(directory.file(), "PRAGMA application_id"), 0x52544b45);
  EXPECT_EQ(number(directory.file(), "PRAGMA user_version"),
            static_cast<std::int64_t>(database::migrations().size()));
  Connection connection(directory.file(), Connection::Access::read);
  database::Query mode(connection, "PRAGMA journal_mode");
  mode.next();
  EXPECT_EQ(mode.text(), "wal");
}

TEST(StoreFile, every_table_is_strict) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file());
  EXPECT_EQ(
      number(directory.file(),
             "SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND type = 'table' AND NOT strict"
             " AND name NOT LIKE 'sqlite_%'"),
      0);
}

TEST(StoreFile, an_empty_file_becomes_a_store) {
  TemporaryDirectory directory;
  std::ofstream(directory.file()).flush();
  database::SqliteStore store(directory.file());
  EXPECT_TRUE(store.add_scenario(make_scenario("s")).created);
}

TEST(StoreFile, a_file_that_is_no_database_is_left_alone) {
  TemporaryDirectory directory;
  const std::string text(10'000, 'x');
  std::ofstream(directory.file()) << text;
  expect_refusal(directory.file(), "is not a Retake store");
  expect_refusal(directory.file(), "is not a Retake store", true);
  EXPECT_EQ(content(directory.file()), text);
}

TEST(StoreFile, another_programs_database_is_left_alone) {
  for (const char* script : {"CREATE TABLE mine (a)", "PRAGMA application_id = 7; CREATE TABLE mine (a)",
                             "PRAGMA user_version = 1", "PRAGMA application_id = 7"}) {
    TemporaryDirectory directory;
    execute(directory.file(), script);
    const auto before = content(directory.file());
    expect_refusal(directory.file(), "is not a Retake store");
    EXPECT_EQ(content(directory.file()), before) << script;
  }
}

TEST(StoreFile, a_newer_schema_is_refused) {
  TemporaryDirectory directory;
  { database::SqliteStore store(directory.file()); }
  execute(directory.file(), "PRAGMA user_version = 1000");
  expect_refusal(directory.file(), "was written by a newer Retake");
  expect_refusal(directory.file(), "was written by a newer Retake", true);
}

TEST(StoreFile, what_cannot_be_opened_is_named) {
  TemporaryDirectory directory;
  expect_refusal(directory.file("missing/retake.db"), "No such file or directory");
  EXPECT_NE(refusal("").find("empty"), std::string::npos);
  std::filesystem::create_directory(directory.file("folder"));
  EXPECT_NE(refusal(directory.file("folder")), "opened");
}

TEST(StoreFile, names_that_mean_something_to_sqlite_are_ordinary_files) {
  TemporaryDirectory directory;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(std::filesystem::path(directory.file()).parent_path());
  for (const char* name : {":memory:", "file:x.db?mode=memory", "100%41.db"}) {
    database::SqliteStore store(name);
    EXPECT_TRUE(std::filesystem::exists(directory.file(name))) << name;
  }
  std::filesystem::current_path(before);
}

TEST(StoreFile, everything_is_in_one_file_once_the_store_is_closed) {
  TemporaryDirectory directory;
  {
    database::SqliteStore store(directory.file());
    fill(store, 50);
    EXPECT_TRUE(std::filesystem::exists(directory.file("retake.db-wal")));
  }
  EXPECT_FALSE(std::filesystem::exists(directory.file("retake.db-wal")));
  database::SqliteStore store(directory.file());
  EXPECT_EQ(store.sample_count("s"), 50u);
}

// --- Who may open it ---------------------------------------------------------------------------

TEST(StoreFile, a_second_daemon_is_refused) {
  TemporaryDirectory directory;
  {
    database::SqliteStore store(directory.file());
    expect_refusal(directory.file(), "is in use by another daemon");
    std::filesystem::create_symlink(directory.file(), directory.file("link.db"));
    EXPECT_NE(refusal(directory.file("link.db")).find("in use"), std::string::npos);
  }
  EXPECT_EQ(refusal(directory.file()), "opened");
}

TEST(StoreFile, a_daemon_in_another_process_is_seen_and_its_death_too) {
  TemporaryDirectory directory;
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const auto child = ::fork();
  if (child == 0) {
    database::SqliteStore store(directory.file());
    [[maybe_unused]] const auto written = ::write(ready[1], "x", 1);
    ::pause();
    ::_exit(1);
  }
  char letter = 0;
  ASSERT_EQ(::read(ready[0], &letter, 1), 1);
  expect_refusal(directory.file(), "is in use by another daemon");
  EXPECT_EQ(refusal(directory.file(), true), "opened");
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(refusal(directory.file()), "opened");
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(StoreFile, a_read_only_store_sees_what_a_daemon_commits_and_writes_nothing) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file(), prompt());
  fill(store, 3);
  StoreOptions options;
  options.read_only = true;
  database::SqliteStore reader(directory.file(), options);
  EXPECT_EQ(reader.sample_count("s"), 3u);
  store.commit(make_progress("c", "s", 4, 4)).get();
  EXPECT_EQ(reader.sample_count("s"), 4u);
  EXPECT_EQ(reader.samples("s", SampleOrder::newest, 10, "").records.size(), 4u);
  EXPECT_TRUE(reader.check().empty());
  EXPECT_EQ(reader.totals().samples, 4u);
  EXPECT_EQ(reader.last_error(), "");
  EXPECT_THROW(reader.add_scenario(make_scenario("t")), StoreError);
  EXPECT_THROW(reader.delete_scenario("s"), StoreError);
  EXPECT_THROW(reader.add_chains({make_chain("e", "s")}), StoreError);
  EXPECT_THROW(reader.set_chain_state("c", ChainState::paused, "", ""), StoreError);
  EXPECT_THROW(reader.commit(make_progress("c", "s", 5, 5)), StoreError);
  EXPECT_THROW(reader.play("s", "", ""), StoreError);
}

TEST(StoreFile, a_read_only_store_needs_a_store) {
  TemporaryDirectory directory;
  expect_refusal(directory.file(), "does not exist", true);
  EXPECT_FALSE(std::filesystem::exists(directory.file()));
  std::ofstream(directory.file()).flush();
  expect_refusal(directory.file(), "is not a Retake store", true);
}

TEST(StoreFile, a_closed_store_can_be_read) {
  TemporaryDirectory directory;
  {
    database::SqliteStore store(directory.file());
    fill(store, 3);
  }
  StoreOptions options;
  options.read_only = true;
  {
    database::SqliteStore reader(directory.file(), options);
    EXPECT_EQ(reader.sample_count("s"), 3u);
  }
  database::SqliteStore store(directory.file());
  EXPECT_EQ(store.sample_count("s"), 3u);
}

// --- Migrations --------------------------------------------------------------------------------

TEST(StoreMigrations, each_script_runs_once_in_order) {
  TemporaryDirectory directory;
  const std::vector<std::string> scripts{
      "CREATE TABLE a (x INTEGER) STRICT; INSERT INTO a VALUES (1)",
      "ALTER TABLE a ADD COLUMN y INTEGER; UPDATE a SET y = x + 1",
      "CREATE TABLE b (z INTEGER) STRICT; INSERT INTO b SELECT x + y FROM a",
  };
  Connection connection(directory.file(), Connection::Access::create);
  EXPECT_EQ(database::file_state(connection, scripts), database::FileState::empty);
  database::migrate(connection, std::span(scripts).first(1));
  EXPECT_EQ(database::file_state(connection, scripts), database::FileState::older);
  database::migrate(connection, scripts);
  EXPECT_EQ(database::file_state(connection, scripts), database::FileState::current);
  EXPECT_EQ(database::file_state(connection, std::span(scripts).first(2)), database::FileState::newer);
  EXPECT_EQ(number(directory.file(), "SELECT z FROM b"), 3);
  EXPECT_EQ(number(directory.file(), "SELECT count(*) FROM a"), 1);
}

TEST(StoreMigrations, a_file_of_version_1_keeps_what_it_holds) {
  TemporaryDirectory directory;
  {
    Connection connection(directory.file(), Connection::Access::create);
    database::migrate(connection, database::migrations().first(1));
    connection.execute(R"sql(
      INSERT INTO scenario (row, id, world, world_version, title, document, created_at)
        VALUES (1, 's', 'bowling', 3, 'Old', '{}', 5);
      INSERT INTO stock (scenario, samples, unplayed) VALUES (1, 1, 1);
      INSERT INTO chain (row, id, scenario, position, seed, method, ratios, settings, state, stop_samples,
        iteration, accepted, samples, simulations, failed_simulations, simulated_seconds, run_seconds,
        iterations_per_second, ended_by, error, created_at)
        VALUES (1, 'c', 1, 2, 7, 'metropolis', 'exact', '', 'paused', 9, 11, 12, 13, 14, 15, 1.5, 2.5, 3.5,
        '', '', 6);
      INSERT INTO chain_kernel VALUES (1, 0, 'redraw', 3, 2);
      INSERT INTO checkpoint VALUES (1, x'01');
      INSERT INTO sample (row, scenario, chain, iteration, replica, weight, log_prior, log_constraint, duration,
        measures, digest, created_at) VALUES (1, 1, 1, 10, 0, 4, -1, -2, 3, '{}', 'd', 7);
      INSERT INTO sample_blob VALUES (1, x'02', x'03');)sql");
  }
  expect_refusal(directory.file(), "was written by an older Retake", true);
  database::SqliteStore store(directory.file(), prompt());
  EXPECT_EQ(number(directory.file(), "PRAGMA user_version"),
            static_cast<std::int64_t>(database::migrations().size()));
  EXPECT_TRUE(store.check().empty());
  const auto chain = store.chain("c").value();
  EXPECT_EQ(chain.index, 2u);
  EXPECT_EQ(chain.stop.samples, 9u);
  EXPECT_EQ(chain.counters.simulations, 14u);
  EXPECT_EQ(chain.counters.iterations_per_second, 3.5);
  EXPECT_EQ(chain.counters.kernels.at(0).proposed, 3u);
  EXPECT_EQ(store.sample("c-10")->weight, 4u);
  EXPECT_EQ(store.checkpoint("c"), "");

  // What it did not know is empty, and can be filled.
  EXPECT_FALSE(chain.stop.ess || chain.counters.effective_samples || chain.counters.is_learning);
  EXPECT_EQ(chain.counters.skipped_seconds, 0);
  EXPECT_EQ(chain.counters.counted, 1u);
  EXPECT_EQ(chain.lesson, 0u);
  EXPECT_EQ(chain.counters.odds.basis, OddsBasis::none);
  EXPECT_TRUE(chain.counters.rungs.empty());
  EXPECT_EQ(store.scenarios_without_pilot(), (std::vector<std::string>{"s"}));
  auto progress = make_progress("c", "s", 20, 20);
  progress.counters.odds = {OddsBasis::rejection, 20, 2, 2, 2, 1};
  progress.counters.rungs = {{0.5, 1, 1}};
  EXPECT_EQ(store.commit(progress).get(), 2u);
  EXPECT_EQ(store.scenario("s")->odds.hits, 2u);
  EXPECT_EQ(store.chain("c")->counters.rungs.size(), 1u);
}

// What was damaged before cells were sealed is not sealed as if it were sound.
TEST(StoreMigrations, a_file_of_every_earlier_version_opens_and_what_cannot_be_true_in_it_is_named) {
  for (std::size_t version = 1; version < database::migrations().size(); ++version) {
    SCOPED_TRACE(version);
    TemporaryDirectory directory;
    {
      Connection connection(directory.file(), Connection::Access::create);
      database::migrate(connection, database::migrations().first(version));
      connection.execute(R"sql(
        INSERT INTO scenario (row, id, world, world_version, title, document, created_at)
          VALUES (1, 's', 'bowling', 3, 'Old', '{}', 5), (2, 't', 'bowling', 3, 'Bent', '{', 5);
        INSERT INTO chain (row, id, scenario, position, seed, method, ratios, settings, state, iteration,
          accepted, samples, simulations, failed_simulations, simulated_seconds, run_seconds,
          iterations_per_second, ended_by, error, created_at)
          VALUES (1, 'c', 1, 2, 7, 'metropolis', 'exact', '', 'paused', 11, 12, 13, 14, 15, 1.5, 2.5, 3.5, '', '', 6),
                 (2, 'd', 1, 2, 7, 'metropolix', 'exact', '', 'running', 11, 12, 13, 14, 15, 1.5, 2.5, 3.5, '', '', 6);
        INSERT INTO sample (row, scenario, chain, iteration, replica, weight, log_prior, log_constraint, duration,
          measures, digest, created_at) VALUES (1, 1, 1, 10, 0, 4, -1, -2, 3, '{}', 'd', 7),
          (2, 1, 1, 11, 0, -5, -1, -2, 3, '{}', 'd', 7), (3, 1, 1, 12, 0, 1, -1, -2, 3, '{', 'd', 7);
        INSERT INTO sample_blob VALUES (1, x'02', x'03'), (2, x'02', x'03'), (3, x'02', x'03'))sql");
      connection.execute(version < 3
                             ? "INSERT INTO stock (scenario, samples, unplayed) VALUES (1, 3, 3), (2, 0, 0)"
                             : "INSERT INTO stock (scenario, samples, counted, unplayed, even, weight)"
                               " VALUES (1, 3, 3, 3, 3, 0), (2, 0, 0, 0, 0, 0)");
    }
    database::SqliteStore store(directory.file(), prompt());
    std::string faults;
    for (const auto& line : store.check())
      faults += line + "\n";
    for (const char* named : {"scenario t is damaged: document", "chain d is damaged: method",
                              "sample c-11 is damaged: weight", "sample c-12 is damaged: measures"})
      EXPECT_NE(faults.find(named), std::string::npos) << named << " is not in\n" << faults;
    EXPECT_EQ(store.scenarios(10, "").records.size(), 1u);
    EXPECT_EQ(store.chains("s").size(), 1u);
    EXPECT_EQ(ids_of(store.samples("s", SampleOrder::oldest, 10, "").records),
              std::vector<std::string>{"c-10"});
    EXPECT_EQ(store.play("s", "alice", "")->sample.id, "c-10");
    EXPECT_FALSE(store.play("s", "alice", "", Repeats::refused));
    EXPECT_EQ(store.scenario("s")->failed, 1u);
  }
}

TEST(StoreMigrations, a_script_that_fails_leaves_the_file_as_it_was) {
  TemporaryDirectory directory;
  Connection connection(directory.file(), Connection::Access::create);
  const std::vector<std::string> scripts{"CREATE TABLE a (x INTEGER) STRICT",
                                         "CREATE TABLE b (x); DROP TABLE none"};
  database::migrate(connection, std::span(scripts).first(1));
  EXPECT_THROW(database::migrate(connection, scripts), database::DatabaseError);
  EXPECT_EQ(database::file_state(connection, scripts), database::FileState::older);
  EXPECT_EQ(number(directory.file(), "SELECT count(*) FROM sqlite_schema"), 1);
}

TEST(StoreMigrations, a_script_that_breaks_references_is_undone) {
  TemporaryDirectory directory;
  Connection connection(directory.file(), Connection::Access::create);
  const std::vector<std::string> scripts{
      "CREATE TABLE a (x INTEGER PRIMARY KEY) STRICT; CREATE TABLE b (x INTEGER REFERENCES a) STRICT;"
      "INSERT INTO a VALUES (1); INSERT INTO b VALUES (1)",
      "DELETE FROM a"};
  database::migrate(connection, std::span(scripts).first(1));
  EXPECT_THROW(database::migrate(connection, scripts), database::DatabaseError);
  EXPECT_EQ(number(directory.file(), "SELECT count(*) FROM a"), 1);
}

// --- Backup ------------------------------------------------------------------------------------

TEST(StoreBackup, a_copy_is_a_store_of_its_own) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file());
  fill(store, 100);
  store.play("s", "alice", "");
  store.backup(directory.file("copy.db"));
  int copies = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(directory.file()).parent_path())) {
    copies += entry.path().filename().string().rfind("copy", 0) == 0 ? 1 : 0;
  }
  EXPECT_EQ(copies, 1);
  database::SqliteStore copy(directory.file("copy.db"));
  EXPECT_EQ(copy.sample_count("s"), 100u);
  EXPECT_EQ(copy.sample_animation("c-77"), "animation of 77");
  EXPECT_EQ(copy.play("s", "alice", "")->sample.id, "c-2");
  EXPECT_TRUE(copy.check().empty());
}

TEST(StoreBackup, an_existing_file_is_not_touched) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file());
  std::ofstream(directory.file("copy.db")) << "precious";
  EXPECT_THROW(store.backup(directory.file("copy.db")), StoreError);
  EXPECT_THROW(store.backup(directory.file()), StoreError);
  EXPECT_EQ(content(directory.file("copy.db")), "precious");
}

TEST(StoreBackup, a_copy_that_cannot_be_written_leaves_nothing_behind) {
  TemporaryDirectory directory;
  database::SqliteStore store(directory.file());
  EXPECT_THROW(store.backup(directory.file("missing/copy.db")), StoreError);
  EXPECT_THROW(store.backup("/dev/full/copy.db"), StoreError);
  EXPECT_EQ(store.last_error(), "");
}

// --- Check -------------------------------------------------------------------------------------

class StoreCheck : public testing::Test {
 protected:
  // Faults found after somebody has meddled with the tables.
  std::vector<std::string> faults_after(const std::string& script) {
    TemporaryDirectory directory;
    {
      database::SqliteStore store(directory.file());
      fill(store, 10);
      store.play("s", "alice", "");
    }
    execute(directory.file(), script);
    return database::SqliteStore(directory.file()).check();
  }
};

TEST_F(StoreCheck, a_sound_store_has_no_faults) {
  EXPECT_TRUE(faults_after("").empty());
}

TEST_F(StoreCheck, a_wrong_count_is_found) {
  EXPECT_EQ(faults_after("UPDATE stock SET samples = 11").size(), 1u);
  EXPECT_EQ(faults_after("UPDATE stock SET unplayed = 3").size(), 1u);
  EXPECT_EQ(faults_after("UPDATE player SET seen = 4").size(), 1u);
}

TEST_F(StoreCheck, a_missing_blob_is_found) {
  const auto faults = faults_after("DELETE FROM sample_blob WHERE sample = 3");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].find("sample 3"), std::string::npos) << faults[0];
}

TEST_F(StoreCheck, a_dangling_reference_is_found) {
  const auto faults = faults_after("INSERT INTO sample_blob VALUES (999, x'00', x'00')");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].find("sample_blob"), std::string::npos) << faults[0];
}

TEST_F(StoreCheck, a_scenario_without_stock_is_found) {
  EXPECT_EQ(faults_after("DELETE FROM stock").size(), 1u);
}

TEST_F(StoreCheck, damaged_pages_are_found) {
  TemporaryDirectory directory;
  {
    database::SqliteStore store(directory.file());
    fill(store, 2000);
  }
  {
    std::fstream file(directory.file(), std::ios::in | std::ios::out | std::ios::binary);
    const auto pages = static_cast<std::streamoff>(std::filesystem::file_size(directory.file()) / 4096);
    for (std::streamoff page = 30; page < pages; page += 7) {
      file.seekp(page * 4096);
      file << std::string(600, '\x5a');
    }
  }
  StoreOptions options;
  options.read_only = true;
  EXPECT_FALSE(database::SqliteStore(directory.file(), options).check().empty());
}

}  // namespace
}  // namespace retake::test
