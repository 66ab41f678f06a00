// See hit_log.h.
#include "worlds/bowling/hit_log.h"

#include <algorithm>

namespace retake::bowling {
namespace {

constexpr double kSlowestHit = 0.15;   // [m/s], chosen: softer touches cannot be heard
constexpr double kHitDuration = 0.02;  // [s] over which the impulses of a hit are added up
constexpr std::size_t kSurfaces = 6;

}  // namespace

HitLog::HitLog(std::size_t bodies)
    : bodies_(bodies), partners_(bodies + kSurfaces), encounters_(bodies * partners_) {}

void HitLog::clear() {
  std::fill(encounters_.begin(), encounters_.end(), Encounter{});
  hits_.clear();
}

HitLog::Encounter& HitLog::encounter(std::size_t first, std::size_t second, Surface with) {
  const std::size_t partner = with == Surface::pin ? second : bodies_ + static_cast<std::size_t>(with);
  return encounters_[first * partners_ + partner];
}

void HitLog::touch(std::size_t first, std::size_t second, const Contact& contact, double approach) {
  Encounter& meeting = encounter(first, second, contact.with);
  meeting.seen = true;
  if (meeting.hit || approach < kSlowestHit) return;
  meeting = {.hit = true, .seen = true, .point = contact.point, .normal = contact.normal};
}

void HitLog::push(std::size_t first, std::size_t second, Surface with, double impulse, double time) {
  Encounter& meeting = encounter(first, second, with);
  if (!meeting.hit) return;
  if (meeting.start < 0) meeting.start = time;
  if (time - meeting.start < kHitDuration) meeting.impulse += impulse;
}

void HitLog::end_step() {
  for (std::size_t first = 0; first < bodies_; ++first)
    for (std::size_t partner = 0; partner < partners_; ++partner) {
      Encounter& meeting = encounters_[first * partners_ + partner];
      if (!meeting.seen) close(first, partner);
      meeting.seen = false;
    }
}

void HitLog::close(std::size_t first, std::size_t partner) {
  Encounter& meeting = encounters_[first * partners_ + partner];
  if (meeting.hit && meeting.impulse > 0)
    hits_.push_back({.time = meeting.start,
                     .first = first,
                     .second = partner,
                     .with = partner < bodies_ ? Surface::pin : static_cast<Surface>(partner - bodies_),
                     .impulse = meeting.impulse,
                     .point = meeting.point,
                     .normal = meeting.normal});
  meeting.hit = false;
}

const std::vector<Hit>& HitLog::finish() {
  for (std::size_t first = 0; first < bodies_; ++first)
    for (std::size_t partner = 0; partner < partners_; ++partner)
      close(first, partner);
  std::stable_sort(hits_.begin(), hits_.end(), [](const Hit& a, const Hit& b) { return a.time < b.time; });
  return hits_;
}

}  // namespace retake::bowling
