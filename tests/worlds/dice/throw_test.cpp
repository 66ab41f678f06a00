// Throws of dice as scenarios: placement and paint change nothing of the motion, resumed and stopped throws
// say what whole ones do, animations show where dice lie, documents are judged.
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sampler/chain.h"
#include "tests/worlds/dice/fixture.h"
#include "worlds/dice/proposals.h"
#include "worlds/dice/throw.h"
#include "worlds/dice/view.h"

namespace retake::tests {
namespace {

using Eigen::Vector3d;

json document(json model, json constraints) {
  return {{"world", "dice"}, {"model", std::move(model)}, {"constraints", std::move(constraints)}};
}

TEST(DiceThrow, PlacementAndPaintChangeNothingOfTheMotion) {
  const DiceTable table;
  const dice::DiceModel& model = table.model;
  RandomStream random = stream(351);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const State state = table.draw(352, i);
    State placed = state;
    at(placed, model.start_x(0)) = 0.01 * random.gaussian();
    at(placed, model.start_x(0) + 2) = 0.01 * random.gaussian();
    at(placed, model.mirrored()) = random.bernoulli(0.5) ? 1 : 0;
    at(placed, model.paint(0)) = 24 * random.uniform();
    std::swap(at(placed, model.velocity_x(0)), at(placed, model.velocity_x(0) + 2));  // a quarter turn
    const dice::DiceThrow before = model.read(state), after = model.read(placed);
    EXPECT_TRUE(before.scene.dice[0].state.same_bits(after.scene.dice[0].state));
    EXPECT_EQ(before.scene.table.key, after.scene.table.key);
  }
}

TEST(DiceThrow, TheMotionBeginsInTheWorldAsTheStateSays) {
  for (const auto pose : {dice::GridPose::random, dice::GridPose::fixed}) {
    const DiceTable table({.dice = 3, .pose = pose});
    for (std::uint64_t i = 0; i < 100; ++i) {
      const State state = table.draw(353, i);
      const dice::DiceThrow thrown = table.model.read(state);
      for (std::size_t die = 0; die < 3; ++die) {
        const auto vector = [&](std::size_t first) -> Vector3d {
          return state.segment<3>(static_cast<Eigen::Index>(first));
        };
        const dice::DieState& launched = thrown.scene.dice[die].state;
        const double rounding = pose == dice::GridPose::random ? 1e-10 : 1e-15;
        EXPECT_LT((thrown.placement.point(launched.position) - vector(table.model.start_x(die))).norm(),
                  rounding);
        const Vector3d velocity = thrown.placement.direction(launched.linear_velocity);
        EXPECT_LT((velocity - vector(table.model.velocity_x(die))).norm(), rounding);
        EXPECT_EQ(thrown.scene.dice[die].step, static_cast<std::int64_t>(250 * die));
      }
    }
  }
}

TEST(DiceThrow, AnotherPlacementNeedsNoSimulation) {
  const auto scenario = Scenario::read(document(json::object(), json::array()));
  const auto performer = scenario->make_performer();
  const DiceTable table;
  const auto run = performer->make_run(), other = performer->make_run();
  Score score, placed_score;
  score.measures.resize(scenario->measures().size());
  placed_score.measures.resize(scenario->measures().size());
  const auto index = [&](const std::string& name) {
    for (std::size_t i = 0; i < scenario->measures().size(); ++i)
      if (scenario->measures()[i].name == name) return i;
    ADD_FAILURE() << name;
    return std::size_t{0};
  };
  const std::size_t x = index("rest_x"), z = index("rest_z");
  RandomStream random = stream(354);
  for (int i = 0; i < 20; ++i) {
    const State state = draw_state(scenario->model(), random);
    ASSERT_EQ(performer->simulate(state, {.record = run.get()}, score).end, SimulationEnd::complete);
    State placed = state;
    at(placed, table.model.start_x(0)) += 0.1;
    at(placed, table.model.start_x(0) + 2) -= 0.2;
    const SimulationOutcome outcome = performer->simulate(
        placed, {.current_state = &state, .current_run = run.get(), .record = other.get()}, placed_score);
    EXPECT_EQ(outcome.simulated_seconds, 0);
    EXPECT_NEAR(placed_score.measures[x], score.measures[x] + 0.1, 1e-15);
    EXPECT_NEAR(placed_score.measures[z], score.measures[z] - 0.2, 1e-15);
    Score whole = placed_score;
    ASSERT_EQ(performer->simulate(placed, {}, whole).end, SimulationEnd::complete);
    EXPECT_TRUE(identical(whole, placed_score));
  }
}

/// Proposes by every row of the world's table; resumed scores are whole ones, and accepted runs go on.
void expect_resumed_scores(const json& model, int iterations) {
  const auto scenario =
      Scenario::read(document(model, {{{"kind", "total"}, {"sum", 3 * model.at("dice").get<int>()}}}));
  const auto resuming = scenario->make_performer(), whole = scenario->make_performer();
  const auto target = scenario->target(Ratios::exact);
  auto current_run = resuming->make_run(), candidate_run = resuming->make_run();
  Score score, wanted;
  score.measures.assign(scenario->measures().size(), kAbsent);
  wanted.measures = score.measures;
  RandomStream random = stream(355);
  State current = draw_state(scenario->model(), random), candidate;
  ASSERT_EQ(resuming->simulate(current, {.record = current_run.get()}, score).end, SimulationEnd::complete);
  for (int i = 0; i < iterations; ++i) {
    candidate = current;
    const auto& rows = target->kernels.rows();
    rows[static_cast<std::size_t>(i) % rows.size()].kernel->propose(scenario->model(), current, candidate,
                                                                    random);
    if (!std::isfinite(scenario->model().log_prior(candidate))) continue;
    const SimulationOutcome outcome = resuming->simulate(
        candidate,
        {.current_state = &current, .current_run = current_run.get(), .record = candidate_run.get()}, score);
    ASSERT_EQ(outcome.end, whole->simulate(candidate, {}, wanted).end);
    if (outcome.end != SimulationEnd::complete) continue;
    ASSERT_TRUE(identical(score, wanted)) << i;
    current = candidate;
    std::swap(current_run, candidate_run);
  }
}

TEST(DiceThrow, ResumedScoresAreWholeOnes) {
  expect_resumed_scores({{"dice", 1}}, 200);
  expect_resumed_scores({{"dice", 2}, {"pose", "fixed"}, {"paint", "fixed"}}, 60);
}

TEST(SlowDiceThrow, ResumedScoresAreWholeOnes) {
  expect_resumed_scores({{"dice", 1}}, 5000);
  expect_resumed_scores({{"dice", 3}, {"interval", 0.1}}, 1500);
}

TEST(DiceThrow, ChainsAreTheSameWithEarlyRejectionAndWithout) {
  const auto scenario = Scenario::read(document({{"dice", 2}}, {{{"kind", "total"}, {"sum", 12}}}));
  const auto performer = scenario->make_performer();
  const auto walk = [&](bool early) {
    Chain chain(scenario->target(Ratios::exact),
                {.seed = 356, .method = Method::metropolis, .early_rejection = early});
    std::vector<State> stays;
    for (int i = 0; i < 60; ++i) {
      chain.step(*performer);
      stays.push_back(chain.stay().state);
    }
    return stays;
  };
  const std::vector<State> with = walk(true), without = walk(false);
  for (std::size_t i = 0; i < with.size(); ++i)
    ASSERT_TRUE(identical(with[i], without[i])) << i;
}

/// Each hit costs one in log density.
class FewHits final : public Term {
 public:
  TermScore score(const Animation& animation, std::span<double>) const override {
    return {.log_density = upper_bound(animation), .satisfied = true};
  }
  double upper_bound(const Animation& so_far) const override {
    return -static_cast<double>(so_far.events.size());
  }
};

TEST(DiceThrow, StopsWhereTheBoundFallsToWhatIsNeeded) {
  const DiceTable table({.dice = 2});
  const auto model = std::make_shared<const dice::DiceModel>(table.model);
  const auto throws = dice::make_throws(model, {}, die_shape());
  Terms terms;
  terms.push_back(std::make_unique<const FewHits>());
  std::vector<double> measures(dice::throw_measures(2).size());
  Animation animation, resumed;
  const auto run = throws->make_run();
  for (std::uint64_t i = 0; i < 10; ++i) {
    const State state = table.draw(361, i);
    const SimulationOutcome whole = throws->simulate(state, {.record = run.get()}, animation, measures);
    ASSERT_EQ(whole.end, SimulationEnd::complete);
    const auto hits = static_cast<double>(animation.events.size());
    const auto end = [&](double needed, const retake::Run* record) {
      return throws->simulate(
          state, {.terms = terms, .needed = needed, .current_state = &state, .current_run = record}, resumed,
          measures);
    };
    for (const retake::Run* record :
         {static_cast<const retake::Run*>(nullptr), static_cast<const retake::Run*>(run.get())}) {
      EXPECT_EQ(end(-hits - 0.5, record).end, SimulationEnd::complete);
      EXPECT_EQ(resumed.events.size(), animation.events.size());
      EXPECT_EQ(end(-hits, record).end, SimulationEnd::stopped);
      EXPECT_EQ(end(-3, record).end, SimulationEnd::stopped);
      EXPECT_EQ(end(0, record).simulated_seconds, 0) << "hopeless from the start";
    }
    EXPECT_LT(end(-3, nullptr).simulated_seconds, 0.8 * whole.simulated_seconds);
  }
}

// --- Animations ----------------------------------------------------------------------------------------

/// The height of a body's mesh over a place, from the triangle around it; NaN beside the mesh. Counts only
/// what faces up.
double height_over(const Body& body, double x, double z) {
  const Mesh mesh = mesh_of(std::get<HeightField>(body.shape));
  const auto vertex = [&](std::size_t index) {
    return Vector3d(body.pose.position + body.pose.rotation * Vector3d(&mesh.positions[3 * index]));
  };
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vector3d a = vertex(mesh.indices[i]), b = vertex(mesh.indices[i + 1]),
                   c = vertex(mesh.indices[i + 2]);
    const Vector3d normal = (b - a).cross(c - a);
    if (normal.y() <= 0) continue;
    const Vector3d place(x, 0, z);
    const auto inside = [&](const Vector3d& from, const Vector3d& to) {
      return (to - from).cross(Vector3d(place - from)).y() >= -1e-12;
    };
    if (inside(a, b) && inside(b, c) && inside(c, a))
      return a.y() - (normal.x() * (x - a.x()) + normal.z() * (z - a.z())) / normal.y();
  }
  return kAbsent;
}

