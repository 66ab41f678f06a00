// See rest_position.h.
#include "worlds/terms/rest_position.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "worlds/terms/fields.h"

namespace retake::terms {

RestPosition::RestPosition(Place place, const Setting& setting)
    : place_(std::move(place)),
      mark_height_(setting.mark_height),
      least_radius_(setting.length / 4),
      flat_(setting.flat),
      reads_frames_(setting.rests_need_frames) {}

std::vector<Measure> RestPosition::measures() const {
  return {{.name = "miss"}};
}

/// [m] to the right of the place in a flat world, else from it.
double RestPosition::miss(const Track& track) const {
  const double x = track.rest.position.x() - place_.x, z = track.rest.position.z() - place_.z;
  return flat_ ? x : std::sqrt(x * x + z * z);
}

TermScore RestPosition::score(const Animation& animation, std::span<double> values) const {
  const Track* track = find_track(animation, place_.body);
  values[0] = track ? miss(*track) : kAbsent;
  if (!track) return {.log_density = log_gaussian(kAway, place_.sd), .satisfied = false};
  return {.log_density = log_gaussian(values[0], place_.sd),
          .satisfied = std::abs(values[0]) <= place_.tolerance};
}

double RestPosition::least_when_satisfied() const {
  return log_gaussian(place_.tolerance, place_.sd);
}

double RestPosition::upper_bound(const Animation& so_far) const {
  const Track* track = find_track(so_far, place_.body);
  if (!track) return log_gaussian(kAway, place_.sd);
  return track->settled ? log_gaussian(miss(*track), place_.sd) : 0;
}

std::vector<Body> RestPosition::markers() const {
  const double half = mark_height_;
  Shape shape = Cylinder{.radius = std::max(place_.tolerance, least_radius_), .height = 2 * half};
  if (flat_) shape = Box{{place_.tolerance, half, *flat_}};
  return {Body{.name = "target",
               .shape = std::move(shape),
               .colour = "#2f9e5b",
               .pose = {.position = {place_.x, half, place_.z}}}};
}

TermKind rest_position_term(const Setting& setting) {
  std::vector<Parameter> fields;
  if (!setting.flat) fields.push_back(body_field(setting, "What shall come to rest there"));
  fields.push_back(number_field("x", -1000, 1000, "m", "Where the body shall come to rest"));
  if (!setting.flat) fields.push_back(number_field("z", -1000, 1000, "m", "Where, in the other direction"));
  fields.push_back(sd_field("sd", setting.length, "m", setting.source));
  fields.push_back(tolerance_field("tolerance", setting.length, "m", setting.source));
  TermKind kind{.kind = "rest_position",
                .summary = setting.flat ? "The " + setting.only_body + " comes to rest near x"
                                        : "A body comes to rest near a place",
                .parameters = ParameterTable(std::move(fields)),
                .make = [setting](const Parameters& term, const Parameters& model, std::string_view pointer,
                                  std::vector<Fault>& faults) -> std::unique_ptr<const Term> {
                  RestPosition::Place place{.body = setting.only_body,
                                            .x = term.number("x"),
                                            .sd = term.number("sd"),
                                            .tolerance = term.number("tolerance")};
                  if (!setting.flat) {
                    place.body = term.text("body");
                    place.z = term.number("z");
                    find_mover(setting.roster(model), place.body, append_pointer(pointer, "body"), faults);
                  }
                  return std::make_unique<const RestPosition>(std::move(place), setting);
                }};
  if (!setting.flat) kind.fit = fit_body(setting);
  return kind;
}

std::vector<TermKind> general_terms(const Setting& setting) {
  return {rest_position_term(setting), state_at_term(setting), contact_at_term(setting), order_term(setting),
          inside_term(setting)};
}

}  // namespace retake::terms
