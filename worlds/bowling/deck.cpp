// See deck.h. Settings of the solver were measured against each other; see worlds/bowling/README.md.
#include "worlds/bowling/deck.h"

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <algorithm>
#include <btBulletDynamicsCommon.h>
#include <cmath>
#include <mutex>
#include <optional>

#include "sampler/check.h"

namespace retake::bowling {
namespace {

using Eigen::Vector3d;

Vector3d eigen(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}
btVector3 bullet(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

struct Material {
  double friction, restitution;
};
constexpr double kDown = 0.6;             // cosine of the tilt beyond which a pin has fallen
constexpr double kSunk = 0.06;            // [m] that its centre of mass has sunk
constexpr double kOffLane = 0.03;         // [m] beyond the lane's edge or the deck's end
constexpr double kBallLeaves = 0.15;      // [m] behind the deck's end, where it has no say any more
constexpr double kPinLeaves = 0.20;       // [m]
constexpr double kFallen = -0.2;          // [m]; a pin so low has fallen behind the deck
constexpr double kLow = 0.12;             // [m]; a fallen pin whose centre is below lies and rolls
constexpr double kPinDamping = 0.02;      // [1/s]
constexpr double kPinSpinDamping = 0.15;  // [1/s]
constexpr double kRollingDamping = 1;     // [1/s] of a lying pin, for the resistance of rolling
// Once it is decided, chosen to let everything come to rest softly within seconds:
constexpr double kSlow = 0.3;               // [m/s]
constexpr double kSlowDamping = 4;          // [1/s] of what is slower
constexpr double kGrowingDamping = 2;       // [1/s] more with every second
constexpr double kRestSpeed = 0.02;         // [m/s]; slower bodies fall asleep
constexpr double kRestTurn = 0.4;           // [rad/s]
constexpr double kPitDamping = 2;           // [1/s], the carpet
constexpr double kImpossibleSpeed = 60;     // [m/s]
constexpr double kBouncingApproach = 0.15;  // [m/s]; softer touches are no hits
constexpr double kHitDuration = 0.02;       // [s] over which the impulses of a hit are added up

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

// --- Contacts ----------------------------------------------------------------------------------------

enum class Kind { still, ball, pin };

class Stage;
/// What a Bullet body stands for.
struct Tag {
  Kind kind;
  std::size_t body;  ///< as in Hit; the body that stands still comes last
  double radius = 0;
  Stage* stage = nullptr;
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

/// Finds the contacts of one pair anew in every step, which leaves nothing behind that a later step could
/// depend on.
class PairContacts final : public btActivatingCollisionAlgorithm {
 public:
  PairContacts(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
               const btCollisionObjectWrapper* second)
      : btActivatingCollisionAlgorithm(info, first, second),
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
  btPersistentManifold* manifold_;
};

class PairContactsFactory final : public btCollisionAlgorithmCreateFunc {
 public:
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* first,
                                                 const btCollisionObjectWrapper* second) override {
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(PairContacts));
    return new (memory) PairContacts(info, first, second);
  }
};

class Configuration final : public btDefaultCollisionConfiguration {
 public:
  using btDefaultCollisionConfiguration::btDefaultCollisionConfiguration;
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

// --- A Bullet world with our bodies ----------------------------------------------------------------------

class Stage {
 public:
  Stage(std::size_t body_count, const Surroundings& surroundings,
        const std::array<Material, 4>& lane_materials);

  /// Empties the world whole, so that it is as new, bit for bit.
  void clear();
  btRigidBody& add(Kind kind, std::size_t body, double mass, const btVector3& inertia, double radius,
                   const btTransform& at);
  void remove(std::size_t body);
  void fix(std::size_t body);
  btRigidBody* body(std::size_t index) { return bodies_[index] ? &*bodies_[index] : nullptr; }
  const btRigidBody* body(std::size_t index) const { return bodies_[index] ? &*bodies_[index] : nullptr; }
  std::size_t size() const { return bodies_.size() - 1; }
  void step(double seconds) { world_.advance(seconds); }
  void damp(std::size_t body, double linear, double angular) {
    tags_[body].linear_damping = linear;
    tags_[body].angular_damping = angular;
  }
  bool asleep() const;

  const Surroundings& surroundings() const { return surroundings_; }
  Material material(Kind first, Surface with) const;
  void note_contact(const btRigidBody& first, const btRigidBody& second, const Contact& contact);
  bool ball_touches_pin = false;
  bool watched = false;
  void gather_hits(double time);
  /// Ends the hits under way and puts them in order of time.
  void finish_hits();
  std::vector<Hit> hits;

