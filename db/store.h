// Store: everything durable. Scenarios, chains with their checkpoints, samples, plays and traces.
// doc/design.md, section 5: one writer that batches commits, read-only connections for everything else.
// Callers must not know which database it is; the Store must not know what a world or a keyframe is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/errors.h"
#include "db/page.h"
#include "db/records.h"

namespace retake {

/// The durable state of one Retake.
/// Thread safety: every method may be called from any thread. Writes are queued to one writer thread
/// and committed in groups; a call that returns (or a future that is ready) says that its write is committed.
/// Throws: StoreUnavailable when the disk fails (full, read-only, file gone); the next call tries again.
/// Other StoreErrors last. Every row that is read is checked: Damaged where one that is asked for is not what
/// was written; lists leave it out.
class Store {
 public:
  Store() = default;
  /// Commits what is queued, then closes.
  virtual ~Store() = default;
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // --- Scenarios -------------------------------------------------------------------------------

  /// Adds a scenario unless one with the same id is there. Durable when it returns.
  virtual AddedScenario add_scenario(const ScenarioRecord& scenario) = 0;
  /// Deletes a scenario with its chains, samples, plays and traces: nothing of it is found once this returns,
  /// its space is freed little by little afterwards. False: it was not there.
  virtual bool delete_scenario(std::string_view id) = 0;
  virtual std::optional<ScenarioRecord> scenario(std::string_view id) const = 0;
  /// For which world a scenario was made, whatever else of it is damaged. Empty: no such scenario.
  virtual std::optional<WorldVersion> world_of(std::string_view scenario) const = 0;
  /// Newest first. Throws: BadCursor.
  virtual Page<ScenarioRecord> scenarios(std::size_t limit, std::string_view cursor) const = 0;
  /// Those for which set_pilot was never called, oldest first.
  virtual std::vector<std::string> scenarios_without_pilot() const = 0;
  /// Durable when it returns. False: there is no such scenario.
  virtual bool set_pilot(std::string_view id, const PilotTally& pilot) = 0;
  /// How many samples the scenario holds; 0 if there is no such scenario.
  virtual std::uint64_t sample_count(std::string_view scenario) const = 0;

  // --- Chains ----------------------------------------------------------------------------------

  /// Adds chains in one transaction. Durable when it returns. Throws: StoreError if the scenario is gone.
  /// Requires: ids that are not empty and hold no '-'.
  virtual void add_chains(const std::vector<ChainRecord>& chains) = 0;
  virtual std::optional<ChainRecord> chain(std::string_view id) const = 0;
  /// In the order in which they were added.
  virtual std::vector<ChainRecord> chains(std::string_view scenario) const = 0;
  /// The same, a page at a time. Throws: BadCursor.
  virtual Page<ChainRecord> chains(std::string_view scenario, std::size_t limit,
                                   std::string_view cursor) const = 0;
  /// Every chain of every scenario in one of these states, in the order in which they were added.
  virtual std::vector<ChainRecord> chains_in_states(const std::vector<ChainState>& states) const = 0;
  /// The chain of a scenario with this one's method, ratios, seed and index, and the lesson if there is one
  /// given; of several the oldest.
  virtual std::optional<ChainRecord> same_chain(const ChainRecord& like,
                                                std::optional<std::uint64_t> lesson) const = 0;
  /// The checkpoint committed last, empty if there is none yet.
  virtual std::string checkpoint(std::string_view chain) const = 0;
  /// Sets the state of a chain, and with it why it ended or failed. Durable when it returns. A chain that was
  /// deleted meanwhile is left out. `running` counts an attempt, also of one that is running already; the
  /// next commit() of its progress forgets them.
  virtual void set_chain_state(std::string_view id, ChainState state, std::string_view ended_by,
                               std::string_view error) = 0;

  /// Durable when it returns. A chain that was deleted meanwhile is left out.
  virtual void set_chain_stop(std::string_view id, const StopRule& stop) = 0;

  /// Queues what a chain did since its last commit: new samples, the weight of the sample it stands on, its
  /// counters, its checkpoint, its trace and what it has learned, all in one transaction. Samples are unique
  /// by (chain, iteration, replica): one that is there already keeps its row and plays and takes the new
  /// weight. Progress of a chain that was deleted meanwhile is dropped. The future is ready once it is
  /// committed, and holds how many samples the scenario has then (0 if it was dropped), or a StoreError;
  /// nothing of the progress is stored then. The queue has no bound: wait for the futures.
  virtual std::future<std::uint64_t> commit(ChainProgress progress) = 0;

