// Connection and Query: the only door to SQLite. Everything else in this folder speaks to these.
// Realises doc/design.md, section 5. Knows nothing of the schema.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace retake::database {

/// SQLite refused: what() is its reason, without SQL.
class DatabaseError : public std::runtime_error {
 public:
  enum class Kind {
    not_a_database,
    constraint,
    unavailable,  ///< the disk's fault, or a lock's: it may succeed later
    other
  };
  DatabaseError(Kind kind, const std::string& reason) : std::runtime_error(reason), kind_(kind) {}
  Kind kind() const { return kind_; }

 private:
  Kind kind_;
};

/// One connection to one file, with the statements that it has prepared. Its SQL has three functions more.
/// A seal is a blob of 4 bytes, a part, for each cell that it is of; NULL, 1, 1.0, '1' and x'31' have
/// different parts.
///   seal(value, ...)                 the seal of these cells
///   reseal(seal, part, value, ...)   the seal with other parts, each told by its number from 0 and its cell
///   unsound(seal, part, value, ...)  the number of the first part, from that one on, that is not its cell's;
///                                    NULL if all are
/// Thread safety: one thread at a time.
class Connection {
 public:
  enum class Access {
    alone,   ///< as read, while nobody writes: without locks and shared memory, which need room on the disk
    read,    ///< the file must exist; nothing can be changed through this connection
    write,   ///< the file must exist
    create,  ///< the file is created if it does not exist
  };

  /// Requires: an absolute path. Throws: DatabaseError.
  Connection(const std::string& path, Access access);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Runs statements that give no rows. Throws: DatabaseError.
  void execute(const std::string& script);
  bool in_transaction() const;
  /// How many rows the last statement inserted, changed or deleted, without those of cascades.
  std::size_t changed_rows() const;
  /// The row number that the last insert gave.
  std::int64_t last_inserted_row() const;
  /// How many pages the write-ahead log held after this connection's last commit.
  std::size_t log_pages() const { return log_pages_; }
  /// Moves what readers no longer need from the write-ahead log into the database. Throws: DatabaseError.
  void checkpoint();
  /// How many bytes of the write-ahead log the last commit needs.
  std::uint64_t log_bytes() const;
  /// Closing leaves the write-ahead log as it is, for whoever opens the file next.
  void leave_log();
  /// Copies the whole database, as one snapshot, into an empty file, which is of no use if this fails and is
  /// not flushed if it succeeds. Throws: DatabaseError.
  void copy_to(const std::string& path);
  /// The text of every statement that is prepared and not in use.
  std::vector<std::string> prepared_statements() const;

  /// Who is told of what is damaged in the rows that are read; nobody at first.
  void on_damage(std::function<void(const std::string&)> told) { told_of_damage_ = std::move(told); }
  void tell_damage(const std::string& damage) const {
    if (told_of_damage_) told_of_damage_(damage);
  }

 private:
  friend class Query;
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  struct Finalize {
    void operator()(sqlite3_stmt* handle) const;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;
  using Statements = std::unordered_map<std::string_view, Statement>;

  [[noreturn]] void raise(int code) const;

  std::unique_ptr<sqlite3, Close> handle_;
  Statements statements_;
  std::size_t log_pages_ = 0;
  std::function<void(const std::string&)> told_of_damage_;
};

/// A value to bind as a blob.
struct Blob {
  std::string_view bytes;
};

/// A statement on its way through its rows. Parameters are bound in the order in which they are given; each
/// call of integer, text, … reads the next column of the current row. Requires: SQL text of static storage
/// duration. Throws: DatabaseError from every method.
class Query {
 public:
  Query(Connection& connection, std::string_view sql);
  template <typename... Values>
  Query(Connection& connection, std::string_view sql, const Values&... values) : Query(connection, sql) {
    bind_all(values...);
  }
  ~Query();
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;

  /// Binds the next parameter; before the first row.
  void bind(std::string_view text);
  void bind(const Blob& blob);
  void bind(double value);
  void bind(std::nullopt_t);
  template <std::integral Value>
  void bind(Value value) {
    if constexpr (std::signed_integral<Value>) {
      bind_signed(value);
    } else {
      bind_unsigned(value);
    }
  }
  template <typename Value>
  void bind(const std::optional<Value>& value) {
    if (value) {
      bind(*value);
    } else {
      bind(std::nullopt);
    }
  }

  template <typename... Values>
  void bind_all(const Values&... values) {
    (bind(values), ...);
  }

  /// Moves to the next row. False: there is none.
  bool next();

  std::int64_t integer();
  std::uint64_t count() { return static_cast<std::uint64_t>(integer()); }
  double real();
  std::string text();  ///< of a text or of a blob
  bool is_null() const;
  /// A column that holds a `Value`, a number.
  template <typename Value>
  Value number() {
    if constexpr (std::floating_point<Value>) {
      return real();
    } else {
      return static_cast<Value>(integer());
    }
  }
  template <typename Value>
  std::optional<Value> optional() {
    if (is_null()) {
      ++column_;
      return std::nullopt;
    }
    return number<Value>();
  }

 private:
  void bind_signed(std::int64_t value);
  void bind_unsigned(std::uint64_t value);

  Connection& connection_;
  Connection::Statements::node_type statement_;
  int parameter_ = 0;
  int column_ = 0;
};

/// Runs one statement to its end and gives how many rows it changed. Throws: DatabaseError.
template <typename... Values>
std::size_t run(Connection& connection, std::string_view sql, const Values&... values) {
  Query query(connection, sql, values...);
  while (query.next()) {
  }
  return connection.changed_rows();
}

/// A transaction: rolled back unless committed.
class Transaction {
 public:
  enum class Kind { read, write };
  Transaction(Connection& connection, Kind kind);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Connection& connection_;
};

}  // namespace retake::database