 private:
  struct Encounter {  ///< of a body with another one or with a surface, while it lasts
    bool hit = false;
    bool seen = false;  ///< in this step
    double start = 0;
    double impulse = 0;
    Vector3d point = Vector3d::Zero(), normal = Vector3d::Zero();
  };
  static constexpr std::size_t kSurfaces = 7;
  std::size_t partners() const { return bodies_.size() + kSurfaces; }
  Encounter& encounter(std::size_t first, std::size_t second, Surface with) {
    const bool still = with != Surface::pin && with != Surface::ball;
    const std::size_t partner = still ? bodies_.size() + static_cast<std::size_t>(with) : second;
    return encounters_[first * partners() + partner];
  }
  void close(std::size_t first, std::size_t partner);

  Surroundings surroundings_;
  std::array<Material, 4> materials_;
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
  std::vector<Encounter> encounters_;
};

enum MaterialRow { kBallLane, kBallCushion, kPinCushion, kPit };

btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 128;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 128;
  info.m_customCollisionAlgorithmMaxElementSize = sizeof(PairContacts);
  return info;
}

Stage::Stage(std::size_t body_count, const Surroundings& surroundings,
             const std::array<Material, 4>& lane_materials)
    : surroundings_(surroundings),
      materials_(lane_materials),
      configuration_(small_pools()),
      dispatcher_(&configuration_),
      broadphase_({kFoulLine - 2, -2, -2}, {kFarEnd + 0.5, 3, 2}, 64, nullptr, true),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
      tags_(body_count + 1),
      bodies_(body_count + 1),
      encounters_((body_count + 1) * (body_count + 1 + kSurfaces)) {
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
  solver.m_solverMode = 0;  // contacts are new in every step: there is nothing to start warm from
}

void Stage::clear() {
  for (auto& body : bodies_)
    if (body && body->getBroadphaseProxy()) world_.removeRigidBody(&*body);
  for (auto& body : bodies_)
    body.reset();
  broadphase_.resetPool(&dispatcher_);
  solver_.reset();
  add(Kind::still, size(), 0, {0, 0, 0}, 0, btTransform::getIdentity());
  std::fill(encounters_.begin(), encounters_.end(), Encounter{});
  hits.clear();
  ball_touches_pin = false;
}

btRigidBody& Stage::add(Kind kind, std::size_t index, double mass, const btVector3& inertia, double radius,
                        const btTransform& at) {
  btCollisionShape* shape = kind == Kind::ball  ? static_cast<btCollisionShape*>(&ball_shape_)
                            : kind == Kind::pin ? static_cast<btCollisionShape*>(&pin_shape_)
                                                : &still_shape_;
  if (kind == Kind::ball) ball_shape_.radius = radius;
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  info.m_startWorldTransform = at;
  info.m_linearSleepingThreshold = 0.08;
  info.m_angularSleepingThreshold = 0.6;
  btRigidBody& body = bodies_[index].emplace(info);
  tags_[index] = {.kind = kind, .body = index, .radius = radius, .stage = this};
  if (kind == Kind::pin) damp(index, kPinDamping, kPinSpinDamping);
  body.setUserPointer(&tags_[index]);
  world_.addRigidBody(&body);
  return body;
}

void Stage::remove(std::size_t index) {
  world_.removeRigidBody(&*bodies_[index]);
  bodies_[index].reset();
}

void Stage::fix(std::size_t index) {
  btRigidBody& body = *bodies_[index];
  body.setLinearVelocity({0, 0, 0});
  body.setAngularVelocity({0, 0, 0});
  body.setMassProps(0, {0, 0, 0});
  body.updateInertiaTensor();
}

bool Stage::asleep() const {
  for (std::size_t i = 0; i < size(); ++i)
    if (bodies_[i] && !bodies_[i]->isStaticObject() && bodies_[i]->isActive()) return false;
  return true;
}

Material Stage::material(Kind first, Surface with) const {
  const bool ball = first == Kind::ball;
  switch (with) {
    case Surface::lane:
    case Surface::gutter:
      return ball ? materials_[kBallLane] : Material{0.35, 0.35};
    case Surface::wall:
      return ball ? Material{0.20, 0.35} : Material{0.30, 0.60};
    case Surface::pit:
      return materials_[kPit];
    case Surface::cushion:
      return materials_[ball ? kBallCushion : kPinCushion];
    case Surface::pin:
      return ball ? Material{0.20, 0.65} : Material{0.25, 0.65};
    case Surface::ball:
      break;
  }
  CHECK(false, "nothing is hit by the ball as a second body");
  return {};
}

void Stage::note_contact(const btRigidBody& first, const btRigidBody& second, const Contact& contact) {
  const Tag &a = tag_of(&first), &b = tag_of(&second);
  if (a.kind == Kind::ball && b.kind == Kind::pin) ball_touches_pin = true;
  if (!watched) return;
  Encounter& meeting = encounter(a.body, b.body, contact.with);
  meeting.seen = true;
  if (meeting.hit) return;
  const btVector3 point = bullet(contact.point);
  const auto velocity = [&](const btRigidBody& body) {
    return eigen(body.getVelocityInLocalPoint(point - body.getCenterOfMassPosition()));
  };
  const double approach = -contact.normal.dot(velocity(first) - velocity(second));
  if (approach < kBouncingApproach) return;
  meeting.hit = true;
  meeting.start = -1;
  meeting.impulse = 0;
  meeting.point = contact.point;
  meeting.normal = contact.normal;
}

void Stage::close(std::size_t first, std::size_t partner) {
  Encounter& meeting = encounters_[first * partners() + partner];
  if (!meeting.hit) return;
  meeting.hit = false;
  if (meeting.impulse <= 0) return;
  const bool still = partner >= bodies_.size();
  hits.push_back({.time = meeting.start,
                  .first = first,
                  .second = still ? size() : partner,
                  .with = still ? static_cast<Surface>(partner - bodies_.size()) : Surface::pin,
                  .impulse = meeting.impulse,
                  .point = meeting.point,
                  .normal = meeting.normal});
}

void Stage::gather_hits(double time) {
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold.getContactPoint(k);
      const std::size_t a = tag_of(manifold.getBody0()).body, b = tag_of(manifold.getBody1()).body;
      const auto with = static_cast<Surface>(point.m_index0);
      // As in PairContacts: the first of a hit is the ball, or the pin that something still touches.
      Encounter& meeting = point.m_partId0 == 0 ? encounter(a, b, with) : encounter(b, a, with);
      if (!meeting.hit) continue;
      if (meeting.start < 0) meeting.start = time;
      if (time - meeting.start < kHitDuration) meeting.impulse += point.m_appliedImpulse;
    }
  }
  for (std::size_t first = 0; first < bodies_.size(); ++first)
    for (std::size_t partner = 0; partner < partners(); ++partner) {
      Encounter& meeting = encounters_[first * partners() + partner];
      if (!meeting.seen) close(first, partner);
      meeting.seen = false;
    }
}

