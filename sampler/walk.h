// Walk: what the methods of a chain have in common - walkers, candidates, and how both meet a simulator.
// doc/design.md, section 3. Internal to the sampler: callers see Chain.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "sampler/bytes.h"
#include "sampler/guide.h"
#include "sampler/lesson.h"
#include "sampler/simulator.h"
#include "sampler/stay.h"
#include "sampler/target.h"

namespace retake {

inline constexpr double kImpossible = -std::numeric_limits<double>::infinity();

/// One that walks: where it stands, and the simulation of that State to resume from.
struct Walker {
  Stay stay;
  std::unique_ptr<Run> run;
  bool was_simulated = false;  ///< false: its first State has no score yet
};

class Walk {
 public:
  virtual ~Walk() = default;

  /// Before the first iteration. Throws: std::runtime_error if the prior never draws a State within its
  /// support.
  virtual void start(Simulator& simulator);
  /// Iteration `counts.iteration`. True if the walker moved to a new State, or became a sample where it is.
  virtual bool step(Simulator& simulator) = 0;
  virtual std::span<const Walker> walkers() const { return {&walker_, 1}; }
  /// Which of them took the last step.
  virtual std::size_t walker() const { return 0; }
  /// What the stay weighed that the last move ended.
  std::uint64_t ended_weight() const { return ended_weight_; }

  /// Everything that the next step depends on, but what `counts` holds.
  virtual void write(ByteWriter& out) const;
  /// Throws: std::out_of_range.
  virtual void read(ByteReader& in);

  /// Writes what it has learned; nothing: it knows nothing that others could begin from.
  virtual std::optional<LessonKind> teach(ByteWriter& out) const {
    (void)out;
    return std::nullopt;
  }
  /// Before the first iteration: what another one's teach() wrote takes the place of learning.
  /// Throws: std::out_of_range.
  virtual void begin_from(ByteReader& lesson);

 protected:
  Walk(const Target& target, const ChainSettings& settings, ChainCounts& counts);

  /// What a candidate is measured by: p_w p_c^beta, where `conditional` restricted to what is satisfied.
  struct Aim {
    double beta = 1;
    bool conditional = false;
  };

  RandomStream random(Purpose purpose, std::size_t replica = 0) const;
  /// Draws the first State of a walker from the prior, within its support.
  void draw_first(Walker& walker, std::size_t replica);
  /// Simulates the State on which a walker stands, to its end.
  void simulate_first(Simulator& simulator, Walker& walker);
  /// A step of Metropolis and Hastings. True if the walker moved to another State; an accepted candidate
  /// equal to the current State is no move and costs no simulation.
  bool step_by(const Kernel& kernel, KernelCounter& counter, RandomStream& draws, double log_u,
               const Aim& aim, Simulator& simulator, Walker& walker);
  /// A guide says how candidates are placed, where it places.
  bool step_by(const ScoredKernel& kernel, const Guide* guide, KernelCounter& counter, RandomStream& draws,
               double log_u, const Aim& aim, Simulator& simulator, Walker& walker);
  /// Simulates candidate_, from `walker` if there is one to resume from. True if its Score is whole.
  bool simulate_candidate(Simulator& simulator, const Walker* walker, double needed, Watch* watch = nullptr);
  /// The walker moves to candidate_.
  void move_to_candidate(Walker& walker);
  /// Places candidate_, which was simulated, as the guide says; it is simulated again where it is placed.
  /// True if its Score is whole.
  bool place_candidate(const Guide& guide, RandomStream& draws, Simulator& simulator, double needed);
  /// Simulates again where a walker stands, to have its run.
  void renew_run(Simulator& simulator, Walker& walker);
  static Simulated simulated(const Walker& walker) {
    return {walker.stay.state, walker.stay.score, walker.run.get()};
  }
  Simulated simulated_candidate() const { return {candidate_, candidate_score_, candidate_run_.get()}; }
  /// Below this a log_constraint says that the animation is not satisfied: what `needed` may be for
  /// candidates that have to be.
  double needed_to_satisfy() const;

  const Target& target_;
  const ChainSettings& settings_;
  ChainCounts& counts_;
  Walker walker_;
  std::uint64_t ended_weight_ = 0;
  // The candidate of the iteration under way; kept to reuse its memory.
  State candidate_;
  double candidate_log_prior_ = 0;
  Score candidate_score_;
  std::unique_ptr<Run> candidate_run_;
  Walker drawn_;  ///< the candidate before it was placed

 private:
  /// True if candidate_, which was proposed, is another State; else its proposal counts as accepted.
  bool is_move(const Walker& walker, KernelCounter& counter);
  /// What the candidate's log_constraint has to exceed, strictly, to be accepted.
  double needed_for(double log_hastings, double log_u, const Aim& aim, const Stay& stay) const;
  /// Whether candidate_ is to be simulated: the answer may be known already.
  bool is_worth_it(double needed) const;
  bool is_reached(double needed, const Aim& aim) const;
  void accept(KernelCounter& counter, Walker& walker);

  bool resumes_;  ///< until the simulator has no Run to offer
};

void write_state(ByteWriter& out, const State& state);
/// Throws: std::out_of_range, also if the State has another length than the target's.
State read_state(ByteReader& in, const Target& target);
void write_walker(ByteWriter& out, const Walker& walker);
/// Throws: std::out_of_range, also if the State or the measures have another length than the target's.
void read_walker(ByteReader& in, const Target& target, Walker& walker);

}  // namespace retake
