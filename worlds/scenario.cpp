// See scenario.h.
#include "worlds/scenario.h"

#include <algorithm>
#include <utility>

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestTitle = 200;  // characters; chosen: fits a heading

std::string read_title(const json& document, std::string_view fallback, std::vector<Fault>& faults) {
  const auto given = document.find("title");
  if (given == document.end()) return std::string(fallback);
  if (!given->is_string()) {
    faults.push_back({"/title", "expected a string, got " + std::string(given->type_name())});
    return {};
  }
  std::string title = given->get<std::string>();
  const auto is_control = [](unsigned char character) { return character < 0x20 || character == 0x7f; };
  if (title.empty())
    faults.push_back({"/title", "must not be empty"});
  else if (title.size() > kLongestTitle)
    faults.push_back({"/title", "must be at most " + std::to_string(kLongestTitle) + " bytes long"});
  else if (std::any_of(title.begin(), title.end(), is_control))
    faults.push_back({"/title", "must not hold control characters"});
  return title;
}

/// Makes names unique: a second "miss" becomes "miss_2".
void add_measures(std::vector<Measure>& measures, const std::vector<Measure>& more) {
  for (const Measure& measure : more) {
    std::string unique = measure.name;
    const auto is_taken = [&](const Measure& other) { return other.name == unique; };
    for (int number = 2; std::any_of(measures.begin(), measures.end(), is_taken); ++number)
      unique = measure.name + "_" + std::to_string(number);
    measures.push_back({.name = unique, .kind = measure.kind, .list = measure.list});
  }
}

}  // namespace

std::shared_ptr<const Scenario> Scenario::read(const json& document,
                                               const std::vector<const World*>& offered) {
  std::vector<Fault> faults;
  if (!document.is_object())
    throw InvalidRequest({{"", "expected an object, got " + std::string(document.type_name())}});
  for (const auto& [name, value] : document.items())
    if (name != "world" && name != "title" && name != "model" && name != "constraints")
      faults.push_back({append_pointer("", name), "there is no such field here"});

  // The world comes first: without it nothing else can be judged.
  std::vector<std::string> names;
  const World* world = nullptr;
  const auto given_world = document.find("world");
  for (const World* each : offered) {
    names.emplace_back(each->name());
    if (given_world != document.end() && *given_world == names.back()) world = each;
  }
  if (!world) {
    faults.push_back(
        {"/world", std::string(given_world == document.end() ? "is required" : "is not a world") +
                       "; there are " + list_of_names(names)});
    throw InvalidRequest(std::move(faults));
  }

  std::shared_ptr<Scenario> scenario(new Scenario);
  scenario->world_ = world;
  scenario->title_ = read_title(document, world->summary().substr(0, kLongestTitle), faults);

  // The model.
  json fitted_model = document.value("model", json::object());
  if (const auto wishes = document.find("constraints");
      wishes != document.end() && wishes->is_array() && fitted_model.is_object())
    world->fit_model(fitted_model, *wishes);
  const std::size_t faults_before = faults.size();
  const Parameters model = world->model_parameters().read(fitted_model, "/model", faults);
  if (faults.size() == faults_before) scenario->scene_ = world->make_scene(model, faults);
  const bool model_is_sound = faults.size() == faults_before;

  // The constraint terms.
  if (const auto given = document.find("constraints"); given == document.end())
    faults.push_back({"/constraints", "is required; [] samples the prior"});
  else
    scenario->judge_ = Judge::read({.name = world->name(), .kinds = world->term_kinds()}, *given,
                                   model_is_sound ? &model : nullptr, "/constraints", faults);
  if (!faults.empty()) throw InvalidRequest(std::move(faults));

  // What chains need.
  scenario->document_ = {{"world", world->name()},
                         {"world_version", world->version()},
                         {"title", scenario->title_},
                         {"model", model.document()},
                         {"constraints", scenario->judge_.document()}};
  Target target{.model = scenario->scene_->model(),
                .kernels = scenario->scene_->kernels(Ratios::exact),
                .measure_names = {},
                .least_satisfied = scenario->judge_.least_when_satisfied(),
                .learned = scenario->scene_->learned()};
  add_measures(scenario->measures_, scenario->scene_->measures());
  add_measures(scenario->measures_, scenario->judge_.measures());
  target.guide = scenario->scene_->guide(scenario->judge_.terms());
  target.placed = scenario->scene_->placed(scenario->judge_.terms());
  for (const Measure& measure : scenario->measures_)
    target.measure_names.push_back(measure.name);
  if (target.guide && !target.guide->soft_kernels().rows().empty())
    target.scored_kernels = {target.guide, &target.guide->soft_kernels()};
  scenario->exact_ = std::make_shared<const Target>(target);
  target.kernels = scenario->scene_->kernels(Ratios::paper);
  target.scored_kernels = nullptr;
  scenario->paper_ = std::make_shared<const Target>(std::move(target));
  return scenario;
}

std::unique_ptr<Scenario::Performer> Scenario::make_performer() const {
  return std::make_unique<Performer>(*this);
}

Scenario::Performer::Performer(const Scenario& scenario)
    : scenario_(scenario),
      physics_(scenario.scene_->make_physics()),
      physics_measures_(scenario.scene_->measures().size()) {}

SimulationOutcome Scenario::Performer::simulate(const State& candidate, const SimulationRequest& request,
                                                Score& score) {
  const Recording recording{.frames = scenario_.judge_.reads_frames(),
                            .terms = scenario_.judge_.terms(),
                            .needed = request.needed,
                            .current_state = request.current_state,
                            .current_run = request.current_run,
                            .record = request.record,
                            .watch = request.watch};
  const SimulationOutcome outcome =
      physics_->simulate(candidate, recording, scored_, std::span(score.measures).first(physics_measures_));
  if (outcome.end == SimulationEnd::complete) judge(scored_, score);
  return outcome;
}

Scenario::Performer::Take Scenario::Performer::perform(const State& state) {
  Take take{.animation = recorded_, .score = {}, .complete = false};
  take.score.measures.assign(scenario_.measures().size(), kAbsent);
  const SimulationOutcome outcome = physics_->simulate(
      state, {.frames = true}, recorded_, std::span(take.score.measures).first(physics_measures_));
  take.complete = outcome.end == SimulationEnd::complete;
  if (!take.complete) return take;
  judge(recorded_, take.score);
  for (Body& marker : scenario_.judge_.markers(recorded_))
    recorded_.bodies.push_back(std::move(marker));
  return take;
}

void Scenario::Performer::judge(const Animation& animation, Score& score) const {
  const TermScore said =
      scenario_.judge_.score(animation, std::span(score.measures).subspan(physics_measures_));
  score.log_constraint = said.log_density;
  score.satisfied = said.satisfied;
}

}  // namespace retake