void Stage::finish_hits() {
  for (std::size_t first = 0; first < bodies_.size(); ++first)
    for (std::size_t partner = 0; partner < partners(); ++partner)
      close(first, partner);
  std::stable_sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.time < b.time; });
}

void PairContacts::processCollision(const btCollisionObjectWrapper* one,
                                    const btCollisionObjectWrapper* other, const btDispatcherInfo&,
                                    btManifoldResult*) {
  manifold_->clearManifold();
  const btCollisionObject *first = one->getCollisionObject(), *second = other->getCollisionObject();
  // The ball comes first, and what stands still comes last.
  const auto rank = [](const btCollisionObject* object) {
    const Kind kind = tag_of(object).kind;
    return kind == Kind::ball ? 0 : kind == Kind::pin ? 1 : 2;
  };
  const bool swapped = rank(first) > rank(second);
  if (swapped) std::swap(first, second);
  const Tag &a = tag_of(first), &b = tag_of(second);

  Contacts contacts;
  if (b.kind == Kind::still) {
    if (a.kind == Kind::ball)
      find_ball_and_lane(eigen(first->getWorldTransform().getOrigin()), a.radius, a.stage->surroundings(),
                         contacts);
    else
      find_pin_and_lane(place_of(first), a.stage->surroundings(), contacts);
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
    const Material material = a.stage->material(a.kind, contact.with);
    point.m_combinedFriction = material.friction;
    point.m_combinedRestitution = material.restitution;
    point.m_partId0 = swapped;
    point.m_index0 = static_cast<int>(contact.with);
    manifold_->addManifoldPoint(point);
    a.stage->note_contact(*btRigidBody::upcast(first), *btRigidBody::upcast(second), contact);
  }
}

}  // namespace

