// Simulator: what a chain needs of physics - a State goes in, a Score comes out.
// Paper, section 4, line 5 of the algorithm. It must not know bodies, constraint terms or files.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sampler/model.h"

namespace retake {

/// What the constraint terms say of an animation.
struct Score {
  double log_constraint = -std::numeric_limits<double>::infinity();  ///< log p_c <= 0, up to a constant
  bool satisfied = false;
  std::vector<double> measures;  ///< in the order of Target::measure_names; NaN where there is none
};

/// What a simulator keeps of one simulation so that a later one may continue from it: checkpoints, first
/// touches. Owned by a chain, a Run outlives the simulator that wrote it and may be read by another thread's
/// simulator.
class Run {
 public:
  virtual ~Run() = default;
};

/// How a simulation ended.
enum class SimulationEnd {
  complete,  ///< the Score is whole
  stopped,   ///< early: log_constraint can no longer exceed `needed`, or by the watch; the Score is not to be
             ///< read
  failed,    ///< it exploded or never came to rest; a rejected candidate
};

/// Looks at a simulation under way, where the world has checkpoints for those who do.
class Watch {
 public:
  virtual ~Watch() = default;
  /// Which of the bodies that move is looked at.
  virtual std::size_t body() const { return 0; }
  /// Whether the simulation goes on if that body meets another one.
  virtual bool may_meet() const { return true; }
  /// `seconds` [s] are simulated; the world says what `features` of a checkpoint are. False: the simulation
  /// is stopped.
  virtual bool goes_on(std::size_t checkpoint, double seconds, std::span<const double> features) = 0;
};

struct SimulationRequest {
  /// The candidate is of use only if its log_constraint exceeds this, strictly; a simulation may stop once it
  /// cannot.
  double needed = -std::numeric_limits<double>::infinity();
  /// The simulation of the State from which the candidate was proposed, if it was recorded: the place to
  /// resume from.
  const State* current_state = nullptr;
  const Run* current_run = nullptr;
  /// Where to record this simulation; null if nobody will resume from it.
  Run* record = nullptr;
  Watch* watch = nullptr;  ///< null if nobody looks
};

struct SimulationOutcome {
  SimulationEnd end = SimulationEnd::failed;
  double simulated_seconds = 0;  ///< [s] of the world's time that was really stepped
  double skipped_seconds = 0;    ///< [s] that resuming or stopping early saved, as far as is known
};

/// Simulates and scores. Reused for many States; owns the scratch memory of one thread.
/// Contract: the outcome is a pure function of the candidate - the same bits whatever ran before, on
/// whichever thread, and whether or not it resumed - except that it may be `stopped` where `needed` permits.
/// Thread safety: one thread at a time.
class Simulator {
 public:
  virtual ~Simulator() = default;
  /// An empty Run for `SimulationRequest::record`; null where the world does not resume.
  virtual std::unique_ptr<Run> make_run() const { return nullptr; }
  /// Throws: Interrupted, where its owner lets others interrupt; see interruption.h.
  virtual SimulationOutcome simulate(const State& candidate, const SimulationRequest& request,
                                     Score& score) = 0;
};

}  // namespace retake
