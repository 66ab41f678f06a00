// See stage.h. Settings of the solver were measured against each other; see worlds/bowling/README.md.
#include "worlds/bowling/stage.h"

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <btBulletDynamicsCommon.h>
#include <mutex>
#include <optional>

#include "sampler/check.h"
#include "worlds/gravity.h"

namespace retake::bowling {
namespace {

using Eigen::Vector3d;

constexpr double kSleepSpeed = 0.08;  // [m/s]
constexpr double kSleepTurn = 0.6;    // [rad/s]

Vector3d eigen(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}
btVector3 bullet(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
btTransform bullet(const Pose& pose) {
  const auto& turn = pose.rotation;
  return btTransform(btQuaternion(turn.x(), turn.y(), turn.z(), turn.w()), bullet(pose.position));
}

// --- Shapes: only their bounds matter to Bullet, contacts are found by contacts.h -----------------

class OwnShape : public btCollisionShape {
 public:
  OwnShape() { m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE; }
  void setLocalScaling(const btVector3&) override {}
  const btVector3& getLocalScaling() const override {
    static const btVector3 one(1, 1, 1);
    return one;
  }
  void calculateLocalInertia(btScalar, btVector3&) const override {}
  const char* getName() const override { return "own"; }
  void setMargin(btScalar) override {}
  btScalar getMargin() const override { return 0; }
};

class PinShape final : public OwnShape {
 public:
  void getAabb(const btTransform& at, btVector3& low, btVector3& high) const override {
    const auto bounds = pin_bounds(eigen(at.getBasis().getColumn(1)));
    low = at.getOrigin() + bullet(bounds[0]);
    high = at.getOrigin() + bullet(bounds[1]);
  }
};

class BallShape final : public OwnShape {
 public:
  double radius = kBallLargestRadius;
  void getAabb(const btTransform& at, btVector3& low, btVector3& high) const override {
    const btVector3 extent(radius, radius, radius);
    low = at.getOrigin() - extent;
    high = at.getOrigin() + extent;
  }
};

constexpr double kFarEnd = 2.5;  // [m], behind everything
class StillShape final : public OwnShape {
 public:
  void getAabb(const btTransform&, btVector3& low, btVector3& high) const override {
    low = {kFoulLine - 1, -1, -1};
    high = {kFarEnd, 1, 1};
  }
};

// --- Contacts -----------------------------------------------------------------------------------

enum class Kind { ball, pin, still };  // in the order in which they are first bodies of a contact

/// What is to be known of a body while contacts are found.
struct Tag {
  Kind kind;
  std::size_t body;  ///< what stands still comes last
  double radius = 0;
  double linear_damping = 0;   ///< [1/s]
  double angular_damping = 0;  ///< [1/s]
};
const Tag& tag_of(const btCollisionObject* object) {
  return *static_cast<const Tag*>(object->getUserPointer());
}

PinPlace place_of(const btCollisionObject* object) {
  const btTransform& at = object->getWorldTransform();
  return {.centre = eigen(at.getOrigin()), .axis = eigen(at.getBasis().getColumn(1))};
}

struct Material {
  double friction, restitution;
};
Material material(const StageSettings& settings, Kind first, Surface with) {
  const bool ball = first == Kind::ball;
  switch (with) {
    case Surface::lane:
    case Surface::gutter:
      return ball ? Material{settings.ball_lane_friction, kLaneBallRestitution} : Material{0.35, 0.35};
    case Surface::wall:
      return ball ? Material{0.20, 0.35} : Material{0.30, 0.60};
    case Surface::pit:
      return {0.5, 0.1};
    case Surface::cushion:
      return ball ? Material{0.5, 0.05} : Material{0.3, settings.cushion_restitution};
    case Surface::pin:
      return ball ? Material{0.20, 0.65} : Material{0.25, 0.65};
  }
  return {};
}

/// What all pairs of a world share while contacts are found.
struct ContactFinding {
  StageSettings settings;
  HitLog hits;
  bool watched = false;
  bool ball_touches_pin = false;
};

/// Finds the contacts of one pair anew in every step, which leaves nothing behind that a later step could
/// depend on.
class PairContacts final : public btActivatingCollisionAlgorithm {
 public:
  PairContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
               const btCollisionObjectWrapper* second, ContactFinding& finding)
      : btActivatingCollisionAlgorithm(info, first, second),
        finding_(finding),
        manifold_(m_dispatcher->getNewManifold(first->getCollisionObject(), second->getCollisionObject())) {}
  ~PairContacts() override { m_dispatcher->releaseManifold(manifold_); }
  PairContacts(const PairContacts&) = delete;
  PairContacts& operator=(const PairContacts&) = delete;

  void processCollision(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*,
                        const btDispatcherInfo&, btManifoldResult*) override;
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override { manifolds.push_back(manifold_); }

 private:
  ContactFinding& finding_;
  btPersistentManifold* manifold_;
};

class PairContactsFactory final : public btCollisionAlgorithmCreateFunc {
 public:
  explicit PairContactsFactory(ContactFinding& finding) : finding_(finding) {}
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* first,
                                                 const btCollisionObjectWrapper* second) override {
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(PairContacts));
    return new (memory) PairContacts(info, first, second, finding_);
  }