// --- The throw
// ----------------------------------------------------------------------------------------------

class Deck::Bodies {
 public:
  explicit Bodies(const DeckSettings& given)
      : settings(given),
        pin(pin_body()),
        deck(given.rack.size() + 1, {.pit = given.pit_cushion}, materials(given, given.cushion_restitution)),
        down(given.rack.size()) {
    CHECK(given.impact_rate % given.settle_rate == 0, given.impact_rate, given.settle_rate);
  }

  static std::array<Material, 4> materials(const DeckSettings& settings, double cushion_restitution) {
    std::array<Material, 4> rows;
    rows[kBallLane] = {settings.ball_lane_friction, kLaneBallRestitution};
    rows[kBallCushion] = {0.5, 0.05};
    rows[kPinCushion] = {0.3, cushion_restitution};
    rows[kPit] = {0.5, 0.1};
    return rows;
  }

  void set(const Throw& thrown);
  void step();
  void latch();
  void release_leavers();
  void move_to_pit(std::size_t body);
  void slow_down();
  btVector3 pin_inertia() const {
    return {pin.transverse_inertia, pin.axial_inertia, pin.transverse_inertia};
  }
  Stage& make_pit();
  const btRigidBody& find(std::size_t body) const {
    if (const btRigidBody* on_deck = deck.body(body)) return *on_deck;
    const btRigidBody* in_pit = pit ? pit->body(body) : nullptr;
    CHECK(in_pit, body);
    return *in_pit;
  }

  DeckSettings settings;
  PinBody pin;
  Stage deck;
  std::unique_ptr<Stage> pit;  ///< where what has left is watched
  Throw thrown;
  std::int64_t ticks = 0;
  bool ball_left = false;
  std::vector<bool> down;
  double first_contact = 0;
  bool playing_out = false;
  std::int64_t played_out_from = 0;
};

Deck::Deck(const DeckSettings& settings) {
  set_bullet_globals();
  bodies_ = std::make_unique<Bodies>(settings);
}
Deck::~Deck() = default;

void Deck::Bodies::set(const Throw& given) {
  thrown = given;
  CHECK(thrown.offsets.size() == settings.rack.size(), thrown.offsets.size());
  ticks = thrown.start;
  ball_left = playing_out = false;
  std::fill(down.begin(), down.end(), false);
  first_contact = std::numeric_limits<double>::infinity();
  deck.clear();
  deck.watched = thrown.watched;
  if (pit) pit->clear();

  const Ball& ball = thrown.ball;
  const btVector3 inertia(ball.inertia(), ball.inertia(), ball.inertia());
  const btTransform at(btQuaternion::getIdentity(), bullet(thrown.motion.position));
  btRigidBody& body = deck.add(Kind::ball, 0, ball.mass, inertia, ball.radius, at);
  body.setLinearVelocity(bullet(thrown.motion.linear_velocity));
  body.setAngularVelocity(bullet(thrown.motion.angular_velocity));
  body.setActivationState(DISABLE_DEACTIVATION);

  for (std::size_t i = 0; i < settings.rack.size(); ++i) {
    const Vector3d place =
        pin_spot(settings.rack[i]) + thrown.offsets[i] + Vector3d(0, pin.centre_of_mass, 0);
    btRigidBody& standing = deck.add(Kind::pin, i + 1, thrown.pins_fixed ? 0 : kPinMass,
                                     thrown.pins_fixed ? btVector3(0, 0, 0) : pin_inertia(), 0,
                                     btTransform(btQuaternion::getIdentity(), bullet(place)));
    standing.setActivationState(ISLAND_SLEEPING);
  }
}

void Deck::Bodies::step() {
  // Long steps begin where a long step would have begun all along, so that frames fall on steps.
  const std::int64_t ratio = settings.impact_rate / settings.settle_rate;
  const std::int64_t step_ticks = ball_left && ticks % ratio == 0 ? ratio : 1;
  const double seconds = static_cast<double>(step_ticks) / settings.impact_rate;
  deck.step(seconds);
  if (pit) pit->step(seconds);
  ticks += step_ticks;
  const double time = static_cast<double>(ticks) / settings.impact_rate;
  if (deck.ball_touches_pin && first_contact > time) first_contact = time;
  if (thrown.watched) {
    deck.gather_hits(time);
    if (pit) pit->gather_hits(time);
  }
  latch();
  release_leavers();
  if (playing_out) slow_down();
}

