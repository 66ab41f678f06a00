// Clauses about densities: none above certainty, no bound below what comes, nothing stopped that may matter.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sampler/chain.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/contract/contract.h"
#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests::clauses {
namespace {

/// A term scores an animation, and bounds it while it is under way.
void check_term(const Term& term, const Animation& whole, Faults& faults) {
  std::vector<double> measures(term.measures().size());
  const TermScore score = term.score(whole, measures);
  faults.expect(score.log_density <= 0, "a log density of ", score.log_density);
  faults.expect(!score.satisfied || score.log_density >= term.least_when_satisfied() - 1e-12,
                "satisfied at less than the least when satisfied: ", score.log_density);
  const auto check_bound = [&](const Animation& so_far) {
    const double bound = term.upper_bound(so_far);
    faults.expect(bound <= 0, "an upper bound of ", bound);
    faults.expect(bound >= score.log_density, "an upper bound of ", bound, " below ", score.log_density,
                  ", which comes of it");
  };
  constexpr std::size_t kStride = 5;
  for (std::size_t frames = 0; frames <= whole.frames; frames += kStride) {
    const double time = frames == 0 ? 0 : static_cast<double>(frames - 1) / whole.rate;
    check_bound(so_far(whole, frames, time));
    if (!term.reads_frames()) check_bound(so_far(whole, 0, time));
  }
  check_bound(whole);
}

/// The smallest example's model with the wish that two bodies touch something in the other order than in a
/// draw; none where no two do, or where no order can be wished.
std::optional<OpenScenario> open_against_a_draw(const World& world) {
  const OpenScenario open = open_smallest(world);
  const Told told = simulate_anew(*open.scene, draw_states(open.model(), 155, 1).front(), {.frames = true});
  std::vector<std::string> touched;
  for (const ContactEvent& event : told.animation.events) {
    if (event.bodies[0] >= told.animation.tracks.size()) continue;
    const std::string& name = told.animation.tracks[event.bodies[0]].name;
    if (std::find(touched.begin(), touched.end(), name) == touched.end()) touched.push_back(name);
  }
  const auto& kinds = world.term_kinds();
  const bool has_order =
      std::any_of(kinds.begin(), kinds.end(), [](const TermKind& kind) { return kind.kind == "order"; });
  if (!told.is_complete() || touched.size() < 2 || !has_order) return std::nullopt;
  const auto contact = [](const std::string& name) -> json { return {{"kind", "contact"}, {"body", name}}; };
  json document = open.scenario->document();
  document.erase("world_version");
  document["constraints"] =
      json::array({{{"kind", "order"}, {"events", json::array({contact(touched[1]), contact(touched[0])})}}});
  return open_scenario(world, document);
}

}  // namespace

/// Of what the prior draws, and of what a chain finds.
void scores_at_most_zero(const World& world, int draws, Faults& faults) {
  for (const OpenScenario& open : open_examples(world))
    for (const State& state : draw_states(open.model(), 153, draws)) {
      const Told told = simulate_anew(*open.scene, state, {.frames = true});
      if (!told.is_complete()) continue;
      for (const auto& term : open.terms)
        check_term(*term, told.animation, faults);
    }
}

/// A simulation stops early only where it cannot exceed what is needed, and else says the same. A world stops
/// early, sometimes, if and only if it says so.
void stops_what_cannot_matter(const World& world, int draws, Faults& faults) {
  int stopped = 0;
  std::vector<OpenScenario> wished = open_examples(world);
  if (auto order = open_against_a_draw(world)) wished.push_back(std::move(*order));
  for (const OpenScenario& open : wished) {
    RandomStream random = stream(154);
    const auto physics = open.scene->make_physics();
    Told whole, told;
    whole.measures.resize(open.scene->measures().size());
    told.measures = whole.measures;
    for (const State& state : draw_states(open.model(), 154, draws)) {
      Recording recording{.frames = open.reads_frames(), .terms = open.terms};
      simulate(*physics, state, recording, whole);
      if (!whole.is_complete()) continue;
      const std::string bits = bits_of(whole);
      const double score = log_density_of(open.terms, whole.animation);
      const double little = 1e-9 * (1 + std::abs(score));
      for (const double needed : {score - little, score - random.uniform()}) {
        recording.needed = needed;
        simulate(*physics, state, recording, told);
        faults.expect(told.is_complete(), "stopped at ", needed, " though ", score, " comes of it");
        faults.expect(!told.is_complete() || bits_of(told) == bits, "another animation if ", needed,
                      " is needed");
      }
      for (const double needed : {score, score * random.uniform(), 0.0}) {
        recording.needed = needed;
        simulate(*physics, state, recording, told);
        faults.expect(told.end != SimulationEnd::failed, "fails if ", needed, " is needed");
        faults.expect(!told.is_complete() || bits_of(told) == bits, "another animation if ", needed,
                      " is needed");
        if (needed < 0) stopped += told.end == SimulationEnd::stopped ? 1 : 0;
      }
    }
  }
  faults.expect((stopped > 0) == world.savings().stops_early, "savings().stops_early is not what happens");
}

/// Two chains, one of which simulates every candidate to its end, make the same moves.
void walks_the_same_early_or_not(const World& world, int steps, Faults& faults) {
  for (const OpenScenario& open : open_examples(world))
    for (const Method method : {Method::metropolis, world.default_method()}) {
      const auto one = open.scenario->make_performer(), other = open.scenario->make_performer();
      const auto target = open.scenario->target(Ratios::exact);
      Chain early(target, {.seed = 331, .method = method});
      Chain late(target, {.seed = 331, .method = method, .early_rejection = false});
      for (int i = 0; i < steps; ++i) {
        const bool same_move = early.step(*one) == late.step(*other);
        faults.expect(same_move && identical(early.stay().state, late.stay().state) &&
                          identical(early.stay().score, late.stay().score),
                      open.scenario->title(), ": step ", i, " of ", to_string(method),
                      " is another one with early rejection");
        if (!faults.sentences().empty()) return;
      }
    }
}

}  // namespace retake::tests::clauses
