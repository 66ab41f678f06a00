// The term `inside`: a body stays in a box for a while. Paper, section 3.2.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "worlds/terms/fields.h"
#include "worlds/terms/played.h"
#include "worlds/words.h"

namespace retake::terms {
namespace {

using Eigen::Vector3d;

constexpr double kBeam = 0.004;      // thickness of the mark's edges, as a share of the box's longest side
constexpr double kLargestMark = 10;  // [m], chosen: a box that is longer bounds nothing in that direction

/// Appends a box to a mesh.
void add_box(const Vector3d& low, const Vector3d& high, Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
  for (int corner = 0; corner < 8; ++corner)
    for (int axis = 0; axis < 3; ++axis)
      mesh.positions.push_back((corner >> axis & 1 ? high : low)[axis]);
  // Corners by their bits x, y, z; two triangles a side, counter-clockwise from outside.
  for (const std::uint32_t corner : {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                     2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6})
    mesh.indices.push_back(first + corner);
}

/// The twelve edges of a box.
Mesh edges(const Vector3d& low, const Vector3d& high) {
  const double half = 0.5 * kBeam * (high - low).maxCoeff();
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 4; ++side) {
      Vector3d begin = low, end = high;
      const int second = (axis + 1) % 3, third = (axis + 2) % 3;
      begin[second] = end[second] = (side & 1 ? high : low)[second];
      begin[third] = end[third] = (side & 2 ? high : low)[third];
      add_box(begin - Vector3d::Constant(half), end + Vector3d::Constant(half), mesh);
    }
  return mesh;
}

class Inside final : public Term {
 public:
  struct Stay {
    std::string body;
    Vector3d low, high;  ///< [m]
    double from, to;     ///< [s]
    double sd;           ///< [m]
  };
  explicit Inside(Stay stay) : stay_(std::move(stay)) {}

  std::vector<Measure> measures() const override {
    return {{.name = "excursion", .unit = "m", .summary = "How far the body gets out of its box"}};
  }
  bool reads_frames() const override { return true; }

  TermScore score(const Animation& animation, std::span<double> values) const override {
    const Track* track = find_guest(animation);
    values[0] = track ? excursion(animation, *track, Progress::finished) : kAbsent;
    return {.log_density = log_gaussian(track ? values[0] : kAway, stay_.sd), .satisfied = values[0] == 0};
  }

  double least_when_satisfied() const override { return 0; }

  Claims claims() const override {
    return {{.field = "/box",
             .demand = StateClaim{.body = stay_.body,
                                  .from = stay_.from,
                                  .to = stay_.to,
                                  .regions = {{.low = stay_.low, .high = stay_.high}}}},
            {.field = "/body", .demand = takes_part(stay_.body)}};
  }

  double upper_bound(const Animation& so_far) const override {
    const Track* track = find_guest(so_far);
    return log_gaussian(track ? excursion(so_far, *track, Progress::unfinished) : kAway, stay_.sd);
  }

  /// The box's edges, where it is no larger than a scene.
  std::vector<Body> markers(const Animation&) const override {
    if ((stay_.high - stay_.low).maxCoeff() > kLargestMark) return {};
    return {Body{.name = "target",
                 .shape = edges(stay_.low, stay_.high),
                 .colour = "#2f9e5b",
                 .surface = Surface::marking}};
  }

 private:
  /// The body's track; null if it is not there during the while.
  const Track* find_guest(const Animation& animation) const {
    const Track* track = find_track(animation, stay_.body);
    return track && is_there(*track, stay_.to) ? track : nullptr;
  }

