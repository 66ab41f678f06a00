// The term `state_at`: where a body is, or how it moves, at a time. Paper, section 3.2.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "worlds/terms/fields.h"
#include "worlds/terms/played.h"
#include "worlds/words.h"

namespace retake::terms {
namespace {

using Eigen::Vector3d;

/// A vector that is wished, and how far it may be missed.
struct Aim {
  Vector3d value;
  double sd, tolerance;
};

class StateAt final : public Term {
 public:
  StateAt(std::string body, double time, std::optional<Aim> position, std::optional<Aim> velocity)
      : body_(std::move(body)), time_(time), position_(std::move(position)), velocity_(std::move(velocity)) {}

  std::vector<Measure> measures() const override {
    std::vector<Measure> all;
    if (position_)
      all.push_back({.name = "position_miss",
                     .unit = "m",
                     .summary = "How far from its place the body is at the time"});
    if (velocity_)
      all.push_back({.name = "velocity_miss",
                     .unit = "m/s",
                     .summary = "By how much the body's velocity misses at the time"});
    return all;
  }
  bool reads_frames() const override { return true; }

  TermScore score(const Animation& animation, std::span<double> values) const override {
    const Track* track = find_track(animation, body_);
    if (!track || !is_there(*track, time_)) {
      std::fill(values.begin(), values.end(), kAbsent);
      return {.log_density = absent(), .satisfied = false};
    }
    return judge(*motion_at(animation, *track, time_, Progress::finished), values);
  }

  double least_when_satisfied() const override {
    return (position_ ? log_gaussian(position_->tolerance, position_->sd) : 0) +
           (velocity_ ? log_gaussian(velocity_->tolerance, velocity_->sd) : 0);
  }

  Claims claims() const override {
    Claims all = {{.field = "/body", .demand = takes_part(body_)}};
    const auto add = [&](const std::optional<Aim>& aim, StateClaim::Quantity quantity, const char* field) {
      if (!aim) return;
      const Region near{.low = aim->value, .high = aim->value, .radius = aim->tolerance};
      all.push_back(
          {.field = field,
           .demand = StateClaim{
               .body = body_, .quantity = quantity, .from = time_, .to = time_, .regions = {near}}});
    };
    add(position_, StateClaim::Quantity::position, "/position");
    add(velocity_, StateClaim::Quantity::velocity, "/velocity");
    return all;
  }

  double upper_bound(const Animation& so_far) const override {
    const Track* track = find_track(so_far, body_);
    if (!track || !is_there(*track, time_)) return absent();
    const auto motion = motion_at(so_far, *track, time_, Progress::unfinished);
    std::array<double, 2> misses{};
    return motion ? judge(*motion, misses).log_density : 0;
  }

 private:
  TermScore judge(const PlayedMotion& motion, std::span<double> misses) const {
    TermScore score;
    std::size_t measure = 0;
    const auto add = [&](const std::optional<Aim>& aim, const Vector3d& value) {
      if (!aim) return;
      const double miss = (value - aim->value).norm();
      misses[measure++] = miss;
      score.log_density += log_gaussian(miss, aim->sd);
      score.satisfied &= miss <= aim->tolerance;
    };
    add(position_, motion.position);
    add(velocity_, motion.velocity);
    return score;
  }

  double absent() const { return log_gaussian(kAway, position_ ? position_->sd : velocity_->sd); }

  std::string body_;
  double time_;
  std::optional<Aim> position_, velocity_;
};

Parameter vector_field(std::string name, double largest, std::string unit, std::string summary) {
  return {.name = std::move(name),
          .kind = Parameter::Kind::number_list,
          .default_value = nlohmann::json::array(),
          .minimum = -largest,
          .maximum = largest,
          .most = 3,
          .unit = std::move(unit),
          .summary = std::move(summary),
          .source = "none: it is left free"};
}

std::optional<Aim> read_aim(const Parameters& term, const std::string& name, double sd, double tolerance,
                            std::string_view pointer, std::vector<Fault>& faults) {
  const std::vector<double> given = term.number_list(name);
  if (given.empty()) return std::nullopt;
  if (given.size() != 3) {
    faults.push_back({append_pointer(pointer, name),
                      "must have 3 members (x, y, z), got " + std::to_string(given.size())});
    return std::nullopt;
  }
  return Aim{.value = {given[0], given[1], given[2]}, .sd = sd, .tolerance = tolerance};
}

std::unique_ptr<const Term> make_state_at(const Setting& setting, const Parameters& term,
                                          const Parameters& model, std::string_view pointer,
                                          std::vector<Fault>& faults) {
  const std::size_t faults_before = faults.size();
  find_mover(setting.roster(model), term.text("body"), append_pointer(pointer, "body"), faults);
  auto position = read_aim(term, "position", term.number("sd"), term.number("tolerance"), pointer, faults);
  auto velocity = read_aim(term, "velocity", term.number("velocity_sd"), term.number("velocity_tolerance"),
                           pointer, faults);
  if (faults.size() == faults_before && !position && !velocity)
    faults.push_back({append_pointer(pointer, "position"), "is required unless there is a velocity"});
  if (faults.size() > faults_before) return nullptr;
  return std::make_unique<const StateAt>(term.text("body"), term.number("time"), std::move(position),
                                         std::move(velocity));
}

std::string state_at_sentence(const Parameters& term, const Parameters&) {
  const std::vector<double> position = term.number_list("position"), velocity = term.number_list("velocity");
  std::vector<std::string> state;
  if (!position.empty()) state.push_back("is at " + in_words(position) + " m");
  if (!velocity.empty()) state.push_back("moves by " + in_words(velocity) + " m/s");
  return body_in_words(term.text("body")) + " " + list_in_words(state) + " after " +
         in_words(term.number("time")) + " s";
}

}  // namespace

TermKind state_at_term(const Setting& setting) {
  ParameterTable fields(
      {body_field(setting, "Whose state it is"),
       number_field("time", 0, kEnd, "s", "When; after the end everything rests"),
       vector_field("position", 1000, "m", "Where the body's origin shall be then: x, y, z"),
       vector_field("velocity", 1000, "m/s", "How it shall move then: x, y, z"),
       sd_field("sd", setting.length, "m", setting.source),
       tolerance_field("tolerance", setting.length, "m", setting.source),
       sd_field("velocity_sd", setting.speed, "m/s", setting.source),
       tolerance_field("velocity_tolerance", setting.speed, "m/s", setting.source)});
  return {.kind = "state_at",
          .summary = "A body is near a place, or near a velocity, at a time",
          .parameters = std::move(fields),
          .make = [setting](auto&&... rest) { return make_state_at(setting, rest...); },
          .fit = fit_body(setting),
          .sentence = state_at_sentence};
}

}  // namespace retake::terms
