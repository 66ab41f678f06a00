// Conditional: explores, learns a redraw from what it finds, freezes it, then walks p(A | satisfied) itself.
// DESIGN section 3. Independence Metropolis with a learned proposal; every decision is taken by counts.
// Internal to the sampler.
#pragma once

#include <memory>
#include <vector>

#include "sampler/kernel.h"
#include "sampler/learned.h"
#include "sampler/tempering.h"
#include "sampler/walk.h"

namespace retake {

/// One iteration is one draw or one local move. Exploring, it draws from what it has learned so far, at first
/// from the prior, and weighs each hit by the proposal that drew it, for good. If the prior finds nothing a
/// ladder looks for the first hits. Sampling, it takes turns: draws until one satisfies, which is then
/// accepted by the ratio of weights; now and then one local move. A stay weighs as many turns as it lasted.
class Conditional final : public Walk {
 public:
  Conditional(const Target& target, const ChainSettings& settings, ChainCounts& counts);
  static std::vector<std::string> kernel_names() { return {"prior", "learned", "local", "tempering"}; }

  bool step(Simulator& simulator) override;
  void write(ByteWriter& out) const override;
  void read(ByteReader& in) override;

 private:
  enum class Phase : std::uint8_t {
    exploring,
    tempering,  ///< as a part of exploring
    learned,    ///< the redraw is frozen; the next step samples
    sampling,
  };

  bool explore(Simulator& simulator);
  bool temper(Simulator& simulator);
  void learn_if_due();
  double plain_hits() const;
  void learn(bool for_good);
  void start_sampling(Simulator& simulator);
  bool sample(Simulator& simulator);
  bool sample_redraw(Simulator& simulator);
  /// Draws a candidate from the redraw as it is. True if it satisfies the constraint, with p_c > 0.
  bool draw_candidate(Simulator& simulator);
  /// log (p p_c / q), which a redraw's acceptance compares.
  double log_weight(const State& state, const Score& score) const {
    return redraw_.log_weight(block_, state) + score.log_constraint;
  }

  Block block_;
  LocalMove local_;
  Phase phase_ = Phase::exploring;
  std::uint8_t turn_ = 0;  ///< redraws until the next local move
  LearnedRedraw redraw_;
  std::vector<WeighedState> hits_;  ///< weights p p_c / q, over the largest p_c among them
  double hit_scale_ = kImpossible;  ///< log of that p_c
  std::uint64_t explored_ = 0;      ///< draws
  std::uint64_t found_ = 0;         ///< hits among them
  double found_weight_ = 0;         ///< sum of their p / q
  double plain_draws_ = 0;          ///< how many draws the prior is expected to have made
  std::uint64_t learned_from_ = 0;  ///< hits
  double valid_share_ = 1;          ///< of the prior within its support
  std::unique_ptr<Tempering> ladder_;
};

}  // namespace retake
