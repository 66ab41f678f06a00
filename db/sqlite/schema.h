// Schema: the tables of a store, the marks by which its file is known, and the way from older versions.
// Realises doc/design.md, section 5. README.md of this folder describes the tables.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "db/sqlite/connection.h"

namespace retake::database {

/// "RTKE", in the header of every store's file.
inline constexpr std::int64_t kApplicationId = 0x52544b45;

/// The scripts that lead from version n to n + 1, in order; the last one's number is the version of this
/// build.
std::span<const std::string> migrations();

enum class FileState { empty, current, older, newer, foreign };
/// What the file is, without changing it. Throws: DatabaseError.
FileState file_state(Connection& connection, std::span<const std::string> scripts = migrations());

/// Runs, in one transaction, the scripts that the file has not seen yet.
/// Requires: the file is empty or older. Throws: DatabaseError; the file is then as it was.
void migrate(Connection& connection, std::span<const std::string> scripts = migrations());

}  // namespace retake::database
