// Readers: the read-only connections, lent to one caller at a time.
// Realises doc/design.md, section 5.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "db/sqlite/connection.h"

namespace retake::database {

/// Thread safety: borrow may be called from any thread; it waits while all connections are lent.
class Readers {
 public:
  /// Opens the connections. Requires: the file is a store. Throws: DatabaseError.
  /// `on_damage` is told of what is damaged in the rows that are read.
  Readers(const std::string& path, std::size_t count, std::function<void(const std::string&)> on_damage,
          Connection::Access access = Connection::Access::read);
  /// Opens others in their place, once all are given back. Throws: DatabaseError; nothing has changed then.
  void reopen();

  /// A borrowed connection within a read transaction, so that all that is read is of one moment.
  class Loan {
   public:
    explicit Loan(Readers& readers);
    ~Loan();
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    Connection& connection() { return *connection_; }

   private:
    Readers& readers_;
    std::unique_ptr<Connection> connection_;
    std::unique_ptr<Transaction> transaction_;
  };

 private:
  using Connections = std::vector<std::unique_ptr<Connection>>;

  Connections open(Connection::Access access) const;
  std::unique_ptr<Connection> take();
  void give_back(std::unique_ptr<Connection> connection);

  const std::string path_;
  const std::size_t count_;
  const std::function<void(const std::string&)> on_damage_;
  std::mutex mutex_;
  std::condition_variable returned_;
  Connections free_;
  bool is_changing_ = false;
};

}  // namespace retake::database
