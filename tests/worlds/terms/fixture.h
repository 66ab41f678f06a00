// What the tests of the general constraint terms share: settings, documents read as a scenario reads them,
// and animations made by hand.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"
#include "worlds/terms/terms.h"

namespace retake::tests {

using Eigen::Vector3d;
using namespace terms;

/// Opposite sides add up to seven.
inline const std::vector<Face> kDieFaces = {{1, {0, 1, 0}},  {6, {0, -1, 0}}, {2, {1, 0, 0}},
                                            {5, {-1, 0, 0}}, {3, {0, 0, 1}},  {4, {0, 0, -1}}};

inline Setting table_top() {
  return {.roster =
              [](const Parameters&) {
                return Roster{.movers = {{.name = "die", .faces = kDieFaces, .tells_rest = true},
                                         {.name = "cup", .tells_rest = true, .tells_fall = true}},
                              .still = {"table", "wall"}};
              },
          .length = 0.1,
          .speed = 0.5,
          .source = "chosen"};
}
inline Setting one_ball() {
  return {.roster = [](const Parameters&) { return Roster{.movers = {{.name = "ball"}}, .still = {}}; },
          .only_body = "ball",
          .length = 0.1,
          .speed = 0.5,
          .source = "chosen",
          .flat = 0.6};
}

/// As a scenario reads a constraint.
inline std::unique_ptr<const Term> read(const TermKind& kind, json document, std::vector<Fault>& faults) {
  const Parameters model{json::object()};
  if (kind.fit) kind.fit(document, model, "/t", faults);
  const Parameters parameters = kind.parameters.read(document, "/t", faults);
  return faults.empty() ? kind.make(parameters, model, "/t", faults) : nullptr;
}
inline std::unique_ptr<const Term> read(const TermKind& kind, const json& document) {
  std::vector<Fault> faults;
  auto term = read(kind, document, faults);
  EXPECT_TRUE(faults.empty()) << faults[0].pointer << " " << faults[0].detail;
  return term;
}
inline std::vector<std::string> fault_pointers(const TermKind& kind, const json& document) {
  std::vector<Fault> faults;
  read(kind, document, faults);
  std::vector<std::string> pointers;
  for (const Fault& fault : faults)
    pointers.push_back(fault.pointer);
  return pointers;
}

struct Said {
  double log_density;
  bool satisfied;
  std::vector<double> measures;
};
inline Said judge(const Term& term, const Animation& animation) {
  std::vector<double> values(term.measures().size(), -1);
  const TermScore score = term.score(animation, values);
  EXPECT_LE(score.log_density, 0);
  if (score.satisfied) {
    EXPECT_GE(score.log_density, term.least_when_satisfied() - 1e-12);
  }
  EXPECT_LE(term.upper_bound(animation), 0);
  EXPECT_GE(term.upper_bound(animation), score.log_density) << "of the whole animation";
  return {score.log_density, score.satisfied, values};
}
inline double half_square(double z) {
  return -0.5 * z * z;
}

/// Bodies that rest where they are put, without frames.
inline Animation resting(std::vector<std::pair<std::string, Vector3d>> places) {
  Animation animation;
  for (const auto& [name, place] : places) {
    Track& track = animation.tracks.emplace_back();
    track.name = name;
    track.start.position = {7, 7, 7};
    track.rest.position = place;
  }
  return animation;
}

/// A die that follows a function of time for so many frames.
template <typename Path>
Animation moving(const Path& path, std::size_t frames, double rate = 10) {
  Animation animation;
  animation.rate = rate;
  animation.frames = frames;
  Track& track = animation.tracks.emplace_back();
  track.name = "die";
  track.positions.resize(3, static_cast<Eigen::Index>(frames));
  for (std::size_t i = 0; i < frames; ++i)
    track.positions.col(static_cast<Eigen::Index>(i)) = path(static_cast<double>(i) / rate);
  track.rest.position = track.positions.rightCols<1>();
  return animation;
}

}  // namespace retake::tests