  /// The farthest that the body gets out of the box [m], as far as is known: between two frames it moves
  /// straight, so it gets farthest at a frame or where the while begins or ends. It is out of nothing before
  /// it is there.
  double excursion(const Animation& animation, const Track& track, Progress progress) const {
    double farthest = 0;
    const auto add = [&](const Vector3d& place) {
      const Vector3d outside = (stay_.low - place).cwiseMax(place - stay_.high).cwiseMax(0);
      farthest = std::max(farthest, outside.norm());
    };
    const double from = std::max(stay_.from, track.from);
    for (const double time : {from, stay_.to})
      if (const auto place = position_at(animation, track, time, progress)) add(*place);
    const double last = std::floor(stay_.to * animation.rate);
    for (auto frame = static_cast<std::size_t>(std::ceil(from * animation.rate));
         frame < animation.frames && static_cast<double>(frame) <= last; ++frame)
      add(track.positions.col(static_cast<Eigen::Index>(frame)));
    return farthest;
  }

  Stay stay_;
};

std::shared_ptr<const ParameterTable> box_fields() {
  const auto corner = [](std::string name, std::string summary) {
    return Parameter{.name = std::move(name),
                     .kind = Parameter::Kind::number_list,
                     .minimum = -1000,
                     .maximum = 1000,
                     .fewest = 3,
                     .most = 3,
                     .unit = "m",
                     .summary = std::move(summary)};
  };
  return std::make_shared<const ParameterTable>(
      std::vector<Parameter>{corner("low", "The corner with the least x, y and z"),
                             corner("high", "The corner with the greatest x, y and z")});
}

std::unique_ptr<const Term> make_inside(const Setting& setting, const Parameters& term,
                                        const Parameters& model, std::string_view pointer,
                                        std::vector<Fault>& faults) {
  find_mover(setting.roster(model), term.text("body"), append_pointer(pointer, "body"), faults);
  const std::vector<double> low = term.object("box").number_list("low"),
                            high = term.object("box").number_list("high");
  const std::string corner = append_pointer(append_pointer(pointer, "box"), "high");
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (low[axis] > high[axis])
      faults.push_back({append_pointer(corner, axis), "must not be below `low`, " + plain_number(low[axis])});
  if (term.number("from") > term.number("to"))
    faults.push_back({append_pointer(pointer, "to"), "must not be before `from`"});
  return std::make_unique<const Inside>(Inside::Stay{.body = term.text("body"),
                                                     .low = {low[0], low[1], low[2]},
                                                     .high = {high[0], high[1], high[2]},
                                                     .from = term.number("from"),
                                                     .to = term.number("to"),
                                                     .sd = term.number("sd")});
}

std::string inside_sentence(const Parameters& term, const Parameters&) {
  const std::vector<double> low = term.object("box").number_list("low"),
                            high = term.object("box").number_list("high");
  std::string text = body_in_words(term.text("body")) + " stays between " + in_words(low) + " m and " +
                     in_words(high) + " m";
  const double from = term.number("from"), to = term.number("to");
  if (from > 0) text += " from " + in_words(from) + " s" + (to < kEnd ? "" : " on");
  if (to < kEnd) text += (from > 0 ? " to " : " until ") + in_words(to) + " s";
  return text;
}

Parameter time_field(std::string name, double value, std::string summary, std::string source) {
  Parameter field = number_field(std::move(name), 0, kEnd, "s", std::move(summary));
  field.default_value = value;
  field.source = std::move(source);
  return field;
}

}  // namespace

TermKind inside_term(const Setting& setting) {
  ParameterTable fields({body_field(setting, "What shall stay inside, with its origin"),
                         {.name = "box",
                          .kind = Parameter::Kind::object,
                          .fields = box_fields(),
                          .summary = "Along the axes; wide numbers leave a direction free"},
                         time_field("from", 0, "From when on", "from the start"),
                         time_field("to", kEnd, "Until when; after the end everything rests", "to the end"),
                         sd_field("sd", setting.length, "m", setting.source)});
  return {.kind = "inside",
          .summary = "A body stays in a box for a while",
          .parameters = std::move(fields),
          .make = [setting](auto&&... rest) { return make_inside(setting, rest...); },
          .fit = fit_body(setting),
          .sentence = inside_sentence};
}

}  // namespace retake::terms
