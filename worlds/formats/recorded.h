// The recorded form of an Animation: quantised, compressed, with a version byte and a checksum.
// doc/design.md, section 5. Positions come back within 0.04 mm, rotations within 0.02 degree. It must not
// know where it is kept.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "worlds/animation.h"

namespace retake {

/// A recorded animation that is not what was written.
class DamagedAnimation : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The file format is described in worlds/README.md. Requires: every pose is finite.
std::string encode_animation(const Animation& animation);

/// [bytes] An upper bound of the memory that decoding them takes, told by their head alone; 0 if it is
/// damaged.
std::size_t decoded_bytes(std::string_view bytes);

/// Throws: DamagedAnimation if the bytes are damaged or of an unknown version.
Animation decode_animation(std::string_view bytes);

/// A State's bytes, and back. Throws: DamagedAnimation.
std::string encode_state(const State& state);
State decode_state(std::string_view bytes);

}  // namespace retake
