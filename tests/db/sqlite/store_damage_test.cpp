// Every cell of every table is damaged in several ways: `check` names it, the store opens, what is told is
// what was written, and everything else goes on.
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "db/sqlite/schema.h"
#include "db/sqlite/sqlite_store.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using database::Connection;
using database::Query;
using database::SqliteStore;

/// A store with a row in every table, of the scenario "s", and another scenario "t" that nobody touches.
void fill_every_table(Store& store) {
  fill(store, 10);
  store.set_pilot("s", {.draws = 100, .hits = 3, .seconds = 0.5});
  auto progress = make_progress("c", "s", 11, 12);
  progress.weights = {{1, 0, 3}};
  progress.counters.kernels = {{"redraw", 5, 4}};
  progress.counters.rungs = {{0.5, 7, 6}};
  progress.counters.odds = {OddsBasis::rejection, 20, 2, 2, 2, 1};
  progress.counters.first_sample_iteration = 1;
  progress.counters.first_sample_seconds = 0.25;
  progress.counters.effective_samples = 8;
  progress.lesson = Lesson{.bytes = "lesson"};
  progress.trace_block = "block";
  progress.state = ChainState::paused;
  store.commit(progress).get();
  store.set_chain_stop("c", {.samples = 100, .counted = 90, .iterations = 1000, .seconds = 60, .ess = 50});
  store.play("s", "alice", "key");
  store.play("s", "alice", "");
  store.play("s", "", "");
  store.add_scenario(make_scenario("t"));
  store.add_chains({make_chain("d", "t")});
  store.commit(make_progress("d", "t", 1, 5)).get();
}

std::string text_of(const ScenarioRecord& record) {
  return record.id + "|" + record.world + "|" + std::to_string(record.world_version) + "|" + record.title +
         "|" + record.document + "|" + std::to_string(record.created_at) + "|" +
         std::to_string(record.samples) + "|" +
         (record.pilot ? std::to_string(record.pilot->draws) + "|" + std::to_string(record.pilot->hits) +
                             "|" + std::to_string(record.pilot->seconds)
                       : "");
}

std::string text_of(const ChainRecord& record) {
  std::string text = record.id + "|" + record.scenario + "|" + std::to_string(record.index) + "|" +
                     std::to_string(record.seed) + "|" + record.method + "|" + record.ratios + "|" +
                     record.settings + "|" + std::to_string(record.lesson) + "|" +
                     std::string(to_string(record.state)) + "|" + record.ended_by + "|" + record.error + "|" +
                     std::to_string(record.created_at) + "|" + std::to_string(record.attempts);
  StopRule stop = record.stop;
  visit_limits(
      [&](std::string_view, const auto& limit) { text += limit ? "|" + std::to_string(*limit) : "|"; }, stop);
  visit_counters(record.counters, [&](const char*, auto value) { text += "|" + std::to_string(value); });
  text += "|" + std::to_string(record.counters.counted) + "|" + std::to_string(record.counters.odds.hits);
  return text;
}

/// Without its plays, which go on.
std::string text_of(const SampleRecord& record) {
  return record.id + "|" + record.scenario + "|" + record.chain + "|" + std::to_string(record.iteration) +
         "|" + std::to_string(record.replica) + "|" + std::to_string(record.weight) + "|" +
         std::to_string(record.log_prior) + "|" + std::to_string(record.log_constraint) + "|" +
         std::to_string(record.duration) + "|" + record.measures + "|" + record.digest + "|" +
         std::to_string(record.created_at);
}