TEST(DiceThrow, DiceLieOnTheTableThatIsShown) {
  const auto scenario = Scenario::read(document({{"dice", 2}}, json::array()));
  const auto performer = scenario->make_performer();
  RandomStream random = stream(357);
  std::set<int> faces;
  for (int i = 0; i < 12; ++i) {
    const auto take = performer->perform(draw_state(scenario->model(), random));
    ASSERT_TRUE(take.complete);
    const Body& table = take.animation.bodies.at(2);
    ASSERT_EQ(table.name, "table");
    for (std::size_t die = 0; die < 2; ++die) {
      const Track& track = take.animation.tracks[die];
      const int face = dice::top_face(track.rest.rotation);
      faces.insert(face);
      const Vector3d& rest = track.rest.position;
      const double above = rest.y() - height_over(table, rest.x(), rest.z());
      // On a face, or on the other die; bumps are a millimetre high.
      EXPECT_GT(above, kDieSide / 2 - 0.002);
      if (face > 0) {
        EXPECT_LT(above, 2 * kDieSide);
      }
    }
    for (const ContactEvent& event : take.animation.events) {
      if (event.bodies[1] != 2) continue;
      const double x = event.position.x(), z = event.position.z();
      EXPECT_NEAR(event.position.y(), height_over(table, x, z), 0.002);
      EXPECT_NEAR(ground_height(take.animation, x, z), height_over(table, x, z), 0.0001);
    }
  }
  EXPECT_GT(faces.size(), 4u);
}

