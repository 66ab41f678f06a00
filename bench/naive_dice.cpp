// See naive_dice.h. Everything that is not set here is Bullet's default.
#include "bench/naive_dice.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletDynamicsCommon.h>
#include <cmath>
#include <vector>

namespace retake::dice {
namespace {

constexpr double kCentimetres = 100;            // a metre
constexpr int kRate = 480;                      // [steps/s]
constexpr double kLongest = 4;                  // [s]
constexpr double kCell = 0.5;                   // [cm]
constexpr int kSamples = 161;                   // along x and z: 80 cm
constexpr double kFirstX = -30, kFirstZ = -40;  // [cm] from the launch

btVector3 bullet(const Eigen::Vector3d& v) {
  return btVector3(v.x(), v.y(), v.z());
}

/// What the hook for materials reads.
Table* current_table = nullptr;

/// The table's own restitution and friction where the die touches it.
bool set_material(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                  const btCollisionObjectWrapper*, int, int) {
  const btVector3 place = point.getPositionWorldOnB() / kCentimetres;
  const Table::Material material = current_table->material(place.x(), place.z());
  point.m_combinedRestitution = material.restitution;
  point.m_combinedFriction = material.friction;
  return true;
}

}  // namespace

struct NaiveDice::Parts {
  explicit Parts(const DieShape& shape) : mass(1e3 * shape.mass()), heights(kSamples * kSamples) {
    const Eigen::Vector3d core =
        (shape.half_extents() - Eigen::Vector3d::Constant(shape.rounding())) * kCentimetres;
    for (const int x : {-1, 1})
      for (const int y : {-1, 1})
        for (const int z : {-1, 1})
          die.addPoint(btVector3(x * core.x(), y * core.y(), z * core.z()), false);
    die.recalcLocalAabb();
    die.setMargin(shape.rounding() * kCentimetres);
    inertia = bullet(shape.inertia() * kCentimetres * kCentimetres) * mass;
  }

  btConvexHullShape die;
  double mass;  ///< [g]
  btVector3 inertia;
  std::vector<float> heights;  ///< [cm]
};

NaiveDice::NaiveDice(const DieShape& shape) : parts_(std::make_unique<Parts>(shape)) {
  gContactAddedCallback = set_material;
}

NaiveDice::~NaiveDice() {
  gContactAddedCallback = nullptr;
}

NaiveDice::Rest NaiveDice::play(Table& table, const DieState& launch) {
  current_table = &table;

  // The height field around the launch; Bullet centres it.
  const double x0 = std::round(launch.position.x() * kCentimetres) + kFirstX;
  const double z0 = std::round(launch.position.z() * kCentimetres) + kFirstZ;
  for (int j = 0; j < kSamples; ++j)
    for (int i = 0; i < kSamples; ++i) {
      const double height =
          table.height((x0 + i * kCell) / kCentimetres, (z0 + j * kCell) / kCentimetres).value;
      parts_->heights[static_cast<std::size_t>(j * kSamples + i)] = static_cast<float>(height * kCentimetres);
    }
  const double highest = table.settings().max_height() * kCentimetres;
  btHeightfieldTerrainShape field(kSamples, kSamples, parts_->heights.data(), -highest, highest, 1, false);
  field.setLocalScaling(btVector3(kCell, 1, kCell));

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, -981, 0});

  btRigidBody ground(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &field));
  const double half = kCell * (kSamples - 1) / 2;
  ground.getWorldTransform().setOrigin(btVector3(x0 + half, 0, z0 + half));
  ground.setCollisionFlags(ground.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  world.addRigidBody(&ground);

  btRigidBody die(
      btRigidBody::btRigidBodyConstructionInfo(parts_->mass, nullptr, &parts_->die, parts_->inertia));
  const Eigen::Quaterniond& turn = launch.rotation;
  die.setWorldTransform(btTransform(btQuaternion(turn.x(), turn.y(), turn.z(), turn.w()),
                                    bullet(launch.position * kCentimetres)));
  die.setLinearVelocity(bullet(launch.linear_velocity * kCentimetres));
  die.setAngularVelocity(bullet(launch.angular_velocity));
  world.addRigidBody(&die);

  for (int step = 0; step < kLongest * kRate && die.isActive(); ++step)
    world.stepSimulation(1.0 / kRate, 0);
  const btTransform& end = die.getWorldTransform();
  const btQuaternion rotation = end.getRotation();
  const btVector3 place = end.getOrigin() / kCentimetres;
  return {.sleeps = !die.isActive(),
          .pose = {.position = {place.x(), place.y(), place.z()},
                   .rotation = Eigen::Quaterniond(rotation.w(), rotation.x(), rotation.y(), rotation.z())}};
}

}  // namespace retake::dice
