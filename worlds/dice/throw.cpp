// See throw.h.
#include "worlds/dice/throw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "worlds/dice/view.h"
#include "worlds/gravity.h"
#include "worlds/recorder.h"

namespace retake::dice {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kFrameRate = 60;  // [frames/s]

// The measures: these, then those of each die.
enum MeasureIndex : std::size_t { kSettlingTime, kTouchedPoints, kDiceMet, kFirstOfDice };
enum DieMeasure : std::size_t { kTopFace, kRestX, kRestZ, kDieMeasures };

class Throws final : public Physics {
 public:
  Throws(std::shared_ptr<const DiceModel> model, const EngineSettings& engine, const DieShape& shape)
      : model_(std::move(model)), tumbler_(engine, shape, model_->settings().table) {
    for (std::size_t die = 0; die < model_->settings().dice; ++die)
      names_.push_back(die_name(die));
    for (const Look& look : look_times(model_->settings()))
      look_steps_.push_back(std::llround(look.seconds / engine.time_step));
  }

  std::unique_ptr<retake::Run> make_run() const override { return std::make_unique<Tumble>(); }

  SimulationOutcome simulate(const State& state, const Recording& recording, Animation& animation,
                             std::span<double> measures) override {
    throw_ = model_->read(state);
    begin(animation);
    if (is_out_of_reach(recording, animation)) return {.end = SimulationEnd::stopped};

    // Tumble, from the run of the current State where there is one.
    auto* run = static_cast<Tumble*>(recording.record);
    if (!run && recording.frames) run = &run_;
    const auto* record = static_cast<const Tumble*>(recording.current_run);
    if (record && !record->complete) record = nullptr;
    const TumbleOutcome outcome = tumbler_.simulate(
        throw_.scene, record, run,
        [&](std::span<const Hit> hits) {
          for (std::size_t i = animation.events.size(); i < hits.size(); ++i)
            animation.events.push_back(event(hits[i]));
          return is_out_of_reach(recording, animation);
        },
        looks_for(recording.watch), recording.interruption);
    if (outcome.end != TumbleEnd::rests)
      return ended(outcome.end == TumbleEnd::stopped ? SimulationEnd::stopped : SimulationEnd::failed,
                   outcome);

    // Tell what happened.
    settle(outcome.step_count, animation);
    measure(outcome.step_count, animation, measures);
    if (recording.frames) {
      record_frames(*run, animation);
      write_scene(tumbler_.shape(), throw_, went(*run), tumbler_.table(), animation);
    }
    return ended(SimulationEnd::complete, outcome);
  }

 private:
  std::size_t dice_count() const { return throw_.scene.dice.size(); }
  double seconds(std::int64_t steps) const {
    return static_cast<double>(steps) * tumbler_.engine().time_step;
  }
  Pose placed(std::size_t die, const Vector3d& position, const Quaterniond& rotation) const {
    return {.position = throw_.placement.point(position),
            .rotation = (throw_.placement.rotation(rotation) * paints()[throw_.paint[die]]).normalized()};
  }
  Pose placed(std::size_t die, const DieState& state) const {
    return placed(die, state.position, state.rotation);
  }

  /// A die is looked at as it rolls.
  Looks looks_for(Watch* watch) const {
    if (!watch) return {};
    return {.die = watch->body(),
            .steps = look_steps_,
            .goes_on =
                [this, watch](std::size_t which, const DieState& die) {
                  const double rolls_on = look_times(model_->settings())[which].rolls_on;
                  const DieState& start = throw_.scene.dice[watch->body()].state;
                  return watch->goes_on(which, seconds(look_steps_[which]), look_at(start, die, rolls_on));
                },
            .may_meet = watch->may_meet()};
  }

  void begin(Animation& animation) const {
    begin_animation(animation, kFrameRate, dice_count());
    for (std::size_t die = 0; die < dice_count(); ++die) {
      Track& track = animation.tracks[die];
      track.start = placed(die, throw_.scene.dice[die].state);
      track.rest = track.start;
      track.from = seconds(throw_.scene.dice[die].step);
      track.name = names_[die];
    }
  }

  /// Steps of single dice are shares of the world's.
  SimulationOutcome ended(SimulationEnd end, const TumbleOutcome& outcome) const {
    const double simulated = seconds(outcome.stepped) / static_cast<double>(dice_count());
    return {.end = end,
            .simulated_seconds = simulated,
            .skipped_seconds = std::max(seconds(outcome.step_count) - simulated, 0.0)};
  }

  ContactEvent event(const Hit& hit) const {
    const std::size_t other =
        hit.other == kTable ? table_body(dice_count()) : static_cast<std::size_t>(hit.other);
    return {.time = seconds(hit.step + 1),
            .bodies = {static_cast<std::size_t>(hit.die), other},
            .impulse = hit.impulse,
            .position = throw_.placement.point(hit.point),
            .normal = throw_.placement.direction(hit.normal)};
  }

  /// A die that rests may be hit by another one; so none rests for good before all do.
  void settle(std::int64_t last_step, Animation& animation) const {
    for (std::size_t die = 0; die < dice_count(); ++die) {
      Track& track = animation.tracks[die];
      track.rest = placed(die, tumbler_.states()[die]);
      track.settled = seconds(last_step);
    }
  }

