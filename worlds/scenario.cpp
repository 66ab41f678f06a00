// See scenario.h.
#include "worlds/scenario.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "worlds/words.h"

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

/// Makes names unique, those of lists too: a second "miss" becomes "miss_2".
void add_measures(std::vector<Measure>& measures, const std::vector<Measure>& more) {
  std::set<std::string> names, shown;  // a list is shown by its own name
  for (const Measure& measure : measures) {
    names.insert(measure.name);
    shown.insert(measure.list.empty() ? measure.name : measure.list);
  }
  const auto unique = [](const std::string& name, const std::set<std::string>& taken) {
    std::string free = name;
    for (int number = 2; taken.contains(free); ++number)
      free = name + "_" + std::to_string(number);
    return free;
  };
  std::map<std::string, std::string> lists;
  for (Measure measure : more) {
    measure.name = unique(measure.name, names);
    names.insert(measure.name);
    if (!measure.list.empty())
      measure.list = lists.try_emplace(measure.list, unique(measure.list, shown)).first->second;
    measures.push_back(std::move(measure));
  }
}

}  // namespace

std::vector<std::string> wishes_of(const json& document, const std::vector<const World*>& offered) {
  const auto world = std::find_if(offered.begin(), offered.end(), [&](const World* each) {
    return document.at("world").get<std::string>() == each->name();
  });
  const auto clause = [&](const json& constraint) {
    const std::string name = constraint.at("kind");
    if (world == offered.end()) return spaced(name);
    const auto& kinds = (*world)->term_kinds();
    const auto kind =
        std::find_if(kinds.begin(), kinds.end(), [&](const TermKind& each) { return each.kind == name; });
    if (kind == kinds.end()) return spaced(name);
    std::vector<Fault> faults;
    const Parameters model = (*world)->model_parameters().read(document.at("model"), "", faults);
    const Parameters term = kind->parameters.read(constraint, "", faults, {"kind"});
    return faults.empty() ? wish_in_words(*kind, term, model) : spaced(name);
  };
  std::vector<std::string> wishes;
  for (const json& constraint : document.at("constraints"))
    wishes.push_back(clause(constraint));
  return wishes;
}

std::shared_ptr<const Scenario> Scenario::read(const json& document,
                                               const std::vector<const World*>& offered) {
  std::vector<Fault> faults;
  if (!document.is_object())
    throw InvalidRequest({{"", "expected an object, got " + std::string(document.type_name())}});
  const auto is_known = [](const std::string& name) {
    return name == "world" || name == "title" || name == "model" || name == "constraints";
  };
  refuse_unknown_fields(document, "", is_known, "there is no such field here", faults);

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
  for (const auto& term : scenario->judge_.terms())
    add_measures(scenario->measures_, term->measures());
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
                            .watch = request.watch,
                            .interruption = &interruption_};
  const SimulationOutcome outcome =
      physics_->simulate(candidate, recording, scored_, std::span(score.measures).first(physics_measures_));
  if (outcome.end == SimulationEnd::complete) judge(scored_, score);
  return outcome;
}

Scenario::Performer::Take Scenario::Performer::perform(const State& state) {
  Take take{.animation = recorded_, .score = {}, .complete = false};
  take.score.measures.assign(scenario_.measures().size(), kAbsent);
  const SimulationOutcome outcome =
      physics_->simulate(state, {.frames = true, .interruption = &interruption_}, recorded_,
                         std::span(take.score.measures).first(physics_measures_));
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
