// Clauses about recorded animations: bodies, frames and events fit together, and keep what the roster says.
#include <algorithm>
#include <cmath>
#include <set>

#include "tests/worlds/contract/contract.h"
#include "tests/worlds/contract/open_scenario.h"
#include "worlds/formats/recorded.h"

namespace retake::tests::clauses {
namespace {

const Roster::Mover* mover_of(const Roster& roster, const Track& track) {
  for (const Roster::Mover& mover : roster.movers)
    if (mover.name == track.name) return &mover;
  return nullptr;
}

void check_body(const Body& body, std::size_t track_count, Faults& faults) {
  faults.expect(!body.name.empty(), "a body has no name");
  faults.expect(body.colour.size() == 7 && body.colour[0] == '#' &&
                    body.colour.find_first_not_of("0123456789abcdef", 1) == std::string::npos,
                body.name, ": no colour: ", body.colour);
  faults.expect(body.surface != Surface::plain, body.name, " does not tell its surface");
  faults.expect(!body.track || *body.track < track_count, body.name, ": follows no track");
  faults.expect(
      body.track || (std::abs(body.pose.rotation.norm() - 1) < 1e-9 && body.pose.position.allFinite()),
      body.name, ": stands nowhere");
}

void check_track(const Track& track, std::size_t frames, Faults& faults) {
  const auto columns = static_cast<Eigen::Index>(frames);
  if (!faults.expect(track.positions.cols() == columns && track.rotations.cols() == columns, track.name,
                     ": not a pose for each frame"))
    return;
  faults.expect(track.positions.allFinite(), track.name, ": is nowhere");
  for (Eigen::Index frame = 0; frame < columns; ++frame) {
    faults.expect(std::abs(track.rotations.col(frame).norm() - 1) < 1e-6, track.name, ": no rotation at ",
                  frame);
    faults.expect(frame == 0 || track.rotations.col(frame).dot(track.rotations.col(frame - 1)) > 0,
                  track.name, ": two hemispheres at ", frame);
  }
  const Eigen::Vector3d end = track.positions.rightCols<1>();
  faults.expect((end - track.rest.position).norm() < 1e-3, track.name, ": does not end in its rest");
  faults.expect(1 - std::abs(track.rotations.rightCols<1>().dot(track.rest.rotation.coeffs())) < 1e-4,
                track.name, ": does not end as it rests");
}

void check_event(const ContactEvent& event, const Animation& animation, Faults& faults) {
  faults.expect(event.time >= 0 && event.time <= animation.duration() + 1e-9, "an event before or after all");
  const auto [a, b] = event.bodies;
  if (!faults.expect(a != b && a < animation.bodies.size() && b < animation.bodies.size(),
                     "an event of bodies ", a, " and ", b))
    return;
  faults.expect(animation.bodies[a].track || animation.bodies[b].track, animation.bodies[a].name, " meets ",
                animation.bodies[b].name, ", and neither moves");
  faults.expect(event.impulse >= 0 && std::abs(event.normal.norm() - 1) < 1e-6 && event.position.allFinite(),
                "an event at ", event.time, " s has no impulse, normal or place");
}

void check_animation(const Animation& animation, Faults& faults) {
  if (!faults.expect(
          animation.frames >= 1 && animation.rate > 0 && animation.bodies.size() >= animation.tracks.size(),
          "not a whole animation"))
    return;
  std::set<std::size_t> followed;
  for (const Body& body : animation.bodies) {
    check_body(body, animation.tracks.size(), faults);
    if (body.track) followed.insert(*body.track);
  }
  faults.expect(followed.size() == animation.tracks.size(), "a track that nothing follows");
  faults.expect(animation.duration() < kEnd, "lasts longer than terms take for the end");
  for (const Track& track : animation.tracks)
    check_track(track, animation.frames, faults);
  for (const ContactEvent& event : animation.events)
    check_event(event, animation, faults);
  faults.expect(std::is_sorted(animation.events.begin(), animation.events.end(),
                               [](const ContactEvent& left, const ContactEvent& right) {
                                 return left.time < right.time;
                               }),
                "events out of order");
}

/// Terms take every name of the roster, and no other.
void check_names(const OpenScenario& open, Faults& faults) {
  const auto& kinds = open.world().term_kinds();
  if (std::none_of(kinds.begin(), kinds.end(),
                   [](const TermKind& kind) { return kind.kind == "contact_at"; }))
    return;
  std::vector<std::string> names = open.roster.still;
  for (const Roster::Mover& mover : open.roster.movers)
    names.push_back(mover.name);
  faults.expect(std::set<std::string>(names.begin(), names.end()).size() == names.size(),
                "two bodies of one name");
  faults.expect(!open.roster.movers.empty(), "nothing moves");
  const auto is_taken = [&](const std::string& name) {
    json document = open.scenario->document();
    document.erase("world_version");
    document["constraints"] = {{{"kind", "contact_at"}, {"body", name}, {"times", {1}}}};
    return faults_of([&] { Scenario::read(document, {&open.world()}); }).empty();
  };
  for (const std::string& name : names)
    faults.expect(is_taken(name), name, ": no term takes the name");
  faults.expect(!is_taken("nobody"), "a term takes a name of nobody");
}

}  // namespace

/// What can be named is what animations have, in the order in which contacts count it.
void names_bodies(const World& world, int draws, Faults& faults) {
  check_names(open_smallest(world), faults);
  for (const OpenScenario& open : open_examples(world))
    for (const State& state : draw_states(open.model(), 361, draws)) {
      const Told told = simulate_anew(*open.scene, state, {.frames = true});
      if (!told.is_complete()) continue;
      const Animation& animation = told.animation;
      const std::size_t tracks = animation.tracks.size(), still = open.roster.still.size();
      if (!faults.expect(animation.bodies.size() >= tracks + still, "fewer bodies than the roster has"))
        continue;
      for (std::size_t track = 0; track < tracks; ++track) {
        const std::string& name = animation.tracks[track].name;
        faults.expect(mover_of(open.roster, animation.tracks[track]), name, ": the roster has no such mover");
        faults.expect(animation.bodies[track].track == track && animation.bodies[track].name == name, name,
                      ": the bodies of the tracks do not come first");
      }
      for (std::size_t i = 0; i < still; ++i)
        faults.expect(
            animation.bodies[tracks + i].name == open.roster.still[i] && !animation.bodies[tracks + i].track,
            "body ", tracks + i, " is ", animation.bodies[tracks + i].name, ", not ", open.roster.still[i],
            " at rest, as the roster says");
      for (const ContactEvent& event : animation.events)
        faults.expect(std::max(event.bodies[0], event.bodies[1]) < tracks + still,
                      "an event of a body that cannot be named");
    }
}

/// Who promises to tell a rest or a fall tells it; and then rests.
void sets_rests(const World& world, int draws, Faults& faults) {
  bool is_fall_promised = false, is_fall_told = false;
  for (const OpenScenario& open : open_examples(world)) {
    for (const Roster::Mover& mover : open.roster.movers)
      is_fall_promised |= mover.tells_fall;
    for (const State& state : draw_states(open.model(), 362, draws)) {
      for (const bool frames : {true, false}) {
        const Told told = simulate_anew(*open.scene, state, {.frames = frames});
        if (!told.is_complete()) continue;
        const Animation& animation = told.animation;
        const double last = frames ? animation.duration() : 3600;
        for (const Track& track : animation.tracks) {
          const auto* mover = mover_of(open.roster, track);
          if (!mover) continue;
          faults.expect(track.settled.has_value() == mover->tells_rest, track.name,
                        mover->tells_rest ? ": does not tell when it rests" : ": tells an unpromised rest");
          faults.expect(!track.fell || mover->tells_fall, track.name, ": tells an unpromised fall");
          is_fall_told |= track.fell.has_value();
          for (const auto& time : {track.settled, track.fell})
            faults.expect(!time || (*time >= 0 && *time <= last + 1e-9), track.name, ": rests or falls at ",
                          time.value_or(0), " s of ", last);
          if (!frames || !track.settled) continue;
          for (auto frame = static_cast<Eigen::Index>(std::ceil(*track.settled * animation.rate + 1e-6));
               frame < track.positions.cols(); ++frame)
            faults.expect((track.positions.col(frame) - track.rest.position).norm() < 1e-3, track.name,
                          ": moves after it has settled");
        }
      }
    }
  }
  faults.expect(!is_fall_promised || is_fall_told, "falls are promised, and none is ever told");
}

/// Animations are whole, and come back from their record.
void records_consistently(const World& world, int draws, Faults& faults) {
  for (const OpenScenario& open : open_examples(world)) {
    const auto performer = open.scenario->make_performer();
    for (const State& state : draw_states(open.model(), 150, draws)) {
      faults.expect(identical(decode_state(encode_state(state)), state), "a State does not come back");
      const auto take = performer->perform(state);
      if (!take.complete) continue;
      check_animation(take.animation, faults);
      if (!faults.sentences().empty()) return;
      const Animation decoded = decode_animation(encode_animation(take.animation));
      check_animation(decoded, faults);
      faults.expect(decoded.bodies.size() == take.animation.bodies.size() &&
                        decoded.events.size() == take.animation.events.size(),
                    "bodies or events do not come back");
    }
  }
}

/// A viewpoint, if there is one, is a box seen from the side or above.
void shows_a_view(const World& world, int draws, Faults& faults) {
  for (const OpenScenario& open : open_examples(world))
    for (const State& state : draw_states(open.model(), 151, draws)) {
      const Told told = simulate_anew(*open.scene, state, {.frames = true});
      const auto view = told.is_complete() ? world.viewpoint(told.animation) : std::nullopt;
      if (!view) continue;
      faults.expect(view->center.allFinite() && view->half_extents.allFinite() &&
                        view->half_extents.minCoeff() >= 0 && view->half_extents.maxCoeff() > 0,
                    "a view of no box");
      faults.expect(std::abs(view->azimuth) <= 3.15 && view->elevation >= 0 && view->elevation < 1.57,
                    "a view from below");
    }
}

}  // namespace retake::tests::clauses