/// What the store tells, by what it is of.
class Told {
 public:
  explicit Told(const Store& store) {
    for (const auto& scenario : store.scenarios(100, "").records) {
      facts_["scenario " + scenario.id] = text_of(scenario);
      for (const auto& chain : attempt([&] { return store.chains(scenario.id); })) {
        facts_["chain " + chain.id] = text_of(chain);
        for (const auto& kernel : chain.counters.kernels)
          facts_["kernel " + kernel.name] =
              std::to_string(kernel.proposed) + "|" + std::to_string(kernel.accepted);
        for (const auto& rung : chain.counters.rungs)
          facts_["rung " + std::to_string(rung.beta)] =
              std::to_string(rung.proposed) + "|" + std::to_string(rung.accepted);
        facts_["checkpoint of " + chain.id] = attempt([&] { return store.checkpoint(chain.id); });
        for (const auto& block : attempt([&] { return store.trace(chain.id); }))
          facts_["block " + block] = block;
        for (const auto& draw : attempt([&] { return store.draws(chain.id, 1000); }))
          facts_["draw " + chain.id + std::to_string(draw.iteration)] =
              draw.measures + "|" + draw.state + "|" + std::to_string(draw.log_prior);
      }
      for (const auto& lesson : attempt([&] { return store.lessons(scenario.id); })) {
        facts_["lesson " + scenario.id + std::to_string(lesson.number)] =
            lesson.method + "|" + lesson.ratios + "|" + lesson.chain + "|" + std::to_string(lesson.version);
        const auto whole = attempt([&] { return store.lesson(scenario.id, lesson.number); });
        if (whole) facts_["bytes of lesson " + std::to_string(lesson.number)] = whole->bytes;
      }
    }
    for (const char* scenario : {"s", "t"})
      for (const auto order : {SampleOrder::newest, SampleOrder::oldest, SampleOrder::likely})
        for (const auto& sample : attempt([&] { return store.samples(scenario, order, 100, ""); }).records) {
          facts_["sample " + sample.id] = text_of(sample);
          facts_["plays of " + sample.id] = std::to_string(sample.plays);
          if (const auto state = attempt([&] { return store.sample_state(sample.id); }))
            facts_["state of " + sample.id] = *state;
          if (const auto animation = attempt([&] { return store.sample_animation(sample.id); }))
            facts_["animation of " + sample.id] = *animation;
        }
  }
  const std::map<std::string, std::string>& facts() const { return facts_; }

 private:
  /// What is damaged is not told.
  template <typename Ask>
  static auto attempt(Ask ask) -> decltype(ask()) {
    try {
      return ask();
    } catch (const Damaged&) {
      return {};
    }
  }
  std::map<std::string, std::string> facts_;
};

struct Cell {
  std::string table, column, type;
};

/// Every stored cell of the schema. The number of a row is no cell: it is the place of the row in the file.
std::vector<Cell> cells_of(const std::string& path) {
  std::vector<Cell> cells;
  Connection connection(path, Connection::Access::read);
  Query query(connection,
              "SELECT m.name, c.name, c.type FROM sqlite_schema m, pragma_table_xinfo(m.name) c"
              " WHERE m.type = 'table' AND m.name NOT LIKE 'sqlite_%' AND c.hidden = 0"
              " AND c.name <> 'row'");
  while (query.next())
    cells.push_back({query.text(), query.text(), query.text()});
  return cells;
}

/// What is put into a cell, as SQL.
std::vector<std::string> damages_to(const Cell& cell) {
  if (cell.type == "INTEGER")
    return {"-5", "9223372036854775807", cell.column + " + 1", "'nobody'", "NULL", "1.5"};
  if (cell.type == "REAL") return {"-1e300", "1e300", cell.column + " + 1", "'nobody'", "NULL", "x'00'"};
  if (cell.type == "TEXT") return {"'{'", "'nobody'", "x'00'", "NULL"};
  return {"CAST('A' || substr(" + cell.column + ", 2) AS BLOB)", "substr(" + cell.column + ", 2)", "x''", "7",
          "NULL"};
}

/// Which row of a table is damaged: the first one.
std::string first_row(const std::string& table) {
  if (table == "seen") return "sample = (SELECT min(sample) FROM seen)";
  if (table == "chain_kernel" || table == "chain_rung" || table == "idempotency") return "1";  // it has one
  return "rowid = (SELECT min(rowid) FROM " + table + ")";
}