  /// The lessons of a scenario, in the order of their numbers.
  virtual std::vector<LessonRecord> lessons(std::string_view scenario) const = 0;
  virtual std::optional<Lesson> lesson(std::string_view scenario, std::uint64_t number) const = 0;
  /// Which lesson a new chain of this method and these ratios begins from: the newest proposal; else, of the
  /// places that are not `taken` and from which no chain went on (one that is under way, or found a sample),
  /// the one that waits longest; else the newest one that is unfinished. Other versions are left out. 0:
  /// none.
  virtual std::uint64_t next_lesson(std::string_view scenario, std::string_view method,
                                    std::string_view ratios,
                                    const std::vector<std::uint64_t>& taken) const = 0;

  /// A chain's trace: the blobs of its trace blocks in order, damaged ones left out.
  virtual std::vector<std::string> trace(std::string_view chain) const = 0;

  // --- Samples ---------------------------------------------------------------------------------

  /// Throws: BadCursor. Plays, weight and measures included; state and animation not.
  virtual Page<SampleRecord> samples(std::string_view scenario, SampleOrder order, std::size_t limit,
                                     std::string_view cursor) const = 0;
  virtual std::optional<SampleRecord> sample(std::string_view id) const = 0;
  /// The State of a sample as it was committed, and its recorded animation. Empty optional: no such sample.
  virtual std::optional<std::string> sample_state(std::string_view id) const = 0;
  virtual std::optional<std::string> sample_animation(std::string_view id) const = 0;
  /// At most `most` samples of a chain, evenly spaced over its satisfied iterations counted with their
  /// weights, in the order of the chain: sample k is the one on which the chain stood at the k-th of `most`
  /// equal parts, so a sample of large weight comes up repeatedly. Samples after (not at) `from_iteration`
  /// only.
  virtual std::vector<DrawRecord> draws(std::string_view chain, std::size_t most,
                                        std::uint64_t from_iteration = 0) const = 0;

  // --- Plays -----------------------------------------------------------------------------------

  /// Hands out a sample, so that what is handed out follows the weights; doc/design.md, section 5, "Plays".
  /// With a player: one that the player has not seen, of the even ones before the rest, the least-played and
  /// of these the oldest; else the one seen longest ago (`repeat`), which is no play of something new and
  /// leaves the counts of plays as they are. Without a player: any, as often as it weighs. What was found
  /// while learning is handed out only as long as nothing counts, what follows the paper's ratios never.
  /// The same non-empty idempotency key for the same scenario gives the same play again.
  /// Survives a killed process when it returns, a power cut within a second.
  /// Empty: the scenario has nothing to hand out (or does not exist), or it would be a refused repeat.
  /// Damaged samples are passed over, for good. Throws: IdempotencyConflict if the key was used with another
  /// player; Damaged if the play that it gave, or the sample of that play, is.
  virtual std::optional<PlayRecord> play(std::string_view scenario, std::string_view player,
                                         std::string_view idempotency_key,
                                         Repeats repeats = Repeats::allowed) = 0;

  // --- Service ---------------------------------------------------------------------------------

  /// Why writing does not work, empty when it does: the error of the last failed write, or what is wrong with
  /// the file. The store looks and tries by itself, so this is known, and over, within a second without a
  /// write. One that was refused (no such scenario, a conflicting key) has not failed.
  virtual std::string last_error() const = 0;
  /// What was found to be damaged since the store was opened, "sample c-4 is damaged: …", first met first; no
  /// more than the first hundred.
  virtual std::vector<std::string> damages() const = 0;
  /// Totals for the metrics page.
  virtual StoreTotals totals() const = 0;
  /// Writes a consistent copy to a new file, while the store is in use. Throws: StoreError if the file
  /// exists.
  virtual void backup(const std::string& path) const = 0;
  /// What is wrong with the file: integrity, damaged rows, foreign keys, counts and missing blobs, one line a
  /// fault; empty when sound. Reads the whole file.
  virtual std::vector<std::string> check() const = 0;
};

}  // namespace retake
