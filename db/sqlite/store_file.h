// Opening, copying and checking the file of a store.
// Realises doc/design.md, section 5.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "db/sqlite/connection.h"

namespace retake::database {

/// The path by which every process knows the file. Throws: StoreError.
std::string absolute_path(const std::string& path);

/// The writing connection, with the current schema. Throws: StoreError, DatabaseError.
std::unique_ptr<Connection> open_to_write(const std::string& path);
/// Throws: StoreError unless the file is a store of this version, DatabaseError.
void require_current(const std::string& path, Connection::Access access = Connection::Access::read);

/// Copies what the connection sees into a new file, which is on the disk when this returns.
/// Throws: StoreError if the file exists or cannot be written.
void write_backup(Connection& connection, const std::string& path);

/// What is wrong with the file, one line a fault.
std::vector<std::string> find_faults(Connection& connection);

}  // namespace retake::database