 private:
  ContactFinding& finding_;
};

void PairContacts::processCollision(const btCollisionObjectWrapper* one,
                                    const btCollisionObjectWrapper* other, const btDispatcherInfo&,
                                    btManifoldResult*) {
  manifold_->clearManifold();
  const btCollisionObject *first = one->getCollisionObject(), *second = other->getCollisionObject();
  // The ball comes first, and what stands still comes last.
  const bool swapped = tag_of(first).kind > tag_of(second).kind;
  if (swapped) std::swap(first, second);
  const Tag &a = tag_of(first), &b = tag_of(second);

  Contacts contacts;
  if (b.kind == Kind::still) {
    if (a.kind == Kind::ball)
      find_ball_and_lane(eigen(first->getWorldTransform().getOrigin()), a.radius,
                         finding_.settings.surroundings, contacts);
    else
      find_pin_and_lane(place_of(first), finding_.settings.surroundings, contacts);
  } else if (a.kind == Kind::ball) {
    find_ball_and_pin(eigen(first->getWorldTransform().getOrigin()), a.radius, place_of(second), contacts);
  } else {
    find_pin_and_pin(place_of(first), place_of(second), contacts);
  }

  for (const Contact& contact : contacts.list()) {
    const btVector3 normal = bullet(contact.normal), on_second = bullet(contact.point),
                    on_first = on_second + contact.gap * normal;
    btManifoldPoint point({0, 0, 0}, {0, 0, 0}, swapped ? -normal : normal, contact.gap);
    point.m_positionWorldOnA = swapped ? on_second : on_first;
    point.m_positionWorldOnB = swapped ? on_first : on_second;
    const Material pair = material(finding_.settings, a.kind, contact.with);
    point.m_combinedFriction = pair.friction;
    point.m_combinedRestitution = pair.restitution;
    point.m_partId0 = swapped;
    point.m_index0 = static_cast<int>(contact.with);
    manifold_->addManifoldPoint(point);
    if (contact.with == Surface::pin && a.kind == Kind::ball) finding_.ball_touches_pin = true;
    if (finding_.watched) {
      const auto velocity = [&](const btCollisionObject* object) {
        const btRigidBody& body = *btRigidBody::upcast(object);
        return body.getVelocityInLocalPoint(on_second - body.getCenterOfMassPosition());
      };
      finding_.hits.touch(a.body, b.body, contact, normal.dot(velocity(second) - velocity(first)));
    }
  }
}

class Configuration final : public btDefaultCollisionConfiguration {
 public:
  Configuration(const btDefaultCollisionConstructionInfo& info, ContactFinding& finding)
      : btDefaultCollisionConfiguration(info), factory_(finding) {}
  btCollisionAlgorithmCreateFunc* getCollisionAlgorithmCreateFunc(int, int) override { return &factory_; }
  btCollisionAlgorithmCreateFunc* getClosestPointsAlgorithmCreateFunc(int, int) override { return &factory_; }

 private:
  PairContactsFactory factory_;
};

/// Bullet keeps the time after which slow bodies fall asleep in a global variable.
void set_bullet_globals() {
  static std::once_flag once;
  std::call_once(once, [] { gDeactivationTime = 0.25; });
}

/// Bullet's step without what our scenes do not use: predicted transforms, motion states, constraints.
/// Damping is ours, so that it costs no power function.
class LeanWorld final : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;
  void advance(double seconds) {
    applyGravity();
    for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i)
      if (btRigidBody& body = *m_nonStaticRigidBodies[i]; body.isActive()) {
        const Tag& tag = tag_of(&body);
        body.setLinearVelocity(body.getLinearVelocity() / (1 + seconds * tag.linear_damping));
        body.setAngularVelocity(body.getAngularVelocity() / (1 + seconds * tag.angular_damping));
      }
    m_dispatchInfo.m_timeStep = seconds;
    performDiscreteCollisionDetection();
    calculateSimulationIslands();
    m_solverInfo.m_timeStep = seconds;
    solveConstraints(m_solverInfo);
    for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i)
      if (btRigidBody& body = *m_nonStaticRigidBodies[i]; body.isActive() && !body.isStaticObject()) {
        btTransform moved;
        body.predictIntegratedTransform(seconds, moved);
        body.proceedToTransform(moved);
      }
    updateActivationState(seconds);
    clearForces();
  }
};

btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 128;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 128;
  info.m_customCollisionAlgorithmMaxElementSize = sizeof(PairContacts);
  return info;
}

}  // namespace

// --- The world ----------------------------------------------------------------------------------

class Stage::World {
 public:
  explicit World(const StageSettings& settings)
      : finding{.settings = settings, .hits = HitLog(settings.bodies)},
        configuration_(small_pools(), finding),
        dispatcher_(&configuration_),
        broadphase_({kFoulLine - 2, -2, -2}, {kFarEnd + 0.5, 3, 2}, 64, nullptr, true),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        tags_(settings.bodies + 1),
        bodies_(settings.bodies + 1) {
    world_.setGravity({0, -kGravity, 0});
    world_.setForceUpdateAllAabbs(false);
    world_.getDispatchInfo().m_useContinuous = false;
    btContactSolverInfo& solver = world_.getSolverInfo();
    solver.m_numIterations = 10;
    solver.m_splitImpulse = 1;
    solver.m_splitImpulsePenetrationThreshold = -1e-5;
    solver.m_erp = solver.m_erp2 = 0.2;
    solver.m_linearSlop = 0;
    solver.m_restitutionVelocityThreshold = kSlowestBounce;
    solver.m_solverMode = SOLVER_USE_WARMSTARTING;  // contacts are new in every step: it only keeps impulses
  }
  ~World() { empty(); }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void clear();
  void add(Kind kind, std::size_t index, double mass, const btVector3& inertia, double radius,
           const Pose& pose, const Motion& motion);
  void remove(std::size_t index) {
    world_.removeRigidBody(&*bodies_[index]);
    bodies_[index].reset();
  }
  void step(double seconds, double now);
  bool has(std::size_t index) const { return bodies_[index].has_value(); }
  btRigidBody& body(std::size_t index) {
    CHECK(bodies_[index].has_value(), index);
    return *bodies_[index];
  }
  Tag& tag(std::size_t index) { return tags_[index]; }

  ContactFinding finding;

 private:
  void empty();
  Configuration configuration_;
  btCollisionDispatcher dispatcher_;
  btAxisSweep3 broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  LeanWorld world_;
  BallShape ball_shape_;
  PinShape pin_shape_;
  StillShape still_shape_;
  std::vector<Tag> tags_;
  std::vector<std::optional<btRigidBody>> bodies_;  ///< the last one stands still
};

void Stage::World::empty() {
  for (auto& body : bodies_)
    if (body) world_.removeRigidBody(&*body);
  for (auto& body : bodies_)
    body.reset();
}

void Stage::World::clear() {
  empty();
  broadphase_.resetPool(&dispatcher_);
  solver_.reset();
  finding.hits.clear();
  finding.ball_touches_pin = false;
  add(Kind::still, bodies_.size() - 1, 0, {0, 0, 0}, 0, {}, {});
}

void Stage::World::add(Kind kind, std::size_t index, double mass, const btVector3& inertia, double radius,
                       const Pose& pose, const Motion& motion) {
  btCollisionShape* shape = &still_shape_;
  if (kind == Kind::pin) shape = &pin_shape_;
  if (kind == Kind::ball) {
    shape = &ball_shape_;
    ball_shape_.radius = radius;
  }
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  info.m_startWorldTransform = bullet(pose);
  info.m_linearSleepingThreshold = kSleepSpeed;
  info.m_angularSleepingThreshold = kSleepTurn;
  btRigidBody& body = bodies_[index].emplace(info);
  tags_[index] = {.kind = kind, .body = index, .radius = radius};
  body.setUserPointer(&tags_[index]);
  if (mass > 0) {
    body.setLinearVelocity(bullet(motion.linear_velocity));
    body.setAngularVelocity(bullet(motion.angular_velocity));
  }
  world_.addRigidBody(&body);
}

void Stage::World::step(double seconds, double now) {
  world_.advance(seconds);
  if (!finding.watched) return;
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      // As PairContacts has put them in order.
      const btManifoldPoint& point = manifold.getContactPoint(k);
      std::size_t first = tag_of(manifold.getBody0()).body, second = tag_of(manifold.getBody1()).body;
      if (point.m_partId0 != 0) std::swap(first, second);
      finding.hits.push(first, second, static_cast<Surface>(point.m_index0), point.m_appliedImpulse, now);
    }
  }
  finding.hits.end_step();
}

