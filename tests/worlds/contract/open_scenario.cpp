// See open_scenario.h.
#include "tests/worlds/contract/open_scenario.h"

#include <algorithm>

#include "sampler/check.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/minimal_world.h"

namespace retake::tests {
namespace {

void add(std::string& bits, const double* values, std::size_t count) {
  bits.append(reinterpret_cast<const char*>(values), count * sizeof(double));
}
void add(std::string& bits, double value) {
  add(bits, &value, 1);
}
void add(std::string& bits, const Pose& pose) {
  add(bits, pose.position.data(), 3);
  add(bits, pose.rotation.coeffs().data(), 4);
}

}  // namespace

const std::vector<const World*>& all_worlds() {
  static const std::vector<const World*> all = [] {
    std::vector<const World*> registered = worlds();
    registered.push_back(&minimal_world());
    return registered;
  }();
  return all;
}

bool OpenScenario::reads_frames() const {
  return std::any_of(terms.begin(), terms.end(), [](const auto& term) { return term->reads_frames(); });
}

OpenScenario open_scenario(const World& world, const json& document) {
  OpenScenario open{.scenario = Scenario::read(document, {&world}), .scene = {}, .terms = {}, .roster = {}};
  const json& whole = open.scenario->document();
  const Parameters model(whole.at("model"));
  std::vector<Fault> faults;
  open.scene = world.make_scene(model, faults);
  open.roster = world.roster(model);
  for (const json& constraint : whole.at("constraints"))
    for (const TermKind& kind : world.term_kinds())
      if (kind.kind == constraint.at("kind"))
        open.terms.push_back(
            kind.make(kind.parameters.read(constraint, "", faults, {"kind"}), model, "", faults));
  CHECK(faults.empty(), faults.front().pointer, faults.front().detail);
  return open;
}

std::vector<OpenScenario> open_examples(const World& world) {
  std::vector<OpenScenario> all;
  for (const json& example : world.examples())
    all.push_back(open_scenario(world, example));
  return all;
}

OpenScenario open_without_wishes(const World& world, const json& example) {
  // The whole model, as the example's wishes fitted it.
  const auto wished = Scenario::read(example, {&world});
  return open_scenario(
      world,
      {{"world", world.name()}, {"model", wished->document().at("model")}, {"constraints", json::array()}});
}

OpenScenario open_smallest(const World& world) {
  const auto size = [&](const json& example) {
    const auto scenario = Scenario::read(example, {&world});
    const std::size_t movers = world.roster(Parameters(scenario->document().at("model"))).movers.size();
    return movers > 1 ? movers : 1000 * 1000;
  };
  const std::vector<json> examples = world.examples();
  return open_without_wishes(
      world, *std::min_element(examples.begin(), examples.end(), [&](const json& left, const json& right) {
        return size(left) < size(right);
      }));
}

std::vector<State> draw_states(const Model& model, std::uint64_t seed, int count) {
  RandomStream random = stream(seed);
  std::vector<State> states;
  for (int i = 0; i < count; ++i)
    states.push_back(draw_state(model, random));
  return states;
}

void simulate(Physics& physics, const State& state, const Recording& recording, Told& told,
              double written_before) {
  std::fill(told.measures.begin(), told.measures.end(), written_before);
  told.end = physics.simulate(state, recording, told.animation, told.measures).end;
}

Told simulate_anew(const Scene& scene, const State& state, const Recording& recording,
                   double written_before) {
  Told told;
  told.measures.resize(scene.measures().size());
  simulate(*scene.make_physics(), state, recording, told, written_before);
  return told;
}

std::string bits_of(const Told& told) {
  if (!told.is_complete()) return told.end == SimulationEnd::failed ? "failed" : "stopped";
  const Animation& animation = told.animation;
  std::string bits;
  add(bits, told.measures.data(), told.measures.size());
  add(bits, static_cast<double>(animation.frames));
  for (const Track& track : animation.tracks) {
    bits += track.name;
    add(bits, track.start);
    add(bits, track.rest);
    add(bits, track.settled.value_or(kAbsent));
    add(bits, track.fell.value_or(kAbsent));
    if (animation.frames == 0) continue;
    add(bits, track.positions.data(), static_cast<std::size_t>(track.positions.size()));
    add(bits, track.rotations.data(), static_cast<std::size_t>(track.rotations.size()));
  }
  for (const ContactEvent& event : animation.events) {
    add(bits, event.time);
    add(bits, static_cast<double>(event.bodies[0]));
    add(bits, static_cast<double>(event.bodies[1]));
    add(bits, event.impulse);
    add(bits, event.position.data(), 3);
    add(bits, event.normal.data(), 3);
  }
  if (animation.frames > 0)
    for (const Body& body : animation.bodies)
      bits += body.name;
  return bits;
}

Animation so_far(const Animation& whole, std::size_t frames, double time) {
  Animation begun = whole;
  begun.frames = frames;
  for (Track& track : begun.tracks) {
    track.positions.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(frames));
    track.rotations.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(frames));
    if (track.settled && *track.settled > time) track.settled.reset();
    if (track.fell && *track.fell > time) track.fell.reset();
    if (!track.settled) track.rest = track.start;
  }
  std::erase_if(begun.events,
                [&](const ContactEvent& event) { return frames == 0 || event.time > begun.duration(); });
  return begun;
}

double log_density_of(const Terms& terms, const Animation& animation) {
  double sum = 0;
  for (const auto& term : terms) {
    std::vector<double> measures(term->measures().size());
    sum += term->score(animation, measures).log_density;
  }
  return sum;
}

}  // namespace retake::tests
