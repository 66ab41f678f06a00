// The pool of read-only connections.
// Realises doc/design.md, section 5.
#include "db/sqlite/readers.h"

#include <algorithm>
#include <utility>

namespace retake::database {

Readers::Readers(const std::string& path, std::size_t count,
                 std::function<void(const std::string&)> on_damage, Connection::Access access)
    : path_(path),
      count_(std::max<std::size_t>(count, 1)),
      on_damage_(std::move(on_damage)),
      free_(open(access)) {}

Readers::Connections Readers::open(Connection::Access access) const {
  Connections connections;
  while (connections.size() < count_) {
    auto connection = std::make_unique<Connection>(path_, access);
    connection->execute(
        "PRAGMA cache_size = -1000");  // [kB], chosen: several pages of a listing and the index roots
    connection->on_damage(on_damage_);
    connections.push_back(std::move(connection));
  }
  return connections;
}

void Readers::reopen() {
  Connections fresh = open(Connection::Access::read);
  {
    std::unique_lock lock(mutex_);
    is_changing_ = true;
    returned_.wait(lock, [&] { return free_.size() == count_; });
    free_ = std::move(fresh);
    is_changing_ = false;
  }
  returned_.notify_all();
}

std::unique_ptr<Connection> Readers::take() {
  std::unique_lock lock(mutex_);
  returned_.wait(lock, [&] { return !is_changing_ && !free_.empty(); });
  auto connection = std::move(free_.back());
  free_.pop_back();
  return connection;
}

void Readers::give_back(std::unique_ptr<Connection> connection) {
  {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(connection));
  }
  returned_.notify_all();
}

Readers::Loan::Loan(Readers& readers) : readers_(readers), connection_(readers.take()) {
  try {
    transaction_ = std::make_unique<Transaction>(*connection_, Transaction::Kind::read);
  } catch (...) {
    readers_.give_back(std::move(connection_));
    throw;
  }
}

Readers::Loan::~Loan() {
  transaction_.reset();
  readers_.give_back(std::move(connection_));
}

}  // namespace retake::database
