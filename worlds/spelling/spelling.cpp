// See spelling.h. The tables here are meant to be read beside section 5.3 and appendix B.1 of the paper.
#include "worlds/spelling/spelling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "worlds/spelling/box.h"
#include "worlds/spelling/marbles.h"
#include "worlds/spelling/moves.h"
#include "worlds/spelling/pour.h"
#include "worlds/spelling/view.h"
#include "worlds/spelling/wish.h"
#include "worlds/terms/terms.h"

namespace retake::spelling {
namespace {

using nlohmann::json;

constexpr double kMarkHeight = 0.0001;  // [m] half of a mark's, chosen: paint on the floors

const ParameterTable& model_table() {
  static const impulse::Settings kEngine;
  static const ParameterTable table({
      {.name = "columns",
       .kind = Parameter::Kind::integer,
       .default_value = 7,
       .minimum = 1,
       .maximum = kMostColumns,
       .summary = "Bins of the box from left to right; by default seven, what a text needs that is longer, "
                  "or as many as `bins` has",
       .source = "5.3.1"},
      {.name = "rows",
       .kind = Parameter::Kind::integer,
       .default_value = 5,
       .minimum = 1,
       .maximum = kMostRows,
       .summary = "Bins of the box from far to near; by default five, what a text needs that is longer, or "
                  "as many as `bins` has",
       .source = "5.3.1"},
      {.name = "balls",
       .kind = Parameter::Kind::integer,
       .default_value = 10,
       .minimum = 1,
       .maximum = kMostColumns * kMostRows,
       .summary =
           "How many balls there are at most, each of which takes part or not; by default as many as the "
           "wish designates bins",
       .source = "5.3: the minimum number required to form the word; ten without a wish chosen: HI's"},
      {.name = "tessellation",
       .kind = Parameter::Kind::integer,
       .default_value = 2,
       .minimum = 1,
       .maximum = 4,
       .summary = "Vertices that move on their own where partitions cross: 1, 2 or 4",
       .source = "the paper does not say; 2 finds words fastest, measured"},
      {.name = "interval",
       .default_value = 0.15,
       .minimum = 0.02,
       .maximum = 2,
       .unit = "s",
       .summary = "From one ball's drop to the next one's, whether or not it takes part; whole milliseconds",
       .source = "chosen: HI falls in two seconds"},
      {.name = "restitution",
       .default_value = kEngine.restitution,
       .minimum = 0,
       .maximum = 0.9,
       .summary = "Share of its speed that a ball keeps where it bounces",
       .source = "chosen: glass on wood"},
      {.name = "friction",
       .default_value = kEngine.friction,
       .minimum = 0,
       .maximum = 1,
       .summary = "Friction between balls, and between ball and box",
       .source = "chosen: glass on wood"},
      {.name = "rolling_resistance",
       .default_value = kEngine.rolling_resistance,
       .minimum = 0.001,
       .maximum = 0.1,
       .summary = "Lever of the force that slows a rolling ball, in radii",
       .source = "chosen: a ball comes to rest in a second"},
  });
  return table;
}

class SpellingScene final : public Scene {
 public:
  explicit SpellingScene(const Parameters& parameters)
      : box_(std::make_shared<const Box>(static_cast<int>(parameters.integer("columns")),
                                         static_cast<int>(parameters.integer("rows")),
                                         static_cast<Tessellation>(parameters.integer("tessellation")))),
        marbles_(std::make_shared<const MarbleModel>(*box_,
                                                     static_cast<std::size_t>(parameters.integer("balls")))) {
    settings_.engine.restitution = parameters.number("restitution");
    settings_.engine.friction = parameters.number("friction");
    settings_.engine.rolling_resistance = parameters.number("rolling_resistance");
    settings_.interval_steps = std::llround(parameters.number("interval") / settings_.engine.time_step);
  }

  std::shared_ptr<const Model> model() const override { return marbles_->model(); }
  KernelTable kernels(Ratios ratios) const override { return marbles_->kernels(ratios); }
  /// To the word, if there is one, whatever else is wished.
  std::shared_ptr<const Guide> guide(const Terms& wishes) const override {
    const Wish* wish = nullptr;
    for (const auto& term : wishes)
      if (const auto* word = dynamic_cast<const Wish*>(term.get())) {
        if (wish) return nullptr;
        wish = word;
      }
    if (!wish) return nullptr;
    return make_guide(*box_, marbles_, wish->pattern(), kFirstBinMeasure);
  }
  std::vector<Measure> measures() const override { return pour_measures(marbles_->marble_count()); }
  std::unique_ptr<Physics> make_physics() const override { return make_pours(marbles_, box_, settings_); }

