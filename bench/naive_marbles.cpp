// See naive_marbles.h. Everything that is not set here is Bullet's default.
#include "bench/naive_marbles.h"

#include <algorithm>
#include <btBulletDynamicsCommon.h>
#include <vector>

namespace retake::spelling {
namespace {

constexpr int kRate = 240;               // [steps/s], the coarsest that functions
constexpr double kCentimetres = 100;     // a metre
constexpr double kLinearDamping = 0.1;   // [1/s]
constexpr double kAngularDamping = 0.3;  // [1/s]; without it nothing ever sleeps

btVector3 bullet(const Eigen::Vector3d& place) {
  return btVector3(place.x(), place.y(), place.z()) * kCentimetres;
}

}  // namespace

struct NaiveMarbles::Parts {
  explicit Parts(const impulse::TriangleMesh& mesh) {
    for (const auto& [a, b, c] : mesh.triangles)
      triangles.addTriangle(bullet(mesh.vertices[a].place), bullet(mesh.vertices[b].place),
                            bullet(mesh.vertices[c].place));
    partitions = std::make_unique<btBvhTriangleMeshShape>(&triangles, true);
    for (const impulse::Plane& plane : mesh.planes)
      walls.push_back(std::make_unique<btStaticPlaneShape>(bullet(plane.normal) / kCentimetres,
                                                           plane.distance * kCentimetres));
  }

  btTriangleMesh triangles;
  std::unique_ptr<btBvhTriangleMeshShape> partitions;
  std::vector<std::unique_ptr<btStaticPlaneShape>> walls;
  btSphereShape marble{kMarbleRadius * kCentimetres};
};

NaiveMarbles::NaiveMarbles(const Box& box) : box_(box), parts_(std::make_unique<Parts>(box.mesh())) {}
NaiveMarbles::~NaiveMarbles() = default;

int NaiveMarbles::in_bins(const impulse::Settings& settings, const impulse::Scene& scene) {
  // The bodies outlive the world that refers to them.
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, -settings.gravity * kCentimetres, 0});
  const auto add = [&](btCollisionShape& shape, double mass, const btVector3& place) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
    info.m_startWorldTransform.setOrigin(place);
    // Bullet multiplies what its two bodies have.
    info.m_friction = mass > 0 ? settings.friction : 1;
    info.m_restitution = mass > 0 ? settings.restitution : 1;
    info.m_linearDamping = kLinearDamping;
    info.m_angularDamping = kAngularDamping;
    world.addRigidBody(bodies.emplace_back(std::make_unique<btRigidBody>(info)).get());
  };
  add(*parts_->partitions, 0, {0, 0, 0});
  for (const auto& wall : parts_->walls)
    add(*wall, 0, {0, 0, 0});
  const std::size_t first_marble = bodies.size();

  std::size_t dropped = 0;
  const double mass = 1e3 * settings.mass();  // [g]
  const double latest = static_cast<double>(scene.latest_step) * settings.time_step;
  for (int step = 0; step < latest * kRate; ++step) {
    for (; dropped < scene.bodies.size() &&
           static_cast<double>(scene.bodies[dropped]->step) * settings.time_step * kRate <= step;
         ++dropped)
      add(parts_->marble, mass, bullet(scene.bodies[dropped]->place));
    world.stepSimulation(1.0 / kRate, 0);
    const bool asleep = std::none_of(bodies.begin() + static_cast<std::ptrdiff_t>(first_marble), bodies.end(),
                                     [](const auto& body) { return body->isActive(); });
    if (asleep && dropped == scene.bodies.size()) break;
  }
  int count = 0;
  for (std::size_t i = first_marble; i < bodies.size(); ++i) {
    const btVector3 place = bodies[i]->getCenterOfMassPosition() / kCentimetres;
    count += !bodies[i]->isActive() && box_.bin_of({place.x(), place.y(), place.z()}) ? 1 : 0;
  }
  return count;
}

}  // namespace retake::spelling
