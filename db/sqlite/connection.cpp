// Connection and Query on SQLite's C interface, which no other file sees.
// Realises doc/design.md, section 5.
#include "db/sqlite/connection.h"

#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <unistd.h>

#include <sqlite3.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace retake::database {
namespace {

// How long a connection waits for a lock that another process holds; chosen to outlast a checkpoint. [ms]
constexpr int kBusyTimeout = 5000;

constexpr int kPageBytes = 4096, kFrameHeaderBytes = 24, kLogHeaderBytes = 32;

DatabaseError::Kind kind_of(int primary_code) {
  switch (primary_code) {
    case SQLITE_NOTADB:
      return DatabaseError::Kind::not_a_database;
    case SQLITE_CONSTRAINT:
      return DatabaseError::Kind::constraint;
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_PROTOCOL:
    case SQLITE_NOMEM:
      return DatabaseError::Kind::unavailable;
    default:
      return DatabaseError::Kind::other;
  }
}

DatabaseError error_of(sqlite3* handle, int code) {
  const int system_error = errno;
  std::string reason = handle != nullptr ? sqlite3_errmsg(handle) : sqlite3_errstr(code);
  const int primary = code & 0xff;
  if (handle != nullptr && (primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN)) {
    // SQLite forgets the system's error where a commit fails; nothing has overwritten it since.
    const int known = sqlite3_system_errno(handle);
    if (const int cause = known != 0 ? known : system_error; cause != 0) {
      reason += std::string(": ") + std::strerror(cause);
    }
  }
  return {kind_of(primary), reason};
}

int open_flags(Connection::Access access) {
  switch (access) {
    case Connection::Access::alone:
      return SQLITE_OPEN_READONLY | SQLITE_OPEN_URI;
    case Connection::Access::read:
      return SQLITE_OPEN_READONLY;
    case Connection::Access::write:
      return SQLITE_OPEN_READWRITE;
    case Connection::Access::create:
      return SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  }
  return SQLITE_OPEN_READONLY;
}

/// The file as SQLite reads it without locks and shared memory: with what its log holds, if there is one.
std::string uri_of_lone(const std::string& path) {
  std::string uri = "file:";
  for (const char character : path) {
    char escaped[4];
    const bool is_plain = std::isalnum(static_cast<unsigned char>(character)) || character == '/';
    std::snprintf(escaped, sizeof escaped, is_plain ? "%c" : "%%%02X", static_cast<unsigned char>(character));
    uri += escaped;
  }
  return uri + (::access((path + "-wal").c_str(), F_OK) == 0 ? "?vfs=unix-none" : "?immutable=1");
}

// --- Seals -------------------------------------------------------------------------------------

constexpr std::size_t kPart = 4;  // [B], chosen: damage passes for sound once in 2^32 times

/// The part of one cell, by its kind and its value.
std::uint32_t part_of(sqlite3_value* cell) {
  const int kind = sqlite3_value_type(cell);
  const auto hash = [&](const void* bytes, std::size_t size) {
    return static_cast<std::uint32_t>(XXH3_64bits_withSeed(bytes, size, static_cast<XXH64_hash_t>(kind)));
  };
  switch (kind) {
    case SQLITE_INTEGER: {
      const sqlite3_int64 value = sqlite3_value_int64(cell);
      return hash(&value, sizeof value);
    }
    case SQLITE_FLOAT: {
      const double value = sqlite3_value_double(cell) + 0.0;  // SQLite keeps no -0
      return hash(&value, sizeof value);
    }
    case SQLITE_NULL:
      return hash("", 0);
    default: {
      const void* bytes = sqlite3_value_blob(cell);
      return hash(bytes == nullptr ? "" : bytes, static_cast<std::size_t>(sqlite3_value_bytes(cell)));
    }
  }
}

void put_part(std::string& seal, std::size_t part, std::uint32_t hash) {
  if (seal.size() < (part + 1) * kPart) seal.resize((part + 1) * kPart);
  for (std::size_t i = 0; i < kPart; ++i)
    seal[part * kPart + i] = static_cast<char>(hash >> (8 * i));
}

std::string bytes_of(sqlite3_value* value) {
  const void* bytes = sqlite3_value_blob(value);
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(value));
  return bytes == nullptr ? std::string() : std::string(static_cast<const char*>(bytes), size);
}

void give_seal(sqlite3_context* context, const std::string& seal) {
  sqlite3_result_blob64(context, seal.data(), seal.size(), SQLITE_TRANSIENT);
}

