// The Store on SQLite: reads go to borrowed read-only connections, writes to the one writer.
// Realises doc/design.md, section 5. The rows are written and read in *_rows.cpp.
#include "db/store.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "db/sqlite/chain_rows.h"
#include "db/sqlite/file_lock.h"
#include "db/sqlite/play_rows.h"
#include "db/sqlite/readers.h"
#include "db/sqlite/sample_rows.h"
#include "db/sqlite/scenario_rows.h"
#include "db/sqlite/store_file.h"
#include "db/sqlite/writer.h"

namespace retake {

using database::Connection;
using database::Urgency;

class Store::Implementation {
 public:
  Implementation(const std::string& path, const Options& options) : path_(database::absolute_path(path)) {
    try {
      if (!options.read_only) {
        lock_ = std::make_unique<database::FileLock>(path_ + ".lock");
        auto connection = database::open_to_write(path_);
        readers_ = std::make_unique<database::Readers>(path_, options.reader_connections);
        start_writer(std::move(connection), options);
      } else {
        database::require_current(path_);
        readers_ = std::make_unique<database::Readers>(path_, options.reader_connections);
      }
    } catch (const StoreError&) {
      throw;
    } catch (const database::LockedElsewhere&) {
      throw StoreError("store: " + path_ + " is in use by another daemon");
    } catch (const std::exception& error) {
      throw StoreError("store: cannot open " + path_ + ": " + error.what());
    }
  }

  /// Reads within one snapshot.
  template <typename Work>
  auto read(const char* what, Work work) {
    try {
      database::Readers::Loan loan(*readers_);
      return work(loan.connection());
    } catch (const database::DatabaseError& error) {
      throw StoreError(std::string("store: cannot read ") + what + " from " + path_ + ": " + error.what());
    }
  }

  template <typename Work>
  auto submit(Urgency urgency, std::size_t rows, const char* operation, Work work) {
    return writer().submit(urgency, rows, operation, std::move(work));
  }
  template <typename Work>
  auto write(const char* operation, Work work) {
    return submit(Urgency::immediate, 0, operation, std::move(work)).get();
  }

  database::Writer& writer() {
    if (!writer_) throw StoreError("store: " + path_ + " is open for reading only");
    return *writer_;
  }
  const database::Writer* writer_or_none() const { return writer_.get(); }
  database::PlayerFrontiers& frontiers() { return frontiers_; }
  const std::string& path() const { return path_; }

 private:
  void start_writer(std::unique_ptr<Connection> connection, const Options& options) {
    writer_ = std::make_unique<database::Writer>(
        std::move(connection), database::Writer::Options{
                                   .path = path_,
                                   .batch_rows = options.batch_rows,
                                   .batch_time = std::chrono::duration<double>(options.batch_seconds),
                                   .rolled_back = [this] { frontiers_.clear(); },
                                   .upkeep = database::purge,
                               });
  }