void Deck::Bodies::slow_down() {
  if (!ball_left) {
    played_out_from = ticks;
    return;
  }
  const double elapsed = static_cast<double>(ticks - played_out_from) / settings.impact_rate;
  for (Stage* stage : {&deck, pit.get()})
    for (std::size_t i = 0; stage && i <= down.size(); ++i) {
      btRigidBody* body = stage->body(i);
      if (!body || body->isStaticObject()) continue;
      const bool slow = body->getLinearVelocity().length2() < kSlow * kSlow;
      const double least = stage == pit.get() ? kPitDamping : kRollingDamping;
      const double damping = least + kGrowingDamping * elapsed + (slow ? kSlowDamping : 0);
      stage->damp(i, damping, damping);
      body->setSleepingThresholds(kRestSpeed, kRestTurn);
    }
}

void Deck::Bodies::latch() {
  for (std::size_t i = 0; i < down.size(); ++i) {
    btRigidBody* body = deck.body(i + 1);
    if (!body || (!down[i] && !body->isActive())) continue;
    const btVector3& at = body->getCenterOfMassPosition();
    if (!down[i])
      down[i] = body->getWorldTransform().getBasis()[1][1] < kDown || at.y() < pin.centre_of_mass - kSunk ||
                std::abs(at.z()) > kLaneHalfWidth + kOffLane || at.x() > kDeckEnd + kOffLane;
    if (down[i]) {
      const double extra = at.y() < kLow ? kRollingDamping : 0;
      deck.damp(i + 1, kPinDamping + extra, kPinSpinDamping + extra);
    }
  }
}

void Deck::Bodies::release_leavers() {
  if (const btRigidBody* ball = deck.body(0);
      ball && ball->getCenterOfMassPosition().x() > kDeckEnd + kBallLeaves) {
    ball_left = true;
    if (!settings.pit_cushion) move_to_pit(0);
  }
  if (settings.pit_cushion) {
    // What lies in the pit has carpet under it.
    if (btRigidBody* ball = deck.body(0); ball && ball_left) {
      deck.damp(0, kPitDamping, kPitDamping);
      if (ball->getActivationState() == DISABLE_DEACTIVATION) ball->forceActivationState(ACTIVE_TAG);
    }
    return;
  }
  for (std::size_t i = 1; i <= down.size(); ++i)
    if (const btRigidBody* body = deck.body(i))
      if (const btVector3& at = body->getCenterOfMassPosition();
          at.x() > kDeckEnd + kPinLeaves || at.y() < kFallen)
        move_to_pit(i);
}

Stage& Deck::Bodies::make_pit() {
  if (!pit) {
    pit = std::make_unique<Stage>(settings.rack.size() + 1, Surroundings{.pit = true},
                                  materials(settings, 0.05));
    pit->clear();
  }
  pit->watched = true;
  return *pit;
}

void Deck::Bodies::move_to_pit(std::size_t index) {
  if (thrown.watched) {
    const btRigidBody& from = *deck.body(index);
    const bool is_ball = index == 0;
    const double inertia = thrown.ball.inertia();
    btRigidBody& to =
        make_pit().add(is_ball ? Kind::ball : Kind::pin, index, is_ball ? thrown.ball.mass : kPinMass,
                       is_ball ? btVector3(inertia, inertia, inertia) : pin_inertia(), thrown.ball.radius,
                       from.getWorldTransform());
    to.setLinearVelocity(from.getLinearVelocity());
    to.setAngularVelocity(from.getAngularVelocity());
    pit->damp(index, kPitDamping, kPitDamping);
  }
  deck.remove(index);
}

void Deck::set(const Throw& thrown) {
  bodies_->set(thrown);
}
void Deck::step() {
  bodies_->step();
}
std::int64_t Deck::ticks() const {
  return bodies_->ticks;
}
double Deck::time() const {
  return static_cast<double>(bodies_->ticks) / bodies_->settings.impact_rate;
}

bool Deck::exploded() const {
  for (std::size_t i = 0; i <= bodies_->down.size(); ++i)
    if (const btRigidBody* body = bodies_->deck.body(i)) {
      const double speed = body->getLinearVelocity().length2();
      if (!(speed < kImpossibleSpeed * kImpossibleSpeed) ||
          !std::isfinite(body->getCenterOfMassPosition().length2()))
        return true;
    }
  return false;
}

