// See lesson_rows.h.
#include "db/sqlite/lesson_rows.h"

#include <algorithm>

#include "db/sqlite/scenario_rows.h"

namespace retake::database {

std::vector<LessonRecord> load_lessons(Connection& connection, std::string_view scenario) {
  Query query(connection,
              "SELECT number, lesson.method, lesson.ratios, chain.id, version, is_place, lesson.created_at"
              " FROM scenario CROSS JOIN lesson ON lesson.scenario = scenario.row"
              " CROSS JOIN chain ON chain.row = lesson.chain WHERE scenario.id = ? ORDER BY number",
              scenario);
  std::vector<LessonRecord> records;
  while (query.next()) {
    LessonRecord record;
    record.number = query.count();
    record.method = query.text();
    record.ratios = query.text();
    record.chain = query.text();
    record.version = static_cast<std::uint32_t>(query.count());
    record.is_place = query.integer() != 0;
    record.created_at = query.integer();
    records.push_back(std::move(record));
  }
  return records;
}

std::optional<Lesson> load_lesson(Connection& connection, std::string_view scenario, std::uint64_t number) {
  Query query(connection,
              "SELECT version, is_place, bytes FROM scenario"
              " CROSS JOIN lesson ON lesson.scenario = scenario.row WHERE scenario.id = ? AND number = ?",
              scenario, number);
  if (!query.next()) return std::nullopt;
  Lesson lesson;
  lesson.version = static_cast<std::uint32_t>(query.count());
  lesson.is_place = query.integer() != 0;
  lesson.bytes = query.text();
  return lesson;
}

std::uint64_t load_next_lesson(Connection& connection, std::string_view scenario, std::string_view method,
                               std::string_view ratios, const std::vector<std::uint64_t>& taken) {
  const auto row = scenario_row(connection, scenario);
  if (!row) return 0;
  Query newest(connection,
               "SELECT number FROM lesson INDEXED BY lesson_by_kind"
               " WHERE scenario = ? AND method = ? AND ratios = ? AND version = ? AND is_place = 0"
               " AND went_on = 0 ORDER BY number DESC LIMIT 1",
               *row, method, ratios, kLessonVersion);
  if (newest.next()) return newest.count();
  Query places(connection,
               "SELECT number FROM lesson INDEXED BY lesson_by_kind"
               " WHERE scenario = ? AND method = ? AND ratios = ? AND version = ? AND is_place = 1"
               " AND went_on = 0 ORDER BY number",
               *row, method, ratios, kLessonVersion);
  while (places.next()) {
    const std::uint64_t number = places.count();
    if (std::find(taken.begin(), taken.end(), number) == taken.end()) return number;
  }
  return 0;
}

void insert_lesson(Connection& connection, std::int64_t scenario, std::int64_t chain, const Lesson& lesson) {
  run(connection,
      "INSERT INTO lesson (scenario, number, method, ratios, chain, version, is_place, bytes, created_at)"
      " SELECT ?1, 1 + coalesce((SELECT max(number) FROM lesson WHERE scenario = ?1), 0), method, ratios, ?2,"
      " ?3, ?4, ?5, ?6 FROM chain WHERE row = ?2",
      scenario, chain, lesson.version, lesson.is_place ? 1 : 0, Blob{lesson.bytes}, now());
}

void take_lesson(Connection& connection, std::int64_t scenario, std::uint64_t number) {
  run(connection, "UPDATE lesson SET went_on = is_place WHERE scenario = ? AND number = ?", scenario, number);
}

void return_lesson_if_unused(Connection& connection, std::string_view chain) {
  run(connection,
      "UPDATE lesson SET went_on = 0 WHERE (scenario, number) IN"
      " (SELECT scenario, lesson FROM chain WHERE id = ? AND samples = 0)",
      chain);
}

}  // namespace retake::database