  // In the order in which they are needed: the last reader closes before the writer's connection, which then
  // folds the write-ahead log into the file; the lock goes last.
  std::string path_;
  std::unique_ptr<database::FileLock> lock_;
  database::PlayerFrontiers frontiers_;  // the writer's thread's own
  std::unique_ptr<database::Writer> writer_;
  std::unique_ptr<database::Readers> readers_;
};

Store::Store(const std::string& path, Options options)
    : implementation_(std::make_unique<Implementation>(path, options)) {}
Store::~Store() = default;

// --- Scenarios ---------------------------------------------------------------------------------

Store::AddedScenario Store::add_scenario(const ScenarioRecord& scenario) {
  return implementation_->write("add a scenario to", [&](Connection& connection) {
    return database::insert_scenario(connection, scenario);
  });
}

bool Store::delete_scenario(std::string_view id) {
  const bool deleted = implementation_->write("delete a scenario from", [&](Connection& connection) {
    return database::delete_scenario(connection, id);
  });
  if (deleted) implementation_->writer().wake_upkeep();
  return deleted;
}

std::optional<ScenarioRecord> Store::scenario(std::string_view id) const {
  return implementation_->read(
      "a scenario", [&](Connection& connection) { return database::load_scenario(connection, id); });
}

Page<ScenarioRecord> Store::scenarios(std::size_t limit, std::string_view cursor) const {
  return implementation_->read("scenarios", [&](Connection& connection) {
    return database::load_scenarios(connection, limit, cursor);
  });
}

std::vector<std::string> Store::scenarios_without_pilot() const {
  return implementation_->read("scenarios", database::load_scenarios_without_pilot);
}

bool Store::set_pilot(std::string_view id, const PilotTally& pilot) {
  return implementation_->write("write a pilot to", [&](Connection& connection) {
    return database::write_pilot(connection, id, pilot);
  });
}

std::uint64_t Store::sample_count(std::string_view scenario) const {
  return implementation_->read(
      "a scenario", [&](Connection& connection) { return database::count_samples(connection, scenario); });
}

// --- Chains ------------------------------------------------------------------------------------

void Store::add_chains(const std::vector<ChainRecord>& chains) {
  for (const auto& chain : chains) {
    if (chain.id.empty() || chain.id.find('-') != std::string::npos) {
      throw std::logic_error("a chain's id must not be empty nor hold '-': " + chain.id);
    }
  }
  implementation_->write("add chains to", [&](Connection& connection) {
    for (const auto& chain : chains) {
      if (!database::insert_chain(connection, chain)) {
        throw StoreError("store: cannot add chains to " + implementation_->path() +
                         ": there is no scenario " + chain.scenario);
      }
    }
    return true;
  });
}

std::optional<ChainRecord> Store::chain(std::string_view id) const {
  return implementation_->read("a chain",
                               [&](Connection& connection) { return database::load_chain(connection, id); });
}

std::vector<ChainRecord> Store::chains(std::string_view scenario) const {
  return implementation_->read(
      "chains", [&](Connection& connection) { return database::load_chains(connection, scenario); });
}

std::vector<ChainRecord> Store::chains_in_states(const std::vector<ChainState>& states) const {
  return implementation_->read(
      "chains", [&](Connection& connection) { return database::load_chains_in_states(connection, states); });
}

std::string Store::checkpoint(std::string_view chain) const {
  return implementation_->read(
      "a checkpoint", [&](Connection& connection) { return database::load_checkpoint(connection, chain); });
}

void Store::set_chain_state(std::string_view id, ChainState state, std::string_view ended_by,
                            std::string_view error) {
  implementation_->write("set the state of a chain in", [&](Connection& connection) {
    database::update_chain_state(connection, id, state, ended_by, error);
    return true;
  });
}

std::future<std::uint64_t> Store::commit(ChainProgress progress) {
  const auto rows = progress.samples.size();
  // Somebody waits for a chain that pauses or ends.
  const Urgency urgency = progress.state ? Urgency::immediate : Urgency::batched;
  return implementation_->submit(urgency, rows, "write a chain's progress to",
                                 [progress = std::move(progress)](Connection& connection) {
                                   return database::write_progress(connection, progress);
                                 });
}

std::vector<std::string> Store::trace(std::string_view chain) const {
  return implementation_->read(
      "a trace", [&](Connection& connection) { return database::load_trace(connection, chain); });
}

// --- Samples -----------------------------------------------------------------------------------

Page<SampleRecord> Store::samples(std::string_view scenario, SampleOrder order, std::size_t limit,
                                  std::string_view cursor) const {
  return implementation_->read("samples", [&](Connection& connection) {
    return database::load_samples(connection, scenario, order, limit, cursor);
  });
}

std::optional<SampleRecord> Store::sample(std::string_view id) const {
  return implementation_->read("a sample",
                               [&](Connection& connection) { return database::load_sample(connection, id); });
}

std::optional<std::string> Store::sample_state(std::string_view id) const {
  return implementation_->read("a sample",
                               [&](Connection& connection) { return database::load_state(connection, id); });
}

std::optional<std::string> Store::sample_animation(std::string_view id) const {
  return implementation_->read(
      "a sample", [&](Connection& connection) { return database::load_animation(connection, id); });
}

std::vector<DrawRecord> Store::draws(std::string_view chain, std::size_t most,
                                     std::uint64_t from_iteration) const {
  return implementation_->read("draws", [&](Connection& connection) {
    return database::load_draws(connection, chain, most, from_iteration);
  });
}

// --- Plays -------------------------------------------------------------------------------------

std::optional<PlayRecord> Store::play(std::string_view scenario, std::string_view player,
                                      std::string_view idempotency_key) {
  auto played = implementation_->submit(Urgency::play, 0, "write a play to", [&](Connection& connection) {
    return database::write_play(connection, implementation_->frontiers(), scenario, player, idempotency_key);
  });
  return played.get();
}

// --- Service -----------------------------------------------------------------------------------

std::string Store::last_error() const {
  const auto* writer = implementation_->writer_or_none();
  return writer == nullptr ? std::string() : writer->last_error();
}

StoreTotals Store::totals() const {
  auto totals = implementation_->read("totals", database::load_totals);
  for (const char* file : {"", "-wal"}) {
    std::error_code missing;
    const auto bytes = std::filesystem::file_size(implementation_->path() + file, missing);
    if (!missing) totals.file_bytes += bytes;
  }
  if (const auto* writer = implementation_->writer_or_none()) {
    totals.queued_commits = writer->queued_jobs();
    totals.failed_commits = writer->failed_jobs();
  }
  return totals;
}

void Store::backup(const std::string& path) const {
  implementation_->read("a backup", [&](Connection& connection) {
    database::write_backup(connection, database::absolute_path(path));
  });
}

std::vector<std::string> Store::check() const {
  try {
    return implementation_->read("the file", database::find_faults);
  } catch (const StoreError& error) {
    return {error.what()};
  }
}

}  // namespace retake
