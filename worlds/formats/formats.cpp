// See formats.h.
#include "worlds/formats/formats.h"

namespace retake {
namespace {

std::string write_keyframes(const Animation& animation, const KeyframeHead& head, double rate) {
  return keyframes_json(animation, head, rate).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

constexpr Format kFormats[] = {
    {.name = "keyframes", .media_type = "application/json", .extension = ".json", .write = write_keyframes},
};

}  // namespace

std::span<const Format> formats() {
  return kFormats;
}

}  // namespace retake
