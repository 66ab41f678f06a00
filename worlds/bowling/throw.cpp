// See throw.h.
#include "worlds/bowling/throw.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "worlds/bowling/view.h"
#include "worlds/recorder.h"

namespace retake::bowling {
namespace {

using Eigen::Vector3d;

constexpr double kHandOver = 0.4;      // [m] before the first pin, where Bullet takes over
constexpr double kClearance = 0.02;    // [m], chosen: far more than closed form and Bullet differ by
constexpr double kWidestPin = 0.0606;  // [m], just beyond the profile's widest ring
constexpr double kLongestPlay = 15;    // [s] on the deck; what is not decided by then is a failure
constexpr double kLongestRest = 8;     // [s] from the decision
constexpr int kFrameRate = 60;         // [frames/s]

enum MeasureIndex {
  kPinsDown,
  kDownCount,
  kEntryOffset,
  kEntryAngle,
  kEntrySpeed,
  kFirstContact,
  kFallOrder
};

/// How a roll ends, as far as the pins are concerned.
struct Arrival {
  std::int64_t start = 0;  ///< when the deck takes over, in its steps
  bool touches = false;    ///< whether the ball can touch a pin at all
};

class Throws final : public Physics {
 public:
  Throws(std::shared_ptr<const ReleaseModel> releases, const LaneFriction& friction,
         const DeckSettings& settings)
      : releases_(std::move(releases)), friction_(friction), settings_(settings), deck_(settings) {
    first_pin_ = kDeckEnd;
    for (const int pin : settings.rack)
      first_pin_ = std::min(first_pin_, pin_spot(pin).x());
  }

  SimulationOutcome simulate(const State& state, const Recording& recording, Animation& animation,
                             std::span<double> measures) override {
    const Release release = releases_->read(state);
    const Roll roll(release.ball, release.motion, friction_);
    const Arrival arrival = arrive(roll, release.ball);
    begin(release, recording, animation);

    // What the pins do.
    if (arrival.touches || recording.frames)
      deck_.set({.ball = release.ball,
                 .motion = roll.at(seconds(arrival.start)),
                 .start = arrival.start,
                 .offsets = release.offsets,
                 .watched = recording.frames,
                 .pins_fixed = !arrival.touches});
    SimulationOutcome outcome{.end = SimulationEnd::complete};
    if (recording.frames) record_roll(roll, arrival.start);
    if (arrival.touches) outcome = play(recording, animation);
    if (outcome.end != SimulationEnd::complete) return outcome;

    measure(roll, arrival.touches, measures);
    for (std::size_t i = 0; i < settings_.rack.size(); ++i) {
      Track& track = animation.tracks[kFirstPinTrack + i];
      if (!track.fell && arrival.touches) track.rest = deck_.pose(1 + i);
    }
    if (!recording.frames) return outcome;
    if (is_decided_against(recording, animation)) {
      outcome.end = SimulationEnd::stopped;
      return outcome;
    }
    record_rest(roll, release.ball, seconds(arrival.start), recording, animation);
    return outcome;
  }

 private:
  double seconds(std::int64_t ticks) const { return static_cast<double>(ticks) / settings_.impact_rate; }

  Arrival arrive(const Roll& roll, const Ball& ball) const {
    const double hand_over = roll.time_at(first_pin_ - kHandOver);
    if (roll.gutter_time() < hand_over || !std::isfinite(hand_over)) {
      const double edge = std::min(roll.gutter_time(), roll.time_at(kDeckEnd));
      return {.start = static_cast<std::int64_t>(std::floor(edge * settings_.impact_rate)), .touches = false};
    }
    // The path is all but straight over the deck: what stays clear of a pin before, beside and behind it does
    // so all the way. Beyond the lane's edge the ball only sinks away.
    const double touching = ball.radius + kWidestPin;
    bool touches = false;
    for (const int pin : settings_.rack) {
      const Vector3d spot = pin_spot(pin);
      double left = std::numeric_limits<double>::infinity(), right = -left;
      for (const double ahead : {-touching, 0.0, touching}) {
        const double time = roll.time_at(spot.x() + ahead);
        const double z = roll.at(std::isfinite(time) ? time : roll.gutter_time()).position.z() - spot.z();
        left = std::min(left, z);
        right = std::max(right, z);
      }
      touches |= left < touching + kClearance && right > -touching - kClearance;
    }
    return {.start = static_cast<std::int64_t>(std::ceil(hand_over * settings_.impact_rate)),
            .touches = touches};
  }