TEST(DiceThrow, ADieIsThereFromItsLaunchOn) {
  constexpr int kFramesApart = 15;  // 0.25 s
  const auto scenario = Scenario::read(document({{"dice", 3}}, json::array()));
  const auto performer = scenario->make_performer();
  const DiceTable table({.dice = 3});
  RandomStream random = stream(359);
  for (int i = 0; i < 8; ++i) {
    const State state = draw_state(scenario->model(), random);
    const auto take = performer->perform(state);
    ASSERT_TRUE(take.complete);
    const Viewpoint viewpoint = dice::throw_viewpoint(take.animation);
    for (std::size_t die = 0; die < 3; ++die) {
      const auto vector = [&](std::size_t first) -> Vector3d {
        return state.segment<3>(static_cast<Eigen::Index>(first));
      };
      const Track& track = take.animation.tracks[die];
      const Eigen::Index launch = kFramesApart * static_cast<Eigen::Index>(die);
      EXPECT_EQ(track.from, 0.25 * static_cast<double>(die));
      EXPECT_LT((track.start.position - vector(table.model.start_x(die))).norm(), 1e-9);
      for (Eigen::Index frame = 0; frame < launch; ++frame) {
        EXPECT_EQ(track.positions.col(frame), track.start.position);
        EXPECT_EQ(track.rotations.col(frame), track.start.rotation.coeffs());
      }
      EXPECT_LT((track.positions.col(launch) - track.start.position).norm(), 1e-9);
      // From then on it flies as it was launched.
      const Vector3d moved = track.positions.col(launch + 1) - track.start.position;
      const Vector3d fall(0, -0.5 * 9.81 / 60, 0);
      EXPECT_LT((60 * moved - vector(table.model.velocity_x(die)) - fall).norm(), 0.006);
      const Vector3d off = (track.start.position - viewpoint.center).cwiseAbs();
      EXPECT_TRUE((off.array() <= viewpoint.half_extents.array()).all()) << "who watches sees launches";
    }
  }
}

