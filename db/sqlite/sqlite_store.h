// SqliteStore: the Store in one SQLite file. Reads go to borrowed read-only connections, writes to the one
// writer. doc/design.md, section 5. The rows are written and read in *_rows.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/sqlite/damages.h"
#include "db/sqlite/file_lock.h"
#include "db/sqlite/file_watch.h"
#include "db/sqlite/player_frontiers.h"
#include "db/sqlite/readers.h"
#include "db/sqlite/writer.h"
#include "db/store.h"
#include "db/store_options.h"

namespace retake::database {

class SqliteStore final : public Store {
 public:
  /// Opens the file, creates or migrates its schema.
  /// Throws: StoreError if another daemon holds it, if it is not a Retake store, or if its schema is newer.
  explicit SqliteStore(const std::string& path, const StoreOptions& options = {});

  // --- Scenarios -------------------------------------------------------------------------------
  AddedScenario add_scenario(const ScenarioRecord& scenario) override;
  bool delete_scenario(std::string_view id) override;
  std::optional<ScenarioRecord> scenario(std::string_view id) const override;
  std::optional<WorldVersion> world_of(std::string_view scenario) const override;
  Page<ScenarioRecord> scenarios(std::size_t limit, std::string_view cursor) const override;
  std::vector<std::string> scenarios_without_pilot() const override;
  bool set_pilot(std::string_view id, const PilotTally& pilot) override;
  std::uint64_t sample_count(std::string_view scenario) const override;

  // --- Chains ----------------------------------------------------------------------------------
  void add_chains(const std::vector<ChainRecord>& chains) override;
  std::optional<ChainRecord> chain(std::string_view id) const override;
  std::vector<ChainRecord> chains(std::string_view scenario) const override;
  Page<ChainRecord> chains(std::string_view scenario, std::size_t limit,
                           std::string_view cursor) const override;
  std::vector<ChainRecord> chains_in_states(const std::vector<ChainState>& states) const override;
  std::string checkpoint(std::string_view chain) const override;
  void set_chain_state(std::string_view id, ChainState state, std::string_view ended_by,
                       std::string_view error) override;
  std::future<std::uint64_t> commit(ChainProgress progress) override;
  std::optional<ChainRecord> same_chain(const ChainRecord& like,
                                        std::optional<std::uint64_t> lesson) const override;
  void set_chain_stop(std::string_view id, const StopRule& stop) override;
  std::vector<LessonRecord> lessons(std::string_view scenario) const override;
  std::optional<Lesson> lesson(std::string_view scenario, std::uint64_t number) const override;
  std::uint64_t next_lesson(std::string_view scenario, std::string_view method, std::string_view ratios,
                            const std::vector<std::uint64_t>& taken) const override;
  std::vector<std::string> trace(std::string_view chain) const override;

  // --- Samples ---------------------------------------------------------------------------------
  Page<SampleRecord> samples(std::string_view scenario, SampleOrder order, std::size_t limit,
                             std::string_view cursor) const override;
  std::optional<SampleRecord> sample(std::string_view id) const override;
  std::optional<std::string> sample_state(std::string_view id) const override;
  std::optional<std::string> sample_animation(std::string_view id) const override;
  std::vector<DrawRecord> draws(std::string_view chain, std::size_t most,
                                std::uint64_t from_iteration) const override;

  // --- Plays -----------------------------------------------------------------------------------
  std::optional<PlayRecord> play(std::string_view scenario, std::string_view player,
                                 std::string_view idempotency_key,
                                 Repeats repeats = Repeats::allowed) override;

  // --- Service ---------------------------------------------------------------------------------
  std::string last_error() const override;
  std::vector<std::string> damages() const override;
  StoreTotals totals() const override;
  void backup(const std::string& path) const override;
  std::vector<std::string> check() const override;

 private:
  /// Reads within one snapshot.
  template <typename Work>
  auto read(const char* what, Work work) const;
  template <typename Work>
  auto submit(Urgency urgency, std::size_t rows, const char* operation, Work work);
  template <typename Work>
  auto write(const char* operation, Work work);
  Writer& writer();
  /// What every connection tells of damage.
  std::function<void(const std::string&)> note_damage();
  void open(const StoreOptions& options);
  /// Everything that writing needs. Throws: StoreError, DatabaseError.
  std::unique_ptr<Connection> open_writing(std::size_t reader_connections);
  void start_writer(std::unique_ptr<Connection> connection, const std::string& reason,
                    const StoreOptions& options);

  // In the order in which they are needed: the last reader closes before the writer's connection, which then
  // folds the write-ahead log into the file; the lock goes last.
  std::string path_;
  mutable Damages damages_;
  std::unique_ptr<FileLock> lock_;
  PlayerFrontiers frontiers_;       ///< the writer's thread's own, as the next
  std::optional<FileWatch> watch_;  ///< once it is open for writing
  std::unique_ptr<Writer> writer_;
  std::unique_ptr<Readers> readers_;
};

}  // namespace retake::database
