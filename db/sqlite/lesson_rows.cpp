// See lesson_rows.h.
#include "db/sqlite/lesson_rows.h"

#include <algorithm>

#include "db/sqlite/scenario_rows.h"

namespace retake::database {
namespace {

#define LESSONS_OF_A_KIND                               \
  "SELECT number FROM lesson INDEXED BY lesson_by_kind" \
  " WHERE scenario = ? AND method = ? AND ratios = ? AND version = ? AND kind = ? AND went_on = 0"
constexpr const char* kNewest = LESSONS_OF_A_KIND " ORDER BY number DESC";
constexpr const char* kOldest = LESSONS_OF_A_KIND " ORDER BY number";
#undef LESSONS_OF_A_KIND

}  // namespace

std::vector<LessonRecord> load_lessons(Connection& connection, std::string_view scenario) {
  Query query(connection,
              "SELECT number, lesson.method, lesson.ratios, chain.id, version, kind, lesson.created_at"
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
    record.kind = lesson_kind(query.text());
    record.created_at = query.integer();
    records.push_back(std::move(record));
  }
  return records;
}

std::optional<Lesson> load_lesson(Connection& connection, std::string_view scenario, std::uint64_t number) {
  Query query(connection,
              "SELECT kind, version, bytes FROM scenario"
              " CROSS JOIN lesson ON lesson.scenario = scenario.row WHERE scenario.id = ? AND number = ?",
              scenario, number);
  if (!query.next()) return std::nullopt;
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
  const auto of_kind = [&](LessonKind kind, std::string_view sql) {
    return Query(connection, sql, *row, method, ratios, kLessonVersion, to_string(kind));
  };
  if (Query newest = of_kind(LessonKind::proposal, kNewest); newest.next()) return newest.count();
  for (Query places = of_kind(LessonKind::place, kOldest); places.next();) {
    const std::uint64_t number = places.count();
    if (std::find(taken.begin(), taken.end(), number) == taken.end()) return number;
  }
  if (Query newest = of_kind(LessonKind::unfinished, kNewest); newest.next()) return newest.count();
  return 0;
}

void insert_lesson(Connection& connection, std::int64_t scenario, std::int64_t chain, const Lesson& lesson) {
  run(connection,
      "INSERT INTO lesson (scenario, number, method, ratios, chain, version, kind, bytes, created_at)"
      " SELECT ?1, 1 + coalesce((SELECT max(number) FROM lesson WHERE scenario = ?1), 0), method, ratios, ?2,"
      " ?3, ?4, ?5, ?6 FROM chain WHERE row = ?2",
      scenario, chain, lesson.version, to_string(lesson.kind), Blob{lesson.bytes}, now());
}

void take_lesson(Connection& connection, std::int64_t scenario, std::uint64_t number) {
  run(connection, "UPDATE lesson SET went_on = (kind = 'place') WHERE scenario = ? AND number = ?", scenario,
      number);
}

void return_lesson_if_unused(Connection& connection, std::string_view chain) {
  run(connection,
      "UPDATE lesson SET went_on = 0 WHERE (scenario, number) IN"
      " (SELECT scenario, lesson FROM chain WHERE id = ? AND samples = 0)",
      chain);
}

}  // namespace retake::database