bool Deck::decided() const {
  constexpr double kQuiet = 0.03, kQuietTurn = 0.1;  // [m/s], [rad/s]
  constexpr double kUpright = 0.99982;               // cosine of 1.1 degrees
  constexpr double kReach = 0.30, kHorizon = 0.8;    // [m], [s]
  const Bodies& all = *bodies_;
  if (all.thrown.pins_fixed) return true;
  if (down_count() == static_cast<int>(all.down.size())) return true;
  if (!all.ball_left) return false;
  for (std::size_t i = 0; i < all.down.size(); ++i) {
    if (all.down[i]) continue;
    const btRigidBody& standing = *all.deck.body(i + 1);
    if (standing.isActive()) {
      // A turn about its own axis cannot tip it.
      const btVector3 axis = standing.getWorldTransform().getBasis().getColumn(1),
                      turn = standing.getAngularVelocity();
      if (standing.getLinearVelocity().length2() > kQuiet * kQuiet ||
          turn.cross(axis).length2() > kQuietTurn * kQuietTurn || axis.y() < kUpright)
        return false;
    }
    // Nothing that moves may reach it.
    for (std::size_t k = 0; k <= all.down.size(); ++k) {
      const btRigidBody* other = all.deck.body(k);
      if (!other || !other->isActive() || (k > 0 && !all.down[k - 1])) continue;
      const double speed = other->getLinearVelocity().length();
      if (speed < kQuiet) continue;
      const double distance =
          (other->getCenterOfMassPosition() - standing.getCenterOfMassPosition()).length();
      if (distance < kReach + kHorizon * speed) return false;
    }
  }
  return true;
}

void Deck::play_out() {
  Bodies& all = *bodies_;
  for (std::size_t i = 0; i < all.down.size(); ++i)
    if (!all.down[i]) all.deck.fix(i + 1);
  all.playing_out = true;
  all.played_out_from = all.ticks;
}

bool Deck::at_rest() const {
  const bool rest = bodies_->ball_left && bodies_->deck.asleep() && (!bodies_->pit || bodies_->pit->asleep());
  return rest;
}

bool Deck::is_down(std::size_t pin) const {
  return bodies_->down[pin];
}
int Deck::down_count() const {
  return static_cast<int>(std::count(bodies_->down.begin(), bodies_->down.end(), true));
}
double Deck::first_contact() const {
  return bodies_->first_contact;
}

Pose Deck::pose(std::size_t body) const {
  const btTransform& at = bodies_->find(body).getWorldTransform();
  const btQuaternion turn = at.getRotation();
  return {.position = eigen(at.getOrigin()),
          .rotation = Eigen::Quaterniond(turn.w(), turn.x(), turn.y(), turn.z()).normalized()};
}

Motion Deck::motion(std::size_t body) const {
  const btRigidBody& found = bodies_->find(body);
  return {.position = eigen(found.getCenterOfMassPosition()),
          .linear_velocity = eigen(found.getLinearVelocity()),
          .angular_velocity = eigen(found.getAngularVelocity())};
}

const std::vector<Hit>& Deck::hits() const {
  Stage& deck = bodies_->deck;
  if (bodies_->pit) {
    bodies_->pit->finish_hits();
    deck.hits.insert(deck.hits.end(), bodies_->pit->hits.begin(), bodies_->pit->hits.end());
    bodies_->pit->hits.clear();
  }
  deck.finish_hits();
  return deck.hits;
}

double Deck::mechanical_energy() const {
  double energy = 0;
  for (std::size_t i = 0; i <= bodies_->down.size(); ++i) {
    const btRigidBody* body = bodies_->deck.body(i);
    if (!body || body->isStaticObject()) continue;
    const double mass = 1 / body->getInvMass();
    const btVector3 spin =
        body->getAngularVelocity() * body->getWorldTransform().getBasis();  // in its own frame
    const btVector3 inverse = body->getInvInertiaDiagLocal();
    for (int k = 0; k < 3; ++k)
      energy += 0.5 * spin[k] * spin[k] / inverse[k];
    energy +=
        mass * (0.5 * body->getLinearVelocity().length2() + kGravity * body->getCenterOfMassPosition().y());
  }
  return energy;
}

void Deck::wake() {
  for (std::size_t i = 1; i <= bodies_->down.size(); ++i)
    if (btRigidBody* body = bodies_->deck.body(i)) body->setActivationState(DISABLE_DEACTIVATION);
}

}  // namespace retake::bowling
