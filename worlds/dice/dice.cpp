// See dice.h. The tables here are meant to be read beside section 5.4 of the paper.
#include "worlds/dice/dice.h"

#include <algorithm>
#include <string>
#include <utility>

#include "worlds/dice/dice_model.h"
#include "worlds/dice/end_wish.h"
#include "worlds/dice/moves.h"
#include "worlds/dice/painting.h"
#include "worlds/dice/symmetry.h"
#include "worlds/dice/throw.h"
#include "worlds/dice/total.h"
#include "worlds/dice/view.h"
#include "worlds/terms/terms.h"

namespace retake::dice {
namespace {

using nlohmann::json;

constexpr double kDensity = 1180;  // [kg/m3], acrylic

const ParameterTable& model_table() {
  static const DiceSettings kDefault;
  static const ParameterTable table({
      {.name = "dice",
       .kind = Parameter::Kind::integer,
       .default_value = kDefault.dice,
       .minimum = 1,
       .maximum = 6,
       .summary = "How many dice are thrown on the table, one after the other; they collide",
       .source = "5.4 has one; more are beyond the paper"},
      {.name = "pose",
       .kind = Parameter::Kind::choice,
       .default_value = "random",
       .choices = {"random", "fixed"},
       .summary = "Where the grid of control points lies: random means that its offset within a cell, its "
                  "angle and its handedness are uniformly random, because nothing fixes them; fixed glues it "
                  "to the world",
       .source = "chosen: the paper fixes the spacing alone; its grid is fixed"},
      {.name = "paint",
       .kind = Parameter::Kind::choice,
       .default_value = "random",
       .choices = {"random", "fixed"},
       .summary = "How a die's faces are numbered: by a random one of the 24 rotations of a cube, or so that "
                  "1, 2 and 3 are on its x, y and z sides",
       .source = "chosen: a die's orientation is random anyway"},
      {.name = "spacing",
       .default_value = kDefault.table.spacing,
       .minimum = 0.002,
       .maximum = 0.1,
       .unit = "m",
       .summary = "Between neighbouring control points of the table",
       .source = "5.4 says a fixed spacing; 1 cm chosen: bumps of a die's size"},
      {.name = "height_spread",
       .default_value = kDefault.table.height_deviation,
       .minimum = 0,
       .maximum = 0.005,
       .above_minimum = true,
       .unit = "m",
       .summary = "Standard deviation of a control point's height; beyond 4.3 of them it is clamped",
       .source = "chosen: dice come to rest flat on a face"},
      {.name = "restitution",
       .default_value = kDefault.table.restitution_mean,
       .minimum = 0,
       .maximum = 0.95,
       .summary = "Mean share of its speed that a die keeps where it bounces",
       .source = "chosen: plastic on a wooden table"},
      {.name = "restitution_spread",
       .default_value = kDefault.table.restitution_deviation,
       .minimum = 0,
       .maximum = 0.5,
       .above_minimum = true,
       .summary = "Standard deviation of a control point's restitution, which is clamped to [0, 0.95]",
       .source = "chosen: springy and dead patches"},
      {.name = "friction",
       .default_value = kDefault.table.friction_mean,
       .minimum = 0.02,
       .maximum = 2,
       .summary = "Mean coefficient of friction between die and table",
       .source = "chosen: plastic on a wooden table"},
      {.name = "friction_spread",
       .default_value = kDefault.table.friction_deviation,
       .minimum = 0,
       .maximum = 0.5,
       .above_minimum = true,
       .summary = "Standard deviation of a control point's friction, which is at least 0.02",
       .source = "chosen: sticky patches, such as spilt beer (5.4)"},
      {.name = "side",
       .default_value = 0.016,
       .minimum = 0.005,
       .maximum = 0.05,
       .unit = "m",
       .summary = "Side of a die",
       .source = "16 mm: the usual size"},
      {.name = "shortening",
       .default_value = 0,
       .minimum = 0,
       .maximum = 0.3,
       .summary = "Share by which a die is shorter along x, between 1 and 6 if the paint is fixed: a crooked "
                  "die",
       .source = "beyond the paper: real dice are up to 3 % off"},
      {.name = "rounding",
       .default_value = 0.0012,
       .minimum = 0.0001,
       .maximum = 0.01,
       .unit = "m",
       .summary = "Radius of a die's edges and corners",
       .source = "chosen: a die with rounded edges"},
      {.name = "drop_height",
       .default_value = kDefault.drop_height,
       .minimum = 0.03,
       .maximum = 1,
       .unit = "m",
       .summary = "Mean height of a die's centre when it is let go",
       .source = "chosen: a hand above a table"},
      {.name = "drop_height_spread",
       .default_value = kDefault.height_spread,
       .minimum = 0,
       .maximum = 0.1,
       .above_minimum = true,
       .unit = "m",
       .summary = "Standard deviation of that height",
       .source = "chosen: 3 mm, as well as a hand repeats it"},
      {.name = "start_spread",
       .default_value = kDefault.start_spread,
       .minimum = 0,
       .maximum = 0.1,
       .above_minimum = true,
       .unit = "m",
       .summary = "Standard deviation of where a die is let go, along x and z, about the origin",
       .source = "chosen: 3 mm, as well as a hand repeats it"},
      {.name = "speed",
       .default_value = kDefault.speed,
       .minimum = 0,
       .maximum = 3,
       .above_minimum = true,
       .unit = "m/s",
       .summary = "Mean speed along x with which a die is let go",
       .source = "chosen: a gentle throw"},
      {.name = "speed_spread",
       .default_value = kDefault.speed_spread,
       .minimum = 0,
       .maximum = 1,
       .above_minimum = true,
       .unit = "m/s",
       .summary = "Standard deviation of each component of that velocity",
       .source = "chosen"},
      {.name = "spin_spread",
       .default_value = kDefault.spin_spread,
       .minimum = 0,
       .maximum = 100,
       .above_minimum = true,
       .unit = "rad/s",
       .summary = "Standard deviation of each component of the angular velocity",
       .source = "chosen: one or two turns a second"},
      {.name = "interval",
       .default_value = kDefault.interval,
       .minimum = 0.05,
       .maximum = 2,
       .unit = "s",
       .summary = "From one die's throw to the next one's; whole milliseconds",
       .source = "chosen: several are in the air or roll at once"},
  });
  return table;
}

DieShape shape_of(const Parameters& model) {
  const double side = model.number("side");
  return DieShape({side * (1 - model.number("shortening")), side, side}, model.number("rounding"), kDensity);
}

DiceSettings settings_of(const Parameters& model) {
  return {.dice = static_cast<std::size_t>(model.integer("dice")),
          .pose = model.choice("pose") == "random" ? GridPose::random : GridPose::fixed,
          .random_paint = model.choice("paint") == "random",
          .table = {.spacing = model.number("spacing"),
                    .height_deviation = model.number("height_spread"),
                    .restitution_mean = model.number("restitution"),
                    .restitution_deviation = model.number("restitution_spread"),
                    .friction_mean = model.number("friction"),
                    .friction_deviation = model.number("friction_spread")},
          .start_spread = model.number("start_spread"),
          .drop_height = model.number("drop_height"),
          .height_spread = model.number("drop_height_spread"),
          .speed = model.number("speed"),
          .speed_spread = model.number("speed_spread"),
          .spin_spread = model.number("spin_spread"),
          .interval = model.number("interval")};
}

class DiceScene final : public Scene {
 public:
  explicit DiceScene(const Parameters& parameters)
      : shape_(shape_of(parameters)),
        model_(std::make_shared<const DiceModel>(settings_of(parameters), engine_, shape_)) {}

