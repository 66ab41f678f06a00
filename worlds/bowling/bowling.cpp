// See bowling.h. The tables here are meant to be read beside section 5.2 and appendix A.1 of the paper.
#include "worlds/bowling/bowling.h"

#include <algorithm>
#include <utility>

#include "worlds/bowling/lane.h"
#include "worlds/bowling/pins.h"
#include "worlds/bowling/release.h"
#include "worlds/bowling/throw.h"
#include "worlds/bowling/view.h"
#include "worlds/terms/terms.h"

namespace retake::bowling {
namespace {

using nlohmann::json;

const ParameterTable& model_table() {
  static const ParameterTable table({
      {.name = "rack",
       .kind = Parameter::Kind::integer_set,
       .default_value = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10},
       .minimum = 1,
       .maximum = kPinCount,
       .fewest = 1,
       .summary = "The pins that are set: 1 is the head pin, 7 to 10 the last row from left to right",
       .source = "5.2.1"},
      {.name = "release",
       .kind = Parameter::Kind::choice,
       .default_value = "paper",
       .choices = {"paper", "modern"},
       .summary =
           "How the ball is thrown: the paper's plain release, or the speed, revolutions, axis rotation "
           "and tilt of professional players",
       .source = "A.1; modern: 30 PBA men average 8.32 m/s and 436 rpm (Albany Times Union, 2020-09-29), 45 "
                 "degrees of rotation and 1.8 degrees to the right (Hooper et al., AIP Advances, 2025)"},
      {.name = "lane_friction",
       .default_value = 0.12,
       .minimum = 0.001,
       .maximum = 1,
       .summary = "Friction between ball and lane where there is no oil",
       .source = "chosen: between oiled and dry lanes; at most 0.32 is legal"},
      {.name = "oil",
       .kind = Parameter::Kind::boolean,
       .default_value = false,
       .summary = "Oil on the first part of the lane and a dry rest, which makes a turning ball hook",
       .source = "beyond the paper"},
      {.name = "oil_length",
       .default_value = 12.192,
       .minimum = 0,
       .maximum = -kFoulLine,
       .unit = "m",
       .summary = "How far from the foul line the oil reaches",
       .source = "a 40 ft pattern"},
      {.name = "oil_friction",
       .default_value = 0.04,
       .minimum = 0.001,
       .maximum = 1,
       .summary = "Friction between ball and oiled lane",
       .source = "0.04 measured on oil"},
      {.name = "dry_friction",
       .default_value = 0.2,
       .minimum = 0.001,
       .maximum = 1,
       .summary = "Friction between ball and lane behind the oil",
       .source = "0.20 to 0.21 measured on dry lanes"},
      {.name = "pit_cushion",
       .kind = Parameter::Kind::boolean,
       .default_value = false,
       .summary =
           "Pins rebound from the cushion at the end of the pit; otherwise what leaves the deck is gone",
       .source = "beyond the paper: seven-ten splits are made by a rebound (WIRED)"},
      {.name = "cushion_restitution",
       .default_value = 0.6,
       .minimum = 0,
       .maximum = 1,
       .summary = "Share of its speed that a pin keeps at the cushion",
       .source = "chosen: 0.3 converts a tenth as often"},
  });
  return table;
}

class BowlingScene final : public Scene {
 public:
  explicit BowlingScene(const Parameters& parameters) {
    deck_.rack = parameters.integer_set("rack");
    for (const int pin : deck_.rack)
      front_ = std::min(front_, pin_spot(pin).x());
    releases_ = std::make_shared<const ReleaseModel>(
        parameters.choice("release") == "modern" ? ReleaseStyle::modern : ReleaseStyle::paper, deck_.rack);
    const double friction = parameters.number("lane_friction");
    friction_ = parameters.boolean("oil")
                    ? LaneFriction{.before = parameters.number("oil_friction"),
                                   .beyond = parameters.number("dry_friction"),
                                   .change = kFoulLine + parameters.number("oil_length")}
                    : LaneFriction{.before = friction, .beyond = friction, .change = kFoulLine};
    deck_.ball_lane_friction = friction_.beyond;
    deck_.pit_cushion = parameters.boolean("pit_cushion");
    deck_.cushion_restitution = parameters.number("cushion_restitution");
  }

  std::shared_ptr<const Model> model() const override { return releases_->model(); }
  KernelTable kernels(Ratios ratios) const override { return releases_->kernels(ratios); }
  std::vector<Coordinate> learned() const override { return releases_->learned(friction_, front_); }
  std::vector<Measure> measures() const override { return throw_measures(deck_.rack.size()); }
  std::unique_ptr<Physics> make_physics() const override { return make_throws(releases_, friction_, deck_); }

 private:
  DeckSettings deck_;
  LaneFriction friction_{};
  double front_ = kDeckEnd;  ///< [m], x of the front-most pin
  std::shared_ptr<const ReleaseModel> releases_;
};

json example(const char* title, json model, json down) {
  return {{"world", "bowling"},
          {"title", title},
          {"model", std::move(model)},
          {"constraints", {{{"kind", "pins"}, {"down", std::move(down)}}}}};
}

Roster roster_of(const Parameters& model) {
  return roster(model.integer_set("rack"));
}

std::vector<TermKind> make_term_kinds() {
  std::vector<TermKind> kinds =
      terms::general_terms({.roster = roster_of,
                            .length = 0.1,
                            .speed = 0.5,
                            .source = "chosen: a ball's radius, and a twentieth of its speed",
                            .rests_need_frames = true});
  kinds.insert(kinds.begin(), pins_term());
  return kinds;
}

class BowlingWorld final : public World {
 public:
  std::string_view name() const override { return "bowling"; }
  int version() const override { return 2; }
  std::string_view summary() const override {
    return "Ten-pin bowling: say which pins are set and which shall fall";
  }
  std::string_view attempt() const override { return "throw"; }
  Method default_method() const override { return Method::conditional; }
  Savings savings() const override { return {.stops_early = true}; }
  const ParameterTable& model_parameters() const override { return model_table(); }
  const std::vector<TermKind>& term_kinds() const override {
    static const std::vector<TermKind> kinds = make_term_kinds();
    return kinds;
  }
  Roster roster(const Parameters& model) const override { return roster_of(model); }
  std::optional<Viewpoint> viewpoint(const Animation&) const override { return deck_viewpoint(); }
  std::vector<json> examples() const override {
    const json none = json::object();
    return {
        example("A strike", none, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}),
        example("Leave the six-seven split", none, {1, 2, 3, 4, 5, 8, 9, 10}),
        example("Pick up the six-seven split", {{"rack", {6, 7}}}, {6, 7}),
        example("The seven-ten split, by a rebound",
                {{"rack", {7, 10}}, {"release", "modern"}, {"oil", true}, {"pit_cushion", true}}, {7, 10})};
  }
  std::shared_ptr<const Scene> make_scene(const Parameters& model, std::vector<Fault>&) const override {
    return std::make_shared<const BowlingScene>(model);
  }
};

}  // namespace

const World& world() {
  static const BowlingWorld bowling_world;
  return bowling_world;
}

}  // namespace retake::bowling
