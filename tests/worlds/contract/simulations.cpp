// Clauses about simulations: pure functions of the State, whatever ran before and whatever is recorded.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "tests/sampler/statistics.h"
#include "tests/worlds/contract/contract.h"
#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests::clauses {
namespace {

bool is_value_of_kind(const Measure& measure, double value) {
  if (std::isnan(value) || measure.kind == Measure::Kind::number) return true;
  if (measure.kind == Measure::Kind::flag) return value == 0 || value == 1;
  return set_of(members_of(value)) == value;
}

/// Whether a simulation without frames knows where a track rests.
bool knows_rest(const Roster& roster, const Track& track) {
  return std::any_of(roster.movers.begin(), roster.movers.end(), [&](const auto& mover) {
    return mover.name == track.name && (mover.tells_rest || (mover.tells_fall && !track.fell));
  });
}

bool has_faces(const Roster& roster, const Track& track) {
  return std::any_of(roster.movers.begin(), roster.movers.end(),
                     [&](const auto& mover) { return mover.name == track.name && !mover.faces.empty(); });
}

bool same(const ContactEvent& left, const ContactEvent& right) {
  return left.time == right.time && left.bodies == right.bodies && left.impulse == right.impulse &&
         left.position == right.position && left.normal == right.normal;
}

/// A simulation with and one without frames tell the same, as far as both tell.
void check_agreement(const OpenScenario& open, const Told& scored, const Told& recorded, Faults& faults) {
  if (!faults.expect(scored.end == recorded.end, "complete with frames or without, but not both") ||
      !recorded.is_complete())
    return;
  faults.expect(identical(scored.measures.data(), recorded.measures.data(), recorded.measures.size()),
                "measures are others with frames");
  const Animation &left = scored.animation, &right = recorded.animation;
  if (!faults.expect(left.tracks.size() == right.tracks.size(), "other tracks with frames")) return;
  for (std::size_t i = 0; i < left.tracks.size(); ++i) {
    const Track &a = left.tracks[i], &b = right.tracks[i];
    faults.expect(a.name == b.name, a.name, ": is ", b.name, " with frames");
    faults.expect(a.settled == b.settled && a.fell == b.fell, a.name,
                  ": rests or falls at another time with frames");
    if (!knows_rest(open.roster, b)) continue;
    faults.expect(a.rest.position == b.rest.position, a.name, ": rests elsewhere with frames");
    faults.expect(!has_faces(open.roster, b) || std::abs(a.rest.rotation.dot(b.rest.rotation)) > 1 - 1e-12,
                  a.name, ": rests another way up with frames");
  }
  faults.expect(left.events.empty() || std::equal(left.events.begin(), left.events.end(),
                                                  right.events.begin(), right.events.end(), same),
                "events are others with frames");
}

}  // namespace

/// Runs that are recorded and runs that are only scored agree bit for bit: in ends, measures, rests, falls,
/// events and scores.
void scores_what_it_records(const World& world, int draws, Faults& faults) {
  for (const OpenScenario& open : open_examples(world)) {
    const auto physics = open.scene->make_physics();
    const auto performer = open.scenario->make_performer();
    Told scored, recorded;
    scored.measures.resize(open.scene->measures().size());
    recorded.measures = scored.measures;
    Score score;
    score.measures.resize(open.scenario->measures().size());
    for (const State& state : draw_states(open.model(), 148, draws)) {
      simulate(*physics, state, {}, scored);
      simulate(*physics, state, {.frames = true}, recorded);
      check_agreement(open, scored, recorded, faults);
      if (!scored.is_complete()) continue;
      const bool complete = performer->simulate(state, {}, score).end == SimulationEnd::complete;
      faults.expect(complete && identical(score, performer->perform(state).score),
                    "the score is another one with frames");
      for (std::size_t i = 0; i < score.measures.size(); ++i)
        faults.expect(is_value_of_kind(open.scenario->measures()[i], score.measures[i]),
                      open.scenario->measures()[i].name, " is ", score.measures[i]);
    }
  }
}

/// A complete simulation writes every measure, and a term that scores it every one of its own: nothing that
/// stood there before is left or matters.
void writes_measures(const World& world, int draws, Faults& faults) {
  const auto check = [&](const std::vector<Measure>& measures, const std::vector<double>& one,
                         const std::vector<double>& other) {
    for (std::size_t i = 0; i < measures.size(); ++i)
      faults.expect(identical(&one[i], &other[i], 1), measures[i].name, ": is not written");
  };
  for (const OpenScenario& open : open_examples(world))
    for (const State& state : draw_states(open.model(), 152, draws))
      for (const bool frames : {false, true}) {
        const Told one = simulate_anew(*open.scene, state, {.frames = frames}, kNotWritten);
        if (!one.is_complete()) continue;
        const Told other = simulate_anew(*open.scene, state, {.frames = frames}, -kNotWritten);
        check(open.scene->measures(), one.measures, other.measures);
        for (const auto& term : open.terms) {
          if (term->reads_frames() && !frames) continue;
          std::vector<double> first(term->measures().size(), kNotWritten), second(first.size(), -kNotWritten);
          term->score(one.animation, first);
          term->score(one.animation, second);
          check(term->measures(), first, second);
        }
      }
}