  std::shared_ptr<const Model> model() const override { return model_->model(); }
  KernelTable kernels(Ratios ratios) const override { return model_->kernels(ratios); }
  /// How each die is thrown; what matters besides is too much to be learned.
  std::vector<Coordinate> learned() const override {
    std::vector<Coordinate> coordinates;
    for (std::size_t die = 0; die < model_->settings().dice; ++die)
      for (std::size_t component = 0; component < 3; ++component)
        coordinates.push_back({.variable = model_->velocity_x(die) + component});
    return coordinates;
  }
  std::shared_ptr<const PlacedRedraw> placed(const Terms& wishes) const override {
    const std::vector<EndWish> of_dice = end_wishes(wishes, dice());
    if (can_be_placed() && of_dice.front().is_wish())
      return std::make_shared<const Symmetry>(model_, of_dice.front(), end_measures(dice()));
    FaceWish faces{.sum = total_wish(wishes)};
    for (const EndWish& wish : of_dice)
      faces.faces.push_back(wish.face);
    if (!model_->settings().random_paint || !faces.is_wish() || is_guided(of_dice, wishes)) return nullptr;
    return std::make_shared<const Painting>(model_, std::move(faces), end_measures(dice()));
  }
  std::shared_ptr<const Guide> guide(const Terms& wishes) const override {
    std::vector<EndWish> of_dice = end_wishes(wishes, dice());
    if (!is_guided(of_dice, wishes)) return nullptr;
    return make_dice_guide(model_, engine_, std::move(of_dice), end_measures(dice()));
  }
  std::vector<Measure> measures() const override { return throw_measures(model_->settings().dice); }
  std::unique_ptr<Physics> make_physics() const override { return make_throws(model_, engine_, shape_); }

