// See scenario.h.
#include "worlds/scenario.h"

#include <algorithm>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestTitle = 200;    // characters; chosen: fits a heading
constexpr std::size_t kMostConstraints = 32;  // chosen: more than any scene needs

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

/// The kind of term that a constraint names; null, and a fault, if it names none.
const TermKind* read_kind(const World& world, const json& constraint, const std::string& pointer,
                          std::vector<Fault>& faults) {
  if (!constraint.is_object()) {
    faults.push_back({pointer, "expected an object, got " + std::string(constraint.type_name())});
    return nullptr;
  }
  std::vector<std::string> offered;
  const auto given = constraint.find("kind");
  for (const TermKind& kind : world.term_kinds()) {
    if (given != constraint.end() && *given == kind.kind) return &kind;
    offered.push_back(kind.kind);
  }
  faults.push_back({append_pointer(pointer, "kind"),
                    std::string(given == constraint.end() ? "is required" : "is not a kind of this world") +
                        "; " + std::string(world.name()) + " offers " + list_of_names(offered)});
  return nullptr;
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
  json filled = json::array();
  const auto given = document.find("constraints");
  if (given == document.end()) {
    faults.push_back({"/constraints", "is required; [] samples the prior"});
  } else if (!given->is_array()) {
    faults.push_back({"/constraints", "expected an array, got " + std::string(given->type_name())});
  } else if (given->size() > kMostConstraints) {
    faults.push_back({"/constraints", "at most " + std::to_string(kMostConstraints) + " are allowed"});
  } else {
    for (std::size_t i = 0; i < given->size(); ++i) {
      const std::string pointer = append_pointer("/constraints", i);
      json term = (*given)[i];
      const TermKind* kind = read_kind(*world, term, pointer, faults);
      if (!kind) continue;
      const std::size_t term_faults_before = faults.size();
      if (kind->fit && model_is_sound) kind->fit(term, model, pointer, faults);
      const Parameters parameters = kind->parameters.read(term, pointer, faults, {"kind"});
      if (model_is_sound && faults.size() == term_faults_before)
        scenario->terms_.push_back(kind->make(parameters, model, pointer, faults));
      json constraint = parameters.document();
      constraint["kind"] = kind->kind;
      filled.push_back(std::move(constraint));
    }
  }
  if (!faults.empty()) throw InvalidRequest(std::move(faults));

  // What chains need.
  scenario->document_ = {{"world", world->name()},
                         {"world_version", world->version()},
                         {"title", scenario->title_},
                         {"model", model.document()},
                         {"constraints", std::move(filled)}};
  Target target{.model = scenario->scene_->model(),
                .kernels = scenario->scene_->kernels(Ratios::exact),
                .measure_names = {},
                .least_satisfied = 0,
                .learned = scenario->scene_->learned()};
  add_measures(scenario->measures_, scenario->scene_->measures());
  for (const auto& term : scenario->terms_) {
    const std::vector<Measure> measures_of_term = term->measures();
    scenario->term_measure_counts_.push_back(measures_of_term.size());
    add_measures(scenario->measures_, measures_of_term);
    scenario->terms_read_frames_ |= term->reads_frames();
    target.least_satisfied += term->least_when_satisfied();
  }
  target.guide = scenario->scene_->guide(scenario->terms_);
  target.placed = scenario->scene_->placed(scenario->terms_);
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
  const Recording recording{.frames = scenario_.terms_read_frames_,
                            .terms = scenario_.terms_,
                            .needed = request.needed,
                            .current_state = request.current_state,
                            .current_run = request.current_run,
                            .record = request.record,
                            .watch = request.watch};
  const SimulationOutcome outcome =
      physics_->simulate(candidate, recording, scored_, std::span(score.measures).first(physics_measures_));
  if (outcome.end == SimulationEnd::complete) score_terms(scored_, score);
  return outcome;
}

Scenario::Performer::Take Scenario::Performer::perform(const State& state) {
  Take take{.animation = recorded_, .score = {}, .complete = false};
  take.score.measures.assign(scenario_.measures().size(), kAbsent);
  const SimulationOutcome outcome = physics_->simulate(
      state, {.frames = true}, recorded_, std::span(take.score.measures).first(physics_measures_));
  take.complete = outcome.end == SimulationEnd::complete;
  if (!take.complete) return take;
  score_terms(recorded_, take.score);
  for (const auto& term : scenario_.terms_)
    for (Body& marker : term->markers(recorded_))
      recorded_.bodies.push_back(std::move(marker));
  return take;
}

void Scenario::Performer::score_terms(const Animation& animation, Score& score) const {
  score.log_constraint = 0;
  score.satisfied = true;
  std::span<double> rest = std::span(score.measures).subspan(physics_measures_);
  for (std::size_t i = 0; i < scenario_.terms_.size(); ++i) {
    const std::size_t measures = scenario_.term_measure_counts_[i];
    const TermScore said = scenario_.terms_[i]->score(animation, rest.first(measures));
    CHECK(said.log_density <= 0, said.log_density);
    score.log_constraint += said.log_density;
    score.satisfied &= said.satisfied;
    rest = rest.subspan(measures);
  }
}

}  // namespace retake