  void begin(const Release& release, const Recording& recording, Animation& animation) {
    const std::size_t pins = settings_.rack.size();
    begin_animation(animation, kFrameRate, kFirstPinTrack + pins);
    if (recording.frames) frames_.clear();
    const double height = pin_body().centre_of_mass;
    for (std::size_t i = 0; i < pins; ++i) {
      Track& track = animation.tracks[kFirstPinTrack + i];
      track.start = {.position = pin_spot(settings_.rack[i]) + release.offsets[i] + Vector3d(0, height, 0)};
      track.rest = track.start;
      track.name = pin_name(settings_.rack[i]);
    }
    Track& ball = animation.tracks[0];
    ball.name = kBallName;
    ball.start = ball.rest = {.position = release.motion.position};
  }

  /// Steps until the outcome is decided, or can no longer be what is needed.
  SimulationOutcome play(const Recording& recording, Animation& animation) {
    const double start = deck_.time();
    const auto ended = [&](SimulationEnd end) {
      return SimulationOutcome{.end = end, .simulated_seconds = deck_.time() - start};
    };
    fallen_.clear();
    while (!deck_.decided()) {
      recording.check_interruption();
      deck_.step();
      if (deck_.exploded() || deck_.time() > start + kLongestPlay) return ended(SimulationEnd::failed);
      if (recording.frames) record_frame();
      if (static_cast<std::size_t>(deck_.down_count()) > fallen_.size()) {
        for (std::size_t i = 0; i < settings_.rack.size(); ++i) {
          auto& fell = animation.tracks[kFirstPinTrack + i].fell;
          if (!deck_.is_down(i) || fell) continue;
          fallen_.push_back(settings_.rack[i]);
          fell = deck_.time();
        }
        if (is_out_of_reach(recording, animation)) return ended(SimulationEnd::stopped);
      }
    }
    // What has fallen has to stay so: bounds rely on it, and so does whoever watches.
    if (deck_.stands_again()) return ended(SimulationEnd::failed);
    return ended(SimulationEnd::complete);
  }

  /// Whether the decided outcome rules out what is needed, however it is played to rest: terms that read no
  /// frames have their last word.
  static bool is_decided_against(const Recording& recording, const Animation& decided) {
    double bound = 0;
    for (const auto& term : recording.terms) {
      std::vector<double> measures(term->measures().size());
      bound += term->reads_frames() ? term->upper_bound(decided) : term->score(decided, measures).log_density;
    }
    return bound <= recording.needed;
  }

  void measure(const Roll& roll, bool touches, std::span<double> measures) const {
    const std::span<const int> down = touches ? std::span<const int>(fallen_) : std::span<const int>();
    measures[kPinsDown] = set_of(down);
    measures[kDownCount] = static_cast<double>(down.size());
    for (std::size_t i = 0; i < settings_.rack.size(); ++i)
      measures[kFallOrder + i] = i < down.size() ? down[i] : kAbsent;
    // The path as it would cross the head pin's spot if nothing stood there.
    const double entry = roll.time_at(0);
    const bool enters = std::isfinite(entry) && entry <= roll.gutter_time();
    const Motion motion = roll.at(enters ? entry : 0);
    measures[kEntryOffset] = enters ? motion.position.z() : kAbsent;
    measures[kEntryAngle] =
        enters ? std::atan2(motion.linear_velocity.z(), motion.linear_velocity.x()) : kAbsent;
    measures[kEntrySpeed] =
        enters ? std::hypot(motion.linear_velocity.x(), motion.linear_velocity.z()) : kAbsent;
    const double contact = touches ? deck_.first_contact() : kAbsent;
    measures[kFirstContact] = std::isfinite(contact) ? contact : kAbsent;
  }

  // --- What a viewer sees ---------------------------------------------------------------------------

  /// The frames before the deck takes over. The deck's ball starts unturned; `turned_` is how far it had
  /// come.
  void record_roll(const Roll& roll, std::int64_t start) {
    const std::int64_t between = settings_.impact_rate / kFrameRate;
    turned_ = Eigen::Quaterniond::Identity();
    for (std::int64_t tick = 0; tick <= start; ++tick) {
      const Motion motion = roll.at(seconds(tick));
      if (tick % between == 0) add_frame({.position = motion.position, .rotation = turned_});
      if (tick == start) break;
      const Vector3d turn =
          roll.at(seconds(tick) + 0.5 / settings_.impact_rate).angular_velocity / settings_.impact_rate;
      const double angle = turn.norm();
      if (angle > 0) turned_ = (Eigen::AngleAxisd(angle, turn / angle) * turned_).normalized();
    }
  }

