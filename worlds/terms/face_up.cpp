// See face_up.h.
#include "worlds/terms/face_up.h"

#include <limits>
#include <utility>

#include "sampler/check.h"
#include "worlds/terms/fields.h"
#include "worlds/words.h"

namespace retake::terms {

int highest_face(const std::vector<Face>& faces, const Eigen::Quaterniond& rotation) {
  int highest = 0;
  double height = -std::numeric_limits<double>::infinity();
  for (const Face& face : faces)
    if (const double y = (rotation * face.normal).y(); y > height) {
      height = y;
      highest = face.number;
    }
  return highest;
}

FaceUp::FaceUp(Roster::Mover body, int face, double log_lambda, bool reads_frames)
    : body_(std::move(body)), face_(face), log_lambda_(log_lambda), reads_frames_(reads_frames) {
  CHECK(!body_.faces.empty(), body_.name);
}

TermScore FaceUp::score(const Animation& animation, std::span<double> values) const {
  const Track* track = find_track(animation, body_.name);
  values[0] = track ? highest_face(body_.faces, track->rest.rotation) : kAbsent;
  const bool satisfied = values[0] == face_;
  return {.log_density = satisfied ? 0 : -log_lambda_, .satisfied = satisfied};
}

Claims FaceUp::claims() const {
  return {{.field = "/face", .demand = shows(body_.name, {face_})},
          {.field = "/body", .demand = takes_part(body_.name)}};
}

double FaceUp::upper_bound(const Animation& so_far) const {
  const Track* track = find_track(so_far, body_.name);
  if (!track) return -log_lambda_;
  const bool may_show = !track->settled || highest_face(body_.faces, track->rest.rotation) == face_;
  return may_show ? 0 : -log_lambda_;
}

namespace {

std::unique_ptr<const Term> make_face_up(const Setting& setting, const Parameters& term,
                                         const Parameters& model, std::string_view pointer,
                                         std::vector<Fault>& faults) {
  const std::string place = append_pointer(pointer, "body");
  const Roster roster = setting.roster(model);
  const Roster::Mover* body = find_mover(roster, term.text("body"), place, faults);
  if (!body) return nullptr;
  if (body->faces.empty()) {
    faults.push_back({place, body->name + " has no faces"});
    return nullptr;
  }
  const auto face = static_cast<int>(term.integer("face"));
  bool has_face = false;
  std::vector<std::string> numbers;
  for (const Face& each : body->faces) {
    has_face |= each.number == face;
    numbers.push_back(std::to_string(each.number));
  }
  if (!has_face)
    faults.push_back({append_pointer(pointer, "face"), "must be one of " + list_of_names(numbers)});
  return std::make_unique<const FaceUp>(*body, face, term.number("log_lambda"), setting.rests_need_frames);
}

}  // namespace

TermKind face_up_term(const Setting& setting) {
  ParameterTable fields({body_field(setting, "What shall show the face"),
                         {.name = "face",
                          .kind = Parameter::Kind::integer,
                          .minimum = 1,
                          .maximum = 100,
                          .summary = "The number on the side that shall end up"},
                         {.name = "log_lambda",
                          .default_value = 6.0,
                          .minimum = 0,
                          .maximum = 100,
                          .above_minimum = true,
                          .summary = "What another side costs in log p_c",
                          .source = "measured to serve one die at a quarter of its side"}});
  return {.kind = "face_up",
          .summary = "A body comes to rest with one of its sides up",
          .parameters = std::move(fields),
          .make = [setting](auto&&... rest) { return make_face_up(setting, rest...); },
          .fit = fit_body(setting),
          .sentence =
              [](const Parameters& term, const Parameters&) {
                return body_in_words(term.text("body")) + " shows face " +
                       std::to_string(term.integer("face"));
              }};
}

}  // namespace retake::terms
