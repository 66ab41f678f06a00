// Resimulation: runs of spheres over a surface, from scratch or from what another run has recorded.
// doc/design.md, section 3, "Event-local re-simulation". It must not know what is wished.
//
// After a change only those bodies are stepped whose motion may differ; all others follow the record. A
// body leaves the record when a step of it differs in any bit, and joins it again when its state agrees.
// The step itself is in contact_step.h.
#pragma once

#include <functional>
#include <memory>

#include "sampler/interruption.h"
#include "worlds/impulse/run.h"
#include "worlds/impulse/surface.h"

namespace retake::impulse {

/// Called when a body has come to rest, in order of time, then of the bodies' indices; the calls are the same
/// from scratch and from a record. True ends the simulation: the outcome is known to be of no use.
struct Rested {
  std::size_t body;
  std::int64_t step;         ///< number of steps done
  Eigen::Vector3d position;  ///< [m] for good
};
using StopWhen = std::function<bool(const Rested&)>;

enum class RunEnd {
  rests,      ///< everything came to rest: the Run is whole
  unsettled,  ///< something still moved at Scene::latest_step: the Run is whole, but of no use as an
              ///< animation
  stopped,    ///< by StopWhen: the Run is not complete
};

struct ResimulationOutcome {
  RunEnd end;
  std::int64_t body_steps = 0;  ///< that were really computed
};

/// Contract: what `simulate` writes is a pure function of the scene, bit-identical to a run from scratch,
/// whatever the record it starts from and whatever the change, whichever was simulated before, on whichever
/// thread: states, impacts, meetings, stays, and the calls of StopWhen.
/// Cost: linear in the bodies that are stepped; a body that follows the record costs next to nothing. A body
/// whose drop had another index or time in the record (a swap) follows that one's motion.
/// Thread safety: one thread at a time; Runs may come from and go to other threads.
class Resimulation {
 public:
  /// Takes the surface for itself, to move its groups. Requires: sensible Settings, the surface made for
  /// their radius.
  Resimulation(const Settings& settings, std::unique_ptr<Surface> surface);
  ~Resimulation();
  Resimulation(const Resimulation&) = delete;
  Resimulation& operator=(const Resimulation&) = delete;

  const Settings& settings() const;
  const Surface& surface() const;

  /// Simulates `scene`, starting from what `record` has, if there is one, and overwrites `run`.
  /// Requires: record is complete, of equal Settings and an equal surface, and not `run`; run == null: only
  /// the outcome is of interest.
  /// Throws: Interrupted, if there is an interruption; the object is then to be destroyed.
  ResimulationOutcome simulate(const Scene& scene, const Run* record, Run* run,
                               const StopWhen& stop_when = {}, const Interruption* interruption = nullptr);

 private:
  class Simulation;
  std::unique_ptr<Simulation> simulation_;
};

}  // namespace retake::impulse
