// See minimal_world.h. A puck is pushed over a table and may rebound from the cushion at its end.
#include "tests/worlds/minimal_world.h"

#include <algorithm>
#include <cmath>

#include "worlds/gravity.h"
#include "worlds/recorder.h"
#include "worlds/terms/terms.h"
#include "worlds/words.h"

namespace retake::tests {
namespace {

constexpr double kFrameRate = 60;                     // [frames/s]
constexpr double kRadius = 0.08, kHalfHeight = 0.01;  // [m], chosen: easy to see
constexpr double kMass = 0.3, kRestitution = 0.6;     // [kg], chosen: wood on felt
constexpr std::size_t kPuck = 0, kCushion = 2;        // in Animation::bodies
constexpr const char *kPuckName = "puck", *kTableName = "table", *kCushionName = "cushion";

/// What constraints can name: what moves, then what stands still, in the order of Animation::bodies.
Roster names() {
  return {.movers = {{.name = kPuckName, .tells_rest = true}}, .still = {kTableName, kCushionName}};
}

// --- How it moves ------------------------------------------------------------------------------------

/// The puck slows down evenly from x = 0 on, and loses speed at the cushion if it gets there.
struct Slide {
  double speed, slowing, length;  ///< [m/s], [m/s^2], [m] to where it touches the cushion
  double left = std::sqrt(std::max(speed * speed - 2 * slowing * length, 0.0));  ///< [m/s] at the cushion
  double hit = (speed - left) / slowing;                                         ///< [s] there, or at rest
  double end = hit + kRestitution * left / slowing;                              ///< [s]

  double x(double time) const {
    const double forth = std::min(time, hit), back = std::clamp(time - hit, 0.0, end - hit);
    return forth * (speed - slowing * forth / 2) - back * (kRestitution * left - slowing * back / 2);
  }
};

class Push final : public Physics {
 public:
  explicit Push(double length) : length_(length) {}

  SimulationOutcome simulate(const State& state, const Recording& recording, Animation& animation,
                             std::span<double> measures) override {
    const Slide slide{.speed = state[0], .slowing = kGravity * state[1], .length = length_};
    begin_animation(animation, kFrameRate, 1);
    Track& track = animation.tracks[kPuck];
    track.name = kPuckName;
    track.start = at(0);
    track.rest = at(slide.x(slide.end));
    track.settled = slide.end;
    if (slide.left > 0)
      animation.events.push_back({.time = slide.hit,
                                  .bodies = {kPuck, kCushion},
                                  .impulse = kMass * (1 + kRestitution) * slide.left,
                                  .position = at(length_ + kRadius).position,
                                  .normal = -Eigen::Vector3d::UnitX()});
    measures[0] = slide.end;
    if (is_out_of_reach(recording, animation)) return {.end = SimulationEnd::stopped};
    if (recording.frames) record(slide, animation);
    return {.end = SimulationEnd::complete, .simulated_seconds = slide.end};
  }

 private:
  static Pose at(double x) { return {.position = {x, kHalfHeight, 0}}; }

  /// What a viewer sees: a pose for each frame, and the bodies, those of the tracks first.
  void record(const Slide& slide, Animation& animation) const {
    animation.frames = frames_until(slide.end, kFrameRate);
    TrackWriter writer(animation.tracks[kPuck], animation.frames);
    for (std::size_t frame = 0; frame < animation.frames; ++frame)
      writer.add(at(slide.x(static_cast<double>(frame) / kFrameRate)));
    animation.bodies = {Body{.name = kPuckName,
                             .shape = Cylinder{kRadius, 2 * kHalfHeight},
                             .colour = "#c8442f",
                             .surface = Surface::plastic,
                             .track = kPuck},
                        Body{.name = kTableName,
                             .shape = Box{{length_ + kRadius, 0.02, 0.2}},
                             .colour = "#b98b5a",
                             .surface = Surface::plastic,
                             .pose = {.position = {0, -0.02, 0}}},
                        Body{.name = kCushionName,
                             .shape = Box{{0.02, 0.04, 0.2}},
                             .colour = "#4a7d61",
                             .surface = Surface::plastic,
                             .pose = {.position = {length_ + kRadius + 0.02, 0, 0}}}};
  }

