// See animation.h.
#include "worlds/animation.h"

#include <cstring>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace retake {
namespace {

/// Feeds numbers to XXH3 in a fixed order.
class Digest {
 public:
  Digest() { XXH3_128bits_reset(&state_); }
  void add(const double* values, std::size_t count) {
    XXH3_128bits_update(&state_, values, count * sizeof(double));
  }
  void add(double value) { add(&value, 1); }
  void add(const Pose& pose) {
    add(pose.position.data(), 3);
    add(pose.rotation.coeffs().data(), 4);
  }
  void add(std::size_t value) {
    const std::uint64_t wide = value;
    XXH3_128bits_update(&state_, &wide, sizeof wide);
  }
  std::string text() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_);
    XXH128_canonical_t bytes;
    XXH128_canonicalFromHash(&bytes, hash);
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string hexadecimal;
    for (const unsigned char byte : bytes.digest) {
      hexadecimal += kDigits[byte >> 4];
      hexadecimal += kDigits[byte & 15];
    }
    return hexadecimal;
  }

 private:
  XXH3_state_t state_;
};

}  // namespace

std::string digest(const State& state, const Animation& animation) {
  Digest bits;
  bits.add(state.data(), static_cast<std::size_t>(state.size()));
  bits.add(animation.rate);
  bits.add(animation.frames);
  for (const Track& track : animation.tracks) {
    bits.add(track.rest);
    bits.add(track.positions.data(), static_cast<std::size_t>(track.positions.size()));
    bits.add(track.rotations.data(), static_cast<std::size_t>(track.rotations.size()));
  }
  for (const ContactEvent& event : animation.events) {
    bits.add(event.time);
    bits.add(event.bodies[0]);
    bits.add(event.bodies[1]);
    bits.add(event.impulse);
    bits.add(event.position.data(), 3);
    bits.add(event.normal.data(), 3);
  }
  return bits.text();
}

}  // namespace retake