TEST(DiceThrow, TheTableThatIsShownIsTheOneThatIsRolledOn) {
  const auto scenario = Scenario::read(document({{"dice", 1}}, json::array()));
  const DiceTable one_die;
  const auto performer = scenario->make_performer();
  RandomStream random = stream(359);
  std::set<bool> mirrored;
  for (int i = 0; i < 12; ++i) {
    const State state = draw_state(scenario->model(), random);
    const auto take = performer->perform(state);
    const dice::DiceThrow thrown = one_die.model.read(state);
    mirrored.insert(thrown.placement.mirrored());
    dice::Table table({});
    table.reset(thrown.scene.table);
    const Body& shown = take.animation.bodies.at(1);
    const auto& field = std::get<HeightField>(shown.shape);
    ASSERT_EQ(field.attributes.at(0).name, "restitution");
    ASSERT_EQ(field.attributes.at(1).name, "friction");
    const Mesh mesh = mesh_of(field);
    for (std::size_t point = 0; point < field.point_count(); point += 17) {
      const Vector3d place = shown.pose.position + shown.pose.rotation * Vector3d(&mesh.positions[3 * point]);
      const Vector3d in_grid = thrown.placement.point_in_grid(place);
      ASSERT_NEAR(place.y(), table.height(in_grid.x(), in_grid.z()).value, 1e-9);
      const dice::Table::Material material = table.material(in_grid.x(), in_grid.z());
      ASSERT_NEAR(field.attributes[0].values[point], material.restitution, 1e-6);
      ASSERT_NEAR(field.attributes[1].values[point], material.friction, 1e-6);
    }
  }
  EXPECT_EQ(mirrored.size(), 2u);
}

TEST(DiceThrow, EveryFaceShowsItsPips) {
  const auto scenario = Scenario::read(document({{"dice", 1}, {"paint", "fixed"}}, json::array()));
  RandomStream random = stream(360);
  const auto performer = scenario->make_performer();
  const auto take = performer->perform(draw_state(scenario->model(), random));
  const Body& pips = take.animation.bodies.at(2);
  ASSERT_EQ(pips.name, "pips_1");
  const Mesh& mesh = std::get<Mesh>(pips.shape);
  // The deepest point of each bowl lies deeper than any other.
  std::map<int, int> deepest;
  for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
    const Vector3d place(&mesh.positions[i]);
    for (int face = 1; face <= 6; ++face) {
      const double depth = kDieSide / 2 - place.dot(dice::face_normal(face));
      if (depth > 0.0006 && depth < 0.001) ++deepest[face];
    }
  }
  EXPECT_EQ(deepest, (std::map<int, int>{{1, 1}, {2, 2}, {3, 3}, {4, 4}, {5, 5}, {6, 6}}));
}

