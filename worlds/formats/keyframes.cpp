// See keyframes.h.
#include "worlds/formats/keyframes.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace retake {
namespace {

using nlohmann::json;

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

/// As the document has them: rounded, and only then in one hemisphere, whichever frames were picked.
Rotations told(const Rotations& rotations) {
  Rotations result = (rotations * kComponentScale).array().round() / kComponentScale;
  put_in_one_hemisphere(result);
  return result;
}

/// Frames at another rate: linear between positions, normalised linear between rotations. The last frame is
/// the rest.
Animation resampled(const Animation& animation, double rate) {
  Animation result = animation;
  result.rate = rate;
  result.frames = static_cast<std::size_t>(std::ceil(animation.duration() * rate - 1e-9)) + 1;
  const auto last = static_cast<Eigen::Index>(animation.frames) - 1;
  for (std::size_t t = 0; t < animation.tracks.size(); ++t) {
    const Track& from = animation.tracks[t];
    Track& to = result.tracks[t];
    to.positions.resize(3, static_cast<Eigen::Index>(result.frames));
    to.rotations.resize(4, static_cast<Eigen::Index>(result.frames));
    for (Eigen::Index frame = 0; frame < to.positions.cols(); ++frame) {
      const double place =
          std::min(static_cast<double>(frame) / rate * animation.rate, static_cast<double>(last));
      const auto before = std::min(static_cast<Eigen::Index>(place), last);
      const auto after = std::min(before + 1, last);
      const double share = place - static_cast<double>(before);
      to.positions.col(frame) = (1 - share) * from.positions.col(before) + share * from.positions.col(after);
      to.rotations.col(frame) =
          ((1 - share) * from.rotations.col(before) + share * from.rotations.col(after)).normalized();
    }
  }
  return result;
}

}  // namespace

KeyframeHead keyframe_head(const Animation& animation, std::string sample, std::string world,
                           int world_version) {
  KeyframeHead head{.sample = std::move(sample), .world = std::move(world), .world_version = world_version};
  if (const World* known = find_world(head.world)) head.viewpoint = known->viewpoint(animation);
  return head;
}

json keyframes_json(const Animation& given, const KeyframeHead& head, double rate) {
  if (rate > 0 && rate != given.rate) return keyframes_json(resampled(given, rate), head);
  const Animation& animation = given;

  json bodies = json::array();
  for (const Body& body : animation.bodies) {
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

  json tracks = json::array();
  for (const Track& track : animation.tracks) {
    json positions = json::array(), rotations = json::array();
    for (Eigen::Index i = 0; i < track.positions.size(); ++i)
      positions.push_back(length(track.positions(i)));
    const Rotations shown = told(track.rotations);
    for (Eigen::Index i = 0; i < shown.size(); ++i)
      rotations.push_back(component(shown(i)));
    json& view =
        tracks.emplace_back(json{{"position", std::move(positions)}, {"rotation", std::move(rotations)}});
    if (track.from > 0) view["from"] = component(track.from);
  }

  json events = json::array();
  for (const ContactEvent& event : animation.events)
    events.push_back(
        {{"time", component(event.time)},
         {"kind", "contact"},
         {"bodies", {animation.bodies[event.bodies[0]].name, animation.bodies[event.bodies[1]].name}},
         {"impulse", component(event.impulse)},
         {"position", lengths(event.position)},
         {"normal", lengths(event.normal)}});

  json document = {{"format", "retake.keyframes/1"},
                   {"sample", head.sample},
                   {"world", head.world},
                   {"world_version", head.world_version},
                   {"units", {{"length", "m"}, {"time", "s"}, {"angle", "rad"}}},
                   {"up", "+y"},
                   {"handedness", "right"},
                   {"quaternion", "xyzw"},
                   {"rate", animation.rate},
                   {"frames", animation.frames},
                   {"duration", animation.duration()},
                   {"bodies", std::move(bodies)},
                   {"tracks", std::move(tracks)},
                   {"events", std::move(events)}};
  if (head.viewpoint)
    document["view"] = {{"center", lengths(head.viewpoint->center)},
                        {"half_extents", lengths(head.viewpoint->half_extents)},
                        {"azimuth", component(head.viewpoint->azimuth)},
                        {"elevation", component(head.viewpoint->elevation)}};
  return document;
}

}  // namespace retake
