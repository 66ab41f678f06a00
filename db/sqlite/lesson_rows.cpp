// See lesson_rows.h.
#include "db/sqlite/lesson_rows.h"

#include <algorithm>

#include "db/errors.h"
#include "db/sqlite/scenario_rows.h"
#include "db/sqlite/seals.h"

namespace retake::database {
namespace {

std::string lessons_of_a_kind(std::string_view order) {
  return "SELECT number, " + unsound_in(lesson_seal()) +
         " FROM lesson INDEXED BY lesson_by_kind"
         " WHERE scenario = ? AND method = ? AND ratios = ? AND version = ? AND kind = ? AND went_on = 0" +
         std::string(order);
}

std::string name_of_lesson(std::uint64_t number, std::string_view scenario) {
  return "lesson " + std::to_string(number) + " of scenario " + std::string(scenario);
}

}  // namespace

std::vector<LessonRecord> load_lessons(Connection& connection, std::string_view scenario) {
  static const std::string sql =
      "SELECT " + unsound_in(lesson_seal()) + ", " + unsound_in(chain_seal(), "id", "id") +
      ", number, lesson.method, lesson.ratios, chain.id, version, kind, lesson.created_at"
      " FROM scenario CROSS JOIN lesson ON lesson.scenario = scenario.row"
      " LEFT JOIN chain ON chain.row = lesson.chain WHERE scenario.id = ? ORDER BY number";
  Query query(connection, sql, scenario);
  std::vector<LessonRecord> records;
  while (query.next()) {
    LessonRecord record;
    auto damaged = read_unsound(lesson_seal(), query);
    if (read_unsound(chain_seal(), query)) damaged = "chain";
    record.number = query.count();
    if (damaged) {
      connection.tell_damage(damage_of(name_of_lesson(record.number, scenario), *damaged));
      continue;
    }
    record.method = query.text();
    record.ratios = query.text();
    record.chain = query.text();
    record.version = static_cast<std::uint32_t>(query.count());
    record.kind = lesson_kind(query.text());
    record.created_at = query.integer();
    records.push_back(std::move(record));
  }
  return records;
}

std::optional<Lesson> load_lesson(Connection& connection, std::string_view scenario, std::uint64_t number) {
  static const std::string sql = "SELECT " + unsound_in(lesson_seal()) +
                                 ", kind, version, bytes FROM scenario"
                                 " CROSS JOIN lesson ON lesson.scenario = scenario.row"
                                 " WHERE scenario.id = ? AND number = ?";
  Query query(connection, sql, scenario, number);
  if (!query.next()) return std::nullopt;
  if (const auto column = read_unsound(lesson_seal(), query))
    throw Damaged(damage_of(name_of_lesson(number, scenario), *column));
  Lesson lesson;
  lesson.kind = lesson_kind(query.text());
  lesson.version = static_cast<std::uint32_t>(query.count());
  lesson.bytes = query.text();
  return lesson;
}

std::uint64_t load_next_lesson(Connection& connection, std::string_view scenario, std::string_view method,
                               std::string_view ratios, const std::vector<std::uint64_t>& taken) {
  const auto row = scenario_row(connection, scenario);
  if (!row) return 0;
  static const std::string newest = lessons_of_a_kind(" ORDER BY number DESC");
  static const std::string oldest = lessons_of_a_kind(" ORDER BY number");
  const auto first_of = [&](LessonKind kind, std::string_view sql,
                            const std::vector<std::uint64_t>& left_out) -> std::uint64_t {
    Query query(connection, sql, *row, method, ratios, kLessonVersion, to_string(kind));
    while (query.next()) {
      const std::uint64_t number = query.count();
      if (const auto column = read_unsound(lesson_seal(), query)) {
        connection.tell_damage(damage_of(name_of_lesson(number, scenario), *column));
      } else if (std::find(left_out.begin(), left_out.end(), number) == left_out.end()) {
        return number;
      }
    }
    return 0;
  };
  if (const auto number = first_of(LessonKind::proposal, newest, {})) return number;
  if (const auto number = first_of(LessonKind::place, oldest, taken)) return number;
  return first_of(LessonKind::unfinished, newest, {});
}

void insert_lesson(Connection& connection, std::int64_t scenario, std::int64_t chain, const Lesson& lesson) {
  std::string method, ratios;
  std::int64_t number = 0;
  {
    static const std::string next =
        "SELECT method, ratios, 1 + coalesce((SELECT max(number) FROM lesson WHERE scenario = ? AND " +
        unsound_in(lesson_seal(), "number", "number") + " IS NULL), 0) FROM chain WHERE row = ?";
    Query query(connection, next, scenario, chain);
    query.next();
    method = query.text();
    ratios = query.text();
    number = query.integer();
  }
  static const std::string sql = "INSERT " + insert_sealed(lesson_seal());
  run(connection, sql, scenario, number, method, ratios, chain, lesson.version, to_string(lesson.kind), 0,
      Blob{lesson.bytes}, now());
}

void take_lesson(Connection& connection, std::int64_t scenario, std::uint64_t number) {
  run(connection,
      "UPDATE lesson SET went_on = (kind = 'place'), seal = reseal(seal, 7, kind = 'place')"
      " WHERE scenario = ? AND number = ?",
      scenario, number);
}

void return_lesson_if_unused(Connection& connection, std::string_view chain) {
  run(connection,
      "UPDATE lesson SET went_on = 0, seal = reseal(seal, 7, 0) WHERE (scenario, number) IN"
      " (SELECT scenario, lesson FROM chain WHERE id = ? AND samples = 0)",
      chain);
}

}  // namespace retake::database
