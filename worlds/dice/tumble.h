// Tumble: dice from their launches until all of them rest, in the grid's frame - from scratch, or from what
// another run has recorded. Paper, section 5.4; doc/design.md, section 3. It must not know where the grid
// lies in the world, paint or wishes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sampler/interruption.h"
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
  std::vector<Launch> dice;  ///< ascending by step; at most 32
  TableContent table;
  std::int64_t latest_step = 0;  ///< what moves after so many steps never rests
};

/// How one die went.
struct DiePath {
  std::int64_t launch_step = 0;
  std::vector<DieState> states;     ///< after k steps from its launch on, until it rests for good
  std::vector<FirstTouch> touches;  ///< by step; of control points that it has not looked at before

  std::int64_t last_step() const { return launch_step + static_cast<std::int64_t>(states.size()) - 1; }
  /// Where it is before a step; before it appears, where it will be then.
  const DieState& at(std::int64_t step) const;
};

/// One simulation, whole: 110 bytes a die and step, 0.07 MB a die. Runs share the paths that they have in
/// common, which nobody changes any more.
struct Tumble : retake::Run {
  TumbleScene scene;
  std::vector<std::shared_ptr<DiePath>> paths;
  std::vector<Hit> hits;          ///< as comes_before() has it
  std::vector<Meeting> meetings;  ///< by step
  std::int64_t step_count = 0;
  bool complete = false;  ///< all dice rest at its end; only such a run can be continued from
};

/// The step before which a die goes in `scene` as it did in the record, bit for bit, as long as no other die
/// meets it that does not; none if it goes so to its end.
std::optional<std::int64_t> first_difference(const TableSettings& settings, const TumbleScene& scene,
                                             const Tumble& record, std::size_t die);

enum class TumbleEnd { rests, stopped, failed };

struct TumbleOutcome {
  TumbleEnd end;
  std::int64_t step_count;  ///< from the beginning
  std::int64_t stepped;     ///< steps of single dice that were really done
};

/// A die is looked at so many steps after its launch, ascending, unless it rests; false stops. Steps taken
/// from a record are not looked at.
struct Looks {
  std::size_t die = 0;
  std::span<const std::int64_t> steps{};
  std::function<bool(std::size_t which, const DieState&)> goes_on{};
  bool may_meet = true;  ///< false: the run stops where that die, simulated, meets another one
};

/// Thread safety: one thread at a time. Its memory is reused.
class Tumbler {
 public:
  Tumbler(const EngineSettings& engine, const DieShape& shape, const TableSettings& table);
  Tumbler(const Tumbler&) = delete;
  Tumbler& operator=(const Tumbler&) = delete;

  /// Asked when there are new hits, with all so far: whether to stop.
  using Stop = std::function<bool(std::span<const Hit>)>;

  /// A pure function of `scene`: the record, if there is one, only saves steps. A die follows its record
  /// until something that it depends on is another, and is simulated from then on. Fills `run` unless it is
  /// null. Requires: at least one die; the record is complete and another object than `run`.
  /// Throws: Interrupted, if there is an interruption; the object is then to be destroyed.
  TumbleOutcome simulate(const TumbleScene& scene, const Tumble* record, Tumble* run, const Stop& stop = {},
                         const Looks& looks = {}, const Interruption* interruption = nullptr);

  // Of the last simulation.
  std::span<const DieState> states() const { return states_; }  ///< where it ended
  std::span<const Hit> hits() const { return hits_; }
  /// Control points that a die has looked at.
  std::size_t touch_count(std::size_t die) const;

  const EngineSettings& engine() const { return engine_; }
  const DieShape& shape() const { return shape_; }
  /// The table of the last simulation, to look at.
  Table& table() { return table_; }

 private:
  /// What becomes of a die.
  struct Course {
    const DiePath* followed = nullptr;  ///< its record; null: it is simulated
    std::int64_t leaves = 0;            ///< the step in which the record ends to be of use
    std::shared_ptr<DiePath> path{};    ///< of one that is simulated
    bool appeared = false;              ///< and is simulated
  };

  void begin(const TumbleScene& scene, const Tumble* record, Tumble* run);
  std::int64_t take_over_beginning();
  void take_over(std::int64_t step);
  bool meets_simulated(std::size_t die, std::int64_t step) const;
  void leave_record(std::size_t die, std::int64_t step);
  void appear(std::size_t die, const DieState& state);
  bool all_rest(std::int64_t step) const;
  void advance(std::int64_t step);
  bool goes_on(const Looks& looks, std::int64_t steps_done);
  bool met(std::size_t die, std::size_t meetings_before) const;
  bool is_out_of_bounds() const;
  void keep(const TumbleOutcome& outcome, Tumble* run);
  bool is_simulated(std::size_t die) const { return courses_[die].followed == nullptr; }
  bool rests(const DieState& state) const { return state.quiet_steps >= engine_.rest_steps(); }
  std::shared_ptr<DiePath> take_spare();
  void give_spare(std::shared_ptr<DiePath> path);

  EngineSettings engine_;
  DieShape shape_;
  Table table_;
  DiceStep step_;
  // The simulation under way.
  TumbleScene scene_;
  const Tumble* record_ = nullptr;
  bool keeps_states_ = false;
  std::vector<Course> courses_;
  std::vector<DieState> states_;  ///< of those that are simulated
  std::vector<MovingDie> dice_;   ///< those that have appeared, ascending
  std::vector<Hit> hits_;
  std::vector<Meeting> meetings_;
  std::size_t next_hit_ = 0, next_meeting_ = 0;  ///< of the record
  std::size_t next_look_ = 0;
  std::int64_t stepped_ = 0;
  std::vector<std::shared_ptr<DiePath>> spares_;
};

}  // namespace retake::dice
