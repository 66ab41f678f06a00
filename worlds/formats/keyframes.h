// Keyframes: the document retake.keyframes/1, an Animation as JSON for any engine and for the page.
// doc/design.md, section 4. It must not know HTTP, files or the store.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "worlds/animation.h"
#include "worlds/world.h"

namespace retake {

/// What a keyframe document says of the sample itself.
struct KeyframeHead {
  std::string sample;
  std::string world;
  int world_version = 1;
  std::optional<Viewpoint> viewpoint{};
};
/// With the viewpoint of the world, if this build knows it.
KeyframeHead keyframe_head(const Animation& animation, std::string sample, std::string world,
                           int world_version);
/// Takes a piece of a text; false: no more of it is wanted.
using TextSink = std::function<bool(std::string_view)>;

/// Writes the document in pieces of some 64 KiB, in bounded memory whatever its size. `rate` [frames/s] 0
/// keeps the animation's own rate; another one resamples it. False if the sink wanted no more.
bool write_keyframes(const Animation& animation, const KeyframeHead& head, double rate, const TextSink& sink);
/// The whole document.
nlohmann::json keyframes_json(const Animation& animation, const KeyframeHead& head, double rate = 0);

/// Numbers of all frames of the document: what its size goes by. Nothing is made for it.
std::size_t keyframe_numbers(const Animation& animation, double rate);

}  // namespace retake
