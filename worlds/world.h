// World: a family of scenes - what is uncertain in them, how candidates are proposed, how they move, what can
// be wished. doc/design.md, sections 1 and 4. It must not know chains, the store or HTTP.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sampler/interruption.h"
#include "sampler/kernel.h"
#include "sampler/model.h"
#include "sampler/placed_redraw.h"
#include "sampler/simulator.h"
#include "sampler/target.h"
#include "worlds/animation.h"
#include "worlds/measure.h"
#include "worlds/parameters.h"
#include "worlds/roster.h"
#include "worlds/term.h"

namespace retake {

/// What a simulation is asked for.
struct Recording {
  bool frames =
      false;  ///< poses at a fixed rate, played until everything rests; else rests and events are enough
  /// Constraint terms that may end the simulation early; empty: it runs to its end.
  std::span<const std::unique_ptr<const Term>> terms{};
  double needed = -std::numeric_limits<double>::infinity();  ///< see SimulationRequest
  const State* current_state = nullptr;                      ///< see SimulationRequest
  const Run* current_run = nullptr;
  Run* record = nullptr;
  Watch* watch = nullptr;  ///< see SimulationRequest; worlds without checkpoints do not ask
  const Interruption* interruption = nullptr;  ///< what takes many steps checks it at each; null: nobody asks

  void check_interruption() const {
    if (interruption) interruption->check();
  }
};

/// The physics of one scene for one thread; see the contract of Simulator.
class Physics {
 public:
  virtual ~Physics() = default;
  virtual std::unique_ptr<Run> make_run() const { return nullptr; }
  /// Simulates a State within the model's support. Overwrites `animation`, whose memory it reuses, and
  /// `measures`, one for each of Scene::measures(). Throws: Interrupted; the object is then to be destroyed.
  virtual SimulationOutcome simulate(const State& state, const Recording& recording, Animation& animation,
                                     std::span<double> measures) = 0;
};

/// A world with its model's numbers filled in. Immutable. Thread safety: shared by all threads.
class Scene {
 public:
  virtual ~Scene() = default;
  virtual std::shared_ptr<const Model> model() const = 0;
  virtual KernelTable kernels(Ratios ratios) const = 0;
  /// The few Variables on which it depends whether a wish comes true, for chains that learn; see
  /// Target::learned.
  virtual std::vector<Coordinate> learned() const { return {}; }
  /// How `conditional` chains come to what these terms wish, where the world knows; see Target::guide. Null
  /// where a term wishes what the guide keeps from happening, and where placed() serves.
  virtual std::shared_ptr<const Guide> guide(const Terms& wishes) const {
    (void)wishes;
    return nullptr;
  }
  /// How `conditional` chains put draws where these terms wish them, where the world can; see Target::placed.
  virtual std::shared_ptr<const PlacedRedraw> placed(const Terms& wishes) const {
    (void)wishes;
    return nullptr;
  }
  /// What Physics::simulate measures.
  virtual std::vector<Measure> measures() const { return {}; }
  virtual std::unique_ptr<Physics> make_physics() const = 0;
};

/// The box that a viewer should see first, and from where.
struct Viewpoint {
  Eigen::Vector3d center;        ///< [m]
  Eigen::Vector3d half_extents;  ///< [m]
  double azimuth;                ///< [rad], 0 looks along -z, pi/2 along -x
  double elevation;              ///< [rad] above the horizon
};

/// Immutable, one object a world, registered in worlds/registry.cpp.
class World {
 public:
  virtual ~World() = default;
  virtual std::string_view name() const = 0;
  /// Grows whenever the same scenario and seed no longer give the same samples.
  virtual int version() const = 0;
  virtual std::string_view summary() const = 0;
  /// A noun for one of its simulations, as people call it: "throw".
  virtual std::string_view attempt() const { return "try"; }
  virtual Method default_method() const = 0;
  /// What its physics saves when a chain lets it: see SimulationRequest.
  struct Savings {
    bool stops_early = false;  ///< once `needed` is out of reach
    bool resumes = false;      ///< from the Run of the current State
  };
  virtual Savings savings() const { return {}; }
  virtual const ParameterTable& model_parameters() const = 0;
  virtual const std::vector<TermKind>& term_kinds() const = 0;
  /// The bodies of a scene by the names that its terms take.
  virtual Roster roster(const Parameters& model) const = 0;
  /// Scenario documents that show the world; an empty store starts with them.
  virtual std::vector<nlohmann::json> examples() const = 0;
  /// For one of its animations, which has frames. None: the viewer chooses by what moves.
  virtual std::optional<Viewpoint> viewpoint(const Animation& shown) const {
    (void)shown;
    return std::nullopt;
  }
  /// Fits a scenario's model to its wishes before it is read: fills in defaults that depend on the
  /// constraints. Called with an object and an array that may hold anything. A parameter that it fills in has
  /// a default in model_parameters() too: that of a scenario without a wish.
  virtual void fit_model(nlohmann::json& model, const nlohmann::json& constraints) const {
    (void)model, (void)constraints;
  }
  /// Appends faults, with pointers below "/model", for what only the parameters together can tell.
  virtual std::shared_ptr<const Scene> make_scene(const Parameters& model,
                                                  std::vector<Fault>& faults) const = 0;
};

/// Every world, in the order in which a person should meet them.
const std::vector<const World*>& worlds();
/// Null if there is none of that name.
const World* find_world(std::string_view name);

}  // namespace retake
