// Animations as answers: found, decoded and written piece by piece, within limits of size and memory.
// doc/api.md, "Keyframes". It must not know which route asks.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "server/api/api.h"
#include "worlds/formats/formats.h"
#include "worlds/formats/recorded.h"

namespace retake {

/// Writes an animation in a format to a sink; false if the sink wanted no more.
using AnimationWriter = std::function<bool(const StreamSink&)>;

/// What writes a sample's animation at a rate, 0 being its own. It holds its place at the desk for as long as
/// it lives. Throws: HttpProblem, 404 if the sample is gone, 422 if the document would be too large, 500 if
/// it is damaged, 503 if too many are being sent.
AnimationWriter animation_writer(Api& api, const SampleRecord& sample, const Format& format, double rate);

/// A 500 that is told to the operator with what is wrong.
HttpProblem damaged_sample(const std::string& id, const char* fault);

/// A part of a stored sample, decoded; one that is damaged is reported and never served. Throws: HttpProblem.
template <typename Decode>
auto decode_stored(const std::string& id, const std::optional<std::string>& bytes, Decode decode_bytes) {
  if (!bytes) throw not_found("sample", id);
  try {
    return decode_bytes(*bytes);
  } catch (const DamagedAnimation& fault) {
    throw damaged_sample(id, fault.what());
  }
}

}  // namespace retake
