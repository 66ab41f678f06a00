// See pour.h.
#include "worlds/spelling/pour.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "worlds/impulse/playback.h"
#include "worlds/impulse/resimulation.h"
#include "worlds/recorder.h"
#include "worlds/spelling/view.h"

namespace retake::spelling {
namespace {

using Eigen::Vector3d;

constexpr double kFrameRate = 60;       // [frames/s]
constexpr double kLongestSettling = 6;  // [s] after the last drop; chosen: marbles take one

// The measures: these, then the bin of each marble, then the place of each in the order of coming to rest.
enum MeasureIndex : std::size_t { kActiveBalls, kDirectBalls, kSettlingTime };

class Pours final : public Physics {
 public:
  Pours(std::shared_ptr<const MarbleModel> marbles, std::shared_ptr<const Box> box,
        const PourSettings& settings)
      : marbles_(std::move(marbles)),
        box_(std::move(box)),
        settings_(settings),
        engine_(settings.engine, box_->make_surface()) {
    for (std::size_t marble = 0; marble < marbles_->marble_count(); ++marble)
      names_.push_back(marble_name(marble));
    const auto slots = static_cast<std::int64_t>(marbles_->marble_count());
    scene_.latest_step =
        slots * settings_.interval_steps +
        static_cast<std::int64_t>(std::lround(kLongestSettling / settings_.engine.time_step));
  }

  std::unique_ptr<retake::Run> make_run() const override { return std::make_unique<impulse::Run>(); }

  SimulationOutcome simulate(const State& state, const Recording& recording, Animation& animation,
                             std::span<double> measures) override {
    set_scene(marbles_->read(state));
    begin(animation);
    if (is_out_of_reach(recording, animation)) return {.end = SimulationEnd::stopped};

    // Simulate, from the run of the current State where there is one.
    auto* run = static_cast<impulse::Run*>(recording.record);
    if (!run && recording.frames) run = &run_;
    const auto* record = static_cast<const impulse::Run*>(recording.current_run);
    if (record && !record->complete) record = nullptr;
    const auto outcome = engine_.simulate(
        scene_, record, run,
        [&](const impulse::Rested& rested) {
          settle(rested, animation);
          return is_out_of_reach(recording, animation);
        },
        recording.interruption);

    // Tell what happened.
    if (outcome.end != impulse::RunEnd::rests)
      return ended(outcome.end == impulse::RunEnd::stopped ? SimulationEnd::stopped : SimulationEnd::failed,
                   outcome.body_steps);
    measure(animation, measures);
    if (recording.frames) record_frames(*run, animation);
    return ended(SimulationEnd::complete, outcome.body_steps);
  }

 private:
  double seconds(std::int64_t steps) const { return static_cast<double>(steps) * settings_.engine.time_step; }

  void set_scene(Drops drops) {
    scene_.bodies.clear();
    for (const auto& place : drops.places) {
      const auto step = static_cast<std::int64_t>(scene_.bodies.size()) * settings_.interval_steps;
      scene_.bodies.push_back(
          place ? std::optional(impulse::Drop{.step = step, .place = {place->x(), kDropHeight, place->y()}})
                : std::nullopt);
    }
    scene_.offsets = std::move(drops.offsets);
  }

  /// A track for each marble that takes part.
  void begin(Animation& animation) {
    tracks_.assign(scene_.bodies.size(), kNoTrack);
    std::size_t tracks = 0;
    for (std::size_t marble = 0; marble < scene_.bodies.size(); ++marble)
      if (scene_.bodies[marble]) tracks_[marble] = tracks++;
    begin_animation(animation, kFrameRate, tracks);
    for (std::size_t marble = 0; marble < scene_.bodies.size(); ++marble) {
      if (tracks_[marble] == kNoTrack) continue;
      Track& track = animation.tracks[tracks_[marble]];
      track.start = {.position = scene_.bodies[marble]->place};
      track.rest = track.start;
      track.from = seconds(scene_.bodies[marble]->step);
      track.name = names_[marble];
    }
    rested_.clear();
  }

  void settle(const impulse::Rested& rested, Animation& animation) {
    Track& track = animation.tracks[tracks_[rested.body]];
    track.rest.position = rested.position;
    track.settled = seconds(rested.step);
    rested_.push_back(rested);
  }

  /// Where only some marbles are stepped, the share of the time that they make is what was simulated.
  SimulationOutcome ended(SimulationEnd end, std::int64_t body_steps) const {
    const std::int64_t last = rested_.empty() ? 0 : rested_.back().step;
    const std::int64_t until = end == SimulationEnd::failed ? scene_.latest_step : last;
    std::vector<std::int64_t> ends(scene_.bodies.size(), until);
    for (const impulse::Rested& rested : rested_)
      ends[rested.body] = rested.step;
    std::int64_t all_steps = 0;
    for (std::size_t marble = 0; marble < scene_.bodies.size(); ++marble)
      if (const auto& drop = scene_.bodies[marble])
        all_steps += std::max(ends[marble] - drop->step, std::int64_t{0});
    if (all_steps == 0) return {.end = end};
    const double share = std::min(1.0, static_cast<double>(body_steps) / static_cast<double>(all_steps));
    return {.end = end,
            .simulated_seconds = share * seconds(until),
            .skipped_seconds = (1 - share) * seconds(until)};
  }