/// Puts it into a cell, as a disk does that knows no constraints.
void damage(const std::string& path, const Cell& cell, const std::string& value) {
  Connection connection(path, Connection::Access::write);
  connection.execute(
      "PRAGMA writable_schema = ON;"
      "CREATE TEMP TABLE schema_before AS SELECT name, sql FROM sqlite_schema;"
      "UPDATE sqlite_schema SET sql = replace(replace(replace(sql, 'STRICT, WITHOUT', 'WITHOUT'), ') STRICT',"
      " ')'), 'NOT NULL', '') WHERE type = 'table' AND name NOT LIKE 'sqlite_%'");
  try {
    Connection lax(path, Connection::Access::write);
    lax.execute("PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = ON; UPDATE " + cell.table +
                " SET " + cell.column + " = " + value + " WHERE " + first_row(cell.table));
  } catch (const database::DatabaseError&) {
    // Another row has that key already, or the key of a row cannot be that.
  }
  connection.execute(
      "UPDATE sqlite_master SET sql = (SELECT sql FROM schema_before WHERE schema_before.name = "
      "sqlite_master.name)"
      " WHERE type = 'table' AND name NOT LIKE 'sqlite_%'; PRAGMA writable_schema = OFF");
}

class StoreDamage : public testing::Test {
 protected:
  StoreDamage() {
    {
      SqliteStore store(directory.file("sound.db"), prompt());
      fill_every_table(store);
      sound = Told(store).facts();
    }
  }
  /// A copy of the sound store.
  std::string copy() const {
    std::filesystem::copy_file(directory.file("sound.db"), directory.file(),
                               std::filesystem::copy_options::overwrite_existing);
    return directory.file();
  }
  static std::vector<std::string> faults(const std::string& path) {
    StoreOptions options;
    options.read_only = true;
    return SqliteStore(path, options).check();
  }

  TemporaryDirectory directory;
  std::map<std::string, std::string> sound;
};

/// Facts of a store that are not those of a sound one.
std::string lies(const std::map<std::string, std::string>& told,
                 const std::map<std::string, std::string>& sound) {
  std::string lies;
  for (const auto& [name, fact] : told) {
    const auto known = sound.find(name);
    if (fact.empty()) continue;
    // A chain of no known state has failed, which is true.
    if (fact.find("|failed||chain c is damaged: state") != std::string::npos) continue;
    if (known == sound.end())
      lies += name + " is not known: " + fact + "\n";
    else if (known->second != fact)
      lies += name + " is " + known->second + ", not " + fact + "\n";
  }
  return lies;
}

TEST_F(StoreDamage, a_sound_store_tells_everything) {
  const std::string path = copy();
  EXPECT_TRUE(faults(path).empty());
  EXPECT_EQ(Told(SqliteStore(path)).facts(), sound);
  EXPECT_TRUE(SqliteStore(path).damages().empty());
}

TEST_F(StoreDamage, no_damaged_cell_hides_anything_else_or_is_told_as_true) {
  const std::vector<Cell> cells = cells_of(directory.file("sound.db"));
  EXPECT_GT(cells.size(), 90u);
  std::size_t damaged = 0;
  for (const Cell& cell : cells) {
    if (cell.table == "flush") continue;  // it counts nothing
    for (const std::string& value : damages_to(cell)) {
      const std::string path = copy();
      const std::string before = "UPDATE " + cell.table + " SET " + cell.column + " = " + value;
      SCOPED_TRACE(before);
      damage(path, cell, value);
      const auto named = faults(path);
      // Rewriting a cell with what it held already is no damage.
      if (named.empty() && Told(SqliteStore(path)).facts() == sound) continue;
      ++damaged;
      EXPECT_FALSE(named.empty());

      SqliteStore store(path, prompt());
      const auto told = Told(store).facts();
      EXPECT_EQ(lies(told, sound), "");

      // Whatever is of the other scenario is there.
      for (const auto& [name, fact] : sound)
        if (name.ends_with(" t") || name.ends_with(" d") || name.find(" d-") != std::string::npos) {
          EXPECT_TRUE(told.contains(name)) << name;
        }
      EXPECT_EQ(store.commit(make_progress("d", "t", 6, 7)).get(), 7u);
      for (int play = 0; play < 7; ++play) {
        const auto given = store.play("t", "bob", "");
        ASSERT_TRUE(given);
        EXPECT_FALSE(given->repeat);
      }

      // Whose name is not known is not found, nor what is named after it.
      const bool is_nameless = (cell.table == "scenario" || cell.table == "chain") &&
                               (cell.column == "id" || cell.column == "seal");
      // A player is given what is sound, and nothing else.
      std::set<std::string> given;
      try {
        while (const auto play = store.play("s", "carol", "", Repeats::refused)) {
          EXPECT_TRUE(given.insert(play->sample.id).second) << play->sample.id;
          EXPECT_EQ(text_of(play->sample), sound.at("sample " + play->sample.id));
          EXPECT_LT(play->remaining, 13u);
          if (given.size() > 20) break;
        }
        for (int play = 0; play < 20; ++play)
          if (const auto any = store.play("s", "", "")) {
            EXPECT_EQ(text_of(any->sample), sound.at("sample " + any->sample.id));
          }
        store.play("s", "alice", "");
      } catch (const Damaged&) {
        EXPECT_TRUE(is_nameless && cell.table == "scenario");
      }
      if (!is_nameless) {
        EXPECT_GE(given.size(), cell.table.starts_with("sample") ? 11u : 12u);
      }
      EXPECT_EQ(store.last_error(), "");
    }
  }
  EXPECT_GT(damaged, 400u);
}

