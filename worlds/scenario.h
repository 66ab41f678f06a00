// Scenario: a world, its model's parameters and constraint terms, read from a document and ready to be
// sampled. doc/design.md, section 1. It must not know chains' progress, the store or HTTP.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "sampler/target.h"
#include "worlds/judge.h"
#include "worlds/world.h"

namespace retake {

/// What a scenario's document wishes: a clause for people for each of its constraints, in their order. Of one
/// that this build cannot read, the name of its kind.
std::vector<std::string> wishes_of(const nlohmann::json& document,
                                   const std::vector<const World*>& offered = worlds());

/// Immutable. Thread safety: shared by all threads.
class Scenario {
 public:
  /// Reads {"world", "title", "model", "constraints"} of one of the worlds on offer and fills in every
  /// default. Throws: InvalidRequest with every fault of the document.
  static std::shared_ptr<const Scenario> read(const nlohmann::json& document,
                                              const std::vector<const World*>& offered = worlds());

  const World& world() const { return *world_; }
  const std::string& title() const { return title_; }
  /// {"world","world_version","title","model","constraints"} with every default; equal scenarios have equal
  /// documents.
  const nlohmann::json& document() const { return document_; }
  const Model& model() const { return *scene_->model(); }
  /// What chains with these ratios walk on.
  std::shared_ptr<const Target> target(Ratios ratios) const {
    return ratios == Ratios::exact ? exact_ : paper_;
  }
  /// Of the scene and then of every term; their names are unique.
  const std::vector<Measure>& measures() const { return measures_; }
  /// The constraint terms, which judge any animation of this world.
  const Judge& judge() const { return judge_; }
  /// A simulator for one thread. Requires: the scenario outlives it.
  class Performer;
  std::unique_ptr<Performer> make_performer() const;

 private:
  Scenario() = default;
  const World* world_ = nullptr;
  std::string title_;
  nlohmann::json document_;
  std::shared_ptr<const Scene> scene_;
  Judge judge_;
  std::vector<Measure> measures_;
  std::shared_ptr<const Target> exact_;
  std::shared_ptr<const Target> paper_;
};

/// Simulates and scores States of a scenario: the chain's Simulator, and the Animation of a State on demand.
/// Reused for many States, also of many chains of its scenario. Thread safety: one thread at a time, but for
/// interruption().
class Scenario::Performer final : public Simulator {
 public:
  explicit Performer(const Scenario& scenario);
  std::unique_ptr<Run> make_run() const override { return physics_->make_run(); }
  SimulationOutcome simulate(const State& candidate, const SimulationRequest& request, Score& score) override;

  /// A State played to rest, with its score. The reference is good until the next call.
  struct Take {
    const Animation& animation;
    Score score;
    bool complete;  ///< false: the simulation failed
  };
  Take perform(const State& state);

  /// Ends what is simulated, from another thread; simulate() and perform() then throw Interrupted.
  Interruption& interruption() { return interruption_; }

 private:
  void judge(const Animation& animation, Score& score) const;
  const Scenario& scenario_;
  std::unique_ptr<Physics> physics_;
  std::size_t physics_measures_;
  Animation scored_;    ///< of candidates
  Animation recorded_;  ///< of performed States
  Interruption interruption_;
};

}  // namespace retake