  void measure(const Animation& animation, std::span<double> measures) const {
    std::fill(measures.begin(), measures.end(), kAbsent);
    const std::size_t bins = kFirstBinMeasure, places = bins + scene_.bodies.size();
    double direct = 0;
    for (std::size_t i = 0; i < rested_.size(); ++i) {
      const std::size_t marble = rested_[i].body;
      measures[places + marble] = static_cast<double>(i + 1);
      const auto bin = box_->bin_of(rested_[i].position);
      if (!bin) continue;
      measures[bins + marble] = static_cast<double>(*bin);
      direct += *bin == bin_below(scene_.bodies[marble]->place) ? 1 : 0;
    }
    measures[kActiveBalls] = static_cast<double>(animation.tracks.size());
    measures[kDirectBalls] = direct;
    measures[kSettlingTime] = rested_.empty() ? 0 : seconds(rested_.back().step);
  }

  /// The bin over which a place is; half of each partition counts with it.
  std::size_t bin_below(const Vector3d& place) const {
    const Rectangle interior = box_->interior();
    const auto cell = [](double from, int count) {
      return std::clamp(static_cast<int>(std::floor((from + kPartition / 2) / kPitch)), 0, count - 1);
    };
    return box_->bin(cell(place.x() - interior.min_x, box_->columns()),
                     cell(place.z() - interior.min_z, box_->rows()));
  }

  // --- What a viewer sees ---------------------------------------------------------------------------

  void record_frames(const impulse::Run& run, Animation& animation) const {
    const std::size_t frames = impulse::frame_count(settings_.engine, run, kFrameRate);
    animation.frames = frames;
    std::vector<std::size_t> shown;
    for (std::size_t marble = 0; marble < tracks_.size(); ++marble) {
      if (tracks_[marble] == kNoTrack) continue;
      shown.push_back(marble);
      Track& track = animation.tracks[tracks_[marble]];
      impulse::write_track(settings_.engine, run, marble, kFrameRate, frames, track);
      track.rest.rotation = Eigen::Quaterniond(Eigen::Vector4d(track.rotations.rightCols<1>()));
    }
    write_scene(*box_, scene_.offsets, shown, animation);
    for (const impulse::Hit& hit : impulse::hits(settings_.engine, run))
      if (hit.time <= animation.duration())
        animation.events.push_back(
            {.time = hit.time,
             .bodies = {tracks_[hit.body], hit.other == impulse::kSurface
                                               ? still_body(*box_, hit.position, shown.size())
                                               : tracks_[static_cast<std::size_t>(hit.other)]},
             .impulse = hit.impulse,
             .position = hit.position,
             .normal = hit.normal});
  }

  static constexpr std::size_t kNoTrack = static_cast<std::size_t>(-1);

  std::shared_ptr<const MarbleModel> marbles_;
  std::shared_ptr<const Box> box_;
  PourSettings settings_;
  impulse::Resimulation engine_;
  std::vector<std::string> names_;  ///< of the marbles
  // The pour under way.
  impulse::Scene scene_;
  std::vector<std::size_t> tracks_;      ///< of each marble
  std::vector<impulse::Rested> rested_;  ///< in order
  impulse::Run run_;                     ///< of pours that nobody else records
};

}  // namespace

std::vector<Measure> pour_measures(std::size_t marbles) {
  std::vector<Measure> measures = {
      {.name = "active_balls", .kind = Measure::Kind::integer, .summary = "How many balls are dropped"},
      {.name = "direct_balls",
       .kind = Measure::Kind::integer,
       .summary = "How many balls come to rest in the bin over which they were let go"},
      {.name = "settling_time", .unit = "s", .summary = "When the last ball comes to rest"}};
  const auto add_list = [&](const std::string& list, const std::string& summary) {
    for (std::size_t marble = 1; marble <= marbles; ++marble)
      measures.push_back({.name = list + "_" + std::to_string(marble),
                          .kind = Measure::Kind::integer,
                          .list = list,
                          .summary = summary});
  };
  add_list("bin_of_ball", "In which bin each ball comes to rest, counted from 0 at the far left, row by row");
  add_list("place_of_ball", "Each ball's place in the order of coming to rest");
  return measures;
}

std::unique_ptr<Physics> make_pours(std::shared_ptr<const MarbleModel> marbles,
                                    std::shared_ptr<const Box> box, const PourSettings& settings) {
  return std::make_unique<Pours>(std::move(marbles), std::move(box), settings);
}

}  // namespace retake::spelling
