// See naive_bowling.h. Everything that is not set here is Bullet's default.
#include "bench/naive_bowling.h"

#include <array>
#include <btBulletDynamicsCommon.h>
#include <cmath>
#include <numbers>
#include <vector>

#include "worlds/bowling/lane.h"
#include "worlds/gravity.h"

namespace retake::bowling {
namespace {

constexpr double kRate = 240;        // [steps/s]
constexpr int kLongestSteps = 2880;  // 12 s after the release
constexpr int kAzimuths = 16;
constexpr double kPinMargin = 0.001;     // [m]; with Bullet's 4 cm, pins would touch before they are hit
constexpr double kThickness = 0.5;       // [m] of what stands still
constexpr double kWallHeight = 1;        // [m]
constexpr double kGone = -0.5;           // [m]; what is below has fallen behind the deck
constexpr double kDown = 0.6;            // cosine of the tilt beyond which a pin has fallen
constexpr double kSunk = 0.06;           // [m] that its centre of mass has sunk
constexpr double kDeactivationTime = 2;  // [s]

/// Bullet multiplies what its two bodies have, so these products come as near to the pairs that the world
/// `bowling` uses as one number a body can: ball and lane 0.12, ball and pin 0.2, pin and lane 0.35, pins
/// 0.25.
struct Material {
  double friction, restitution;
};
constexpr Material kLane{0.5, 0.35}, kWalls{0.6, 0.75}, kPin{0.5, 0.8}, kBall{0.3, 0.8};

btVector3 bullet(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// Bullet's own value of what worlds/bowling sets for the whole program.
class DefaultDeactivation {
 public:
  DefaultDeactivation() : before_(gDeactivationTime) { gDeactivationTime = kDeactivationTime; }
  ~DefaultDeactivation() { gDeactivationTime = before_; }
  DefaultDeactivation(const DefaultDeactivation&) = delete;
  DefaultDeactivation& operator=(const DefaultDeactivation&) = delete;

 private:
  btScalar before_;
};

}  // namespace

class NaiveBowling::Shapes {
 public:
  Shapes() : pin_body(bowling::pin_body()) {
    for (const auto& [height, radius] : kPinProfile)
      for (int i = 0; i < (radius > 0 ? kAzimuths : 1); ++i) {
        const double azimuth = 2 * std::numbers::pi * i / kAzimuths;
        pin.addPoint(
            {radius * std::cos(azimuth), height - pin_body.centre_of_mass, radius * std::sin(azimuth)},
            false);
      }
    pin.recalcLocalAabb();
    pin.setMargin(kPinMargin);
  }

  PinBody pin_body;
  btConvexHullShape pin;
  btBoxShape lane{{kHalfLength, kThickness / 2, kLaneHalfWidth}};
  btBoxShape gutter{{kHalfLength, kThickness / 2, (kWall - kLaneHalfWidth) / 2}};
  btBoxShape wall{{kHalfLength, kWallHeight / 2, kThickness / 2}};

  static constexpr double kStart = kFoulLine - 1;  // [m]
  static constexpr double kHalfLength = (kDeckEnd - kStart) / 2;
};

/// One world with everything in it.
class NaiveBowling::Throw {
 public:
  Throw(Shapes& shapes, const Release& release) : shapes_(shapes), ball_shape_(release.ball.radius) {
    world_.setGravity({0, -kGravity, 0});

    // Lane, gutters and walls.
    const double middle = Shapes::kStart + Shapes::kHalfLength;
    add(shapes.lane, kLane, {middle, -kThickness / 2, 0});
    for (const int side : {-1, 1}) {
      add(shapes.gutter, kLane,
          {middle, -kGutterDepth - kThickness / 2, side * (kLaneHalfWidth + kWall) / 2});
      add(shapes.wall, kWalls, {middle, 0, side * (kWall + kThickness / 2)});
    }

    // Ball and pins.
    const double inertia = release.ball.inertia();
    btRigidBody& ball = add(ball_shape_, kBall, bullet(release.motion.position), release.ball.mass,
                            {inertia, inertia, inertia});
    ball.setLinearVelocity(bullet(release.motion.linear_velocity));
    ball.setAngularVelocity(bullet(release.motion.angular_velocity));
    const PinBody& pin = shapes.pin_body;
    for (int i = 0; i < kPinCount; ++i) {
      const Eigen::Vector3d place = pin_spot(i + 1) + release.offsets[static_cast<std::size_t>(i)];
      pins_[static_cast<std::size_t>(i)] =
          &add(shapes.pin, kPin, bullet(place) + btVector3(0, pin.centre_of_mass, 0), kPinMass,
               {pin.transverse_inertia, pin.axial_inertia, pin.transverse_inertia});
    }
  }

  void play() {
    for (int step = 0; step < kLongestSteps; ++step) {
      world_.stepSimulation(1 / kRate, 0);
      bool asleep = true;
      for (const auto& body : bodies_) {
        if (!body->isInWorld() || body->isStaticObject()) continue;
        if (body->getCenterOfMassPosition().y() < kGone)
          world_.removeRigidBody(body.get());
        else if (body->isActive())
          asleep = false;
      }
      if (asleep) return;
    }
  }

  int pins_down() const {
    int down = 0;
    for (const btRigidBody* pin : pins_) {
      const btTransform& at = pin->getWorldTransform();
      const bool stands = pin->isInWorld() && at.getBasis()[1][1] >= kDown &&
                          at.getOrigin().y() >= shapes_.pin_body.centre_of_mass - kSunk;
      down += stands ? 0 : 1;
    }
    return down;
  }

 private:
  btRigidBody& add(btCollisionShape& shape, const Material& material, const btVector3& place, double mass = 0,
                   const btVector3& inertia = {0, 0, 0}) {
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
    info.m_startWorldTransform.setOrigin(place);
    info.m_friction = material.friction;
    info.m_restitution = material.restitution;
    btRigidBody& body = *bodies_.emplace_back(std::make_unique<btRigidBody>(info));
    world_.addRigidBody(&body);
    return body;
  }

  Shapes& shapes_;
  btSphereShape ball_shape_;
  // The bodies outlive the world that refers to them.
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::array<btRigidBody*, kPinCount> pins_{};
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
};

NaiveBowling::NaiveBowling() : shapes_(std::make_unique<Shapes>()) {}
NaiveBowling::~NaiveBowling() = default;

int NaiveBowling::pins_down(const Release& release) {
  const DefaultDeactivation defaults;
  Throw thrown(*shapes_, release);
  thrown.play();
  return thrown.pins_down();
}

}  // namespace retake::bowling
