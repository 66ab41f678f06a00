// See cast.h.
#include "worlds/impulse/cast.h"

#include <algorithm>

#include "sampler/check.h"

namespace retake::impulse {
namespace {

bool same_drop(const Drop& a, const Drop& b) {
  return a.step == b.step && same_bits(a.place, b.place);
}

}  // namespace

void Cast::assemble(const Scene& scene, const Run* record, const Surface& surface) {
  surface_ = &surface;
  compare_offsets(scene, record);
  assign_scripts(scene, record);
  for (Actor& actor : actors_)
    if (actor.on_script) find_wake(actor, actor.birth);
}

void Cast::release() {
  for (Actor& actor : actors_) {
    actor.script.reset();
    actor.writer.reset();
  }
}

void Cast::compare_offsets(const Scene& scene, const Run* record) {
  group_changed_.assign(scene.offsets.size(), false);
  any_group_changed_ = false;
  if (record == nullptr) return;
  CHECK(record->scene.offsets.size() == scene.offsets.size());
  for (std::size_t group = 0; group < scene.offsets.size(); ++group)
    if (!same_bits(record->scene.offsets[group], scene.offsets[group]))
      group_changed_[group] = any_group_changed_ = true;
}

void Cast::assign_scripts(const Scene& scene, const Run* record) {
  const std::size_t recorded = record == nullptr ? 0 : record->scene.bodies.size();
  actors_.resize(std::max(scene.bodies.size(), recorded));
  loose_.clear();
  for (std::uint32_t body = 0; body < actors_.size(); ++body) {
    const std::optional<Drop> now = body < scene.bodies.size() ? scene.bodies[body] : std::nullopt;
    const std::optional<Drop> then = body < recorded ? record->scene.bodies[body] : std::nullopt;
    const bool same = now && then && same_drop(*now, *then);
    Actor& actor = actors_[body];
    actor = Actor{};
    actor.takes_part = now.has_value();
    actor.is_new = (now || then) && !same;
    if (now) {
      CHECK(now->step >= 0, now->step);
      actor.birth = now->step;
      actor.place = now->place;
    }
    if (same) actor.script = record->motions[body];
    actor.own_script = actor.on_script = same;
    if (then && !same) loose_.push_back(body);
  }
  // A drop that another body had.
  for (Actor& actor : actors_) {
    if (!actor.takes_part || actor.on_script) continue;
    for (const std::uint32_t body : loose_)
      if (same_bits(record->scene.bodies[body]->place, actor.place)) {
        actor.script = record->motions[body];
        actor.on_script = true;
        break;
      }
  }
}

bool Cast::region_changed(std::uint32_t region) const {
  const auto groups = surface_->groups(region);
  return std::any_of(groups.begin(), groups.end(),
                     [&](std::uint32_t group) { return group_changed_[group]; });
}

void Cast::find_wake(Actor& actor, std::int64_t from) const {
  actor.wake = actor.wake_end = kNever;
  const auto consider = [&](std::int64_t begin, std::int64_t end) {
    begin = std::max(begin, from);
    if (begin < end && begin < actor.wake) {
      actor.wake = begin;
      actor.wake_end = end;
    }
  };
  const Motion& script = *actor.script;
  for (const Meeting& meeting : script.meetings)
    if (!actor.own_script || actors_[static_cast<std::size_t>(meeting.other)].changed())
      consider(actor.birth + meeting.begin, actor.birth + meeting.end);
  if (any_group_changed_)
    for (std::size_t i = 0; i < script.stays.size(); ++i) {
      const bool last = i + 1 == script.stays.size();
      const std::int64_t begin = actor.birth + script.stays[i].begin,
                         end = last ? actor.script_end() : actor.birth + script.stays[i + 1].begin;
      if (end <= from || !region_changed(script.stays[i].region)) continue;
      consider(begin, end);
      break;
    }
  // The record ended before it was at rest.
  if (!script.rests) consider(actor.script_end(), kNever);
}

void Cast::warn_of(std::uint32_t changed, std::int64_t from) {
  for (Actor& actor : actors_) {
    if (!actor.on_script || !actor.own_script || actor.rests) continue;
    for (const Meeting& meeting : actor.script->meetings) {
      if (meeting.other != static_cast<std::int32_t>(changed)) continue;
      const std::int64_t begin = std::max(actor.birth + meeting.begin, from), end = actor.birth + meeting.end;
      if (begin >= end || begin >= actor.wake) continue;
      actor.wake = begin;
      actor.wake_end = end;
    }
  }
}

}  // namespace retake::impulse