TEST_F(StoreDamage, a_chain_that_would_be_taken_up_has_failed_whatever_cell_of_it_is_damaged) {
  SqliteStore(directory.file("sound.db"), prompt()).set_chain_state("c", ChainState::running, "", "");
  for (const Cell& cell : cells_of(directory.file("sound.db"))) {
    if (cell.table != "chain" || std::set<std::string>{"id", "scenario", "state"}.contains(cell.column))
      continue;
    for (const std::string& value : damages_to(cell)) {
      SCOPED_TRACE(cell.column + " = " + value);
      const std::string path = copy();
      damage(path, cell, value);
      if (faults(path).empty()) continue;  // it is what it was
      const SqliteStore store(path, prompt());
      EXPECT_EQ(store.scenario("s")->failed, 1u);
      EXPECT_EQ(store.scenario("s")->running, 0u);
    }
  }
}

TEST_F(StoreDamage, pages_of_chains_are_filled_with_those_that_are_sound) {
  {
    SqliteStore store(directory.file("sound.db"), prompt());
    for (const char* id : {"e", "f", "g", "h"})
      store.add_chains({make_chain(id, "s")});
  }
  for (const char* damaged : {"c", "f", "h"})
    Connection(directory.file("sound.db"), Connection::Access::write)
        .execute(std::string("UPDATE chain SET seed = seed + 1 WHERE id = '") + damaged + "'");
  const SqliteStore store(directory.file("sound.db"), prompt());
  for (const std::size_t limit : {1u, 2u, 3u}) {
    std::vector<std::string> ids;
    std::string cursor;
    do {
      const auto page = store.chains("s", limit, cursor);
      if (!page.next_cursor.empty()) {
        EXPECT_EQ(page.records.size(), limit);
      }
      for (const auto& chain : page.records)
        ids.push_back(chain.id);
      cursor = page.next_cursor;
    } while (!cursor.empty());
    EXPECT_EQ(ids, (std::vector<std::string>{"e", "g"})) << limit;
  }
  EXPECT_EQ(store.damages().size(), 3u);
}

TEST_F(StoreDamage, attempts_are_sealed_as_they_are_counted_and_no_count_makes_damaged_ones_sound) {
  const std::string path = copy();
  {
    SqliteStore store(path, prompt());
    for (std::uint64_t attempts = 1; attempts <= 3; ++attempts) {
      store.set_chain_state("c", ChainState::running, "", "");
      EXPECT_EQ(store.chain("c")->attempts, attempts);
    }
    EXPECT_EQ(store.check(), std::vector<std::string>{});
    store.commit(make_progress("c", "s", 13, 13)).get();
    EXPECT_EQ(store.chain("c")->attempts, 0u);
    EXPECT_EQ(store.check(), std::vector<std::string>{});
    store.set_chain_state("c", ChainState::paused, "", "");
  }
  Connection(path, Connection::Access::write).execute("UPDATE chain SET attempts = 2 WHERE id = 'c'");
  SqliteStore store(path, prompt());
  store.set_chain_state("c", ChainState::running, "", "");
  EXPECT_THROW(store.chain("c"), Damaged);
  EXPECT_EQ(store.check(), std::vector<std::string>{"chain c is damaged: attempts is not what was written"});
}

}  // namespace
}  // namespace retake::test
