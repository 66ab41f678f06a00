// Animations as answers: found, decoded and written piece by piece, within limits of size and memory.
// doc/api.md, "Keyframes". It must not know which route asks.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "db/errors.h"
#include "server/api/api.h"
#include "worlds/formats/formats.h"
#include "worlds/formats/recorded.h"

namespace retake {

/// Writes an animation in a format to a sink; false if the sink wanted no more.
using AnimationWriter = std::function<bool(const StreamSink&)>;

/// What writes a sample's animation at a rate, 0 being its own. It holds its place at the desk for as long as
/// it lives. Throws: HttpProblem, 404 if the sample is gone, 422 if the document would be too large, 503 if
/// too many are being sent; Damaged, so that nothing of a damaged one is sent.
AnimationWriter animation_writer(Api& api, const SampleRecord& sample, const Format& format, double rate);

/// A part of a stored sample, decoded. Throws: HttpProblem, 404; Damaged where it was bent before it was
/// sealed.
template <typename Decode>
auto decode_stored(const std::string& id, const std::optional<std::string>& bytes, Decode decode_bytes) {
  if (!bytes) throw not_found("sample", id);
  try {
    return decode_bytes(*bytes);
  } catch (const DamagedAnimation& fault) {
    throw Damaged("sample " + id + " is damaged: " + fault.what());
  }
}

}  // namespace retake
