// See ball2d.h. The tables here are meant to be read beside sections 3.1, 5.1.1 and 5.1.2 of the paper.
#include "worlds/ball2d/ball2d.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "worlds/ball2d/bounce.h"
#include "worlds/gravity.h"
#include "worlds/recorder.h"
#include "worlds/terms/terms.h"

namespace retake::ball2d {
namespace {

using nlohmann::json;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMass = 1;             // [kg], chosen: only the impulses of contact events depend on it
constexpr double kFrameRate = 60;       // [frames/s]
constexpr double kTableHalfLength = 6;  // [m], chosen: holds nearly every bounce
constexpr double kTableHalfWidth = 1.2, kTableThickness = 0.16;  // [m], chosen
constexpr double kPlinthHeight = 0.14, kPlinthInset = 0.2;  // [m], chosen: the table seems to float on it
constexpr double kFloor = 200;                              // [m] to every side, chosen: to the horizon
constexpr double kMarkReach = 0.6;  // [m] of a mark to either side, chosen: half the table
// [s], chosen: of what can be asked for, 3 minutes are the longest on Earth.
constexpr double kLongestFlight = 300;
constexpr std::size_t kBall = 0, kTable = 1;  // in Animation::bodies
constexpr const char *kBallName = "ball", *kTableName = "table";

const ParameterTable& model_table() {
  static const ParameterTable table({
      {.name = "normal_sd",
       .default_value = 10 * kDegree,
       .minimum = 0,
       .maximum = std::numbers::pi / 4,
       .above_minimum = true,
       .unit = "rad",
       .summary = "Standard deviation of the tilt of the normal at each collision",
       .source = "3.1: 10 degrees"},
      {.name = "collisions",
       .kind = Parameter::Kind::integer,
       .default_value = 5,
       .minimum = 1,
       .maximum = 20,
       .summary = "Collisions before the contact at which the ball rests",
       .source = "5.1"},
      {.name = "drop_height",
       .default_value = 4.5,
       .minimum = kRadius,
       .maximum = 100,
       .above_minimum = true,
       .unit = "m",
       .summary = "Height of the ball's centre at the start; its diameter is 1 m",
       .source = "5.1: 4.5 D, read as the height of the centre"},
      {.name = "restitution",
       .default_value = 1 / std::numbers::sqrt2,
       .minimum = 0,
       .maximum = 1,
       .above_minimum = true,
       .summary = "Factor of the normal velocity at a collision",
       .source = "5.1"},
      {.name = "gravity",
       .default_value = kGravity,
       .minimum = 0,
       .maximum = 1000,
       .above_minimum = true,
       .unit = "m/s^2",
       .summary = "Gravity; it changes the timing but not the path. So much that no ball can fly for longer "
                  "than 300 s",
       .source = "standard gravity"},
      {.name = "step",
       .default_value = 5 * kDegree,
       .minimum = 0,
       .maximum = std::numbers::pi,
       .above_minimum = true,
       .unit = "rad",
       .summary = "Largest change of a tilt in one proposal of the method metropolis",
       .source = "5.1.2: 5 degrees"},
      {.name = "redraw_share",
       .default_value = 0.05,
       .minimum = 0,
       .maximum = 1,
       .summary =
           "Share of proposals of the method metropolis that draw every tilt anew; 0: the paper's alone",
       .source = "chosen: without it one chain in fifty never arrives"},
  });
  return table;
}

// --- What can be wished: above all where the ball comes to rest (5.1.1) -------------------------

Roster roster() {
  return {.movers = {{.name = kBallName, .tells_rest = true}}, .still = {kTableName}};
}

std::vector<TermKind> make_term_kinds() {
  return terms::general_terms(
      {.roster = [](const Parameters&) { return roster(); },
       .only_body = kBallName,
       .length = 0.1,
       .speed = 0.5,
       .source = "5.1.1 and figure 2: 0.1 D; speeds chosen, what a fall of 1 cm makes",
       .mark_height = 0.002,
       .flat = kMarkReach});
}

// --- The simulator -----------------------------------------------------------------------------

class BallPhysics final : public Physics {
 public:
  explicit BallPhysics(const BounceModel& model) : model_(model) {}

