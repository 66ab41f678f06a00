// See measure.h.
#include "worlds/measure.h"

#include <cstdint>

#include "sampler/check.h"

namespace retake {

double set_of(std::span<const int> members) {
  std::uint64_t bits = 0;
  for (const int member : members) {
    CHECK(member >= 0 && member <= kLargestMember, member);
    bits |= std::uint64_t{1} << member;
  }
  return static_cast<double>(bits);
}

std::vector<int> members_of(double set) {
  CHECK(set >= 0 && set < 0x1p53, set);
  const auto bits = static_cast<std::uint64_t>(set);
  std::vector<int> members;
  for (int member = 0; member <= kLargestMember; ++member)
    if (bits >> member & 1) members.push_back(member);
  return members;
}

}  // namespace retake