void seal(sqlite3_context* context, int count, sqlite3_value** cells) {
  std::string parts;
  for (int i = 0; i < count; ++i)
    put_part(parts, static_cast<std::size_t>(i), part_of(cells[i]));
  give_seal(context, parts);
}

void reseal(sqlite3_context* context, int count, sqlite3_value** arguments) {
  std::string parts = bytes_of(arguments[0]);
  for (int i = 1; i + 1 < count; i += 2)
    put_part(parts, static_cast<std::size_t>(sqlite3_value_int64(arguments[i])), part_of(arguments[i + 1]));
  give_seal(context, parts);
}

void unsound(sqlite3_context* context, int count, sqlite3_value** arguments) {
  const auto* parts = static_cast<const unsigned char*>(sqlite3_value_blob(arguments[0]));
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(arguments[0]));
  auto part = static_cast<std::size_t>(sqlite3_value_int64(arguments[1]));
  for (int i = 2; i < count; ++i, ++part) {
    std::uint32_t kept = 0;
    const bool is_there = parts != nullptr && (part + 1) * kPart <= size;
    for (std::size_t k = 0; is_there && k < kPart; ++k)
      kept |= static_cast<std::uint32_t>(parts[part * kPart + k]) << (8 * k);
    if (!is_there || kept != part_of(arguments[i])) {
      sqlite3_result_int64(context, static_cast<sqlite3_int64>(part));
      return;
    }
  }
}

/// SQLite calls through C; what little may throw there is memory that ran out.
template <void (*function)(sqlite3_context*, int, sqlite3_value**)>
void guarded(sqlite3_context* context, int count, sqlite3_value** arguments) {
  try {
    function(context, count, arguments);
  } catch (const std::exception&) {
    sqlite3_result_error_nomem(context);
  }
}

void add_seal_functions(sqlite3* handle) {
  constexpr int kFlags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS;
  sqlite3_create_function_v2(handle, "seal", -1, kFlags, nullptr, guarded<seal>, nullptr, nullptr, nullptr);
  sqlite3_create_function_v2(handle, "reseal", -1, kFlags, nullptr, guarded<reseal>, nullptr, nullptr,
                             nullptr);
  sqlite3_create_function_v2(handle, "unsound", -1, kFlags, nullptr, guarded<unsound>, nullptr, nullptr,
                             nullptr);
}

}  // namespace

void Connection::Close::operator()(sqlite3* handle) const {
  sqlite3_close_v2(handle);
}
void Connection::Finalize::operator()(sqlite3_stmt* handle) const {
  sqlite3_finalize(handle);
}

Connection::Connection(const std::string& path, Access access) {
  sqlite3* handle = nullptr;
  const std::string name = access == Access::alone ? uri_of_lone(path) : path;
  const int code = sqlite3_open_v2(name.c_str(), &handle, open_flags(access) | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) raise(code);
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyTimeout);
  add_seal_functions(handle);
  // The hook takes the place of automatic checkpoints: the writer decides when one is due.
  sqlite3_wal_hook(
      handle,
      [](void* connection, sqlite3*, const char*, int pages) {
        static_cast<Connection*>(connection)->log_pages_ = static_cast<std::size_t>(pages);
        return SQLITE_OK;
      },
      this);
  execute("PRAGMA temp_store = MEMORY");  // needs no further descriptor in the middle of a statement
  if (access == Access::read || access == Access::alone) execute("PRAGMA query_only = ON");
  if (access == Access::alone) {
    execute("PRAGMA locking_mode = EXCLUSIVE");
    leave_log();
  }
  // SQLite opens what it may not write for reading.
  if ((access == Access::write || access == Access::create) && sqlite3_db_readonly(handle, "main") == 1)
    raise(SQLITE_READONLY);
}

Connection::~Connection() = default;

void Connection::raise(int code) const {
  throw error_of(handle_.get(), code);
}

std::uint64_t Connection::log_bytes() const {
  if (log_pages_ == 0) return 0;
  return kLogHeaderBytes + std::uint64_t{log_pages_} * (kFrameHeaderBytes + kPageBytes);
}

void Connection::leave_log() {
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
}

void Connection::execute(const std::string& script) {
  const int code = sqlite3_exec(handle_.get(), script.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) raise(code);
}

bool Connection::in_transaction() const {
  return sqlite3_get_autocommit(handle_.get()) == 0;
}

std::size_t Connection::changed_rows() const {
  return static_cast<std::size_t>(sqlite3_changes64(handle_.get()));
}

std::int64_t Connection::last_inserted_row() const {
  return sqlite3_last_insert_rowid(handle_.get());
}

