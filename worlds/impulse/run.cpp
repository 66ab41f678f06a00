// See run.h.
#include "worlds/impulse/run.h"

#include <algorithm>
#include <bit>
#include <map>

#include "worlds/impulse/surface.h"

namespace retake::impulse {

std::vector<FirstTouch> first_touches(const Motion& motion, const Surface& surface) {
  std::map<std::uint32_t, std::int32_t> first;
  for (const Stay& stay : motion.stays)
    for (const std::uint32_t group : surface.groups(stay.region))
      first.try_emplace(group, stay.begin);
  std::vector<FirstTouch> touches;
  for (const auto& [group, step] : first)
    touches.push_back({group, step});
  return touches;
}

bool same_impact(const Impact& a, const Impact& b) {
  return a.step == b.step && a.other == b.other &&
         std::bit_cast<std::uint64_t>(a.impulse) == std::bit_cast<std::uint64_t>(b.impulse) &&
         same_bits(a.point, b.point) && same_bits(a.normal, b.normal);
}

bool same_bits(const Motion& a, const Motion& b) {
  const auto same = [](const auto& list, const auto& other, const auto& equal) {
    return std::equal(list.begin(), list.end(), other.begin(), other.end(), equal);
  };
  return a.rests == b.rests &&
         same(a.states, b.states, [](const auto& x, const auto& y) { return x.same_bits(y); }) &&
         same(a.impacts, b.impacts, same_impact) &&
         same(a.meetings, b.meetings,
              [](const Meeting& x, const Meeting& y) {
                return x.other == y.other && x.begin == y.begin && x.end == y.end;
              }) &&
         same(a.stays, b.stays,
              [](const Stay& x, const Stay& y) { return x.begin == y.begin && x.region == y.region; }) &&
         same(a.blocks, b.blocks, [](const Motion::Bounds& x, const Motion::Bounds& y) {
           return same_bits(x.low, y.low) && same_bits(x.high, y.high);
         });
}

}  // namespace retake::impulse
