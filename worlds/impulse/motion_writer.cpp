// See motion_writer.h.
#include "worlds/impulse/motion_writer.h"

#include <algorithm>
#include <tuple>

#include "worlds/impulse/contact_step.h"

namespace retake::impulse {
namespace {

constexpr std::size_t kUsualSteps = 1100;  // from drop to rest

std::vector<Impact>::const_iterator first_impact(const Motion& motion, std::int32_t step) {
  return std::partition_point(motion.impacts.begin(), motion.impacts.end(),
                              [&](const Impact& impact) { return impact.step < step; });
}

}  // namespace

MotionWriter::MotionWriter() : motion_(std::make_shared<Motion>()) {
  motion_->states.reserve(kUsualSteps);
}

MotionWriter::MotionWriter(const SphereState& birth) : MotionWriter() {
  motion_->states.push_back(birth);
}

void MotionWriter::append(const Step& step) {
  const std::int32_t k = motion_->step_count();
  motion_->states.push_back(step.state);
  motion_->impacts.insert(motion_->impacts.end(), step.impacts.begin(), step.impacts.end());
  for (const std::int32_t partner : step.partners)
    meet(partner, k, k + 1);
  stay(step.region, k);
  motion_->rests = step.rests;
}

void MotionWriter::copy(const Motion& source, std::int32_t end) {
  if (motion_->states.empty()) motion_->states.push_back(source.states.front());
  const std::int32_t begin = motion_->step_count();
  if (end <= begin) return;
  motion_->states.insert(motion_->states.end(), source.states.begin() + begin + 1,
                         source.states.begin() + end + 1);
  motion_->impacts.insert(motion_->impacts.end(), first_impact(source, begin), first_impact(source, end));
  for (const Meeting& meeting : source.meetings)
    if (meeting.begin < end && meeting.end > begin)
      meet(meeting.other, std::max(meeting.begin, begin), std::min(meeting.end, end));
  for (std::size_t i = 0; i < source.stays.size() && source.stays[i].begin < end; ++i)
    if (i + 1 == source.stays.size() || source.stays[i + 1].begin > begin)
      stay(source.stays[i].region, std::max(source.stays[i].begin, begin));
  motion_->rests = source.rests && end == source.step_count();
}

/// Continues a meeting that ends where this one begins.
void MotionWriter::meet(std::int32_t other, std::int32_t begin, std::int32_t end) {
  auto& meetings = motion_->meetings;
  const auto last = std::find_if(meetings.rbegin(), meetings.rend(), [&](const Meeting& meeting) {
    return meeting.other == other && meeting.end == begin;
  });
  if (last != meetings.rend())
    last->end = end;
  else
    meetings.push_back({other, begin, end});
}

void MotionWriter::stay(std::uint32_t region, std::int32_t begin) {
  if (motion_->stays.empty() || motion_->stays.back().region != region)
    motion_->stays.push_back({begin, region});
}

std::shared_ptr<const Motion> MotionWriter::finish(const Settings& settings) {
  Motion& motion = *motion_;
  std::sort(motion.meetings.begin(), motion.meetings.end(), [](const Meeting& a, const Meeting& b) {
    return std::tie(a.begin, a.other) < std::tie(b.begin, b.other);
  });
  motion.blocks.clear();
  for (std::int32_t k = 0; k < motion.step_count(); ++k) {
    const Eigen::Vector3d place = fallen_position(settings, motion.states[static_cast<std::size_t>(k)]);
    if (k % Motion::kBlock == 0) motion.blocks.push_back({place, place});
    Motion::Bounds& bounds = motion.blocks.back();
    bounds.low = bounds.low.cwiseMin(place);
    bounds.high = bounds.high.cwiseMax(place);
  }
  return std::move(motion_);
}

bool has_step(const Motion& motion, std::int32_t k, const MotionWriter::Step& step) {
  // The state at its end.
  if (k + 1 > motion.step_count()) return false;
  if (!motion.states[static_cast<std::size_t>(k) + 1].same_bits(step.state)) return false;
  if (step.rests != (motion.rests && k + 1 == motion.step_count())) return false;
  // Partners, each of them once.
  std::size_t met = 0;
  for (const Meeting& meeting : motion.meetings) {
    if (meeting.begin > k || meeting.end <= k) continue;
    ++met;
    if (std::find(step.partners.begin(), step.partners.end(), meeting.other) == step.partners.end())
      return false;
  }
  if (met != step.partners.size()) return false;
  // Impacts.
  const auto begin = first_impact(motion, k), end = first_impact(motion, k + 1);
  return std::equal(begin, end, step.impacts.begin(), step.impacts.end(), same_impact);
}

}  // namespace retake::impulse
