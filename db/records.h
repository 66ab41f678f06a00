// Records: what the Store keeps, as plain values with named fields. Times are milliseconds since the Unix
// epoch. Realises doc/design.md, section 5. Blobs are opaque here: their formats belong to the folders that
// write them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sampler/lesson.h"
#include "sampler/odds.h"
#include "sampler/stay.h"

namespace retake {

/// What a first look by draws from the prior found.
struct PilotTally {
  std::uint64_t draws = 0;
  std::uint64_t hits = 0;
  double seconds = 0;  ///< [s] of CPU time
};

struct ScenarioRecord {
  std::string id;
  std::string world;
  int world_version = 1;
  std::string title;
  std::string document;         ///< canonical JSON text with every default filled in
  std::int64_t created_at = 0;  ///< [ms]
  std::uint64_t samples = 0;    ///< filled by the store
  std::uint64_t running = 0;    ///< chains by state, filled by the store; queued ones count as running
  std::uint64_t paused = 0;
  std::uint64_t finished = 0;
  std::uint64_t failed = 0;
  OddsTally odds;                   ///< of its chains, pooled; filled by the store
  std::optional<PilotTally> pilot;  ///< none until set_pilot
};

/// For which world a scenario was made.
struct WorldVersion {
  std::string name;
  int version = 1;
};

struct AddedScenario {
  ScenarioRecord scenario;
  bool created;  ///< false: the same document was there already
};

enum class ChainState { queued, running, paused, finished, failed };
std::string_view to_string(ChainState state);
/// Requires: one of the names that to_string gives.
ChainState chain_state(std::string_view name);

/// When a chain ends by itself; nothing set: when it is stopped.
struct StopRule {
  std::optional<std::uint64_t> samples{};
  std::optional<std::uint64_t> counted{};  ///< samples that count: those of learning do not
  std::optional<std::uint64_t> iterations{};
  std::optional<double> seconds{};     ///< [s] of running time, pauses left out
  std::optional<std::uint64_t> ess{};  ///< effective samples, of the variable or measure that has fewest
};

/// Calls `visit(name, limit...)` for every limit of one or several rules. Who keeps, sends or compares them
/// goes by this list.
template <typename Visitor, typename... Rules>
void visit_limits(Visitor&& visit, Rules&... rules) {
  visit("samples", rules.samples...);
  visit("counted", rules.counted...);
  visit("iterations", rules.iterations...);
  visit("seconds", rules.seconds...);
  visit("ess", rules.ess...);
}

/// Counters that grow while a chain runs: those of the sampler's Chain, and those of whoever runs it.
struct ChainCounters : ChainCounts {
  double run_seconds = 0;            ///< [s] for which the chain has been stepped
  double iterations_per_second = 0;  ///< over the last seconds in which it ran
  std::uint64_t counted = 0;         ///< samples of a weight above 0
  std::optional<std::uint64_t> first_sample_iteration;
  std::optional<double> first_sample_seconds;  ///< run_seconds at the first sample
  std::optional<double> effective_samples;     ///< as judged last
};

struct ChainRecord {
  std::string id;
  std::string scenario;
  std::uint32_t index = 0;  ///< which chain of its request; with the seed it decides every draw
  std::uint64_t seed = 0;   ///< below 2^63
  std::string method;
  std::string ratios;
  std::string settings;      ///< JSON text of further settings of the chain, empty if none
  std::uint64_t lesson = 0;  ///< the number of the lesson that it began from; 0: it learns by itself
  ChainState state = ChainState::queued;
  StopRule stop;
  ChainCounters counters;
  std::string ended_by;         ///< for finished chains: what ended it
  std::string error;            ///< for failed chains
  std::uint64_t attempts = 0;   ///< how often it was set running without any progress since; the store's
  std::int64_t created_at = 0;  ///< [ms], set by the store if 0
};

/// A lesson without its bytes. Its number is the scenario's, counted from 1; neither ever changes.
struct LessonRecord {
  std::uint64_t number = 0;
  std::string method;
  std::string ratios;
  std::string chain;  ///< that learned it
  std::uint32_t version = kLessonVersion;
  LessonKind kind = LessonKind::proposal;
  std::int64_t created_at = 0;  ///< [ms]
};

/// A sample without its blobs. Its id names its place for good: chain, iteration and replica.
struct SampleRecord {
  std::string id;  ///< see sample_id
  std::string scenario;
  std::string chain;
  std::uint64_t iteration = 0;
  std::uint32_t replica = 0;
  std::uint64_t weight =
      1;  ///< how often it counts as a draw of p(A | satisfied); 0: found while it was learning
  double log_prior = 0;
  double log_constraint = 0;
  double duration = 0;   ///< [s]
  std::string measures;  ///< JSON object text
  std::string digest;    ///< of State and Animation, hexadecimal
  std::uint64_t plays = 0;
  std::int64_t created_at = 0;  ///< [ms], set by the store if 0
};

/// "chain-iteration", or "chain-iteration-replica" for a replica other than 0.
/// Requires: the chain's id holds no '-'.
std::string sample_id(std::string_view chain, std::uint64_t iteration, std::uint32_t replica);

/// A sample on its way into the store.
struct NewSample {
  SampleRecord record;
  std::string state;      ///< the State's bytes
  std::string animation;  ///< the recorded Animation's bytes
};

/// The weight that a sample has reached.
struct WeightUpdate {
  std::uint64_t iteration = 0;
  std::uint32_t replica = 0;
  std::uint64_t weight = 1;
};

struct ChainProgress {
  std::string chain;
  std::string scenario;
  std::vector<NewSample> samples;
  std::vector<WeightUpdate> weights;  ///< of samples committed before
  ChainCounters counters;
  std::optional<ChainState> state;  ///< set when the chain's state changes with this commit
  std::string ended_by;
  std::string error;
  std::string checkpoint;
  std::optional<Lesson> lesson;  ///< becomes the scenario's next one
  std::string trace_block;       ///< appended to the trace unless empty
  bool replace_trace = false;    ///< the block takes the place of all earlier ones
};

/// One draw of a chain for the diagnostics.
struct DrawRecord {
  std::uint64_t iteration = 0;
  double log_prior = 0;
  double log_constraint = 0;
  std::string measures;  ///< JSON object text
  std::string state;     ///< the State's bytes
};

/// Whether a player who has seen everything is given something again.
enum class Repeats { allowed, refused };

struct PlayRecord {
  std::string id;
  SampleRecord sample;
  bool repeat = false;
  /// Samples that count and that this player has not seen after this play; without a player, that were never
  /// played. Where nothing counts yet, of what was found while learning.
  std::uint64_t remaining = 0;
  /// Those of them with which the player's plays go on to follow the weights; without a player all of them.
  std::uint64_t even_remaining = 0;
  bool replayed = false;  ///< an idempotency key gave an earlier play again
};

struct StoreTotals {
  std::uint64_t scenarios = 0;
  std::uint64_t samples = 0;
  std::uint64_t plays = 0;
  std::uint64_t queued_commits = 0;  ///< writes that wait for their commit
  std::uint64_t failed_commits = 0;  ///< writes that failed since the store was opened
  std::uint64_t file_bytes = 0;      ///< database and write-ahead log
  std::uint64_t damaged_rows = 0;    ///< met since the store was opened
};

}  // namespace retake