  void add_frame(const Pose& ball) {
    std::vector<Pose>& poses = frames_.emplace_back();
    poses.push_back(ball);
    for (std::size_t i = 1; i <= settings_.rack.size(); ++i)
      poses.push_back(deck_.pose(i));
  }

  void record_frame() {
    if (deck_.ticks() % (settings_.impact_rate / kFrameRate) != 0) return;
    Pose ball = deck_.pose(0);
    ball.rotation = (ball.rotation * turned_).normalized();
    add_frame(ball);
  }

  /// Plays on until everything rests, and writes the animation. The deck took over from the roll at
  /// `hand_over` [s].
  void record_rest(const Roll& roll, const Ball& ball, double hand_over, const Recording& recording,
                   Animation& animation) {
    deck_.play_out();
    const double decided = deck_.time();
    while (!deck_.exploded() && deck_.time() < decided + kLongestRest) {
      recording.check_interruption();
      if (deck_.at_rest() && deck_.ticks() % (settings_.impact_rate / kFrameRate) == 0) break;
      deck_.step();
      if (!deck_.exploded()) record_frame();
    }
    write_frames(animation);
    write_scene(settings_.rack, ball.radius, animation);
    const std::size_t pins = settings_.rack.size();
    for (const Roll::Touch& touch : roll.touches())
      if (touch.time < hand_over && touch.impulse > 0)
        animation.events.push_back({.time = touch.time,
                                    .bodies = {0, still_body(Surface::lane, 0, pins)},
                                    .impulse = touch.impulse,
                                    .position = touch.position,
                                    .normal = Vector3d::UnitY()});
    for (const Hit& hit : deck_.hits()) {
      const bool still = hit.with != Surface::pin;
      const std::size_t other = still ? still_body(hit.with, hit.point.z(), pins) : hit.second;
      if (hit.time <= animation.duration())
        animation.events.push_back({.time = hit.time,
                                    .bodies = {hit.first, other},
                                    .impulse = hit.impulse,
                                    .position = hit.point,
                                    .normal = hit.normal});
    }
  }

  void write_frames(Animation& animation) const {
    animation.frames = frames_.size();
    for (std::size_t body = 0; body < animation.tracks.size(); ++body) {
      Track& track = animation.tracks[body];
      TrackWriter writer(track, frames_.size());
      for (const std::vector<Pose>& poses : frames_)
        writer.add(poses[body]);
      if (body == 0 || track.fell) writer.rest(frames_.back()[body]);
    }
  }

  std::shared_ptr<const ReleaseModel> releases_;
  LaneFriction friction_;
  DeckSettings settings_;
  Deck deck_;
  double first_pin_;
  std::vector<int> fallen_;                ///< the pins that are down, in the order in which they fell
  std::vector<std::vector<Pose>> frames_;  ///< of the ball, then the pins
  Eigen::Quaterniond turned_;
};

}  // namespace

std::vector<Measure> throw_measures(std::size_t pins) {
  std::vector<Measure> measures = {
      {.name = "pins_down", .kind = Measure::Kind::integer_set, .summary = "The pins that fall"},
      {.name = "down_count", .kind = Measure::Kind::integer, .summary = "How many pins fall"},
      {.name = "entry_offset",
       .unit = "m",
       .summary = "How far right of the middle the ball crosses the head pin's spot, were nothing there"},
      {.name = "entry_angle",
       .unit = "rad",
       .summary = "The ball's direction there, to the right of straight ahead"},
      {.name = "entry_speed", .unit = "m/s", .summary = "The ball's speed there"},
      {.name = "first_contact", .unit = "s", .summary = "When the ball first hits a pin"}};
  for (std::size_t i = 1; i <= pins; ++i)
    measures.push_back({.name = "fall_order_" + std::to_string(i),
                        .kind = Measure::Kind::integer,
                        .list = "fall_order",
                        .summary = "The pins in the order in which they fall"});
  return measures;
}

std::unique_ptr<Physics> make_throws(std::shared_ptr<const ReleaseModel> releases,
                                     const LaneFriction& friction, const DeckSettings& deck) {
  return std::make_unique<Throws>(std::move(releases), friction, deck);
}

}  // namespace retake::bowling