Stage::Stage(const StageSettings& settings) {
  set_bullet_globals();
  world_ = std::make_unique<World>(settings);
  clear(false);
}
Stage::~Stage() = default;

void Stage::clear(bool watched) {
  world_->clear();
  world_->finding.watched = watched;
}

void Stage::add_ball(const Ball& ball, const Pose& pose, const Motion& motion) {
  const double inertia = ball.inertia();
  world_->add(Kind::ball, 0, ball.mass, {inertia, inertia, inertia}, ball.radius, pose, motion);
}

void Stage::add_pin(std::size_t body, const Pose& pose, const Motion& motion) {
  static const PinBody pin = pin_body();
  world_->add(Kind::pin, body, kPinMass, {pin.transverse_inertia, pin.axial_inertia, pin.transverse_inertia},
              0, pose, motion);
  damp(body, kPinDamping, kPinSpinDamping);
}

void Stage::remove(std::size_t body) {
  world_->remove(body);
}
bool Stage::has(std::size_t body) const {
  return world_->has(body);
}
void Stage::step(double seconds, double now) {
  world_->step(seconds, now);
}
bool Stage::ball_has_touched_pin() const {
  return world_->finding.ball_touches_pin;
}
const std::vector<Hit>& Stage::finish_hits() {
  return world_->finding.hits.finish();
}

Pose Stage::pose(std::size_t body) const {
  const btTransform& at = world_->body(body).getWorldTransform();
  const btQuaternion turn = at.getRotation();
  return {.position = eigen(at.getOrigin()),
          .rotation = Eigen::Quaterniond(turn.w(), turn.x(), turn.y(), turn.z()).normalized()};
}
Motion Stage::motion(std::size_t body) const {
  const btRigidBody& found = world_->body(body);
  return {.position = eigen(found.getCenterOfMassPosition()),
          .linear_velocity = eigen(found.getLinearVelocity()),
          .angular_velocity = eigen(found.getAngularVelocity())};
}
Vector3d Stage::position(std::size_t body) const {
  return eigen(world_->body(body).getCenterOfMassPosition());
}
Vector3d Stage::velocity(std::size_t body) const {
  return eigen(world_->body(body).getLinearVelocity());
}
Vector3d Stage::axis(std::size_t body) const {
  return eigen(world_->body(body).getWorldTransform().getBasis().getColumn(1));
}

double Stage::energy(std::size_t body) const {
  const btRigidBody& found = world_->body(body);
  if (found.isStaticObject()) return 0;
  const double mass = 1 / found.getInvMass();
  const btVector3 spin =
      found.getAngularVelocity() * found.getWorldTransform().getBasis();  // in its own frame
  const btVector3 inverse = found.getInvInertiaDiagLocal();
  double energy =
      mass * (0.5 * found.getLinearVelocity().length2() + kGravity * found.getCenterOfMassPosition().y());
  for (int k = 0; k < 3; ++k)
    energy += 0.5 * spin[k] * spin[k] / inverse[k];
  return energy;
}

bool Stage::is_active(std::size_t body) const {
  return world_->body(body).isActive();
}
bool Stage::is_fixed(std::size_t body) const {
  return world_->body(body).isStaticObject();
}
void Stage::fix(std::size_t body) {
  btRigidBody& found = world_->body(body);
  found.setLinearVelocity({0, 0, 0});
  found.setAngularVelocity({0, 0, 0});
  found.setMassProps(0, {0, 0, 0});
  found.updateInertiaTensor();
}
void Stage::damp(std::size_t body, double linear, double angular) {
  world_->tag(body).linear_damping = linear;
  world_->tag(body).angular_damping = angular;
}
void Stage::set_sleeping_speeds(std::size_t body, double linear, double angular) {
  world_->body(body).setSleepingThresholds(linear, angular);
}
void Stage::put_to_sleep(std::size_t body) {
  world_->body(body).setActivationState(ISLAND_SLEEPING);
}
void Stage::keep_awake(std::size_t body) {
  world_->body(body).setActivationState(DISABLE_DEACTIVATION);
}
void Stage::let_sleep(std::size_t body) {
  if (world_->body(body).getActivationState() == DISABLE_DEACTIVATION)
    world_->body(body).forceActivationState(ACTIVE_TAG);
}
void Stage::delay_sleep(std::size_t body) {
  world_->body(body).setDeactivationTime(0);
}

}  // namespace retake::bowling
