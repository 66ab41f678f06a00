// Opening, copying and checking the file of a store.
// Realises doc/design.md, section 5.
#include "db/sqlite/store_file.h"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <unistd.h>

#include "db/errors.h"
#include "db/sqlite/schema.h"
#include "db/sqlite/seals.h"

namespace retake::database {
namespace {

namespace fs = std::filesystem;

void require_ours(FileState state, const std::string& path) {
  if (state == FileState::foreign) throw StoreError("store: " + path + " is not a Retake store");
  if (state == FileState::newer) throw StoreError("store: " + path + " was written by a newer Retake");
}

// An open file that is closed again, for what the file system has to be told.
class File {
 public:
  File(const std::string& path, int flags)
      : path_(path), descriptor_(::open(path.c_str(), flags | O_CLOEXEC, 0644)) {
    if (descriptor_ < 0) fail("open");
  }
  ~File() { ::close(descriptor_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  void flush() {
    if (::fsync(descriptor_) != 0) fail("flush");
  }

 private:
  [[noreturn]] void fail(const char* operation) const {
    throw StoreError(std::string("store: cannot ") + operation + " " + path_ + ": " + std::strerror(errno));
  }
  std::string path_;
  int descriptor_;
};

void add_lines(Connection& connection, std::string_view sql, std::string_view prefix,
               std::vector<std::string>& faults) {
  try {
    Query query(connection, sql);
    while (query.next()) {
      if (auto line = query.text(); line != "ok") faults.push_back(std::string(prefix) + line);
    }
  } catch (const DatabaseError& error) {
    faults.push_back(std::string(prefix) + "rows cannot be counted: " + error.what());
  }
}

// How the rows of a table are looked at: the statement gives what a row is called and what is damaged of it.
struct Look {
  const SealedTable& table;
  std::string sql;
  Look(const SealedTable& its_table, const std::string& name, const std::string& joins = "")
      : table(its_table),
        sql("SELECT " + name + ", " + unsound_in(table) + " FROM " + std::string(table.name) + " " + joins +
            " WHERE " + unsound_in(table) + " IS NOT NULL") {}
};

const std::vector<Look>& looks() {
  const auto of = [](const char* owner, const std::string& row) {
    return std::string("coalesce(") + owner + ".id, 'in row ' || " + row + ")";
  };
  const auto join = [](const char* owner, const std::string& row) {
    return std::string("LEFT JOIN ") + owner + " ON " + owner + ".row = " + row;
  };
  static const std::vector<Look> all{
      {scenario_seal(), "'scenario ' || " + of("scenario", "scenario.row")},
      {stock_seal(), "'stock of scenario ' || " + of("scenario", "stock.scenario"),
       join("scenario", "stock.scenario")},
      {chain_seal(), "'chain ' || " + of("chain", "chain.row")},
      {kernel_seal(), "'a kernel of chain ' || " + of("chain", "chain_kernel.chain"),
       join("chain", "chain_kernel.chain")},
      {rung_seal(), "'a rung of chain ' || " + of("chain", "chain_rung.chain"),
       join("chain", "chain_rung.chain")},
      {checkpoint_seal(), "'checkpoint of chain ' || " + of("chain", "checkpoint.chain"),
       join("chain", "checkpoint.chain")},
      {trace_seal(), "'a stretch of the trace of chain ' || " + of("chain", "trace_block.chain"),
       join("chain", "trace_block.chain")},
      {lesson_seal(), "'lesson ' || lesson.number || ' of scenario ' || " + of("scenario", "lesson.scenario"),
       join("scenario", "lesson.scenario")},
      {sample_seal(),
       "'sample ' || coalesce(chain.id || '-' || sample.iteration || iif(replica = 0, '', '-' || replica),"
       " 'in row ' || sample.row)",
       "CROSS JOIN sample_blob ON sample_blob.sample = sample.row " + join("chain", "sample.chain")},
      {player_seal(), "'player in row ' || player.row"},
      {seen_seal(), "'what the player in row ' || seen.player || ' has seen'"},
      {play_seal(), "'play p' || play.row"},
      {key_seal(), "'idempotency key ' || idempotency.key"},
  };
  return all;
}

// A line for each row whose seal is broken.
void add_damaged(Connection& connection, const Look& look, std::vector<std::string>& faults) {
  Query query(connection, look.sql);
  while (query.next()) {
    const std::string thing = query.text();
    faults.push_back(damage_of(thing, read_unsound(look.table, query).value_or("seal")));
  }
}

}  // namespace

std::string absolute_path(const std::string& path) {
  if (path.empty()) throw StoreError("store: the path is empty");
  std::error_code error;
  const auto absolute = fs::weakly_canonical(fs::absolute(path, error), error);
  if (error) throw StoreError("store: cannot open " + path + ": " + error.message());
  return absolute.string();
}

std::unique_ptr<Connection> open_to_write(const std::string& path) {
  auto connection = std::make_unique<Connection>(path, Connection::Access::create);
  const auto state = file_state(*connection);
  require_ours(state, path);
  connection->execute(
      "PRAGMA journal_mode = WAL;"
      "PRAGMA synchronous = FULL;"
      "PRAGMA secure_delete = OFF;"  // the file is no secret, and overwriting halves the speed of deletes
      "PRAGMA cache_size = -8000;"   // [kB], chosen: the inner pages of every index of 100,000 samples
      "PRAGMA journal_size_limit = 33554432");  // [B], so that a log once swollen does not stay so
  if (state != FileState::current) migrate(*connection);
  connection->execute("PRAGMA foreign_keys = ON");
  return connection;
}

void require_current(const std::string& path, Connection::Access access) {
  if (!fs::exists(path)) throw StoreError("store: " + path + " does not exist");
  Connection connection(path, access);
  const auto state = file_state(connection);
  require_ours(state, path);
  if (state == FileState::empty) throw StoreError("store: " + path + " is not a Retake store");
  if (state == FileState::older) {
    throw StoreError("store: " + path + " was written by an older Retake; open it for writing once");
  }
}

void write_backup(Connection& connection, const std::string& path) {
  // Write beside it, then give the whole copy its name, unless that has been taken meanwhile.
  if (fs::exists(path)) throw StoreError("store: cannot back up to " + path + ": the file exists");
  static std::atomic<unsigned> backups = 0;
  const std::string unfinished =
      path + ".unfinished-" + std::to_string(::getpid()) + "-" + std::to_string(++backups);
  try {
    File(unfinished, O_RDWR | O_CREAT | O_TRUNC).flush();
    connection.copy_to(unfinished);
    File(unfinished, O_RDONLY).flush();
    if (::link(unfinished.c_str(), path.c_str()) != 0) {
      if (errno == EEXIST) throw StoreError("store: cannot back up to " + path + ": the file exists");
      fs::rename(unfinished, path);  // a file system without links
    }
    fs::remove(unfinished);
    File(fs::path(path).parent_path().string(), O_RDONLY | O_DIRECTORY).flush();
  } catch (const StoreError&) {
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    throw;
  } catch (const std::exception& error) {
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    throw StoreError("store: cannot back up to " + path + ": " + error.what());
  }
}

std::vector<std::string> find_faults(Connection& connection) {
  std::vector<std::string> faults;
  static const std::string stock_sound = unsound_in(stock_seal()) + " IS NULL AND ";
  static const std::string player_sound = unsound_in(player_seal()) + " IS NULL AND ";
  add_lines(connection, "PRAGMA integrity_check", "", faults);
  for (const Look& look : looks())
    add_damaged(connection, look, faults);
  add_lines(connection, "SELECT sample.row || ' was set aside as damaged' FROM sample WHERE shelf = 4",
            "sample in row ", faults);
  add_lines(
      connection,
      "SELECT \"table\" || ' ' || rowid || ' refers to a missing ' || parent FROM pragma_foreign_key_check",
      "", faults);
  static const std::string stock_sql =
      "SELECT scenario.id || ' holds ' || held.samples || ' samples, ' || held.counted || ' that count, '"
      " || held.even || ' even, ' || held.learning || ' from learning, ' || held.unplayed || ' and '"
      " || held.unplayed_learning || ' of these unplayed, of weight ' || held.weight || ', but its stock "
      "says '"
      " || concat_of.told"
      " FROM stock JOIN scenario ON scenario.row = stock.scenario"
      " JOIN (SELECT stock.scenario, count(sample.row) AS samples, count(sample.row) FILTER (WHERE shelf <= "
      "1) AS counted,"
      " count(sample.row) FILTER (WHERE shelf = 0) AS even, count(sample.row) FILTER (WHERE shelf = 2) AS "
      "learning, count(sample.row) FILTER (WHERE shelf <= 1 AND sample.plays = 0) AS unplayed,"
      " count(sample.row) FILTER (WHERE shelf = 2 AND sample.plays = 0) AS unplayed_learning, "
      "coalesce(sum(sample.weight) FILTER (WHERE shelf <= 1), 0) AS weight"
      " FROM stock LEFT JOIN sample ON sample.scenario = stock.scenario AND shelf <= 3"
      " GROUP BY stock.scenario) AS held"
      " ON held.scenario = stock.scenario"
      " JOIN (SELECT scenario, samples || ', ' || counted || ', ' || even || ', ' || learning || ', ' || "
      "unplayed"
      " || ', ' || unplayed_learning || ' and ' || weight AS told FROM stock) AS concat_of"
      " ON concat_of.scenario = stock.scenario"
      " WHERE " +
      stock_sound +
      "(stock.samples, stock.counted, stock.even, stock.learning, stock.unplayed, "
      "stock.unplayed_learning,"
      " stock.weight) IS NOT (held.samples, held.counted, held.even, held.learning, held.unplayed,"
      " held.unplayed_learning, held.weight)";
  add_lines(connection, stock_sql, "scenario ", faults);
  add_lines(connection,
            "SELECT id || ' has no stock' FROM scenario WHERE id IS NOT NULL"
            " AND NOT EXISTS (SELECT 1 FROM stock WHERE stock.scenario = scenario.row)",
            "scenario ", faults);
  add_lines(connection,
            "SELECT sample.row || ' has no state and animation' FROM sample"
            " WHERE NOT EXISTS (SELECT 1 FROM sample_blob WHERE sample_blob.sample = sample.row)",
            "sample ", faults);
  static const std::string player_sql =
      "SELECT player.row || ' has seen ' || had.counted || ' samples that count, ' || had.even"
      " || ' even and ' || had.learning || ' from learning, but ' || seen || ', ' || seen_even || ' and '"
      " || seen_learning || ' are counted' FROM player JOIN stock ON stock.scenario = player.scenario"
      " JOIN (SELECT player.row, count(sample.row) FILTER (WHERE shelf <= 1) AS counted, count(sample.row) "
      "FILTER (WHERE shelf = 0) AS even,"
      " count(sample.row) FILTER (WHERE shelf = 2) AS learning FROM player LEFT JOIN seen ON seen.player = "
      "player.row"
      " LEFT JOIN sample ON sample.row = seen.sample GROUP BY player.row) AS had ON had.row = player.row"
      " WHERE " +
      player_sound + "(seen, seen_even, seen_learning) IS NOT (had.counted, had.even, had.learning)";
  add_lines(connection, player_sql, "player ", faults);
  return faults;
}

}  // namespace retake::database