  SimulationOutcome simulate(const State& tilts, const Recording& recording, Animation& animation,
                             std::span<double> measures) override {
    begin_animation(animation, kFrameRate, 1);
    hops_.clear();

    double duration = 0;
    std::size_t hop_count = 0;
    const double x = bounce(
        model_, tilts,
        [&](const Hop& hop) {
          duration = hop.start + hop.duration;
          if (hop_count > 0) measures[hop_count] = hop.vx < 0 ? -1 : 1;  // the first is the drop
          ++hop_count;
          if (recording.frames) hops_.push_back(hop);
        },
        [&](double time, double at, double sine, double cosine, double impulse) {
          if (impulse <= 0) return;
          const Eigen::Vector3d normal(sine, cosine, 0);
          animation.events.push_back({.time = time,
                                      .bodies = {kBall, kTable},
                                      .impulse = kMass * impulse,
                                      .position = Eigen::Vector3d(at, kRadius, 0) - kRadius * normal,
                                      .normal = normal});
        });
    Track& track = animation.tracks[0];
    track.name = kBallName;
    track.start.position = {0, model_.drop_height, 0};
    track.rest.position = {x, kRadius, 0};
    track.settled = duration;
    measures[0] = x;
    if (recording.frames) record(duration, animation);
    return {.end = SimulationEnd::complete, .simulated_seconds = duration};
  }

 private:
  void record(double duration, Animation& animation) const {
    animation.bodies = {Body{.name = kBallName,
                             .shape = Sphere{kRadius},
                             .colour = "#c8442f",
                             .surface = Surface::rubber,
                             .track = 0},
                        Body{.name = kTableName,
                             .shape = Box{{kTableHalfLength, kTableThickness / 2, kTableHalfWidth}},
                             .colour = "#b98b5a",
                             .surface = Surface::wood,
                             .pose = {.position = {0, -kTableThickness / 2, 0}}},
                        // What only the eye needs.
                        Body{.name = "plinth",
                             .shape = Box{{kTableHalfLength - kPlinthInset, kPlinthHeight / 2,
                                           kTableHalfWidth - kPlinthInset}},
                             .colour = "#33373d",
                             .surface = Surface::plaster,
                             .pose = {.position = {0, -kTableThickness - kPlinthHeight / 2, 0}}},
                        Body{.name = "floor",
                             .shape = Box{{kFloor, kTableThickness / 2, kFloor}},
                             .colour = "#b9b4ab",
                             .surface = Surface::stone,
                             .pose = {.position = {0, -1.5 * kTableThickness - kPlinthHeight, 0}}}};
    animation.frames = static_cast<std::size_t>(std::ceil(duration * kFrameRate)) + 1;
    Track& track = animation.tracks[0];
    TrackWriter writer(track, animation.frames);
    std::size_t hop = 0;
    for (std::size_t frame = 0; frame < animation.frames; ++frame) {
      const double time = static_cast<double>(frame) / kFrameRate;
      while (hop < hops_.size() && time > hops_[hop].start + hops_[hop].duration)
        ++hop;
      if (hop < hops_.size()) {
        const Hop& at = hops_[hop];
        const double since = time - at.start;
        // The model ignores rotation.
        writer.add({.position = {at.x + at.vx * since,
                                 at.y + at.vy * since - 0.5 * model_.gravity * since * since, 0}});
      } else {
        writer.add(track.rest);
      }
    }
  }

