// The rows of lessons: what chains of a scenario have learned, and which of it the next one begins from.
// Realises doc/design.md, section 3, "Lessons". Must be called within a transaction.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "db/records.h"
#include "db/sqlite/connection.h"

namespace retake::database {

std::vector<LessonRecord> load_lessons(Connection& connection, std::string_view scenario);
std::optional<Lesson> load_lesson(Connection& connection, std::string_view scenario, std::uint64_t number);
/// See Store::next_lesson.
std::uint64_t load_next_lesson(Connection& connection, std::string_view scenario, std::string_view method,
                               std::string_view ratios, const std::vector<std::uint64_t>& taken);

/// Adds a lesson that a chain learned, under the scenario's next number.
void insert_lesson(Connection& connection, std::int64_t scenario, std::int64_t chain, const Lesson& lesson);
/// A chain begins from a lesson: it goes on from there, if it is a place.
void take_lesson(Connection& connection, std::int64_t scenario, std::uint64_t number);
/// The chain has ended; if it found nothing, another one may go on from where it began.
void return_lesson_if_unused(Connection& connection, std::string_view chain);

}  // namespace retake::database
