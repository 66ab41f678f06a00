// GatheredDraws: the draws of a chain that no store holds, as Store::draws would give them.
// doc/design.md, section 3, "Diagnostics". It must not know what they are for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "db/records.h"

namespace retake {

class GatheredDraws {
 public:
  /// Takes the samples and the weights of a chain's progress; the animations are not kept.
  void add(const ChainProgress& progress);
  /// See Store::draws.
  std::vector<DrawRecord> draws(std::size_t most, std::uint64_t from_iteration) const;

 private:
  struct Gathered {
    std::uint64_t weight;
    DrawRecord draw;
  };
  using Place = std::pair<std::uint64_t, std::uint32_t>;  // iteration and replica
  std::map<Place, Gathered> samples_;
};

}  // namespace retake