 private:
  std::size_t dice() const { return model_->settings().dice; }
  /// One die on a grid of random pose can be put anywhere.
  bool can_be_placed() const { return dice() == 1 && model_->settings().pose == GridPose::random; }
  /// Whether dice are brought to their ends one by one. The guide keeps them apart until they are there, so
  /// it does not serve wishes by which they have to meet; and faces that paint gives, or that few dice show
  /// by chance, need none.
  bool is_guided(const std::vector<EndWish>& of_dice, const Terms& wishes) const {
    constexpr std::ptrdiff_t kFacesByChance = 3;  // one throw in 216
    const auto have = [&](auto what) { return std::count_if(of_dice.begin(), of_dice.end(), what); };
    const bool has_place = have([](const EndWish& wish) { return wish.place.has_value(); }) > 0;
    const auto faces = have([](const EndWish& wish) { return wish.face.has_value(); });
    const bool needs_guide = has_place || (!model_->settings().random_paint && faces > kFacesByChance);
    const bool shall_meet =
        std::any_of(wishes.begin(), wishes.end(), [](const auto& term) { return !term->meetings().empty(); });
    return !can_be_placed() && needs_guide && !shall_meet;
  }

  EngineSettings engine_;
  DieShape shape_;
  std::shared_ptr<const DiceModel> model_;
};

json sum_example() {
  return {{"world", "dice"},
          {"title", "Two dice that show seven"},
          {"model", {{"dice", 2}}},
          {"constraints", {{{"kind", "total"}, {"sum", 7}}}}};
}

/// That a die comes to rest within the tolerance of a place, all in metres, with a face up.
json::array_t spot(int die, double x, double z, double tolerance, int face) {
  json rests = {{"kind", "rest_position"}, {"x", x}, {"z", z}, {"sd", tolerance}, {"tolerance", tolerance}};
  json shows = {{"kind", "face_up"}, {"face", face}};
  if (die > 0) rests["body"] = shows["body"] = "die_" + std::to_string(die);
  return {std::move(rests), std::move(shows)};
}

json spot_example() {
  return {{"world", "dice"},
          {"title", "A six within a millimetre"},
          {"constraints", spot(0, 0.12, 0.03, 0.001, 6)}};
}

/// Dice on one table that may hit each other, side by side in the end.
json row_example() {
  json wishes = json::array();
  for (int die = 1; die <= 3; ++die)
    for (json& wish : spot(die, 0.12, 0.024 * (die - 2), 0.004, die))
      wishes.push_back(std::move(wish));
  return {{"world", "dice"},
          {"title", "One, two, three in a row"},
          {"model", {{"dice", 3}}},
          {"constraints", std::move(wishes)}};
}

/// Figure 9: six dice, each on a table of its own, "told to land in a specific place showing a specific
/// side".
json figure_9_example(int die) {
  return {{"world", "dice"},
          {"title", "Figure 9: die " + std::to_string(die)},
          {"constraints", spot(0, 0.12, 0.02 * (die - 3.5), 0.004, die)}};
}

Roster roster_of(const Parameters& model) {
  return roster(static_cast<std::size_t>(model.integer("dice")));
}

/// [m] A die that keeps all energy, and that of all dice that hit it, and turns it into speed along the
/// table, gets no farther until the run ends. Of draws eight deviations from the mean.
double reach_of(const Parameters& model) {
  constexpr double kDeviations = 8;  // chosen: one draw in 10^15 lies beyond
  const DiceSettings settings = settings_of(model);
  const DieShape shape = shape_of(model);
  const EngineSettings engine;
  const double height = settings.drop_height + kDeviations * settings.height_spread;
  const double speed = settings.speed + kDeviations * settings.speed_spread;
  const double spin = kDeviations * settings.spin_spread;
  const double squared = speed * speed +
                         2 * kDeviations * kDeviations * settings.speed_spread * settings.speed_spread +
                         2 * engine.gravity * height + shape.inertia().sum() * spin * spin;
  return std::sqrt(2.0) * kDeviations * settings.start_spread +
         std::sqrt(squared * static_cast<double>(settings.dice)) * longest_run(settings);
}

std::vector<TermKind> make_term_kinds() {
  const terms::Setting setting{
      .roster = roster_of,
      .only_body = die_name(0),
      .length = 0.004,
      .speed = 0.1,
      .source = "chosen: a quarter of a die's side, and a quarter of the speed with which it is thrown",
      .mark_height = 0.0001,  // chosen: paint on the table
      .reach = reach_of};
  std::vector<TermKind> kinds = {total_term(), terms::face_up_term(setting)};
  const std::vector<TermKind> general = terms::general_terms(setting);
  kinds.insert(kinds.end(), general.begin(), general.end());
  return kinds;
}

class DiceWorld final : public World {
 public:
  std::string_view name() const override { return "dice"; }
  int version() const override { return 2; }
  std::string_view summary() const override {
    return "Dice thrown on a table with random bumps, springy and sticky patches: say what they shall show";
  }
  std::string_view attempt() const override { return "throw"; }
  Method default_method() const override { return Method::conditional; }
  Savings savings() const override { return {.stops_early = true, .resumes = true}; }
  const ParameterTable& model_parameters() const override { return model_table(); }
  const std::vector<TermKind>& term_kinds() const override {
    static const std::vector<TermKind> kinds = make_term_kinds();
    return kinds;
  }
  Roster roster(const Parameters& model) const override { return roster_of(model); }
  std::optional<Viewpoint> viewpoint(const Animation& shown) const override { return throw_viewpoint(shown); }
  std::vector<json> examples() const override {
    std::vector<json> all = {spot_example(), row_example(), sum_example()};
    for (int die = 1; die <= 6; ++die)
      all.push_back(figure_9_example(die));
    return all;
  }
  std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                          std::vector<Fault>& faults) const override {
    const double shortest = model.number("side") * (1 - model.number("shortening"));
    const double height = model.number("height_spread") * 4.3;
    const std::size_t faults_before = faults.size();
    if (2 * model.number("rounding") >= 0.9 * shortest)
      faults.push_back({"/model/rounding", "must be less than 0.45 of the die's shortest side"});
    // In any orientation, four deviations below the mean.
    if (model.number("drop_height") - 4 * model.number("drop_height_spread") <
        0.9 * model.number("side") + height)
      faults.push_back({"/model/drop_height",
                        "must be so large that a die starts above the table: four "
                        "drop_height_spread more than 0.9 sides and 4.3 height_spread"});
    if (faults.size() > faults_before) return nullptr;
    return std::make_shared<const DiceScene>(model);
  }
};

}  // namespace

const World& world() {
  static const DiceWorld dice_world;
  return dice_world;
}

}  // namespace retake::dice
