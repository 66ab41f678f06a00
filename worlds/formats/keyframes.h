// Keyframes: the document retake.keyframes/1, an Animation as JSON for any engine and for the page.
// doc/design.md, section 4. It must not know HTTP, files or the store.
#pragma once

#include <optional>
#include <string>

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
/// The document. `rate` [frames/s] 0 keeps the animation's own rate; another one resamples it.
nlohmann::json keyframes_json(const Animation& animation, const KeyframeHead& head, double rate = 0);

}  // namespace retake
