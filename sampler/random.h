// RandomStream: random numbers that are a pure function of where they are used.
// doc/design.md, section 3, "Randomness". No generator state exists, so a checkpoint needs none.
#pragma once

#include <array>
#include <cstdint>

#include <Random123/philox.h>

#include "sampler/normal.h"

namespace retake {

/// What a draw is for. The numbers are part of the determinism contract: never renumber.
enum class Purpose : std::uint8_t {
  initial = 0,
  proposal = 1,
  acceptance = 2,
  swap = 3,
  learning = 4,
  field = 5,  ///< a random field that one key gives whole
};

/// Where in the whole computation a stream of draws belongs.
struct RandomAddress {
  std::uint64_t seed = 0;
  std::uint32_t chain = 0;
  std::uint16_t replica = 0;
  Purpose purpose = Purpose::initial;
  std::uint64_t iteration = 0;
  std::uint8_t method = 0;  ///< of the chain, so that two methods of one seed do not find the same
};

/// The draws at one address: Philox4x64-10 (Salmon et al. 2011) keyed by seed, chain, replica, method and
/// purpose, its counter the iteration and the number of the draw. Cheap to make. Thread safety: one thread at
/// a time.
class RandomStream {
 public:
  explicit RandomStream(const RandomAddress& address)
      : key_{{address.seed, (static_cast<std::uint64_t>(address.chain) << 32) |
                                (static_cast<std::uint64_t>(address.replica) << 16) |
                                (static_cast<std::uint64_t>(address.method) << 8) |
                                static_cast<std::uint64_t>(address.purpose)}},
        iteration_(address.iteration) {}

  /// 64 random bits.
  std::uint64_t bits() {
    const std::uint64_t lane = draw_ % 4;
    if (lane == 0) block_ = generator_({{iteration_, draw_ / 4, 0, 0}}, key_);
    ++draw_;
    return block_[lane];
  }

  /// Uniform on the open interval (0, 1).
  double uniform() { return (static_cast<double>(bits() >> 12) + 0.5) * 0x1p-52; }

  /// Standard normal, by inversion: one uniform draw each.
  double gaussian() { return normal_quantile(uniform()); }

  /// Uniform on {0, ..., count - 1}. Requires: 0 < count <= 2^32.
  std::uint64_t index(std::uint64_t count) { return ((bits() >> 32) * count) >> 32; }

  bool bernoulli(double probability) { return uniform() < probability; }

 private:
  using Generator = r123::Philox4x64;
  Generator generator_;
  Generator::key_type key_;
  Generator::ctr_type block_{};
  std::uint64_t iteration_;
  std::uint64_t draw_ = 0;
};

}  // namespace retake
