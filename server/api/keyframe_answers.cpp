// See keyframe_answers.h.
#include "server/api/keyframe_answers.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace retake {
namespace {

/// The greatest whole rate whose document is not too large.
std::size_t largest_rate(const Animation& animation, std::size_t most_numbers) {
  const double frames = static_cast<double>(most_numbers) / 7 / static_cast<double>(animation.tracks.size());
  auto rate =
      static_cast<std::size_t>(std::max(1.0, std::floor(frames / std::max(animation.duration(), 1e-9))));
  while (rate > 1 && keyframe_numbers(animation, static_cast<double>(rate)) > most_numbers)
    --rate;
  return rate;
}

/// Throws: HttpProblem.
void check_size(const Animation& animation, double rate, std::size_t most_numbers) {
  const std::size_t numbers = keyframe_numbers(animation, rate);
  if (numbers <= most_numbers) return;
  throw HttpProblem(422, "document-too-large", "The document would be too large",
                    "It would hold " + std::to_string(numbers) + " numbers of frames, and may hold " +
                        std::to_string(most_numbers) + "; ask for a rate of at most " +
                        std::to_string(largest_rate(animation, most_numbers)) + ".");
}

}  // namespace

AnimationWriter animation_writer(Api& api, const SampleRecord& sample, const Format& format, double rate) {
  const auto world = api.store.world_of(sample.scenario);
  const std::optional<std::string> bytes = api.store.sample_animation(sample.id);
  if (!world || !bytes) throw not_found("sample", sample.id);
  const std::shared_ptr<void> place = api.documents.take(decoded_bytes(*bytes));
  if (!place)
    throw HttpProblem(503, "unavailable", "The server is busy", "Too many large animations are being sent.",
                      {}, {{"Retry-After", "2"}});
  const auto animation = std::make_shared<const Animation>(decode_stored(sample.id, bytes, decode_animation));
  check_size(*animation, rate, api.limits.most_keyframe_numbers);
  KeyframeHead head = keyframe_head(*animation, sample.id, world->name, world->version);
  // The place is given back last.
  return [&api, &format, place, animation, head = std::move(head), rate](const StreamSink& sink) {
    return format.write(*animation, head, rate, api.documents.hurried(sink));
  };
}

}  // namespace retake
