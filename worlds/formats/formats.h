// Formats: the files in which an Animation leaves Retake. The API's routes and the commands both read this
// list. doc/design.md, section 6. It must not know HTTP or the store.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "worlds/animation.h"
#include "worlds/formats/keyframes.h"

namespace retake {

struct Format {
  std::string_view name;        ///< in addresses and options, such as "keyframes"
  std::string_view media_type;  ///< such as "application/json"
  std::string_view extension;   ///< of files, with its dot
  /// The whole file, piece by piece. `rate` [frames/s] 0 keeps the animation's own rate. False if the sink
  /// wanted no more.
  bool (*write)(const Animation& animation, const KeyframeHead& head, double rate, const TextSink& sink);
};

/// Every format; the first one is what commands write unless asked for another.
std::span<const Format> formats();

}  // namespace retake
