// See keyframes.h.
#include "worlds/formats/keyframes.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kPieceBytes = 64 * 1024;  ///< chosen: a hundred of a socket's segments

/// Rounded so that the text is short: 5 decimals are a tenth of what positions are true to.
json rounded(double value, double scale) {
  const double whole = std::round(value * scale);
  return whole == 0 ? json(0) : json(whole / scale);  // no minus zero
}
json length(double value) {
  return rounded(value, 1e5);
}
constexpr double kComponentScale = 1e6;
json component(double value) {
  return rounded(value, kComponentScale);
}

template <typename Vector>
json lengths(const Vector& values) {
  json array = json::array();
  for (const double value : values)
    array.push_back(length(value));
  return array;
}

json quaternion(const Eigen::Quaterniond& rotation) {
  return {component(rotation.x()), component(rotation.y()), component(rotation.z()), component(rotation.w())};
}

json shape_json(const Shape& shape) {
  struct View {
    json operator()(const Sphere& sphere) const {
      return {{"type", "sphere"}, {"radius", length(sphere.radius)}};
    }
    json operator()(const Box& box) const {
      return {{"type", "box"}, {"half_extents", lengths(box.half_extents)}};
    }
    json operator()(const Cylinder& cylinder) const {
      return {{"type", "cylinder"}, {"radius", length(cylinder.radius)}, {"height", length(cylinder.height)}};
    }
    json operator()(const Revolution& revolution) const {
      json profile = json::array();
      for (const auto& point : revolution.profile)
        profile.push_back(lengths(point));
      return {{"type", "revolution"}, {"profile", std::move(profile)}};
    }
    json operator()(const Mesh& mesh) const {
      return {{"type", "mesh"}, {"positions", lengths(mesh.positions)}, {"indices", mesh.indices}};
    }
    json operator()(const HeightField& field) const {
      json mesh = (*this)(mesh_of(field));
      for (const Attribute& attribute : field.attributes) {
        json& values = mesh["attributes"][attribute.name] = json::array();
        for (const double value : attribute.values)
          values.push_back(rounded(value, 100));
      }
      return mesh;
    }
  };
  return std::visit(View{}, shape);
}

