// See sqlite_store.h.
#include "db/sqlite/sqlite_store.h"

#include <chrono>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "db/sqlite/chain_rows.h"
#include "db/sqlite/lesson_rows.h"
#include "db/sqlite/play_rows.h"
#include "db/sqlite/sample_rows.h"
#include "db/sqlite/scenario_rows.h"
#include "db/sqlite/store_file.h"

namespace retake::database {

SqliteStore::SqliteStore(const std::string& path, const StoreOptions& options)
    : path_(absolute_path(path)), damages_(options.on_damage) {
  try {
    if (options.read_only) {
      require_current(path_);
      readers_ = std::make_unique<Readers>(path_, options.reader_connections, note_damage());
    } else {
      open(options);
    }
  } catch (const StoreError&) {
    throw;
  } catch (const std::exception& error) {
    throw StoreError("store: cannot open " + path_ + ": " + error.what());
  }
}

/// Where the disk keeps it from writing, it reads, and the writer goes on trying.
void SqliteStore::open(const StoreOptions& options) {
  std::unique_ptr<Connection> connection;
  std::string reason;
  try {
    connection = open_writing(options.reader_connections);
  } catch (const DatabaseError& error) {
    std::error_code missing;
    const auto bytes = std::filesystem::file_size(path_, missing);
    const bool holds_something = !missing && bytes > 0;
    if (error.kind() != DatabaseError::Kind::unavailable || !holds_something) throw;
    reason = error.what();
    require_current(path_, Connection::Access::alone);
    readers_ = std::make_unique<Readers>(path_, options.reader_connections, note_damage(),
                                         Connection::Access::alone);
  }
  start_writer(std::move(connection), reason, options);
}

std::unique_ptr<Connection> SqliteStore::open_writing(std::size_t reader_connections) {
  try {
    if (!lock_) lock_ = std::make_unique<FileLock>(path_ + ".lock");
  } catch (const LockedElsewhere&) {
    throw StoreError("store: " + path_ + " is in use by another daemon");
  } catch (const std::runtime_error& error) {
    throw DatabaseError(DatabaseError::Kind::unavailable, std::string("cannot lock it: ") + error.what());
  }
  auto connection = open_to_write(path_);
  connection->on_damage(note_damage());
  {
    Transaction transaction(*connection, Transaction::Kind::write);
    set_damaged_chains_aside(*connection);
    transaction.commit();
  }
  if (readers_)
    readers_->reopen();
  else
    readers_ = std::make_unique<Readers>(path_, reader_connections, note_damage());
  watch_.emplace(path_);
  return connection;
}

std::function<void(const std::string&)> SqliteStore::note_damage() {
  return [this](const std::string& damage) { damages_.note(damage); };
}

template <typename Work>
auto SqliteStore::read(const char* what, Work work) const {
  try {
    Readers::Loan loan(*readers_);
    return work(loan.connection());
  } catch (const Damaged& damage) {
    damages_.note(damage.what());
    throw;
  } catch (const DatabaseError& error) {
    const std::string text =
        std::string("store: cannot read ") + what + " from " + path_ + ": " + error.what();
    if (error.kind() == DatabaseError::Kind::unavailable) throw StoreUnavailable(text);
    throw StoreError(text);
  }
}

template <typename Work>
auto SqliteStore::submit(Urgency urgency, std::size_t rows, const char* operation, Work work) {
  return writer().submit(urgency, rows, operation, std::move(work));
}

template <typename Work>
auto SqliteStore::write(const char* operation, Work work) {
  return submit(Urgency::immediate, 0, operation, std::move(work)).get();
}

Writer& SqliteStore::writer() {
  if (!writer_) throw StoreError("store: " + path_ + " is open for reading only");
  return *writer_;
}

void SqliteStore::start_writer(std::unique_ptr<Connection> connection, const std::string& reason,
                               const StoreOptions& options) {
  const std::size_t readers = options.reader_connections;
  writer_ = std::make_unique<Writer>(
      std::move(connection), reason,
      Writer::Options{
          .path = path_,
          .batch_rows = options.batch_rows,
          .batch_time = std::chrono::duration<double>(options.batch_seconds),
          .rolled_back = [this] { frontiers_.clear(); },
          .upkeep = purge,
          .open = [this, readers] { return open_writing(readers); },
          .inspect = [this](const Connection& writing) { return watch_->fault(writing.log_bytes()); },
          .tell = options.tell,
      });
}

// --- Scenarios ---------------------------------------------------------------------------------

AddedScenario SqliteStore::add_scenario(const ScenarioRecord& scenario) {
  return write("add a scenario to",
               [&](Connection& connection) { return insert_scenario(connection, scenario); });
}

bool SqliteStore::delete_scenario(std::string_view id) {
  const bool deleted = write("delete a scenario from", [&](Connection& connection) {
    return database::delete_scenario(connection, id);
  });
  if (deleted) writer().wake_upkeep();
  return deleted;
}

std::optional<ScenarioRecord> SqliteStore::scenario(std::string_view id) const {
  return read("a scenario", [&](Connection& connection) { return load_scenario(connection, id); });
}

std::optional<WorldVersion> SqliteStore::world_of(std::string_view scenario) const {
  return read("a scenario", [&](Connection& connection) { return load_world_of(connection, scenario); });
}

Page<ScenarioRecord> SqliteStore::scenarios(std::size_t limit, std::string_view cursor) const {
  return read("scenarios", [&](Connection& connection) { return load_scenarios(connection, limit, cursor); });
}

std::vector<std::string> SqliteStore::scenarios_without_pilot() const {
  return read("scenarios", load_scenarios_without_pilot);
}

bool SqliteStore::set_pilot(std::string_view id, const PilotTally& pilot) {
  return write("write a pilot to",
               [&](Connection& connection) { return write_pilot(connection, id, pilot); });
}

std::uint64_t SqliteStore::sample_count(std::string_view scenario) const {
  return read("a scenario", [&](Connection& connection) { return count_samples(connection, scenario); });
}

// --- Chains ------------------------------------------------------------------------------------

void SqliteStore::add_chains(const std::vector<ChainRecord>& chains) {
  for (const auto& chain : chains) {
    if (chain.id.empty() || chain.id.find('-') != std::string::npos) {
      throw std::logic_error("a chain's id must not be empty nor hold '-': " + chain.id);
    }
  }
  write("add chains to", [&](Connection& connection) {
    for (const auto& chain : chains) {
      if (!insert_chain(connection, chain)) {
        throw StoreError("store: cannot add chains to " + path_ + ": there is no scenario " + chain.scenario);
      }
    }
    return true;
  });
}

std::optional<ChainRecord> SqliteStore::chain(std::string_view id) const {
  return read("a chain", [&](Connection& connection) { return load_chain(connection, id); });
}

std::vector<ChainRecord> SqliteStore::chains(std::string_view scenario) const {
  return read("chains", [&](Connection& connection) { return load_chains(connection, scenario); });
}

Page<ChainRecord> SqliteStore::chains(std::string_view scenario, std::size_t limit,
                                      std::string_view cursor) const {
  return read("chains",
              [&](Connection& connection) { return load_chains(connection, scenario, limit, cursor); });
}

std::vector<ChainRecord> SqliteStore::chains_in_states(const std::vector<ChainState>& states) const {
  return read("chains", [&](Connection& connection) { return load_chains_in_states(connection, states); });
}

std::string SqliteStore::checkpoint(std::string_view chain) const {
  return read("a checkpoint", [&](Connection& connection) { return load_checkpoint(connection, chain); });
}

void SqliteStore::set_chain_state(std::string_view id, ChainState state, std::string_view ended_by,
                                  std::string_view error) {
  write("set the state of a chain in", [&](Connection& connection) {
    update_chain_state(connection, id, state, ended_by, error);
    return true;
  });
}

std::future<std::uint64_t> SqliteStore::commit(ChainProgress progress) {
  const auto rows = progress.samples.size();
  // Somebody waits for a chain that pauses or ends.
  const Urgency urgency = progress.state ? Urgency::immediate : Urgency::batched;
  return submit(urgency, rows, "write a chain's progress to",
                [this, progress = std::move(progress)](Connection& connection) {
                  const Written written = write_progress(connection, progress);
                  if (written.shelves_moved) frontiers_.clear();
                  return written.samples;
                });
}

std::optional<ChainRecord> SqliteStore::same_chain(const ChainRecord& like,
                                                   std::optional<std::uint64_t> lesson) const {
  return read("a chain", [&](Connection& connection) { return load_same_chain(connection, like, lesson); });
}

void SqliteStore::set_chain_stop(std::string_view id, const StopRule& stop) {
  write("change a chain in", [id = std::string(id), stop](Connection& connection) {
    update_chain_stop(connection, id, stop);
    return true;
  });
}

std::vector<LessonRecord> SqliteStore::lessons(std::string_view scenario) const {
  return read("lessons", [&](Connection& connection) { return load_lessons(connection, scenario); });
}

std::optional<Lesson> SqliteStore::lesson(std::string_view scenario, std::uint64_t number) const {
  return read("a lesson", [&](Connection& connection) { return load_lesson(connection, scenario, number); });
}

std::uint64_t SqliteStore::next_lesson(std::string_view scenario, std::string_view method,
                                       std::string_view ratios,
                                       const std::vector<std::uint64_t>& taken) const {
  return read("lessons", [&](Connection& connection) {
    return load_next_lesson(connection, scenario, method, ratios, taken);
  });
}

std::vector<std::string> SqliteStore::trace(std::string_view chain) const {
  return read("a trace", [&](Connection& connection) { return load_trace(connection, chain); });
}

// --- Samples -----------------------------------------------------------------------------------

Page<SampleRecord> SqliteStore::samples(std::string_view scenario, SampleOrder order, std::size_t limit,
                                        std::string_view cursor) const {
  return read("samples", [&](Connection& connection) {
    return load_samples(connection, scenario, order, limit, cursor);
  });
}

std::optional<SampleRecord> SqliteStore::sample(std::string_view id) const {
  return read("a sample", [&](Connection& connection) { return load_sample(connection, id); });
}

std::optional<std::string> SqliteStore::sample_state(std::string_view id) const {
  return read("a sample", [&](Connection& connection) { return load_state(connection, id); });
}

std::optional<std::string> SqliteStore::sample_animation(std::string_view id) const {
  return read("a sample", [&](Connection& connection) { return load_animation(connection, id); });
}

std::vector<DrawRecord> SqliteStore::draws(std::string_view chain, std::size_t most,
                                           std::uint64_t from_iteration) const {
  return read("draws",
              [&](Connection& connection) { return load_draws(connection, chain, most, from_iteration); });
}

// --- Plays -------------------------------------------------------------------------------------

std::optional<PlayRecord> SqliteStore::play(std::string_view scenario, std::string_view player,
                                            std::string_view idempotency_key, Repeats repeats) {
  auto played = submit(Urgency::play, 0, "write a play to", [&](Connection& connection) {
    return write_play(connection, frontiers_, {scenario, player, idempotency_key, repeats});
  });
  return played.get();
}

// --- Service -----------------------------------------------------------------------------------

std::string SqliteStore::last_error() const {
  return writer_ ? writer_->last_error() : std::string();
}

std::vector<std::string> SqliteStore::damages() const {
  return damages_.first();
}

StoreTotals SqliteStore::totals() const {
  auto totals = read("totals", load_totals);
  totals.damaged_rows = damages_.count();
  for (const char* file : {"", "-wal"}) {
    std::error_code missing;
    const auto bytes = std::filesystem::file_size(path_ + file, missing);
    if (!missing) totals.file_bytes += bytes;
  }
  if (writer_) {
    totals.queued_commits = writer_->queued_jobs();
    totals.failed_commits = writer_->failed_jobs();
  }
  return totals;
}

void SqliteStore::backup(const std::string& path) const {
  read("a backup", [&](Connection& connection) { write_backup(connection, absolute_path(path)); });
}

std::vector<std::string> SqliteStore::check() const {
  try {
    return read("the file", find_faults);
  } catch (const StoreError& error) {
    return {error.what()};
  }
}

}  // namespace retake::database
