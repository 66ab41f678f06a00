// What the tests of the impulse engine share: boxes of marbles, changes of what is dropped, and a simulation
// that steps everybody.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sampler/random.h"
#include "worlds/impulse/resimulation.h"
#include "worlds/spelling/box.h"

namespace retake::tests {

/// Marbles that fall into a box, one each `interval` steps.
struct Marbles {
  spelling::Box box;
  std::size_t count;
  std::int64_t interval;  ///< [steps]
  std::string name;

  std::int64_t latest_step() const { return static_cast<std::int64_t>(count) * interval + 6000; }
};

inline Marbles hi() {
  return {spelling::Box(7, 5, spelling::Tessellation::two), 10, 150, "HI"};
}
inline Marbles acm() {
  return {spelling::Box(15, 7, spelling::Tessellation::two), 30, 150, "ACM"};
}
inline Marbles long_word() {
  return {spelling::Box(40, 7, spelling::Tessellation::two), 81, 150, "40 x 7"};
}
inline Marbles crowded() {
  return {spelling::Box(7, 5, spelling::Tessellation::two), 20, 20, "crowded"};
}

impulse::Drop draw_drop(const Marbles& marbles, std::size_t body, RandomStream& random);
Eigen::Vector3d draw_offset(RandomStream& random);
impulse::Scene draw_scene(const Marbles& marbles, RandomStream& random);

/// Changes a scene in one way or another, and says how.
std::string change(const Marbles& marbles, impulse::Scene& scene, RandomStream& random);

/// Steps every body in every step and compares every body with every other one.
impulse::Run simulate_naively(const impulse::Settings& settings, impulse::Surface& surface,
                              const impulse::Scene& scene);

/// Empty if two runs are the same in every bit; else where they differ.
std::string difference(const impulse::Run& a, const impulse::Run& b);

}  // namespace retake::tests