  BounceModel model_;
  std::vector<Hop> hops_;
};

class BallScene final : public Scene {
 public:
  explicit BallScene(const Parameters& parameters)
      : bounce_{.drop_height = parameters.number("drop_height"),
                .restitution = parameters.number("restitution"),
                .gravity = parameters.number("gravity")},
        step_(parameters.number("step")),
        redraw_share_(parameters.number("redraw_share")) {
    // 3.1: the direction of the normal at each collision.
    std::vector<Variable> variables;
    for (std::int64_t i = 1; i <= parameters.integer("collisions"); ++i)
      variables.push_back({.name = "tilt_" + std::to_string(i),
                           .unit = "rad",
                           .prior = Distribution::gaussian(0, parameters.number("normal_sd"))});
    model_ = std::make_shared<const Model>(std::move(variables));
  }

  std::shared_ptr<const Model> model() const override { return model_; }

  KernelTable kernels(Ratios ratios) const override {
    // 5.1.2: each normal with probability one half, by a number uniform on (-5, 5) degrees.
    std::vector<Perturb::Group> tilts;
    for (std::size_t i = 0; i < model_->size(); ++i)
      tilts.push_back(
          {.variables = {i}, .shape = Perturb::Shape::uniform, .size = step_, .probability = 0.5});
    std::vector<WeightedKernel> rows;
    if (redraw_share_ < 1)
      rows.push_back({"perturb", 1 - redraw_share_, std::make_shared<const Perturb>(std::move(tilts))});
    if (redraw_share_ > 0)
      rows.push_back({"redraw", redraw_share_, std::make_shared<const Redraw>(Redraw::all(*model_, ratios))});
    return KernelTable(std::move(rows));
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> all = {{.name = "x", .unit = "m", .summary = "Where the ball comes to rest"}};
    for (std::size_t i = 1; i <= model_->size(); ++i)
      all.push_back({.name = "bounce_" + std::to_string(i),
                     .kind = Measure::Kind::integer,
                     .list = "bounces",
                     .summary = "Which way the ball goes from each collision: 1 right, -1 left"});
    return all;
  }
  std::unique_ptr<Physics> make_physics() const override { return std::make_unique<BallPhysics>(bounce_); }

 private:
  BounceModel bounce_;
  double step_, redraw_share_;
  std::shared_ptr<const Model> model_;
};

class BallWorld final : public World {
 public:
  std::string_view name() const override { return "ball2d"; }
  int version() const override { return 1; }
  std::string_view summary() const override {
    return "A ball bounces on a table whose normal is uncertain at every collision";
  }
  std::string_view attempt() const override { return "drop"; }
  Method default_method() const override { return Method::rejection; }
  const ParameterTable& model_parameters() const override { return model_table(); }
  const std::vector<TermKind>& term_kinds() const override {
    static const std::vector<TermKind> kinds = make_term_kinds();
    return kinds;
  }
  Roster roster(const Parameters&) const override { return ball2d::roster(); }
  std::vector<json> examples() const override {
    return {{{"world", "ball2d"},
             {"title", "A ball that comes to rest one diameter to the right"},
             {"model", json::object()},
             {"constraints", {{{"kind", "rest_position"}, {"x", 1.0}, {"sd", 0.1}}}}}};
  }
  std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                          std::vector<Fault>& faults) const override {
    // A ball that keeps all its energy goes up and down again once for every collision.
    const double fall = model.number("drop_height") - kRadius;
    const double falls = 1 + 2 * static_cast<double>(model.integer("collisions"));
    if (falls * std::sqrt(2 * fall / model.number("gravity")) > kLongestFlight) {
      // In three digits, rounded up.
      const double exact = 2 * fall * std::pow(falls / kLongestFlight, 2);
      const double digit = std::pow(10, std::floor(std::log10(exact)) - 2);
      const double least = std::ceil(exact / digit) * digit;
      faults.push_back({"/model/gravity", "must be at least " + plain_number(least) +
                                              " m/s^2 with this height and so many collisions: the ball "
                                              "could fly for longer than " +
                                              plain_number(kLongestFlight) + " s"});
      return nullptr;
    }
    return std::make_shared<const BallScene>(model);
  }
};

}  // namespace

const World& world() {
  static const BallWorld ball_world;
  return ball_world;
}

}  // namespace retake::ball2d
