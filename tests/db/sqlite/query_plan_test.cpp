// No request's cost may grow with the stock: every statement that serves one is answered by an index.
#include <set>

#include <gtest/gtest.h>

#include "db/sqlite/chain_rows.h"
#include "db/sqlite/lesson_rows.h"
#include "db/sqlite/play_rows.h"
#include "db/sqlite/sample_rows.h"
#include "db/sqlite/scenario_rows.h"
#include "db/sqlite/sqlite_store.h"
#include "db/sqlite/store_file.h"
#include "tests/db/fixture.h"

namespace retake::test {
namespace {

using database::Connection;

// What SQLite says of how it runs the statement, one line a step.
std::vector<std::string> plan(Connection& connection, const std::string& sql) {
  static std::set<std::string> kept;  // a connection refers to the texts of its statements
  const auto& explain = *kept.insert("EXPLAIN QUERY PLAN " + sql).first;
  std::vector<std::string> steps;
  {
    database::Query query(connection, explain);
    while (query.next()) {
      query.integer();
      query.integer();
      query.integer();
      steps.push_back(query.text());
    }
  }
  return steps;
}

bool begins_with(const std::string& text, std::string_view start) {
  return text.rfind(start, 0) == 0;
}

TEST(StoreQueryPlans, every_statement_of_a_request_goes_by_an_index) {
  TemporaryDirectory directory;
  {
    database::SqliteStore store(directory.file());
    fill(store, 300);
  }
  auto connection = database::open_to_write(directory.file());
  database::Transaction transaction(*connection, database::Transaction::Kind::write);
  database::PlayerFrontiers frontiers;

  // Everything that requests and chains run.
  database::load_scenario(*connection, "s");
  database::load_scenarios(*connection, 10, "");
  database::load_world_of(*connection, "s");
  database::count_samples(*connection, "s");
  database::load_scenarios_without_pilot(*connection);
  database::write_pilot(*connection, "s", {});
  database::insert_scenario(*connection, make_scenario("t"));
  database::insert_chain(*connection, [] {
    auto chain = make_chain("d", "t");
    chain.lesson = 1;
    return chain;
  }());
  database::load_chain(*connection, "c");
  database::load_chains(*connection, "s");
  database::load_checkpoint(*connection, "c");
  database::load_trace(*connection, "c");
  database::load_lessons(*connection, "s");
  database::load_lesson(*connection, "s", 1);
  database::load_next_lesson(*connection, "s", "metropolis", "exact", {});
  database::load_same_chain(*connection, make_chain("", "s"), 1);
  database::update_chain_stop(*connection, "c", {.samples = 1});
  database::update_chain_state(*connection, "c", ChainState::finished, "", "");
  database::update_chain_state(*connection, "c", ChainState::paused, "", "");
  auto progress = make_progress("c", "s", 300, 301);
  progress.weights = {{1, 0, 2}};
  progress.trace_block = "block";
  progress.replace_trace = true;
  progress.counters.kernels = {{"redraw", 1, 1}};
  progress.counters.rungs = {{0, 1, 1}};
  progress.lesson = Lesson{.bytes = "lesson"};
  database::write_progress(*connection, progress);
  database::load_sample(*connection, "c-1");
  database::load_state(*connection, "c-1");
  database::load_animation(*connection, "c-1");
  for (const auto order : {SampleOrder::newest, SampleOrder::oldest, SampleOrder::likely}) {
    const auto page = database::load_samples(*connection, "s", order, 10, "");
    database::load_samples(*connection, "s", order, 10, page.next_cursor);
  }
  database::load_draws(*connection, "c", 10, 0);
  for (int play = 0; play < 700; ++play)
    database::write_play(*connection, frontiers, {"s", "alice"});
  database::write_play(*connection, frontiers, {"s", "", "key"});
  database::write_play(*connection, frontiers, {"s", "", "key"});
  for (int play = 0; play < 400; ++play) {
    database::write_play(*connection, frontiers, {"s", play % 2 == 0 ? "bob" : ""});
  }
  database::delete_scenario(*connection, "t");
  while (database::purge(*connection)) {
  }

  const auto statements = connection->prepared_statements();
  EXPECT_GT(statements.size(), 61u);
  for (const auto& sql : statements) {
    if (begins_with(sql, "PRAGMA")) continue;
    for (const auto& step : plan(*connection, sql)) {
      EXPECT_FALSE(begins_with(step, "SCAN") && !begins_with(step, "SCAN CONSTANT ROW")) << step << "\n"
                                                                                         << sql;
      EXPECT_FALSE(begins_with(step, "USE TEMP B-TREE")) << step << "\n" << sql;
      EXPECT_EQ(step.find("AUTOMATIC"), std::string::npos) << step << "\n" << sql;
    }
  }
}

// The plan of the statement that contains the text.
std::string plan_of(Connection& connection, const std::string& text) {
  for (const auto& sql : connection.prepared_statements()) {
    if (!begins_with(sql, "EXPLAIN") && sql.find(text) != std::string::npos)
      return plan(connection, sql).at(0);
  }
  return "no such statement";
}

TEST(StoreQueryPlans, the_searches_use_every_column_of_their_index) {
  TemporaryDirectory directory;
  {
    database::SqliteStore store(directory.file());
    fill(store, 200);
  }
  auto connection = database::open_to_write(directory.file());
  database::Transaction transaction(*connection, database::Transaction::Kind::write);
  database::PlayerFrontiers frontiers;
  for (int play = 0; play < 300; ++play) {
    database::write_play(*connection, frontiers, {"s", play % 3 == 0 ? "bob" : "alice"});
  }
  for (const auto order : {SampleOrder::newest, SampleOrder::oldest, SampleOrder::likely}) {
    database::load_samples(*connection, "s", order, 10, "");
  }
  database::load_draws(*connection, "c", 10, 0);
  EXPECT_EQ(
      plan_of(*connection, "plays = ? AND row >= ?"),
      "SEARCH sample USING COVERING INDEX sample_by_shelf (scenario=? AND shelf=? AND plays=? AND rowid>?)");
  EXPECT_EQ(plan_of(*connection, "plays > ?"),
            "SEARCH sample USING COVERING INDEX sample_by_shelf (scenario=? AND shelf=? AND plays>?)");
  EXPECT_EQ(plan_of(*connection, "sample.scenario = ? AND sample.row < ?"),
            "SEARCH sample USING INDEX sample_by_scenario (scenario=? AND rowid<?)");
  EXPECT_EQ(plan_of(*connection, "sample.scenario = ? AND sample.row > ?"),
            "SEARCH sample USING INDEX sample_by_scenario (scenario=? AND rowid>?)");
  EXPECT_EQ(plan_of(*connection, "log_target = ? AND sample.row < ?"),
            "SEARCH sample USING INDEX sample_by_log_target (scenario=? AND log_target=? AND rowid<?)");
  EXPECT_EQ(plan_of(*connection, "log_target < ?"),
            "SEARCH sample USING INDEX sample_by_log_target (scenario=? AND log_target<?)");
  EXPECT_EQ(plan_of(*connection, "SELECT row, weight FROM"),
            "SEARCH sample USING COVERING INDEX sample_by_weight (chain=? AND iteration>?)");
}

}  // namespace
}  // namespace retake::test
