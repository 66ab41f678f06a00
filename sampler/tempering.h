// Tempering: replicas on a ladder 0 = beta_0 < ... < beta_R = 1 walk p_w p_c^beta and swap places.
// doc/design.md, section 3. Swaps: deterministic even-odd (Okabe et al. 2001); ladder: equal rejection of
// neighbouring swaps (Syed, Bouchard-Cote, Deligiannidis & Doucet, JRSS B 84 (2022) 321-350). Internal to the
// sampler.
#pragma once

#include <set>
#include <vector>

#include "sampler/kernel.h"
#include "sampler/learned.h"
#include "sampler/walk.h"

namespace retake {

/// One iteration is one step of one replica, from the prior up; swaps follow the last one of a round. A first
/// few draws from the prior tell how steep the constraint is. The ladder is tuned until enough was found to
/// trust it, then frozen; what is found before has weight 0. Where log_constraint is constant on the
/// satisfied set satisfied States of every replica are samples, else those of the last.
class Tempering final : public Walk {
 public:
  /// As a part of another method it keeps to itself: `counts.kernels[first_kernel]` counts its steps, nothing
  /// else of `counts` but what simulating counts.
  enum class Part { whole, of_another };
  Tempering(const Target& target, const ChainSettings& settings, ChainCounts& counts, Part part = Part::whole,
            std::size_t first_kernel = 0);
  static std::vector<std::string> kernel_names() { return {"redraw", "local"}; }

  bool step(Simulator& simulator) override;
  std::span<const Walker> walkers() const override { return walkers_; }
  std::size_t walker() const override { return walker_index_; }
  void write(ByteWriter& out) const override;
  void read(ByteReader& in) override;
  std::optional<LessonKind> teach(ByteWriter& out) const override;
  void begin_from(ByteReader& lesson) override;

  /// So many satisfied States were found, from so many independent draws of the prior, that kernels may be
  /// learned from them and the ladder be trusted.
  bool has_found_enough() const;

 private:
  enum class Stage : std::uint8_t { pilot, tuning, sampling };
  struct Rung {
    double beta = 0;
    std::size_t walker = 0;      ///< which one stands here
    double rejected = 0;         ///< mean share of rejected swaps with the next rung, summed
    std::uint64_t attempts = 0;  ///< of such swaps since the last tuning
  };
  /// Sums over some rounds, one for each rung: of the ratio p_c^(beta' - beta) to the next rung, and on the
  /// last of satisfied / p_c. Their means multiply to P(satisfied) among the draws of the prior that count as
  /// whole: the lowest replica never stands where p_c is 0 or a simulation fails.
  struct Batch {
    std::uint64_t rounds = 0;
    std::vector<double> sums;
  };

  bool step_pilot(Simulator& simulator);
  void build_ladder();
  void place_on_ladder(std::size_t count);
  bool step_rung(Simulator& simulator);
  bool note_stay(Walker& walker, bool moved, bool counts);
  void finish_round();
  void swap_neighbours();
  void tune();
  void freeze();
  void add_to_batches();
  void estimate_odds();
  void publish_rungs();
  KernelCounter& counter(std::size_t kernel) {
    return counts_.kernels[part_ == Part::whole ? kernel : first_kernel_];
  }

  Part part_;
  std::size_t first_kernel_;
  Redraw redraw_;
  LocalMove local_;
  Stage stage_ = Stage::pilot;
  std::vector<double> pilot_;  ///< -log_constraint of its draws
  std::vector<Walker> walkers_;
  std::vector<std::uint64_t> lineages_;  ///< of each walker: the iteration of the draw that it stems from
  std::vector<Rung> rungs_;
  std::size_t walker_index_ = 0;
  std::size_t turn_ = 0;        ///< the rung that steps next
  std::uint64_t round_ = 0;     ///< since the ladder was built
  std::uint64_t tuned_at_ = 0;  ///< round
  std::uint64_t stage_rounds_;  ///< until the next tuning
  std::uint32_t tunings_ = 0;
  std::uint64_t hits_ = 0;                  ///< satisfied States moved to
  std::set<std::uint64_t> found_lineages_;  ///< of them; no more than needed
  std::vector<Batch> batches_;
  std::uint64_t batch_rounds_ = 1;
  std::uint64_t prior_draws_ = 0;  ///< within the support, by the lowest replica of a frozen ladder
  std::uint64_t whole_draws_ = 0;  ///< of them: those with p_c > 0 whose simulation did not fail
};

}  // namespace retake
