// See deck.h.
#include "worlds/bowling/deck.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sampler/check.h"

namespace retake::bowling {
namespace {

using Eigen::Vector3d;

constexpr double kDown = 0.6;            // cosine of the tilt beyond which a pin has fallen
constexpr double kSunk = 0.06;           // [m] that its centre of mass has sunk
constexpr double kOffLane = 0.03;        // [m] beyond the lane's edge or the deck's end
constexpr double kBallLeaves = 0.15;     // [m] behind the deck's end, where it has no say any more
constexpr double kPinLeaves = 0.20;      // [m]
constexpr double kSunkInPit = -0.2;      // [m]; a pin so low has fallen behind the deck
constexpr double kImpossibleSpeed = 60;  // [m/s]
constexpr double kUpright = 0.99982;     // cosine of 1.1 degrees
constexpr double kStill = 0.01;          // [m/s] below which a tilted pin leans on something
constexpr double kStillTurn = 0.05;      // [rad/s]

constexpr double kLow = 0.12;          // [m]; a fallen pin whose centre is below lies and rolls
constexpr double kRollingDamping = 1;  // [1/s] more, for the resistance of rolling
constexpr double kPitDamping = 2;      // [1/s], the carpet
// Once it is decided, chosen to let everything come to rest softly and within seconds:
constexpr double kSlow = 0.3;          // [m/s]
constexpr double kSlowDamping = 4;     // [1/s] more of what is slower
constexpr double kGrowingDamping = 2;  // [1/s] more with every second
constexpr double kRestSpeed = 0.02;    // [m/s]; slower bodies fall asleep
constexpr double kRestTurn = 0.4;      // [rad/s]

constexpr double kPitRestitution = 0.05;  // of the curtain where nothing comes back from

}  // namespace

Deck::Deck(const DeckSettings& settings)
    : settings_(settings),
      standing_height_(pin_body().centre_of_mass),
      stage_({.bodies = 1 + settings.rack.size(),
              .surroundings = {.pit = settings.pit_cushion},
              .ball_lane_friction = settings.ball_lane_friction,
              .cushion_restitution = settings.cushion_restitution}),
      down_(settings.rack.size()) {
  CHECK(settings.impact_rate % settings.settle_rate == 0, settings.impact_rate, settings.settle_rate);
}
Deck::~Deck() = default;

void Deck::set(const Throw& thrown) {
  CHECK(thrown.offsets.size() == settings_.rack.size(), thrown.offsets.size());
  thrown_ = thrown;
  ticks_ = thrown.start;
  ball_left_ = playing_out_ = false;
  std::fill(down_.begin(), down_.end(), false);
  first_contact_ = std::numeric_limits<double>::infinity();
  stage_.clear(thrown.watched);
  if (pit_) pit_->clear(thrown.watched);

  stage_.add_ball(thrown.ball, {.position = thrown.motion.position}, thrown.motion);
  stage_.keep_awake(0);
  for (std::size_t i = 0; i < settings_.rack.size(); ++i) {
    const Vector3d place = pin_spot(settings_.rack[i]) + thrown.offsets[i] + Vector3d(0, standing_height_, 0);
    stage_.add_pin(1 + i, {.position = place}, {});
    if (thrown.pins_fixed) stage_.fix(1 + i);
    stage_.put_to_sleep(1 + i);
  }
}

void Deck::step() {
  // Long steps begin where a long step would have begun all along, so that frames fall on steps.
  const std::int64_t ratio = settings_.impact_rate / settings_.settle_rate;
  const std::int64_t step_ticks = ball_left_ && ticks_ % ratio == 0 ? ratio : 1;
  ticks_ += step_ticks;
  stage_.step(seconds(step_ticks), time());
  if (pit_) pit_->step(seconds(step_ticks), time());
  if (stage_.ball_has_touched_pin()) first_contact_ = std::min(first_contact_, time());
  latch_fallen();
  take_leavers();
  if (playing_out_) slow_down();
}

void Deck::latch_fallen() {
  for (std::size_t i = 0; i < down_.size(); ++i) {
    const std::size_t body = 1 + i;
    if (!stage_.has(body) || (!down_[i] && !stage_.is_active(body))) continue;
    const Vector3d at = stage_.position(body);
    if (!down_[i])
      down_[i] = stage_.axis(body).y() < kDown || at.y() < standing_height_ - kSunk ||
                 std::abs(at.z()) > kLaneHalfWidth + kOffLane || at.x() > kDeckEnd + kOffLane;
    if (!down_[i] && stage_.axis(body).y() < kUpright) {
      // Slow enough to fall asleep, a pin that totters is still about to fall over.
      const Motion motion = stage_.motion(body);
      if (motion.linear_velocity.squaredNorm() > kStill * kStill ||
          motion.angular_velocity.squaredNorm() > kStillTurn * kStillTurn)
        stage_.delay_sleep(body);
    }
    if (down_[i]) {
      const double extra = at.y() < kLow ? kRollingDamping : 0;
      stage_.damp(body, kPinDamping + extra, kPinSpinDamping + extra);
    }
  }
}

void Deck::take_leavers() {
  if (stage_.has(0) && stage_.position(0).x() > kDeckEnd + kBallLeaves) {
    ball_left_ = true;
    if (settings_.pit_cushion) {
      stage_.damp(0, kPitDamping, kPitDamping);
      stage_.let_sleep(0);
    } else {
      move_to_pit(0);
    }
  }
  if (settings_.pit_cushion) return;  // pins may come back
  for (std::size_t body = 1; body < bodies(); ++body)
    if (stage_.has(body))
      if (const Vector3d at = stage_.position(body); at.x() > kDeckEnd + kPinLeaves || at.y() < kSunkInPit)
        move_to_pit(body);
}

void Deck::move_to_pit(std::size_t body) {
  if (thrown_.watched) {
    if (!pit_) {
      pit_ = std::make_unique<Stage>(StageSettings{.bodies = bodies(),
                                                   .surroundings = {.pit = true},
                                                   .ball_lane_friction = settings_.ball_lane_friction,
                                                   .cushion_restitution = kPitRestitution});
      pit_->clear(true);
    }
    if (body == 0)
      pit_->add_ball(thrown_.ball, stage_.pose(0), stage_.motion(0));
    else
      pit_->add_pin(body, stage_.pose(body), stage_.motion(body));
    pit_->damp(body, kPitDamping, kPitDamping);
  }
  stage_.remove(body);
}

void Deck::slow_down() {
  if (!ball_left_) {
    played_out_from_ = ticks_;
    return;
  }
  const double growing = kGrowingDamping * seconds(ticks_ - played_out_from_);
  for (Stage* stage : {&stage_, pit_.get()})
    for (std::size_t body = 0; stage && body < bodies(); ++body) {
      if (!stage->has(body) || stage->is_fixed(body)) continue;
      const bool slow = stage->velocity(body).squaredNorm() < kSlow * kSlow;
      const double least = stage == &stage_ ? kRollingDamping : kPitDamping;
      const double damping = least + growing + (slow ? kSlowDamping : 0);
      stage->damp(body, damping, damping);
      stage->set_sleeping_speeds(body, kRestSpeed, kRestTurn);
    }
}

void Deck::play_out() {
  for (std::size_t i = 0; i < down_.size(); ++i)
    if (!down_[i]) stage_.fix(1 + i);
  playing_out_ = true;
  played_out_from_ = ticks_;
}

// --- What can be said of the throw ----------------------------------------------------------------

std::int64_t Deck::ticks() const {
  return ticks_;
}
double Deck::time() const {
  return seconds(ticks_);
}

bool Deck::exploded() const {
  for (std::size_t body = 0; body < bodies(); ++body)
    if (stage_.has(body) && (!(stage_.velocity(body).squaredNorm() < kImpossibleSpeed * kImpossibleSpeed) ||
                             !stage_.position(body).allFinite()))
      return true;
  return false;
}

bool Deck::decided() const {
  constexpr double kQuiet = 0.03, kQuietTurn = 0.1;  // [m/s], [rad/s]
  constexpr double kReach = 0.30, kHorizon = 0.8;    // [m], [s]
  if (thrown_.pins_fixed || down_count() == static_cast<int>(down_.size())) return true;
  if (!ball_left_) return false;
  for (std::size_t i = 0; i < down_.size(); ++i) {
    if (down_[i]) continue;
    const std::size_t standing = 1 + i;
    if (stage_.is_active(standing)) {
      // A turn about its own axis cannot tip it.
      const Motion motion = stage_.motion(standing);
      const Vector3d axis = stage_.axis(standing);
      if (motion.linear_velocity.squaredNorm() > kQuiet * kQuiet ||
          motion.angular_velocity.cross(axis).squaredNorm() > kQuietTurn * kQuietTurn || axis.y() < kUpright)
        return false;
    }
    // Nothing that moves may reach it.
    for (std::size_t other = 0; other < bodies(); ++other) {
      const bool stands = other > 0 && !down_[other - 1];
      if (stands || !stage_.has(other) || !stage_.is_active(other)) continue;
      const double speed = stage_.velocity(other).norm();
      if (speed < kQuiet) continue;
      if ((stage_.position(other) - stage_.position(standing)).norm() < kReach + kHorizon * speed)
        return false;
    }
  }
  return true;
}

bool Deck::at_rest() const {
  if (!ball_left_) return false;
  for (const Stage* stage : {static_cast<const Stage*>(&stage_), static_cast<const Stage*>(pit_.get())})
    for (std::size_t body = 0; stage && body < bodies(); ++body)
      if (stage->has(body) && !stage->is_fixed(body) && stage->is_active(body)) return false;
  return true;
}

bool Deck::stands_again() const {
  for (std::size_t i = 0; i < down_.size(); ++i) {
    const std::size_t body = 1 + i;
    if (!down_[i] || !stage_.has(body)) continue;
    const Vector3d at = stage_.position(body);
    const bool on_lane = at.x() < kDeckEnd && std::abs(at.z()) < kLaneHalfWidth;
    if (on_lane && stage_.axis(body).y() > kUpright && std::abs(at.y() - standing_height_) < 0.005)
      return true;
  }
  return false;
}

bool Deck::is_down(std::size_t pin) const {
  return down_[pin];
}
int Deck::down_count() const {
  return static_cast<int>(std::count(down_.begin(), down_.end(), true));
}
double Deck::first_contact() const {
  return first_contact_;
}

const Stage& Deck::stage_of(std::size_t body) const {
  if (stage_.has(body)) return stage_;
  CHECK(pit_ && pit_->has(body), body);
  return *pit_;
}
Pose Deck::pose(std::size_t body) const {
  return stage_of(body).pose(body);
}
Motion Deck::motion(std::size_t body) const {
  return stage_of(body).motion(body);
}

std::vector<Hit> Deck::hits() {
  std::vector<Hit> hits = stage_.finish_hits();
  if (pit_) hits.insert(hits.end(), pit_->finish_hits().begin(), pit_->finish_hits().end());
  std::stable_sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.time < b.time; });
  return hits;
}

double Deck::mechanical_energy() const {
  double energy = 0;
  for (std::size_t body = 0; body < bodies(); ++body)
    if (stage_.has(body)) energy += stage_.energy(body);
  return energy;
}

void Deck::wake() {
  for (std::size_t body = 1; body < bodies(); ++body)
    if (stage_.has(body)) stage_.keep_awake(body);
}

}  // namespace retake::bowling