/// Physics and the memory that it writes to are reused for States of all kinds - recorded, scored, stopped
/// early, resumed, far from what the prior draws - and say each time what new ones say.
void remembers_nothing(const World& world, int draws, Faults& faults) {
  struct Known {
    State state;
    std::size_t before;  ///< the State from which it was proposed
    std::string scored, recorded;
    double log_density;
  };
  for (const OpenScenario& open : open_examples(world)) {
    // The States: draws of the prior, what the proposals make of them, and what they may fail at.
    RandomStream random = stream(145);
    std::vector<Known> all;
    const KernelTable kernels = open.scene->kernels(Ratios::exact);
    const auto add = [&](const State& state, std::size_t before) {
      if (!std::isfinite(open.model().log_prior(state))) return;
      const Told scored = simulate_anew(*open.scene, state, {});
      const Told recorded = simulate_anew(*open.scene, state, {.frames = true});
      all.push_back({state, before, bits_of(scored), bits_of(recorded),
                     recorded.is_complete() ? log_density_of(open.terms, recorded.animation) : 0});
    };
    for (const State& state : draw_states(open.model(), 145, draws)) {
      const std::size_t before = all.size();
      add(state, before);
      State candidate = state;
      kernels.rows()[kernels.choose(random.uniform())].kernel->propose(open.model(), state, candidate,
                                                                       random);
      add(candidate, before);
      State far = state;
      for (std::size_t i = 0; i < open.model().size(); ++i) {
        const Distribution& prior = open.model().variables()[i].prior;
        double& value = far[static_cast<Eigen::Index>(i)];
        if (prior.kind() == Distribution::Kind::gaussian) value += 3 * (value - prior.mean());
      }
      add(far, before);
    }
    std::set<std::string> different;
    for (const Known& known : all)
      different.insert(known.recorded);
    faults.expect(different.size() > all.size() / 3, "different States give one animation");

    // One object for all of them, in random order.
    const auto physics = open.scene->make_physics();
    const std::unique_ptr<Run> run = physics->make_run(), current_run = physics->make_run();
    Told scored, recorded;
    scored.measures.resize(open.scene->measures().size());
    recorded.measures = scored.measures;
    for (std::size_t round = 0; round < 4 * all.size(); ++round) {
      const Known& known = all[random.index(all.size())];
      Recording recording{.frames = false, .record = run.get()};
      switch (random.index(4)) {
        case 0:
          simulate(*physics, known.state, {.frames = true}, recorded);
          faults.expect(bits_of(recorded) == known.recorded, "a recorded animation is another one than anew");
          break;
        case 1:
          simulate(*physics, known.state, {}, scored);
          faults.expect(bits_of(scored) == known.scored, "a simulation is another one than anew");
          break;
        case 2:  // One that may be stopped, early or late.
          recording.frames = open.reads_frames();
          recording.terms = open.terms;
          recording.needed = random.uniform() * known.log_density;
          simulate(*physics, known.state, recording, scored);
          break;
        case 3: {  // One that resumes, where the world can.
          const Known& current = all[known.before];
          simulate(*physics, current.state, {.frames = false, .record = current_run.get()}, scored);
          if (scored.is_complete()) {
            recording.current_state = &current.state;
            recording.current_run = current_run.get();
          }
          simulate(*physics, known.state, recording, scored);
          faults.expect(bits_of(scored) == known.scored, "a resumed simulation is another one than anew");
          break;
        }
      }
    }
  }
}

/// Without wishes every simulation that ends is perfect, and few fail.
void ends_complete(const World& world, int draws, Faults& faults) {
  const OpenScenario open = open_without_wishes(world, world.examples().at(0));
  const auto performer = open.scenario->make_performer();
  Score score;
  score.measures.resize(open.scenario->measures().size());
  int complete = 0;
  for (const State& state : draw_states(open.model(), 144, draws)) {
    const SimulationEnd end = performer->simulate(state, {}, score).end;
    faults.expect(end != SimulationEnd::stopped, "stopped though nothing is needed");
    if (end != SimulationEnd::complete) continue;
    ++complete;
    faults.expect(score.log_constraint == 0 && score.satisfied, "not perfect though nothing is wished");
  }
  faults.expect(complete > 0.8 * draws, draws - complete, " of ", draws, " simulations failed");
}

}  // namespace retake::tests::clauses
