// Conditional: explores, learns a redraw from what it finds, freezes it, then walks p(A | satisfied) itself.
// doc/design.md, section 3. An importance Markov chain (Andral, Douc, Marival and Robert, Stochastic
// Processes and their Applications, 2024) on a learned proposal; every decision is taken by counts. Internal
// to the sampler.
#pragma once

#include <memory>
#include <vector>

#include "sampler/kernel.h"
#include "sampler/learned.h"
#include "sampler/tempering.h"
#include "sampler/walk.h"

namespace retake {

/// A local move that leaves a learned q as it is, where LocalMove leaves the prior as it is.
class LearnedLocalMove final : public Kernel {
 public:
  /// Requires: both outlive it.
  LearnedLocalMove(const Block& block, const LearnedRedraw& redraw);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  const Block& block_;
  const LearnedRedraw& redraw_;
  LocalMove move_;
};

/// One iteration is one draw or one local move. At first it draws from the prior, and what satisfies counts
/// as with rejection; where that is common it stays so, as learning would cost more than it gives. Exploring,
/// it draws from what it has learned so far, and weighs each hit by the proposal that drew it, for good. If
/// the prior finds nothing a ladder looks for the first hits. Sampling, it walks q restricted to what
/// satisfies: to every draw that does, and now and then by a local move that leaves q as it is there. Where
/// it stands counts a whole number of times, whose mean is proportional to p p_c / q, so that what is counted
/// follows p(A | satisfied). Independence Metropolis would count each of them by chance and give two thirds
/// of the effective samples.
class Conditional final : public Walk {
 public:
  Conditional(const Target& target, const ChainSettings& settings, ChainCounts& counts);
  static std::vector<std::string> kernel_names() { return {"prior", "learned", "local", "tempering"}; }

  bool step(Simulator& simulator) override;
  void write(ByteWriter& out) const override;
  void read(ByteReader& in) override;
  std::optional<LessonKind> teach(ByteWriter& out) const override;
  void begin_from(ByteReader& lesson) override;

 private:
  enum class Phase : std::uint8_t {
    plain,  ///< draws of the prior that count, at first and where they find enough
    exploring,
    tempering,  ///< as a part of exploring
    sampling,   ///< by the redraw as it is now
  };

  bool explore(Simulator& simulator);
  void keep_hit();
  std::uint64_t plain_count();
  void look_whether_common();
  bool temper(Simulator& simulator);
  void learn_if_due();
  double plain_hits() const;
  void learn(bool for_good);
  void start_sampling();
  void enter_sampling();
  bool sample(Simulator& simulator);
  bool move_locally(Simulator& simulator);
  /// What it has learned, as part of a checkpoint and of a lesson.
  void write_learned(ByteWriter& out) const;
  void read_learned(ByteReader& in);
  /// How often the walker's State counts: a whole number, its mean proportional to p p_c / q.
  std::uint64_t draw_count(RandomStream& random) const;
  /// Draws a candidate from the redraw as it is. True if it satisfies the constraint, with p_c > 0.
  bool draw_candidate(Simulator& simulator);
  Block block_;
  Phase phase_ = Phase::exploring;
  std::uint8_t turn_ = 0;  ///< hits until the next local move
  LearnedRedraw redraw_;
  LearnedLocalMove local_;
  std::vector<WeighedState> hits_;  ///< weights p p_c / q, over the largest p_c among them
  double hit_scale_ = kImpossible;  ///< log of that p_c
  std::uint64_t explored_ = 0;      ///< draws
  std::uint64_t found_ = 0;         ///< hits among them
  double found_weight_ = 0;         ///< sum of their p / q
  double plain_worth_ = 0;          ///< sum of p_c of the plain draws that satisfied
  double plain_draws_ = 0;          ///< how many draws the prior is expected to have made
  std::uint64_t learned_from_ = 0;  ///< hits
  double valid_share_ = 1;          ///< of the prior within its support
  std::unique_ptr<Tempering> ladder_;
};

}  // namespace retake
