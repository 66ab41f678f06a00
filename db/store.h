// Store: everything durable. Scenarios, chains with their checkpoints, samples, plays and traces.
// doc/design.md, section 5: one writer thread that batches commits, read-only connections for everything
// else. Callers must not know which database it is; the Store must not know what a world or a keyframe is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "db/records.h"

namespace retake {

/// The store cannot do what was asked: names the operation and the thing (file, table), never SQL.
class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A page cursor that this store did not hand out, or handed out for another listing.
class BadCursor : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

enum class SampleOrder { newest, oldest, likely };

template <typename Record>
struct Page {
  std::vector<Record> records;
  std::string next_cursor;  ///< empty at the end
};

/// The durable state of one Retake, in one file.
/// Thread safety: every method may be called from any thread. Writes are queued to one writer thread
/// and committed in groups; a call that returns (or a future that is ready) says that its write is committed.
/// Throws: StoreError when the environment fails (disk full, file gone); the next call tries again.
class Store {
 public:
  struct Options {
    bool read_only = false;       ///< for tools that look at a store, also while a daemon serves it
    std::size_t batch_rows = 32;  ///< a group is committed when it holds this many samples, or
    double batch_seconds = 0.05;  ///< when its oldest sample is this old [s]
    std::size_t reader_connections = 4;
  };

  /// Opens the file, creates or migrates its schema.
  /// Throws: StoreError if another daemon holds it, if it is not a Retake store, or if its schema is newer.
  explicit Store(const std::string& path, Options options);
  explicit Store(const std::string& path) : Store(path, Options{}) {}
  /// Commits what is queued, then closes.
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // --- Scenarios -------------------------------------------------------------------------------

  struct AddedScenario {
    ScenarioRecord scenario;
    bool created;  ///< false: the same document was there already
  };
  /// Adds a scenario unless one with the same id is there. Durable when it returns.
  AddedScenario add_scenario(const ScenarioRecord& scenario);
  /// Deletes a scenario with its chains, samples, plays and traces: nothing of it is found once this returns,
  /// its space is freed little by little afterwards. False: it was not there.
  bool delete_scenario(std::string_view id);
  std::optional<ScenarioRecord> scenario(std::string_view id) const;
  /// Newest first. Throws: BadCursor.
  Page<ScenarioRecord> scenarios(std::size_t limit, std::string_view cursor) const;
  /// Those for which set_pilot was never called, oldest first.
  std::vector<std::string> scenarios_without_pilot() const;
  /// Durable when it returns. False: there is no such scenario.
  bool set_pilot(std::string_view id, const PilotTally& pilot);
  /// How many samples the scenario holds; 0 if there is no such scenario.
  std::uint64_t sample_count(std::string_view scenario) const;

  // --- Chains ----------------------------------------------------------------------------------

  /// Adds chains in one transaction. Durable when it returns. Throws: StoreError if the scenario is gone.
  /// Requires: ids that are not empty and hold no '-'.
  void add_chains(const std::vector<ChainRecord>& chains);
  std::optional<ChainRecord> chain(std::string_view id) const;
  /// In the order in which they were added.
  std::vector<ChainRecord> chains(std::string_view scenario) const;
  /// Every chain of every scenario in one of these states, in the order in which they were added.
  std::vector<ChainRecord> chains_in_states(const std::vector<ChainState>& states) const;
  /// The checkpoint committed last, empty if there is none yet.
  std::string checkpoint(std::string_view chain) const;
  /// Sets the state of a chain, and with it why it ended or failed. Durable when it returns. A chain that was
  /// deleted meanwhile is left out.
  void set_chain_state(std::string_view id, ChainState state, std::string_view ended_by,
                       std::string_view error);

  /// Queues what a chain did since its last commit: new samples, the weight of the sample it stands on, its
  /// counters, its checkpoint and its trace, all in one transaction. Samples are unique by (chain, iteration,
  /// replica): one that is there already keeps its row and plays and takes the new weight.
  /// Progress of a chain that was deleted meanwhile is dropped. The future is ready once it is committed, and
  /// holds how many samples the scenario has then (0 if it was dropped), or a StoreError; nothing of the
  /// progress is stored then. The queue has no bound: wait for the futures.
  std::future<std::uint64_t> commit(ChainProgress progress);

  /// A chain's trace: the blobs of its trace blocks in order.
  std::vector<std::string> trace(std::string_view chain) const;

  // --- Samples ---------------------------------------------------------------------------------

  /// Throws: BadCursor. Plays, weight and measures included; state and animation not.
  Page<SampleRecord> samples(std::string_view scenario, SampleOrder order, std::size_t limit,
                             std::string_view cursor) const;
  std::optional<SampleRecord> sample(std::string_view id) const;
  /// The State of a sample as it was committed, and its recorded animation. Empty optional: no such sample.
  std::optional<std::string> sample_state(std::string_view id) const;
  std::optional<std::string> sample_animation(std::string_view id) const;
  /// At most `most` samples of a chain, evenly spaced over its satisfied iterations counted with their
  /// weights, in the order of the chain: sample k is the one on which the chain stood at the k-th of `most`
  /// equal parts, so a sample of large weight comes up repeatedly. Samples after (not at) `from_iteration`
  /// only.
  std::vector<DrawRecord> draws(std::string_view chain, std::size_t most,
                                std::uint64_t from_iteration = 0) const;

  // --- Plays -----------------------------------------------------------------------------------

  /// Hands out a sample. With a player: the least-played one that the player has not seen, else the one seen
  /// longest ago (`repeat`). Without: the least-played one; ties go to the oldest sample. The same non-empty
  /// idempotency key for the same scenario gives the same play again.
  /// Survives a killed process when it returns, a power cut within a second.
  /// Empty: the scenario holds no sample (or does not exist).
  /// Throws: IdempotencyConflict if the key was used with another player.
  std::optional<PlayRecord> play(std::string_view scenario, std::string_view player,
                                 std::string_view idempotency_key);

  // --- Service ---------------------------------------------------------------------------------

  /// The error of the last failed write, empty when the last write succeeded. A write that was refused (no
  /// such scenario, a conflicting key) has not failed.
  std::string last_error() const;
  /// Totals for the metrics page.
  StoreTotals totals() const;
  /// Writes a consistent copy to a new file, while the store is in use. Throws: StoreError if the file
  /// exists.
  void backup(const std::string& path) const;
  /// What is wrong with the file: integrity, foreign keys, counts and missing blobs, one line a fault; empty
  /// when sound. Reads the whole file.
  std::vector<std::string> check() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// An idempotency key came again with another request.
class IdempotencyConflict : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

}  // namespace retake
