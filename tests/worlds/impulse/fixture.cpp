// See fixture.h.
#include "tests/worlds/impulse/fixture.h"

#include <algorithm>
#include <cmath>

#include "worlds/impulse/contact_step.h"
#include "worlds/impulse/motion_writer.h"

namespace retake::tests {

using Eigen::Vector3d;
using namespace impulse;
using impulse::Run;  // not the sampler's
using impulse::Scene;

Drop draw_drop(const Marbles& marbles, std::size_t body, RandomStream& random) {
  const spelling::Rectangle area = marbles.box.drop_area();
  const double x = area.min_x + random.uniform() * (area.max_x - area.min_x);
  const double z = area.min_z + random.uniform() * (area.max_z - area.min_z);
  return {static_cast<std::int64_t>(body) * marbles.interval, {x, spelling::kDropHeight, z}};
}

Vector3d draw_offset(RandomStream& random) {
  Vector3d offset;
  for (double& component : offset)
    component = std::clamp(1e-4 * random.gaussian(), -1e-3, 1e-3);
  return offset;
}

Scene draw_scene(const Marbles& marbles, RandomStream& random) {
  Scene scene;
  for (std::size_t body = 0; body < marbles.count; ++body)
    scene.bodies.push_back(draw_drop(marbles, body, random));
  for (std::size_t group = 0; group < marbles.box.group_count(); ++group)
    scene.offsets.push_back(draw_offset(random));
  scene.latest_step = marbles.latest_step();
  return scene;
}

namespace {

/// Drops change places, and keep the slots' times.
void exchange(Scene& scene, std::size_t a, std::size_t b, std::int64_t interval) {
  std::swap(scene.bodies[a], scene.bodies[b]);
  if (scene.bodies[a]) scene.bodies[a]->step = static_cast<std::int64_t>(a) * interval;
  if (scene.bodies[b]) scene.bodies[b]->step = static_cast<std::int64_t>(b) * interval;
}

}  // namespace

std::string change(const Marbles& marbles, Scene& scene, RandomStream& random) {
  const std::size_t count = scene.bodies.size();
  const auto any = [&] { return static_cast<std::size_t>(random.index(count)); };
  const std::size_t body = any(), other = any();
  switch (random.index(15)) {
    case 0:
      scene.bodies[body].reset();
      return "remove " + std::to_string(body);
    case 1:
    case 2:
      scene.bodies[body] = draw_drop(marbles, body, random);
      return "redraw " + std::to_string(body);
    case 3: {
      if (!scene.bodies[body]) return "nothing";
      const spelling::Rectangle area = marbles.box.drop_area();
      Vector3d& place = scene.bodies[body]->place;
      const double size = 0.01 * std::pow(10.0, -4 * random.uniform());
      place.x() = std::clamp(place.x() + size * random.gaussian(), area.min_x, area.max_x);
      place.z() = std::clamp(place.z() + size * random.gaussian(), area.min_z, area.max_z);
      return "walk " + std::to_string(body);
    }
    case 4:
    case 5:
      exchange(scene, body, other, marbles.interval);
      return "swap " + std::to_string(body) + ", " + std::to_string(other);
    case 6: {
      for (std::size_t i = 0, size = 3 + random.index(4); i < size; ++i)
        exchange(scene, any(), any(), marbles.interval);
      return "permute";
    }
    case 7: {
      const std::size_t length = std::min<std::size_t>(2 + random.index(7), count),
                        first = random.index(count - length + 1);
      for (std::size_t i = 0; i < length / 2; ++i)
        exchange(scene, first + i, first + length - 1 - i, marbles.interval);
      return "reverse " + std::to_string(length) + " from " + std::to_string(first);
    }
    case 8:
    case 9:
    case 10: {
      const std::size_t groups = std::size_t{1} << random.index(5);
      for (std::size_t i = 0; i < groups; ++i)
        scene.offsets[random.index(scene.offsets.size())] = draw_offset(random);
      return "offset " + std::to_string(groups) + " groups";
    }
    case 11: {  // out of its slot: two may even be born together
      if (scene.bodies[body]) scene.bodies[body]->step += static_cast<std::int64_t>(random.index(400));
      if (scene.bodies[other]) scene.latest_step -= static_cast<std::int64_t>(random.index(3));
      return "delay " + std::to_string(body);
    }
    case 12:
      for (Vector3d& offset : scene.offsets)
        offset = draw_offset(random);
      return "offset every group";
    case 13:
      if (count > 1 && random.bernoulli(0.5)) {
        scene.bodies.pop_back();
        return "one body less";
      }
      scene.bodies.push_back(draw_drop(marbles, count, random));
      return "one body more";
    default:
      scene = draw_scene(marbles, random);
      if (random.index(3) == 0) scene.bodies.resize(count / 2);
      scene.bodies.resize(marbles.count);
      return "everything";
  }
}

Run simulate_naively(const Settings& settings, Surface& surface, const Scene& scene) {
  surface.set_offsets(scene.offsets);
  ContactStep contacts(settings);
  const std::size_t count = scene.bodies.size();
  std::vector<std::optional<MotionWriter>> writers(count);
  for (std::size_t i = 0; i < count; ++i)
    if (scene.bodies[i]) writers[i].emplace(SphereState{.position = scene.bodies[i]->place});
  for (std::int64_t step = 0; step < scene.latest_step; ++step) {
    // Who is there, who moves.
    std::vector<std::size_t> there;
    std::vector<bool> rests(count);
    std::vector<Vector3d> places(count);
    std::vector<std::size_t> outcomes(count);
    contacts.clear();
    for (std::size_t i = 0; i < count; ++i) {
      if (!scene.bodies[i] || scene.bodies[i]->step > step) continue;
      there.push_back(i);
      rests[i] = writers[i]->rests();
      places[i] = writers[i]->state().position;
      if (rests[i]) continue;
      const SphereState fallen = fall(settings, writers[i]->state());
      places[i] = fallen.position;
      outcomes[i] = contacts.add(static_cast<std::uint32_t>(i), fallen);
    }
    // Every pair.
    std::vector<std::vector<std::int32_t>> partners(count);
    for (const std::size_t i : there)
      for (const std::size_t j : there) {
        if (j <= i || (rests[i] && rests[j]) || !overlap(settings, places[i], places[j])) continue;
        if (rests[i] || rests[j]) {
          const std::size_t mover = rests[i] ? j : i, still = rests[i] ? i : j;
          contacts.add_pair_with_resting(outcomes[mover], static_cast<std::uint32_t>(still), places[still]);
        } else {
          contacts.add_pair(outcomes[i], outcomes[j]);
        }
        partners[i].push_back(static_cast<std::int32_t>(j));
        partners[j].push_back(static_cast<std::int32_t>(i));
      }
    contacts.solve(surface);
    for (const ContactStep::Outcome& outcome : contacts.outcomes()) {
      const std::int64_t since = step - scene.bodies[outcome.body]->step;
      std::vector<Impact> impacts;
      for (const ContactStep::Hit& hit : contacts.hits())
        if (hit.body == outcome.body)
          impacts.push_back(
              {static_cast<std::int32_t>(since), hit.other, hit.impulse, hit.point, hit.normal});
      writers[outcome.body]->append(
          {outcome.state, outcome.region, partners[outcome.body], impacts, outcome.rests});
    }
  }
  Run run;
  run.scene = scene;
  run.complete = run.rests = true;
  for (auto& writer : writers) {
    run.motions.push_back(writer ? writer->finish(settings) : nullptr);
    if (writer) run.rests = run.rests && run.motions.back()->rests;
  }
  return run;
}

std::string difference(const Run& a, const Run& b) {
  if (a.complete != b.complete || a.rests != b.rests) return "one is complete or rests, the other not";
  if (a.motions.size() != b.motions.size()) return "numbers of bodies";
  for (std::size_t i = 0; i < a.motions.size(); ++i) {
    if (!a.motions[i] != !b.motions[i]) return "body " + std::to_string(i) + " is only in one";
    if (!a.motions[i] || same_bits(*a.motions[i], *b.motions[i])) continue;
    std::size_t k = 0;
    const Motion &x = *a.motions[i], &y = *b.motions[i];
    while (k < std::min(x.states.size(), y.states.size()) && x.states[k].same_bits(y.states[k]))
      ++k;
    return "body " + std::to_string(i) + " from step " + std::to_string(k) + " since birth, of " +
           std::to_string(x.step_count()) + " and " + std::to_string(y.step_count());
  }
  return "";
}

}  // namespace retake::tests