void Connection::checkpoint() {
  const int code =
      sqlite3_wal_checkpoint_v2(handle_.get(), nullptr, SQLITE_CHECKPOINT_PASSIVE, nullptr, nullptr);
  if (code != SQLITE_OK && code != SQLITE_BUSY) raise(code);
}

void Connection::copy_to(const std::string& path) {
  Connection target(path, Access::create);
  target.execute("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF");
  sqlite3_backup* backup = sqlite3_backup_init(target.handle_.get(), "main", handle_.get(), "main");
  if (backup == nullptr) target.raise(sqlite3_errcode(target.handle_.get()));
  // All pages in one step, so that all are of one snapshot.
  const int code = sqlite3_backup_step(backup, -1);
  sqlite3_backup_finish(backup);
  if (code != SQLITE_DONE) throw error_of(target.handle_.get(), code);
}

std::vector<std::string> Connection::prepared_statements() const {
  std::vector<std::string> texts;
  for (const auto& [text, statement] : statements_)
    texts.emplace_back(text);
  return texts;
}

Query::Query(Connection& connection, std::string_view sql) : connection_(connection) {
  statement_ = connection.statements_.extract(sql);
  if (!statement_.empty()) return;
  sqlite3_stmt* handle = nullptr;
  const int code = sqlite3_prepare_v3(connection.handle_.get(), sql.data(), static_cast<int>(sql.size()),
                                      SQLITE_PREPARE_PERSISTENT, &handle, nullptr);
  if (code != SQLITE_OK) connection.raise(code);
  Connection::Statements fresh;
  fresh.emplace(sql, Connection::Statement(handle));
  statement_ = fresh.extract(fresh.begin());
}

Query::~Query() {
  sqlite3_reset(statement_.mapped().get());
  sqlite3_clear_bindings(statement_.mapped().get());
  connection_.statements_.insert(std::move(statement_));
}

bool Query::next() {
  column_ = 0;
  errno = 0;
  const int code = sqlite3_step(statement_.mapped().get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  connection_.raise(code);
}

std::int64_t Query::integer() {
  return sqlite3_column_int64(statement_.mapped().get(), column_++);
}

double Query::real() {
  return sqlite3_column_double(statement_.mapped().get(), column_++);
}

std::string Query::text() {
  sqlite3_stmt* handle = statement_.mapped().get();
  const void* bytes = sqlite3_column_blob(handle, column_);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(handle, column_));
  ++column_;
  return bytes == nullptr ? std::string() : std::string(static_cast<const char*>(bytes), size);
}

bool Query::is_null() const {
  return sqlite3_column_type(statement_.mapped().get(), column_) == SQLITE_NULL;
}

void Query::bind(std::string_view text) {
  const int code =
      sqlite3_bind_text64(statement_.mapped().get(), ++parameter_, text.data() == nullptr ? "" : text.data(),
                          text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  if (code != SQLITE_OK) connection_.raise(code);
}

void Query::bind(const Blob& blob) {
  const int code = sqlite3_bind_blob64(statement_.mapped().get(), ++parameter_,
                                       blob.bytes.data() == nullptr ? "" : blob.bytes.data(),
                                       blob.bytes.size(), SQLITE_TRANSIENT);
  if (code != SQLITE_OK) connection_.raise(code);
}

void Query::bind(double value) {
  const int code = sqlite3_bind_double(statement_.mapped().get(), ++parameter_, value);
  if (code != SQLITE_OK) connection_.raise(code);
}

void Query::bind(std::nullopt_t) {
  const int code = sqlite3_bind_null(statement_.mapped().get(), ++parameter_);
  if (code != SQLITE_OK) connection_.raise(code);
}

void Query::bind_signed(std::int64_t value) {
  const int code = sqlite3_bind_int64(statement_.mapped().get(), ++parameter_, value);
  if (code != SQLITE_OK) connection_.raise(code);
}

void Query::bind_unsigned(std::uint64_t value) {
  if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
    throw DatabaseError(DatabaseError::Kind::constraint, std::to_string(value) + " is above 2^63 - 1");
  }
  bind_signed(static_cast<std::int64_t>(value));
}

Transaction::Transaction(Connection& connection, Kind kind) : connection_(connection) {
  run(connection_, kind == Kind::read ? "BEGIN" : "BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  if (!connection_.in_transaction()) return;
  try {
    run(connection_, "ROLLBACK");
  } catch (const DatabaseError&) {
    // The connection is beyond use; its next transaction says so.
  }
}

void Transaction::commit() {
  run(connection_, "COMMIT");
}

}  // namespace retake::database
