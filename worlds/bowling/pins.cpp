// See pins.h.
#include "worlds/bowling/pins.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "worlds/bowling/lane.h"
#include "worlds/bowling/release.h"
#include "worlds/bowling/view.h"
#include "worlds/measure.h"
#include "worlds/words.h"

namespace retake::bowling {
namespace {

using nlohmann::json;

constexpr double kMoved = 0.05;  // [m] from where it stood, chosen: less than a pin's radius

class Pins final : public Term {
 public:
  Pins(std::vector<int> rack, const std::vector<int>& down, double log_lambda)
      : rack_(std::move(rack)), log_lambda_(log_lambda) {
    for (const int pin : rack_)
      must_fall_.push_back(std::find(down.begin(), down.end(), pin) != down.end());
  }

  std::vector<Measure> measures() const override {
    return {{.name = "as_wished",
             .kind = Measure::Kind::integer_set,
             .summary = "The pins that end as they shall"},
            {.name = "short_of_wish",
             .kind = Measure::Kind::integer,
             .summary = "How many pins wrongly stand, fall or move; those that wrongly fall count twice"}};
  }

  /// log p_c = (k + m - max) log lambda: k pins end as wished, m pins that must stand have not moved far. A
  /// pin that wrongly stands does not count in m: it would win there what it loses in k.
  TermScore score(const Animation& animation, std::span<double> measures) const override {
    std::vector<int> as_wished;
    int missing = 0;
    for (std::size_t i = 0; i < rack_.size(); ++i) {
      const Track& track = animation.tracks[kFirstPinTrack + i];
      if (must_fall_[i]) {
        missing += track.fell ? 0 : 1;
        if (track.fell) as_wished.push_back(rack_[i]);
      } else {
        const bool stands = !track.fell;
        const bool stayed = stands && (track.rest.position - track.start.position).norm() <= kMoved;
        missing += (stands ? 0 : 1) + (stayed ? 0 : 1);
        if (stayed) as_wished.push_back(rack_[i]);
      }
    }
    measures[0] = set_of(as_wished);
    measures[1] = missing;
    return {.log_density = log_density(missing), .satisfied = missing == 0};
  }

  double least_when_satisfied() const override { return 0; }

  /// A pin that is to stand ends near its spot.
  Claims claims() const override {
    constexpr double kDeviations = 8;  // chosen: one pin in 10^15 is set farther off
    Claims all;
    for (std::size_t i = 0; i < rack_.size(); ++i) {
      const std::string body = pin_name(rack_[i]);
      all.push_back({.field = "/down", .demand = falls(body, must_fall_[i])});
      if (must_fall_[i]) continue;
      Region near{.radius = kMoved + std::sqrt(2.0) * kDeviations * kPinOffset};
      near.low.x() = near.high.x() = pin_spot(rack_[i]).x();
      near.low.z() = near.high.z() = pin_spot(rack_[i]).z();
      all.push_back({.field = "/down",
                     .demand = StateClaim{.body = body, .from = kEnd, .to = kEnd, .regions = {near}}});
    }
    return all;
  }

  /// A pin that has fallen never stands again.
  double upper_bound(const Animation& so_far) const override {
    int missing = 0;
    for (std::size_t i = 0; i < rack_.size(); ++i)
      if (!must_fall_[i] && so_far.tracks[kFirstPinTrack + i].fell) missing += 2;
    return log_density(missing);
  }

 private:
  double log_density(int missing) const { return missing == 0 ? 0 : -missing * log_lambda_; }

  std::vector<int> rack_;
  std::vector<bool> must_fall_;
  double log_lambda_;
};

/// A small rack has few levels between a miss and the wish, so each may be steeper.
void fit_to_rack(json& term, const Parameters& model, std::string_view pointer, std::vector<Fault>& faults) {
  const std::vector<int> rack = model.integer_set("rack");
  if (!term.contains("log_lambda")) term["log_lambda"] = rack.size() <= 2 ? 5.0 : 2.5;
  const auto down = term.find("down");
  if (down == term.end() || !down->is_array()) return;
  for (std::size_t i = 0; i < down->size(); ++i) {
    const json& pin = (*down)[i];
    const bool is_pin = pin.is_number_integer() && pin >= 1 && pin <= kPinCount;
    if (is_pin && std::find(rack.begin(), rack.end(), pin.get<int>()) == rack.end())
      faults.push_back(
          {append_pointer(append_pointer(pointer, "down"), i), "pin " + pin.dump() + " is not in the rack"});
  }
}

std::string sentence(const Parameters& term, const Parameters& model) {
  const std::vector<int> rack = model.integer_set("rack"), down = term.integer_set("down");
  std::vector<int> up;
  std::set_difference(rack.begin(), rack.end(), down.begin(), down.end(), std::back_inserter(up));
  const auto named = [](const std::vector<int>& pins, const char* one, const char* several) {
    std::vector<std::string> numbers;
    for (const int pin : pins)
      numbers.push_back(std::to_string(pin));
    return (pins.size() == 1 ? "pin " : "pins ") + list_in_words(numbers) +
           (pins.size() == 1 ? one : several);
  };
  if (down.empty()) return "every pin stays up";
  if (up.empty() && down.size() > 2) return "all " + std::to_string(down.size()) + " pins go down";
  if (up.empty()) return named(down, " goes down", " go down");
  if (up.size() > down.size()) return named(down, " goes down", " go down") + ", and no other";
  return named(up, " stays up", " stay up") + ", and every other goes down";
}

}  // namespace

TermKind pins_term() {
  ParameterTable fields({
      {.name = "down",
       .kind = Parameter::Kind::integer_set,
       .minimum = 1,
       .maximum = kPinCount,
       .summary = "Pins that shall fall; the others of the rack shall stay where they stand"},
      {.name = "log_lambda",
       .default_value = 2.5,
       .minimum = 0,
       .maximum = 100,
       .above_minimum = true,
       .summary =
           "What one pin that is not as wished costs in log p_c; 5 by default for racks of two or fewer",
       .source = "5.2.1: lambda = e^2.5; 5 measured to serve spares"},
  });
  return {.kind = "pins",
          .summary = "Some pins of the rack fall, and the others stay where they stand",
          .parameters = std::move(fields),
          .make = [](const Parameters& term, const Parameters& model, std::string_view,
                     std::vector<Fault>&) -> std::unique_ptr<const Term> {
            return std::make_unique<const Pins>(model.integer_set("rack"), term.integer_set("down"),
                                                term.number("log_lambda"));
          },
          .fit = fit_to_rack,
          .sentence = sentence};
}

}  // namespace retake::bowling