  double length_;  ///< [m]
};

// --- What is uncertain, and how candidates are proposed ----------------------------------------------

class Shuffleboard final : public Scene {
 public:
  explicit Shuffleboard(double length) : length_(length) {}
  std::shared_ptr<const Model> model() const override { return model_; }
  KernelTable kernels(Ratios ratios) const override {
    return KernelTable({{"perturb", 0.8,
                         std::make_shared<const Perturb>(std::vector<Perturb::Group>{
                             {.variables = {0}, .size = 0.2, .probability = 0.7},
                             {.variables = {1}, .size = 0.01, .probability = 0.7}})},
                        {"redraw", 0.2, std::make_shared<const Redraw>(Redraw::all(*model_, ratios))}});
  }
  std::vector<Measure> measures() const override {
    return {{.name = "duration", .unit = "s", .summary = "When the puck comes to rest"}};
  }
  std::unique_ptr<Physics> make_physics() const override { return std::make_unique<Push>(length_); }

 private:
  double length_;
  std::shared_ptr<const Model> model_ = std::make_shared<const Model>(
      std::vector<Variable>{{.name = "speed", .unit = "m/s", .prior = Distribution::gaussian(2.5, 0.5)},
                            {.name = "friction", .unit = "", .prior = Distribution::gaussian(0.25, 0.03)}},
      [](const State& state) { return state[0] > 0 && state[1] > 0; });
};

// --- What can be wished ------------------------------------------------------------------------------

/// The puck comes to rest beyond a line. log p_c is a Gaussian of how far it falls short.
class Beyond final : public Term {
 public:
  explicit Beyond(double line) : line_(line) {}
  std::vector<Measure> measures() const override {
    return {{.name = "short", .unit = "m", .summary = "How far before the line the puck comes to rest"}};
  }
  TermScore score(const Animation& animation, std::span<double> values) const override {
    values[0] = shortfall(animation);
    return {.log_density = log_density(values[0]), .satisfied = values[0] == 0};
  }
  double least_when_satisfied() const override { return 0; }
  double upper_bound(const Animation& so_far) const override {
    return so_far.tracks[kPuck].settled ? log_density(shortfall(so_far)) : 0;
  }

 private:
  double shortfall(const Animation& animation) const {
    return std::max(line_ - animation.tracks[kPuck].rest.position.x(), 0.0);
  }
  static double log_density(double shortfall) { return -0.5 * std::pow(shortfall / kRadius, 2); }
  double line_;  ///< [m]
};

std::vector<TermKind> make_term_kinds() {
  std::vector<TermKind> kinds =
      terms::general_terms({.roster = [](const Parameters&) { return names(); },
                            .only_body = kPuckName,
                            .length = kRadius,
                            .speed = 0.2,
                            .source = "chosen: a puck's radius, a tenth of its speed"});
  kinds.push_back({.kind = "beyond",
                   .summary = "The puck comes to rest beyond a line",
                   .parameters = ParameterTable({{.name = "line",
                                                  .default_value = 1,
                                                  .minimum = 0,
                                                  .maximum = 10,
                                                  .unit = "m",
                                                  .summary = "Where the line is",
                                                  .source = "chosen: one puck in five gets there"}}),
                   .make = [](const Parameters& term, const Parameters&,
                              auto&&...) { return std::make_unique<const Beyond>(term.number("line")); },
                   .sentence =
                       [](const Parameters& term, const Parameters&) {
                         return "the puck comes to rest beyond " + in_words(term.number("line")) + " m";
                       }});
  return kinds;
}

// --- The world ---------------------------------------------------------------------------------------

class MinimalWorld final : public World {
 public:
  std::string_view name() const override { return "shuffleboard"; }
  int version() const override { return 1; }
  std::string_view summary() const override { return "A puck slides over a table: say where it shall rest"; }
  std::string_view attempt() const override { return "push"; }
  Method default_method() const override { return Method::metropolis; }
  Savings savings() const override { return {.stops_early = true}; }
  const ParameterTable& model_parameters() const override { return model_; }
  const std::vector<TermKind>& term_kinds() const override { return kinds_; }
  Roster roster(const Parameters&) const override { return names(); }
  std::vector<nlohmann::json> examples() const override {
    return {
        {{"world", "shuffleboard"}, {"title", "Beyond the line"}, {"constraints", {{{"kind", "beyond"}}}}}};
  }
  std::shared_ptr<const Scene> make_scene(const Parameters& model, std::vector<Fault>&) const override {
    return std::make_shared<const Shuffleboard>(model.number("length"));
  }

 private:
  const ParameterTable model_{{{.name = "length",
                                .default_value = 1.2,
                                .minimum = 0.5,
                                .maximum = 10,
                                .unit = "m",
                                .summary = "From where the puck starts to where it touches the cushion",
                                .source = "chosen: every other puck gets there"}}};
  const std::vector<TermKind> kinds_ = make_term_kinds();
};

}  // namespace

const World& minimal_world() {
  static const MinimalWorld world;
  return world;
}

}  // namespace retake::tests