TEST(DiceThrow, ADieIsAClosedSurfaceOfItsSize) {
  const auto scenario =
      Scenario::read(document({{"dice", 1}, {"shortening", 0.2}, {"paint", "fixed"}}, json::array()));
  const auto performer = scenario->make_performer();
  RandomStream random = stream(358);
  const auto take = performer->perform(draw_state(scenario->model(), random));
  ASSERT_TRUE(take.complete);
  // Its body has a hole for each pip, and the pips fill them.
  std::map<std::array<long, 3>, std::size_t> known;  // places in nanometres
  std::vector<Vector3d> points;
  double volume = 0;
  std::multiset<std::pair<std::size_t, std::size_t>> edges;
  for (const std::size_t part : {0, 2}) {
    const Mesh& mesh = std::get<Mesh>(take.animation.bodies.at(part).shape);
    const auto welded = [&](std::uint32_t index) {
      const double* place = &mesh.positions[3 * index];
      const std::array<long, 3> key = {std::lround(place[0] * 1e9), std::lround(place[1] * 1e9),
                                       std::lround(place[2] * 1e9)};
      const auto [found, is_new] = known.emplace(key, points.size());
      if (is_new) points.emplace_back(place);
      return found->second;
    };
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const std::size_t a = welded(mesh.indices[i]), b = welded(mesh.indices[i + 1]),
                        c = welded(mesh.indices[i + 2]);
      // The divergence theorem: outside is outside.
      volume += points[a].dot(points[b].cross(points[c])) / 6;
      for (const auto& edge : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
        edges.insert(edge);
    }
  }
  Vector3d farthest = Vector3d::Zero();
  for (const Vector3d& point : points)
    farthest = farthest.cwiseMax(point);
  EXPECT_LT((farthest - Vector3d(0.8, 1, 1) * kDieSide / 2).norm(), 1e-12);
  const double box = 0.8 * kDieSide * kDieSide * kDieSide;
  EXPECT_LT(volume, box);
  EXPECT_GT(volume, 0.95 * box);
  for (const auto& [from, to] : edges) {
    EXPECT_EQ(edges.count({from, to}), 1u);
    EXPECT_EQ(edges.count({to, from}), 1u);
  }
}

// --- Documents and proposals -------------------------------------------------------------------------------

TEST(DiceThrow, ImpossibleModelsAreRefused) {
  const auto refused = [](json model, json constraints = json::array()) {
    return pointers(faults_of([&] { Scenario::read(document(std::move(model), std::move(constraints))); }));
  };
  using Pointers = std::vector<std::string>;
  EXPECT_EQ(refused({{"rounding", 0.0075}}), Pointers{"/model/rounding"});
  EXPECT_EQ(refused({{"drop_height", 0.03}, {"drop_height_spread", 0.01}}), Pointers{"/model/drop_height"});
  EXPECT_EQ(refused({{"dice", 7}}), Pointers{"/model/dice"});
  EXPECT_EQ(refused(json::object(), {{{"kind", "total"}, {"sum", 7}}}), Pointers{"/constraints/0/sum"});
  EXPECT_EQ(refused({{"dice", 2}}, {{{"kind", "total"}, {"sum", 1}}}), Pointers{"/constraints/0/sum"});
  EXPECT_TRUE(refused({{"dice", 2}}, {{{"kind", "total"}, {"sum", 7}}}).empty());
}

TEST(DiceThrow, ChangingOneControlPointOverridesItAlone) {
  const DiceTable table;
  const dice::DiceModel& model = table.model;
  const auto rows = model.kernels(Ratios::exact).rows();
  const auto row =
      std::find_if(rows.begin(), rows.end(), [](const auto& one) { return one.name == "control_point"; });
  ASSERT_NE(row, rows.end());
  RandomStream random = stream(359);
  State current = table.draw(360, 0);
  EXPECT_TRUE(model.read(current).scene.table.overrides.empty());
  for (std::size_t i = 1; i <= 20; ++i) {
    State candidate = current;
    EXPECT_EQ(row->kernel->propose(*model.model(), current, candidate, random), 0);
    const auto before = model.read(current).scene.table.overrides;
    const auto after = model.read(candidate).scene.table.overrides;
    EXPECT_LE(after.size(), before.size() + 1);
    EXPECT_TRUE(std::is_sorted(after.begin(), after.end(),
                               [](const auto& a, const auto& b) { return a.place < b.place; }));
    EXPECT_EQ(model.model()->log_prior(candidate), model.model()->log_prior(current));
    std::swap(current, candidate);
  }
  EXPECT_GT(model.read(current).scene.table.overrides.size(), 15u);
  // Everything anew: nothing is overridden.
  rows.front().kernel->propose(*model.model(), State(current), current, random);
  EXPECT_TRUE(model.read(current).scene.table.overrides.empty());
}

}  // namespace
}  // namespace retake::tests
