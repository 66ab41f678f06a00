// See tumble.h.
#include "worlds/dice/tumble.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "sampler/check.h"

namespace retake::dice {
namespace {

constexpr std::int64_t kNeverLeaves = std::numeric_limits<std::int64_t>::max();

const Override* given(const TableContent& content, GridPlace place) {
  const auto found =
      std::lower_bound(content.overrides.begin(), content.overrides.end(), place,
                       [](const Override& one, const GridPlace& wanted) { return one.place < wanted; });
  return found == content.overrides.end() || found->place != place ? nullptr : &*found;
}

/// Whether a control point is another one on another table.
bool differs(const TableSettings& settings, const TableContent& a, const TableContent& b, GridPlace place) {
  const Override *in_a = given(a, place), *in_b = given(b, place);
  if (in_a && in_b) return in_a->point != in_b->point;
  if (!in_a && !in_b && a.key == b.key) return false;
  return control_point(settings, a, place) != control_point(settings, b, place);
}

}  // namespace

const DieState& DiePath::at(std::int64_t step) const {
  const auto last = static_cast<std::int64_t>(states.size()) - 1;
  return states[static_cast<std::size_t>(std::clamp<std::int64_t>(step - launch_step, 0, last))];
}

std::optional<std::int64_t> first_difference(const TableSettings& settings, const TumbleScene& scene,
                                             const Tumble& record, std::size_t die) {
  const TumbleScene& before = record.scene;
  if (scene.dice.size() != before.dice.size() || scene.latest_step != before.latest_step) return 0;
  const Launch &a = scene.dice[die], &b = before.dice[die];
  if (a.step != b.step || !a.state.same_bits(b.state)) return std::min(a.step, b.step);
  if (scene.table.key == before.table.key && scene.table.overrides == before.table.overrides)
    return std::nullopt;
  for (const FirstTouch& touch : record.paths[die]->touches)
    if (differs(settings, scene.table, before.table, touch.place)) return touch.step;
  return std::nullopt;
}

Tumbler::Tumbler(const EngineSettings& engine, const DieShape& shape, const TableSettings& table)
    : engine_(engine), shape_(shape), table_(table), step_(engine_, shape_, table_) {}

TumbleOutcome Tumbler::simulate(const TumbleScene& scene, const Tumble* record, Tumble* run, const Stop& stop,
                                const Looks& looks, const Interruption* interruption) {
  CHECK(!scene.dice.empty() && (!record || (record != run && record->complete)));
  begin(scene, record, run);
  const auto ended = [&](TumbleEnd end, std::int64_t step) {
    const TumbleOutcome outcome{.end = end, .step_count = step, .stepped = stepped_};
    keep(outcome, run);
    return outcome;
  };
  std::int64_t step = take_over_beginning();
  if (!hits_.empty() && stop && stop(hits_)) return ended(TumbleEnd::stopped, step);
  for (;; ++step) {
    if (interruption) interruption->check();
    take_over(step);
    for (std::size_t die = 0; die < courses_.size(); ++die)
      if (is_simulated(die) && !courses_[die].appeared && scene_.dice[die].step <= step)
        appear(die, scene_.dice[die].state);
    if (all_rest(step)) return ended(TumbleEnd::rests, step);
    if (step >= scene_.latest_step) return ended(TumbleEnd::failed, step);

    const std::size_t hits_before = hits_.size(), meetings_before = meetings_.size();
    advance(step);
    if (!looks.may_meet && met(looks.die, meetings_before)) return ended(TumbleEnd::stopped, step + 1);
    if (is_out_of_bounds()) return ended(TumbleEnd::failed, step + 1);
    if (hits_.size() > hits_before && stop && stop(hits_)) return ended(TumbleEnd::stopped, step + 1);
    if (!goes_on(looks, step + 1)) return ended(TumbleEnd::stopped, step + 1);
  }
}

void Tumbler::begin(const TumbleScene& scene, const Tumble* record, Tumble* run) {
  scene_ = scene;
  record_ = record;
  keeps_states_ = run != nullptr;
  table_.reset(scene_.table);
  for (Course& course : courses_)
    give_spare(std::move(course.path));
  if (run) {
    for (auto& path : run->paths)
      give_spare(std::move(path));
    run->paths.clear();
  }
  courses_.assign(scene.dice.size(), {});
  states_.resize(scene.dice.size());
  dice_.clear();
  hits_.clear();
  meetings_.clear();
  next_hit_ = next_meeting_ = next_look_ = 0;
  stepped_ = 0;
  for (std::size_t die = 0; die < courses_.size(); ++die) {
    states_[die] = scene.dice[die].state;
    const bool follows = record && record->scene.dice.size() == courses_.size();
    if (follows) {
      courses_[die].followed = record->paths[die].get();
      courses_[die].leaves = first_difference(table_.settings(), scene, *record, die).value_or(kNeverLeaves);
    } else {
      courses_[die].path = take_spare();
      courses_[die].path->launch_step = scene.dice[die].step;
    }
  }
}

/// Returns the step before which all dice follow their records.
std::int64_t Tumbler::take_over_beginning() {
  std::int64_t step = 0;
  if (!is_simulated(0)) {
    step = record_->step_count;
    for (const Course& course : courses_)
      step = std::min(step, course.leaves);
  }
  if (!record_) return step;
  for (; next_hit_ < record_->hits.size() && record_->hits[next_hit_].step < step; ++next_hit_)
    hits_.push_back(record_->hits[next_hit_]);
  for (; next_meeting_ < record_->meetings.size() && record_->meetings[next_meeting_].step < step;
       ++next_meeting_)
    meetings_.push_back(record_->meetings[next_meeting_]);
  return step;
}

/// Those leave their records in this step who depend on what is another, or on one that is simulated: that
/// they met, or that they may meet now.
void Tumbler::take_over(std::int64_t step) {
  const auto follows = [&](std::size_t die) { return !is_simulated(die); };
  for (std::size_t die = 0; die < courses_.size(); ++die)
    if (follows(die) && courses_[die].leaves <= step) leave_record(die, step);
  if (!record_) return;

  const std::vector<Meeting>& met = record_->meetings;
  for (bool somebody_left = true; somebody_left;) {
    somebody_left = false;
    const auto leave = [&](std::size_t die) {
      leave_record(die, step);
      somebody_left = true;
    };
    for (std::size_t i = next_meeting_; i < met.size() && met[i].step == step; ++i) {
      const auto a = static_cast<std::size_t>(met[i].first), b = static_cast<std::size_t>(met[i].second);
      if (follows(a) != follows(b)) leave(follows(a) ? a : b);
    }
    for (std::size_t die = 0; die < courses_.size(); ++die)
      if (follows(die) && meets_simulated(die, step)) leave(die);
  }
  for (; next_meeting_ < met.size() && met[next_meeting_].step <= step; ++next_meeting_)
    if (follows(static_cast<std::size_t>(met[next_meeting_].first))) meetings_.push_back(met[next_meeting_]);
}

/// Whether one that follows its record may meet one that is simulated.
bool Tumbler::meets_simulated(std::size_t die, std::int64_t step) const {
  if (scene_.dice[die].step > step) return false;
  const DieState& state = courses_[die].followed->at(step);
  return std::any_of(dice_.begin(), dice_.end(), [&](const MovingDie& other) {
    return step_.may_meet(state, rests(state), *other.state, other.rests);
  });
}

void Tumbler::leave_record(std::size_t die, std::int64_t step) {
  Course& course = courses_[die];
  const DiePath& before = *std::exchange(course.followed, nullptr);
  course.path = take_spare();
  DiePath& path = *course.path;
  path.launch_step = scene_.dice[die].step;
  if (path.launch_step >= step) return;  // it has yet to appear
  const auto first_touch =
      std::partition_point(before.touches.begin(), before.touches.end(),
                           [step](const FirstTouch& touch) { return touch.step < step; });
  path.touches.assign(before.touches.begin(), first_touch);
  table_.restore(static_cast<std::int32_t>(die), path.touches);
  if (keeps_states_) {
    const auto known = static_cast<std::ptrdiff_t>(before.states.size());
    path.states.assign(before.states.begin(),
                       before.states.begin() + std::min(step - path.launch_step + 1, known));
  }
  appear(die, before.at(step));
}

void Tumbler::appear(std::size_t die, const DieState& state) {
  Course& course = courses_[die];
  course.appeared = true;
  states_[die] = state;
  if (keeps_states_ && course.path->states.empty()) course.path->states.push_back(state);
  const auto index = static_cast<std::int32_t>(die);
  const auto place =
      std::find_if(dice_.begin(), dice_.end(), [&](const MovingDie& other) { return other.index > index; });
  dice_.insert(
      place,
      {.state = &states_[die], .index = index, .rests = rests(state), .touches = &course.path->touches});
}

bool Tumbler::all_rest(std::int64_t step) const {
  for (const Course& course : courses_)
    if (course.followed ? step < course.followed->last_step() : !course.appeared) return false;
  return std::all_of(dice_.begin(), dice_.end(), [](const MovingDie& die) { return die.rests; });
}

void Tumbler::advance(std::int64_t step) {
  std::uint32_t rested = 0;  // a bit each
  for (const MovingDie& die : dice_)
    rested |= die.rests ? std::uint32_t{1} << die.index : 0;
  const std::size_t hits_before = hits_.size();
  step_.advance(step, dice_, hits_, meetings_);

  for (const MovingDie& die : dice_) {
    if (die.rests && (rested >> die.index & 1) != 0) continue;
    ++stepped_;
    if (!keeps_states_) continue;
    DiePath& path = *courses_[static_cast<std::size_t>(die.index)].path;
    // One that has just been woken was where it rested.
    path.states.resize(static_cast<std::size_t>(step - path.launch_step + 1), path.states.back());
    path.states.push_back(*die.state);
  }

  // What those did that follow their records.
  if (!record_) return;
  const std::vector<Hit>& known = record_->hits;
  const std::size_t simulated = hits_.size();
  for (; next_hit_ < known.size() && known[next_hit_].step <= step; ++next_hit_)
    if (!is_simulated(static_cast<std::size_t>(known[next_hit_].die))) hits_.push_back(known[next_hit_]);
  if (simulated > hits_before && hits_.size() > simulated)
    std::stable_sort(hits_.begin() + static_cast<std::ptrdiff_t>(hits_before), hits_.end(), comes_before);
}

bool Tumbler::goes_on(const Looks& looks, std::int64_t steps_done) {
  if (!looks.goes_on || looks.die >= courses_.size() || !courses_[looks.die].appeared) return true;
  if (rests(states_[looks.die])) return true;
  const std::int64_t steps = steps_done - scene_.dice[looks.die].step;
  while (next_look_ < looks.steps.size() && looks.steps[next_look_] < steps)
    ++next_look_;
  return next_look_ == looks.steps.size() || looks.steps[next_look_] != steps ||
         looks.goes_on(next_look_, states_[looks.die]);
}

bool Tumbler::met(std::size_t die, std::size_t meetings_before) const {
  const auto index = static_cast<std::int32_t>(die);
  return std::any_of(
      meetings_.begin() + static_cast<std::ptrdiff_t>(meetings_before), meetings_.end(),
      [index](const Meeting& meeting) { return meeting.first == index || meeting.second == index; });
}

/// Whether something exploded.
bool Tumbler::is_out_of_bounds() const {
  constexpr double kFarthest = 100;  // [m]
  return std::any_of(dice_.begin(), dice_.end(), [](const MovingDie& die) {
    return !(die.state->position.squaredNorm() < kFarthest * kFarthest);
  });
}

void Tumbler::keep(const TumbleOutcome& outcome, Tumble* run) {
  table_.look_as(0, 0, nullptr);
  for (std::size_t die = 0; die < courses_.size(); ++die)
    if (!is_simulated(die)) states_[die] = courses_[die].followed->at(outcome.step_count);
  if (!run) return;
  run->scene = scene_;
  run->hits.assign(hits_.begin(), hits_.end());
  run->meetings.assign(meetings_.begin(), meetings_.end());
  run->step_count = outcome.step_count;
  run->complete = outcome.end == TumbleEnd::rests;
  for (std::size_t die = 0; die < courses_.size(); ++die)
    run->paths.push_back(is_simulated(die) ? courses_[die].path : record_->paths[die]);
}

std::size_t Tumbler::touch_count(std::size_t die) const {
  const Course& course = courses_[die];
  return (course.followed ? course.followed->touches : course.path->touches).size();
}

std::shared_ptr<DiePath> Tumbler::take_spare() {
  if (spares_.empty()) return std::make_shared<DiePath>();
  std::shared_ptr<DiePath> path = std::move(spares_.back());
  spares_.pop_back();
  path->states.clear();
  path->touches.clear();
  return path;
}

/// Keeps the memory of a path that nobody shares.
void Tumbler::give_spare(std::shared_ptr<DiePath> path) {
  constexpr std::size_t kMost = 8;  // chosen
  if (path && path.use_count() == 1 && spares_.size() < kMost) spares_.push_back(std::move(path));
}

}  // namespace retake::dice