std::string dumped(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

/// Gathers a text and hands it on in pieces.
class Pieces {
 public:
  explicit Pieces(const TextSink& sink) : sink_(sink) {}

  /// Both are false once no more is wanted.
  bool add(std::string_view text) {
    gathered_ += text;
    return gathered_.size() < kPieceBytes ? is_wanted_ : flush();
  }
  bool flush() {
    is_wanted_ = is_wanted_ && (gathered_.empty() || sink_(gathered_));
    gathered_.clear();
    return is_wanted_;
  }

 private:
  const TextSink& sink_;
  std::string gathered_;
  bool is_wanted_ = true;
};

/// The frames of an animation at a rate: linear between positions, normalised linear between rotations. The
/// last frame is the rest.
class Frames {
 public:
  Frames(const Animation& animation, double rate)
      : animation_(animation), rate_(rate > 0 ? rate : animation.rate), is_own_(rate_ == animation.rate) {}

  double rate() const { return rate_; }
  std::size_t count() const {
    if (is_own_) return animation_.frames;
    return static_cast<std::size_t>(std::ceil(animation_.duration() * rate_ - 1e-9)) + 1;
  }
  double duration() const { return count() > 0 ? static_cast<double>(count() - 1) / rate_ : 0; }
  Eigen::Vector3d position(const Track& track, std::size_t frame) const {
    return between<3>(track.positions, frame);
  }
  Eigen::Vector4d rotation(const Track& track, std::size_t frame) const {
    const Eigen::Vector4d rotation = between<4>(track.rotations, frame);
    return is_own_ ? rotation : rotation.normalized();
  }

 private:
  template <int Rows>
  Eigen::Matrix<double, Rows, 1> between(const Eigen::Matrix<double, Rows, Eigen::Dynamic>& values,
                                         std::size_t frame) const {
    if (is_own_) return values.col(static_cast<Eigen::Index>(frame));
    const Eigen::Index last = values.cols() - 1;
    const double place =
        std::min(static_cast<double>(frame) / rate_ * animation_.rate, static_cast<double>(last));
    const auto before = std::min(static_cast<Eigen::Index>(place), last);
    const auto after = std::min(before + 1, last);
    const double share = place - static_cast<double>(before);
    return (1 - share) * values.col(before) + share * values.col(after);
  }

  const Animation& animation_;
  const double rate_;
  const bool is_own_;
};

/// A list of numbers of each frame, of which never more than some thousands are there at once.
template <typename NumbersOfFrame>
bool add_numbers(Pieces& pieces, std::size_t frames, NumbersOfFrame numbers_of) {
  constexpr std::size_t at_once = 1024;
  bool is_wanted = pieces.add("[");
  for (std::size_t first = 0; is_wanted && first < frames; first += at_once) {
    json numbers = json::array();
    for (std::size_t frame = first; frame < std::min(first + at_once, frames); ++frame)
      numbers_of(frame, numbers);
    const std::string text = dumped(numbers);
    is_wanted =
        pieces.add(first > 0 ? "," : "") && pieces.add(std::string_view(text).substr(1, text.size() - 2));
  }
  return is_wanted && pieces.add("]");
}

bool add_track(Pieces& pieces, const Frames& frames, const Track& track) {
  if (track.from > 0) pieces.add("\"from\":" + dumped(component(track.from)) + ",");
  pieces.add("\"position\":");
  if (!add_numbers(pieces, frames.count(), [&](std::size_t frame, json& numbers) {
        for (const double value : frames.position(track, frame))
          numbers.push_back(length(value));
      }))
    return false;
  pieces.add(",\"rotation\":");
  // Rounded, and only then in one hemisphere, whichever frames are picked.
  Eigen::Vector4d last = Eigen::Vector4d::Zero();
  return add_numbers(pieces, frames.count(), [&](std::size_t frame, json& numbers) {
    Eigen::Vector4d rotation = (frames.rotation(track, frame) * kComponentScale).array().round();
    rotation /= kComponentScale;
    if (rotation.dot(last) < 0) rotation = -rotation;
    last = rotation;
    for (const double value : rotation)
      numbers.push_back(component(value));
  });
}

bool add_tracks(Pieces& pieces, const Frames& frames, const std::vector<Track>& tracks) {
  bool is_wanted = pieces.add("[");
  for (std::size_t i = 0; is_wanted && i < tracks.size(); ++i)
    is_wanted = pieces.add(i > 0 ? ",{" : "{") && add_track(pieces, frames, tracks[i]) && pieces.add("}");
  return is_wanted && pieces.add("]");
}

json bodies_json(const std::vector<Body>& all) {
  json bodies = json::array();
  for (const Body& body : all) {
    json view = {{"name", body.name},
                 {"shape", shape_json(body.shape)},
                 {"color", body.colour},
                 {"surface", to_string(body.surface)}};
    if (body.track) {
      view["track"] = *body.track;
    } else {
      view["position"] = lengths(body.pose.position);
      view["rotation"] = quaternion(body.pose.rotation);
    }
    bodies.push_back(std::move(view));
  }
  return bodies;
}

json events_json(const Animation& animation) {
  json events = json::array();
  for (const ContactEvent& event : animation.events)
    events.push_back(
        {{"time", component(event.time)},
         {"kind", "contact"},
         {"bodies", {animation.bodies[event.bodies[0]].name, animation.bodies[event.bodies[1]].name}},
         {"impulse", component(event.impulse)},
         {"position", lengths(event.position)},
         {"normal", lengths(event.normal)}});
  return events;
}

/// All of it but the frames.
json frame_json(const Animation& animation, const KeyframeHead& head, const Frames& frames) {
  json document = {{"format", "retake.keyframes/1"},
                   {"sample", head.sample},
                   {"world", head.world},
                   {"world_version", head.world_version},
                   {"units", {{"length", "m"}, {"time", "s"}, {"angle", "rad"}}},
                   {"up", "+y"},
                   {"handedness", "right"},
                   {"quaternion", "xyzw"},
                   {"rate", frames.rate()},
                   {"frames", frames.count()},
                   {"duration", frames.duration()},
                   {"bodies", bodies_json(animation.bodies)},
                   {"tracks", nullptr},
                   {"events", events_json(animation)}};
  if (head.viewpoint)
    document["view"] = {{"center", lengths(head.viewpoint->center)},
                        {"half_extents", lengths(head.viewpoint->half_extents)},
                        {"azimuth", component(head.viewpoint->azimuth)},
                        {"elevation", component(head.viewpoint->elevation)}};
  return document;
}

}  // namespace

KeyframeHead keyframe_head(const Animation& animation, std::string sample, std::string world,
                           int world_version) {
  KeyframeHead head{.sample = std::move(sample), .world = std::move(world), .world_version = world_version};
  if (const World* known = find_world(head.world)) head.viewpoint = known->viewpoint(animation);
  return head;
}

std::size_t keyframe_numbers(const Animation& animation, double rate) {
  return 7 * animation.tracks.size() * Frames(animation, rate).count();
}

bool write_keyframes(const Animation& animation, const KeyframeHead& head, double rate,
                     const TextSink& sink) {
  const Frames frames(animation, rate);
  Pieces pieces(sink);
  const json document = frame_json(animation, head, frames);
  std::string_view before = "{";
  for (const auto& [key, value] : document.items()) {
    pieces.add(std::string(before) + dumped(key) + ":");
    const bool is_wanted =
        key == "tracks" ? add_tracks(pieces, frames, animation.tracks) : pieces.add(dumped(value));
    if (!is_wanted) return false;
    before = ",";
  }
  pieces.add("}");
  return pieces.flush();
}

json keyframes_json(const Animation& animation, const KeyframeHead& head, double rate) {
  std::string text;
  write_keyframes(animation, head, rate, [&](std::string_view piece) {
    text += piece;
    return true;
  });
  return json::parse(text);
}

}  // namespace retake
