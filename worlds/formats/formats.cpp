// See formats.h.
#include "worlds/formats/formats.h"

namespace retake {
namespace {

constexpr Format kFormats[] = {
    {.name = "keyframes", .media_type = "application/json", .extension = ".json", .write = write_keyframes},
};

}  // namespace

std::span<const Format> formats() {
  return kFormats;
}

}  // namespace retake
