// See tumble.h.
#include "worlds/dice/tumble.h"

#include <algorithm>
#include <optional>

#include "sampler/check.h"

namespace retake::dice {
namespace {

std::optional<ControlPoint> given(const TableContent& content, GridPlace place) {
  const auto found =
      std::lower_bound(content.overrides.begin(), content.overrides.end(), place,
                       [](const Override& one, const GridPlace& wanted) { return one.place < wanted; });
  if (found == content.overrides.end() || found->place != place) return std::nullopt;
  return found->point;
}

/// Whether a control point may be another one.
bool differs(const TableContent& a, const TableContent& b, GridPlace place) {
  const auto in_a = given(a, place), in_b = given(b, place);
  return in_a != in_b || (!in_a && a.key != b.key);
}

}  // namespace

std::int64_t first_difference(const TumbleScene& scene, const Tumble& record) {
  const TumbleScene& before = record.scene;
  if (scene.dice.size() != before.dice.size() || scene.latest_step != before.latest_step) return 0;
  std::int64_t first = record.step_count();
  for (std::size_t die = 0; die < scene.dice.size(); ++die) {
    const Launch &a = scene.dice[die], &b = before.dice[die];
    // A die that has yet to appear is part of the recorded states, but of nothing else.
    if (a.step != b.step || !a.state.same_bits(b.state)) first = std::min({first, a.step, b.step});
  }
  const bool same_table =
      scene.table.key == before.table.key && scene.table.overrides == before.table.overrides;
  if (same_table) return first;
  for (const FirstTouch& touch : record.touches) {
    if (touch.step >= first) break;
    if (differs(scene.table, before.table, touch.place)) return touch.step;
  }
  return first;
}

Tumbler::Tumbler(const EngineSettings& engine, const DieShape& shape, const TableSettings& table)
    : engine_(engine), shape_(shape), table_(table), step_(engine_, shape_, table_) {}

TumbleOutcome Tumbler::simulate(const TumbleScene& scene, const Tumble* record, Tumble* run, const Stop& stop,
                                const Looks& looks) {
  CHECK(!scene.dice.empty() && (!record || (record != run && record->complete)));
  const std::int64_t begin = resume(scene, record, run);
  const auto ended = [&](TumbleEnd end, std::int64_t step) {
    // What was recorded of a run that is played to its end as it was is not looked at again.
    if (step > begin || !record) {
      const auto& touches = table_.first_touches();
      touches_.assign(touches.begin(), touches.end());
    }
    if (run) {
      run->hits.assign(hits_.begin(), hits_.end());
      run->touches = touches_;
      run->complete = end == TumbleEnd::rests;
    }
    return TumbleOutcome{.end = end, .step_count = step, .stepped = step - begin};
  };
  if (!hits_.empty() && stop && stop(hits_)) return ended(TumbleEnd::stopped, begin);

  std::size_t next_look = 0;
  for (std::int64_t step = begin;; ++step) {
    // Who takes part.
    while (dice_.size() < states_.size() && scene.dice[dice_.size()].step <= step)
      dice_.push_back({&states_[dice_.size()], static_cast<std::int32_t>(dice_.size())});
    const bool all_rest =
        dice_.size() == states_.size() &&
        std::all_of(dice_.begin(), dice_.end(), [](const MovingDie& die) { return die.rests; });
    if (all_rest) return ended(TumbleEnd::rests, step);
    if (step >= scene.latest_step) return ended(TumbleEnd::failed, step);

    // Step.
    const std::size_t hits_before = hits_.size();
    step_.advance(step, dice_, hits_);
    if (is_out_of_bounds()) return ended(TumbleEnd::failed, step + 1);
    if (run) run->states.insert(run->states.end(), states_.begin(), states_.end());
    if (hits_.size() > hits_before && stop && stop(hits_)) return ended(TumbleEnd::stopped, step + 1);
    while (next_look < looks.steps.size() && looks.steps[next_look] < step + 1)
      ++next_look;
    if (next_look < looks.steps.size() && looks.steps[next_look] == step + 1 &&
        !looks.goes_on(next_look, states_))
      return ended(TumbleEnd::stopped, step + 1);
  }
}

/// Begins where the record ends to be that of `scene`. Returns the number of steps that are done.
std::int64_t Tumbler::resume(const TumbleScene& scene, const Tumble* record, Tumble* run) {
  content_ = scene.table;
  table_.reset(content_);
  const std::int64_t begin = record ? first_difference(scene, *record) : 0;
  states_.clear();
  dice_.clear();
  hits_.clear();
  touches_.clear();
  if (record) {
    const auto earlier = [begin](const auto& one) { return one.step < begin; };
    std::copy_if(record->hits.begin(), record->hits.end(), std::back_inserter(hits_), earlier);
    std::copy_if(record->touches.begin(), record->touches.end(), std::back_inserter(touches_), earlier);
    if (begin < record->step_count()) table_.restore(touches_);
  }
  for (std::size_t die = 0; die < scene.dice.size(); ++die) {
    const bool waits = scene.dice[die].step >= begin;
    states_.push_back(waits || begin == 0 ? scene.dice[die].state : record->row(begin)[die]);
  }
  for (std::size_t die = 0; die < scene.dice.size() && scene.dice[die].step < begin; ++die)
    dice_.push_back(
        {&states_[die], static_cast<std::int32_t>(die), states_[die].quiet_steps >= engine_.rest_steps()});
  if (!run) return begin;

  // What is recorded from then on continues what was: with the launches of dice that wait.
  run->scene = scene;
  run->complete = false;
  run->states.clear();
  if (!record) {
    run->states.assign(states_.begin(), states_.end());
    return begin;
  }
  run->states.reserve(record->states.size());
  run->states.assign(record->states.begin(),
                     record->states.begin() + (begin + 1) * static_cast<std::int64_t>(states_.size()));
  for (std::int64_t step = 0; step <= begin; ++step)
    for (std::size_t die = 0; die < scene.dice.size(); ++die)
      if (scene.dice[die].step >= step)
        run->states[static_cast<std::size_t>(step) * states_.size() + die] = scene.dice[die].state;
  return begin;
}

/// Whether something exploded.
bool Tumbler::is_out_of_bounds() const {
  constexpr double kFarthest = 100;  // [m]
  return std::any_of(states_.begin(), states_.end(), [](const DieState& state) {
    return !(state.position.squaredNorm() < kFarthest * kFarthest);
  });
}

}  // namespace retake::dice