 private:
  std::shared_ptr<const Box> box_;
  std::shared_ptr<const MarbleModel> marbles_;
  PourSettings settings_;
};

json example(const char* text, int columns, int rows) {
  return {{"world", "spelling"},
          {"title", std::string("Marbles that spell ") + text},
          {"model", {{"columns", columns}, {"rows", rows}}},
          {"constraints", {{{"kind", "spell"}, {"text", text}}}}};
}

/// Gives a box the size of the first pattern of bins, which goes with no other; without one makes it larger
/// until it has room for the texts that do not fit into it.
void fit_box(int& columns, int& rows, const json& constraints) {
  for (const json& constraint : constraints)
    if (const auto size = box_of(constraint)) {
      columns = size->columns;
      rows = size->rows;
      return;
    }
  for (const json& constraint : constraints) {
    const auto room = box_for(constraint);
    if (!room || designated_bins(constraint, columns, rows)) continue;
    columns = std::max(columns, room->columns);
    rows = std::max(rows, room->rows);
  }
}

Roster roster_of(const Parameters& model) {
  return roster(static_cast<std::size_t>(model.integer("balls")));
}

std::vector<TermKind> make_term_kinds() {
  std::vector<TermKind> kinds = wish_terms();
  const std::vector<TermKind> general = terms::general_terms(
      {.roster = roster_of,
       .length = kMarbleRadius,
       .speed = 0.1,
       .source = "chosen: a marble's radius, and a tenth of the speed with which it falls into the box",
       .mark_height = kMarkHeight});
  kinds.insert(kinds.end(), general.begin(), general.end());
  return kinds;
}

class SpellingWorld final : public World {
 public:
  std::string_view name() const override { return "spelling"; }
  int version() const override { return 2; }
  std::string_view summary() const override {
    return "Marbles poured into a box of bins: say which word they shall spell";
  }
  std::string_view attempt() const override { return "pour"; }
  Method default_method() const override { return Method::conditional; }
  Savings savings() const override { return {.stops_early = true, .resumes = true}; }
  const ParameterTable& model_parameters() const override { return model_table(); }
  const std::vector<TermKind>& term_kinds() const override {
    static const std::vector<TermKind> kinds = make_term_kinds();
    return kinds;
  }
  Roster roster(const Parameters& model) const override { return roster_of(model); }
  std::vector<json> examples() const override {
    return {example("HI", 7, 5), example("ACM", 15, 7), example("HOMEMADE", 40, 7)};
  }
  std::optional<Viewpoint> viewpoint(const Animation& shown) const override { return box_viewpoint(shown); }

  /// A box of the size of the wished bins, or with room for every text, if no size is given. As many balls as
  /// the largest wish designates bins; without a wish HI's, if there are so many bins.
  void fit_model(json& model, const json& constraints) const override {
    std::vector<Fault> faults;
    const Parameters given = model_parameters().read(model, "", faults);
    if (!faults.empty()) return;
    int columns = static_cast<int>(given.integer("columns"));
    int rows = static_cast<int>(given.integer("rows"));
    if (!model.contains("columns") && !model.contains("rows")) {
      fit_box(columns, rows, constraints);
      model["columns"] = columns;
      model["rows"] = rows;
    }
    if (model.contains("balls")) return;
    int balls = 0;
    for (const json& constraint : constraints)
      if (const auto pattern = designated_bins(constraint, columns, rows))
        balls = std::max(balls, pattern->count());
    model["balls"] = balls > 0 ? balls : std::min(static_cast<int>(given.integer("balls")), columns * rows);
  }

  std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                          std::vector<Fault>& faults) const override {
    const std::size_t faults_before = faults.size();
    const std::int64_t tessellation = model.integer("tessellation");
    if (tessellation == 3) faults.push_back({"/model/tessellation", "must be 1, 2 or 4, got 3"});
    const std::int64_t bins = model.integer("columns") * model.integer("rows");
    if (model.integer("balls") > bins)
      faults.push_back(
          {"/model/balls", "must be at most as many as there are bins, " + std::to_string(bins)});
    if (faults.size() > faults_before) return nullptr;
    return std::make_shared<const SpellingScene>(model);
  }
};

}  // namespace

const World& world() {
  static const SpellingWorld spelling_world;
  return spelling_world;
}

}  // namespace retake::spelling
