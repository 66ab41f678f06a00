// Tumble: dice from their launches until all of them rest, in the grid's frame - from scratch, or from what
// another run has recorded. Paper, section 5.4; DESIGN section 3. It must not know where the grid lies in the
// world, paint or wishes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sampler/simulator.h"
#include "worlds/dice/dice_step.h"

namespace retake::dice {

/// A die that appears.
struct Launch {
  DieState state;
  std::int64_t step;  ///< before which it appears
};

/// What is simulated: everything that decides a run, besides the settings.
struct TumbleScene {
  std::vector<Launch> dice;  ///< ascending by step
  TableContent table;
  std::int64_t latest_step = 0;  ///< what moves after so many steps never rests
};

/// One simulation, whole: 110 bytes a die and step, 0.07 MB a die.
struct Tumble : retake::Run {
  TumbleScene scene;
  std::vector<DieState> states;     ///< after k steps, of each die: a row for each k
  std::vector<Hit> hits;            ///< by step
  std::vector<FirstTouch> touches;  ///< by step
  bool complete = false;            ///< all dice rest at its end; only such a run can be continued from

  std::int64_t step_count() const { return static_cast<std::int64_t>(states.size() / scene.dice.size()) - 1; }
  std::span<const DieState> row(std::int64_t step) const {
    return std::span(states).subspan(static_cast<std::size_t>(step) * scene.dice.size(), scene.dice.size());
  }
};

/// The step before which a run of `scene` is that of the record bit for bit; the record's step_count() if all
/// of it is.
std::int64_t first_difference(const TumbleScene& scene, const Tumble& record);

enum class TumbleEnd { rests, stopped, failed };

struct TumbleOutcome {
  TumbleEnd end;
  std::int64_t step_count;  ///< from the beginning
  std::int64_t stepped;     ///< of these, not taken from the record
};

/// Looked at after so many steps, ascending, each with where the dice are; false stops. Steps taken from a
/// record are not looked at.
struct Looks {
  std::span<const std::int64_t> steps{};
  std::function<bool(std::size_t which, std::span<const DieState>)> goes_on{};
};

/// Thread safety: one thread at a time. Its memory is reused.
class Tumbler {
 public:
  Tumbler(const EngineSettings& engine, const DieShape& shape, const TableSettings& table);
  Tumbler(const Tumbler&) = delete;
  Tumbler& operator=(const Tumbler&) = delete;

  /// Asked when there are new hits, with all so far: whether to stop.
  using Stop = std::function<bool(std::span<const Hit>)>;

  /// A pure function of `scene`: the record, if there is one, only saves steps. Fills `run` unless it is
  /// null. Requires: at least one die; the record is complete and another object than `run`.
  TumbleOutcome simulate(const TumbleScene& scene, const Tumble* record, Tumble* run, const Stop& stop = {},
                         const Looks& looks = {});

  // Of the last simulation.
  std::span<const DieState> states() const { return states_; }  ///< where it ended
  std::span<const Hit> hits() const { return hits_; }
  std::span<const FirstTouch> touches() const { return touches_; }

  const EngineSettings& engine() const { return engine_; }
  const DieShape& shape() const { return shape_; }
  /// The table of the last simulation, to look at.
  Table& table() { return table_; }

 private:
  std::int64_t resume(const TumbleScene& scene, const Tumble* record, Tumble* run);
  bool is_out_of_bounds() const;

  EngineSettings engine_;
  DieShape shape_;
  Table table_;
  DiceStep step_;
  TableContent content_;
  std::vector<DieState> states_;
  std::vector<MovingDie> dice_;  ///< that have appeared
  std::vector<Hit> hits_;
  std::vector<FirstTouch> touches_;
};

}  // namespace retake::dice
