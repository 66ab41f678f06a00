// See rest_position.h.
#include "worlds/terms/rest_position.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "worlds/terms/fields.h"
#include "worlds/words.h"

namespace retake::terms {
namespace {

// The mark, all chosen, in lengths by which places may be missed by default.
constexpr double kDot = 0.2;           // radius of the dot in the middle
constexpr double kLine = 0.3;          // width of circles
constexpr double kRingDistance = 2.8;  // from the tolerance to the ring, for a body of some lengths
constexpr std::uint32_t kAround = 40;  // corners of a circle

/// Appends what lies between two circles around the origin, on a surface that is as high as `height` says.
void add_annulus(double inner, double outer, const std::function<double(double, double)>& height,
                 Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
  for (const double radius : {inner, outer})
    for (std::uint32_t corner = 0; corner < kAround; ++corner) {
      const double angle = 2 * std::numbers::pi * corner / kAround;
      const double x = radius * std::cos(angle), z = radius * std::sin(angle);
      mesh.positions.insert(mesh.positions.end(), {x, height(x, z), z});
    }
  for (std::uint32_t corner = 0; corner < kAround; ++corner) {
    const std::uint32_t a = first + corner, b = first + (corner + 1) % kAround;
    // From x to z is clockwise, seen from above.
    mesh.indices.insert(mesh.indices.end(), {a, b, b + kAround, a, b + kAround, a + kAround});
  }
}

}  // namespace

RestPosition::RestPosition(Place place, const Setting& setting)
    : place_(std::move(place)),
      mark_height_(setting.mark_height),
      length_(setting.length),
      flat_(setting.flat),
      reads_frames_(setting.rests_need_frames) {}

std::vector<Measure> RestPosition::measures() const {
  return {{.name = "miss",
           .unit = "m",
           .summary = flat_ ? "How far right of its place the body comes to rest"
                            : "How far from its place the body comes to rest"}};
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

Claims RestPosition::claims() const {
  Region near;
  near.low.x() = near.high.x() = place_.x;
  if (!flat_) near.low.z() = near.high.z() = place_.z;
  near.radius = place_.tolerance;
  return {{.field = "/x",
           .demand = StateClaim{.body = place_.body, .from = kEnd, .to = kEnd, .regions = {std::move(near)}}},
          {.field = flat_ ? "" : "/body", .demand = takes_part(place_.body)}};
}

double RestPosition::upper_bound(const Animation& so_far) const {
  const Track* track = find_track(so_far, place_.body);
  if (!track) return log_gaussian(kAway, place_.sd);
  return track->settled ? log_gaussian(miss(*track), place_.sd) : 0;
}

std::vector<Body> RestPosition::markers(const Animation& shown) const {
  Body mark{.name = "target", .shape = {}, .colour = "#2f9e5b", .surface = Surface::marking};
  if (flat_) {
    mark.shape = Box{{place_.tolerance, mark_height_, *flat_}};
    mark.pose.position = {place_.x, mark_height_, 0};
    return {std::move(mark)};
  }
  mark.pose.position = {place_.x, 0, place_.z};
  const auto height = [&](double x, double z) {
    return ground_height(shown, place_.x + x, place_.z + z) + mark_height_;
  };
  Mesh mesh;
  const double line = kLine * length_, ring = place_.tolerance + kRingDistance * length_;
  add_annulus(0, kDot * length_, height, mesh);
  add_annulus(std::max(place_.tolerance - line, 0.0), place_.tolerance, height, mesh);
  if (place_.tolerance < kRingDistance * length_) add_annulus(ring, ring + line, height, mesh);
  mark.shape = std::move(mesh);
  if (const auto body = std::find_if(shown.bodies.begin(), shown.bodies.end(),
                                     [&](const Body& each) { return each.name == place_.body; });
      body != shown.bodies.end())
    mark.colour = body->colour;
  return {std::move(mark)};
}

namespace {

/// A place that nothing can reach is refused, before it is looked for.
void check_reach(const RestPosition::Place& place, double reach, std::string_view pointer,
                 std::vector<Fault>& faults) {
  const double distance = std::hypot(place.x, place.z);
  if (distance - place.tolerance <= reach) return;
  std::string text = "nothing comes to rest farther than " + in_words(std::round(10 * reach) / 10) +
                     " m from where it is thrown, and x = " + in_words(place.x) +
                     " m, z = " + in_words(place.z) + " m is " + in_words(std::round(10 * distance) / 10) +
                     " m away";
  if (distance / 100 <= reach)
    text += "; were these centimetres? Then x is " + in_words(place.x / 100) + " and z " +
            in_words(place.z / 100);
  faults.push_back({append_pointer(pointer, std::abs(place.x) >= std::abs(place.z) ? "x" : "z"), text});
}

}  // namespace

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
                  if (setting.reach) check_reach(place, setting.reach(model), pointer, faults);
                  return std::make_unique<const RestPosition>(std::move(place), setting);
                }};
  if (!setting.flat) kind.fit = fit_body(setting);
  kind.sentence = [setting](const Parameters& term, const Parameters&) {
    std::string where = "x = " + in_words(term.number("x")) + " m";
    if (!setting.flat) where += " and z = " + in_words(term.number("z")) + " m";
    return body_in_words(setting.flat ? setting.only_body : term.text("body")) + " comes to rest at " +
           where + ", within " + in_words(term.number("tolerance")) + " m";
  };
  return kind;
}

std::vector<TermKind> general_terms(const Setting& setting) {
  return {rest_position_term(setting), state_at_term(setting), contact_at_term(setting), order_term(setting),
          inside_term(setting)};
}

}  // namespace retake::terms
