// A small world for what no registered world has: every kind of measure, a term whose default depends on the
// model, and a viewpoint.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "worlds/scenario.h"

namespace retake::tests {

/// A bead that appears somewhere on a rod with notches at 0, 1, 2, …, and stays there.
class StubWorld : public World {
 public:
  mutable int terms_made = 0;

  std::string_view name() const override { return "stub"; }
  int version() const override { return 1; }
  std::string_view summary() const override { return "A bead on a rod"; }
  Method default_method() const override { return Method::rejection; }
  const ParameterTable& model_parameters() const override { return model_; }
  const std::vector<TermKind>& term_kinds() const override { return terms_; }
  Roster roster(const Parameters&) const override { return {.movers = {{.name = "bead"}}, .still = {}}; }
  std::vector<nlohmann::json> examples() const override { return {}; }
  std::optional<Viewpoint> viewpoint(const Animation&) const override {
    return Viewpoint{.center = {1, 2, 3}, .half_extents = {4, 5, 6.5}, .azimuth = -0.25, .elevation = 0.5};
  }
  std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                          std::vector<Fault>& faults) const override {
    if (model.integer_set("notches").back() > model.number("length"))
      faults.push_back({"/model/notches", "lie beyond the end of the rod"});
    return std::make_shared<const Rod>(model.number("length"), model.integer_set("notches"));
  }

 private:
  /// Measures where the bead is, whether it is past the middle, and which notches it has passed: none (rather
  /// than the empty set) before the first.
  class Bead final : public Physics {
   public:
    Bead(double length, std::vector<int> notches) : length_(length), notches_(std::move(notches)) {}
    SimulationOutcome simulate(const State& state, const Recording&, Animation& animation,
                               std::span<double> measures) override {
      const double x = state[0];
      animation.frames = 1;
      animation.bodies = {{.name = "bead",
                           .shape = Sphere{.radius = 0.1},
                           .colour = "#336699",
                           .surface = Surface::plastic,
                           .track = 0}};
      animation.tracks.resize(1);
      animation.tracks[0].rest.position = {x, 0, 0};
      animation.tracks[0].positions = animation.tracks[0].rest.position;
      animation.tracks[0].rotations = Eigen::Vector4d(0, 0, 0, 1);
      std::vector<int> passed;
      for (const int notch : notches_)
        if (notch < x) passed.push_back(notch);
      measures[0] = x;
      measures[1] = x > length_ / 2;
      measures[2] = passed.empty() ? kAbsent : set_of(passed);
      return {.end = SimulationEnd::complete};
    }

   private:
    double length_;
    std::vector<int> notches_;
  };

  class Rod final : public Scene {
   public:
    Rod(double length, std::vector<int> notches) : length_(length), notches_(std::move(notches)) {
      model_ = std::make_shared<const Model>(
          std::vector<Variable>{{.name = "x", .unit = "m", .prior = Distribution::uniform(0, length)}});
    }
    std::shared_ptr<const Model> model() const override { return model_; }
    KernelTable kernels(Ratios ratios) const override {
      return KernelTable({{"redraw", 1, std::make_shared<const Redraw>(Redraw::all(*model_, ratios))}});
    }
    std::vector<Measure> measures() const override {
      return {{.name = "x"},
              {.name = "past_the_middle", .kind = Measure::Kind::flag},
              {.name = "passed", .kind = Measure::Kind::integer_set}};
    }
    std::unique_ptr<Physics> make_physics() const override {
      return std::make_unique<Bead>(length_, notches_);
    }

   private:
    double length_;
    std::vector<int> notches_;
    std::shared_ptr<const Model> model_;
  };

  /// Satisfied before `limit`, which is the end of the rod unless given; measures whether it is.
  class Before final : public Term {
   public:
    explicit Before(double limit) : limit_(limit) {}
    std::vector<Measure> measures() const override {
      return {{.name = "past_the_middle", .kind = Measure::Kind::flag}};
    }
    TermScore score(const Animation& animation, std::span<double> values) const override {
      const bool satisfied = animation.tracks[0].rest.position.x() < limit_;
      values[0] = satisfied;
      return {.log_density = satisfied ? 0.0 : -1.0, .satisfied = satisfied};
    }

   private:
    double limit_;
  };

  const ParameterTable model_{{
      {.name = "length",
       .default_value = 10,
       .minimum = 1,
       .maximum = 100,
       .unit = "m",
       .summary = "Of the rod"},
      {.name = "notches",
       .kind = Parameter::Kind::integer_set,
       .default_value = {1, 2, 3},
       .minimum = 0,
       .maximum = kLargestMember,
       .fewest = 1,
       .summary = "Where the rod has notches"},
  }};
  const std::vector<TermKind> terms_ = {
      {.kind = "before",
       .summary = "The bead is before a limit",
       .parameters = ParameterTable({{.name = "limit",
                                      .default_value = 10,
                                      .minimum = 0,
                                      .maximum = 100,
                                      .summary = "The end of the rod unless given"}}),
       .make =
           [this](const Parameters& term, const Parameters& model, std::string_view pointer,
                  std::vector<Fault>& faults) {
             ++terms_made;
             if (term.number("limit") > model.number("length"))
               faults.push_back({append_pointer(pointer, "limit"), "lies beyond the end of the rod"});
             return std::make_unique<const Before>(term.number("limit"));
           },
       .fit =
           [](nlohmann::json& term, const Parameters& model, std::string_view, std::vector<Fault>&) {
             if (!term.contains("limit")) term["limit"] = model.number("length");
           }}};
};

inline const StubWorld& stub_world() {
  static const StubWorld world;
  return world;
}

inline std::shared_ptr<const Scenario> read_stub_scenario(const nlohmann::json& document) {
  return Scenario::read(document, {&stub_world()});
}

}  // namespace retake::tests
