// Cast: the bodies of a scene while it is simulated, and which motion of a record each of them follows.
// doc/design.md, section 3, "Event-local re-simulation". It must not know how they are stepped.
//
// Every body has a script if the record holds a motion that begins as it does: its own, or that of another
// body that was dropped at the same place. It has to be stepped itself
//   - where a vertex group that has another offset now can matter;
//   - where its script meets a body that is not what it was in the record (`changed`), or anybody, if it is
//     itself not what it was;
//   - from where a record ends that was cut before it was at rest.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "worlds/impulse/motion_writer.h"
#include "worlds/impulse/run.h"
#include "worlds/impulse/surface.h"

namespace retake::impulse {

inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

/// One body of a scene while it is simulated.
struct Actor {
  bool takes_part = false;
  bool is_new = false;  ///< takes part, other than in the record, or only there: changed from the start
  std::int64_t birth = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [m] of birth, then of rest

  std::shared_ptr<const Motion> script;  ///< null: there is none
  bool own_script = false;               ///< what this very body did in the record, at the same time
  bool on_script = false;
  /// Steps in which a body on its script has to be stepped next: [wake, wake_end).
  std::int64_t wake = kNever, wake_end = kNever;

  /// What it did so far, if it ever was off its script; up to where it joined it again if it is on it.
  std::optional<MotionWriter> writer;

  bool rests = false;
  std::int64_t near_until = 0;  ///< until this step it may come near something changed that rests

  // Of the current step.
  std::int64_t searched = -1, joined = -1;  ///< the last steps in which it looked for contacts, and was found
  SphereState fallen;
  std::size_t outcome = 0;  ///< its place in the ContactStep
  std::vector<std::int32_t> partners;
  std::vector<Impact> impacts;

  /// Whether others may not rely on what the record says of it.
  bool changed() const { return is_new || (takes_part && !(on_script && own_script)); }
  std::int32_t since_birth(std::int64_t step) const { return static_cast<std::int32_t>(step - birth); }
  /// The step before which its script ends, in rest or because the record does.
  std::int64_t script_end() const { return birth + script->step_count(); }
  const SphereState& state(std::int64_t step) const {
    return on_script ? script->states[static_cast<std::size_t>(step - birth)] : writer->state();
  }
};

/// Thread safety: one thread at a time.
class Cast {
 public:
  /// Gives every body its script, and finds where it has to be stepped first.
  void assemble(const Scene& scene, const Run* record, const Surface& surface);
  /// Lets go of all motions.
  void release();

  std::size_t size() const { return actors_.size(); }
  Actor& operator[](std::size_t body) { return actors_[body]; }
  const Actor& operator[](std::size_t body) const { return actors_[body]; }

  /// The next steps, from one on, in which a body on its script has to be stepped.
  void find_wake(Actor& actor, std::int64_t from) const;
  /// Wakes those whose scripts meet a body, from a step on: it is not what it was any more.
  void warn_of(std::uint32_t changed, std::int64_t from);

 private:
  void compare_offsets(const Scene& scene, const Run* record);
  void assign_scripts(const Scene& scene, const Run* record);
  bool region_changed(std::uint32_t region) const;

  const Surface* surface_ = nullptr;
  std::vector<Actor> actors_;        ///< by body
  std::vector<bool> group_changed_;  ///< by vertex group
  bool any_group_changed_ = false;
  std::vector<std::uint32_t> loose_;  ///< bodies whose drop in the record is no longer theirs
};

}  // namespace retake::impulse