  void measure(std::int64_t last_step, const Animation& animation, std::span<double> measures) const {
    const auto met = [](const Hit& hit) { return hit.other != kTable; };
    const std::span<const Hit> hits = tumbler_.hits();
    measures[kSettlingTime] = seconds(last_step);
    std::size_t touched = 0;
    for (std::size_t die = 0; die < dice_count(); ++die)
      touched += tumbler_.touch_count(die);
    measures[kTouchedPoints] = static_cast<double>(touched);
    measures[kDiceMet] = std::any_of(hits.begin(), hits.end(), met) ? 1 : 0;
    for (std::size_t die = 0; die < dice_count(); ++die) {
      const Pose& rest = animation.tracks[die].rest;
      const int face = top_face(rest.rotation);
      const std::span<double> of_die = measures.subspan(kFirstOfDice);
      of_die[kTopFace * dice_count() + die] = face == 0 ? kAbsent : face;
      of_die[kRestX * dice_count() + die] = rest.position.x();
      of_die[kRestZ * dice_count() + die] = rest.position.z();
    }
  }

  /// Poses between steps by interpolation.
  void record_frames(const Tumble& run, Animation& animation) const {
    const double steps_a_frame = 1 / (kFrameRate * tumbler_.engine().time_step);
    const auto last = static_cast<double>(run.step_count);
    animation.frames = frames_until(seconds(run.step_count), kFrameRate);
    for (std::size_t die = 0; die < dice_count(); ++die) {
      TrackWriter track(animation.tracks[die], animation.frames);
      for (std::size_t frame = 0; frame < animation.frames; ++frame)
        track.add(pose_at(run, die, std::min(static_cast<double>(frame) * steps_a_frame, last)));
      track.rest(animation.tracks[die].rest);
    }
  }

  static std::vector<DieState> went(const Tumble& run) {
    std::vector<DieState> all;
    for (const auto& path : run.paths)
      all.insert(all.end(), path->states.begin(), path->states.end());
    return all;
  }

  /// Until its launch a die is where it is launched.
  Pose pose_at(const Tumble& run, std::size_t die, double steps) const {
    if (steps < static_cast<double>(run.paths[die]->launch_step))
      return placed(die, throw_.scene.dice[die].state);
    const auto whole = static_cast<std::int64_t>(std::floor(steps));
    const DieState& begin = run.paths[die]->at(whole);
    if (whole == run.step_count) return placed(die, begin);
    const DieState& end = run.paths[die]->at(whole + 1);
    const double share = steps - static_cast<double>(whole);
    Eigen::Vector4d turn = end.rotation.coeffs();
    if (turn.dot(begin.rotation.coeffs()) < 0) turn = -turn;
    turn = (1 - share) * begin.rotation.coeffs() + share * turn;
    return placed(die, begin.position + share * (end.position - begin.position),
                  Quaterniond(turn).normalized());
  }

  std::shared_ptr<const DiceModel> model_;
  Tumbler tumbler_;
  std::vector<std::string> names_;  ///< of the dice
  std::vector<std::int64_t> look_steps_;
  // The throw under way.
  DiceThrow throw_;
  Tumble run_;  ///< of throws that nobody else records
};

}  // namespace

LookFeatures look_at(const DieState& start, const DieState& now, double rolls_on) {
  const Vector3d heading = Vector3d(start.linear_velocity.x(), 0, start.linear_velocity.z()).normalized();
  const Vector3d across(-heading.z(), 0, heading.x()), velocity = now.linear_velocity;
  const Vector3d rest = now.position - start.position + rolls_on * velocity;
  return {rest.dot(heading), rest.dot(across), std::hypot(velocity.x(), velocity.z())};
}

std::array<Look, 7> look_times(const DiceSettings& settings) {
  // After the mean time of the fall, 0.15 s with default settings; measured with those on 6,000 throws.
  constexpr std::array<Look, 7> kAfterFall = {{{0.03, 0.211, 0.031},
                                               {0.06, 0.184, 0.030},
                                               {0.09, 0.165, 0.029},
                                               {0.13, 0.148, 0.025},
                                               {0.175, 0.129, 0.018},
                                               {0.225, 0.110, 0.014},
                                               {0.285, 0.093, 0.009}}};
  const double fall = std::sqrt(2 * std::max(settings.drop_height - 0.01, 0.01) / kGravity);
  std::array<Look, 7> looks = kAfterFall;
  for (Look& look : looks)
    look.seconds += fall;
  return looks;
}

std::vector<Measure> throw_measures(std::size_t dice) {
  std::vector<Measure> measures = {
      {.name = "settling_time", .unit = "s", .summary = "When the last die comes to rest"},
      {.name = "touched_points",
       .kind = Measure::Kind::integer,
       .summary = "How many of the table's control points the dice touch, each die by itself"},
      {.name = "dice_met", .kind = Measure::Kind::flag, .summary = "Whether dice hit each other"}};
  const auto add = [&](const Measure& of_a_die) {
    for (std::size_t die = 1; die <= dice; ++die) {
      measures.push_back(of_a_die);
      if (dice == 1) continue;
      measures.back().name += "_" + std::to_string(die);
      measures.back().list = of_a_die.name;
    }
  };
  const std::string each = dice == 1 ? "the die" : "each die";
  add({.name = "top_face",
       .kind = Measure::Kind::integer,
       .summary = "The number on top of " + each + "; none while it leans"});
  add({.name = "rest_x", .unit = "m", .summary = "Where " + each + " comes to rest, to the right"});
  add({.name = "rest_z", .unit = "m", .summary = "Where " + each + " comes to rest, towards the viewer"});
  return measures;
}

std::unique_ptr<Physics> make_throws(std::shared_ptr<const DiceModel> model, const EngineSettings& engine,
                                     const DieShape& shape) {
  return std::make_unique<Throws>(std::move(model), engine, shape);
}

}  // namespace retake::dice
