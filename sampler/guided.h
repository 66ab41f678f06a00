// Guided: walks p(A | satisfied) the way that a world shows - its own start, its own kernels.
// doc/design.md, section 3, "Conditional". Every decision is taken by counts. Internal to the sampler.
#pragma once

#include <optional>

#include "sampler/guide.h"
#include "sampler/walk.h"

namespace retake {

/// One iteration is one candidate. It builds up a first satisfied State, burns in, and from then on notes
/// where it stands at fixed intervals: those are its samples, as successive States are near-copies.
///
/// While it burns in it looks, now and then, whether its animation has become another one. It has burned in
/// when that has happened often enough for its start to be forgotten, and how often it happened says how long
/// the intervals have to be. Some of what it meets meanwhile is shown, ever less, and weighs nothing. A walk that
/// hardly gets away is not waited for without end: its samples are then more alike.
///
/// Now and then comes a soft stretch: a fixed number of satisfied States of a walk on p(A). The satisfied
/// States alone that such a walk visits are a walk on p(A | satisfied), so the target stays as it is, and
/// what the kernels on satisfied States cannot reach is reached.
class Guided final : public Walk {
 public:
  /// Requires: target.guide.
  Guided(const Target& target, const ChainSettings& settings, ChainCounts& counts);
  static std::vector<std::string> kernel_names(const Guide& guide);

  void start(Simulator& simulator) override;
  bool step(Simulator& simulator) override;
  /// The sample that was noted last, not where it walks on.
  std::span<const Walker> walkers() const override { return {&noted_, 1}; }
  void write(ByteWriter& out) const override;
  void read(ByteReader& in) override;
  std::optional<LessonKind> teach(ByteWriter& out) const override;
  void begin_from(ByteReader& lesson) override;

 private:
  enum class Phase : std::uint8_t {
    building,
    burning_in,
    sampling,
    soft_stretch,  ///< within sampling
  };

  void start_building(Simulator& simulator);
  void build(Simulator& simulator);
  void move(const ScoredKernelTable& kernels, std::size_t first_counter, bool conditional,
            Simulator& simulator);
  bool go_on(Simulator& simulator);
  bool look_back(Simulator& simulator);
  void end_burning_in();
  bool note();

  const Guide& guide_;
  Phase phase_ = Phase::building;
  std::uint64_t vain_tries_ = 0;  ///< while building
  std::uint64_t met_ = 0;         ///< satisfied States of the walk, since the phase began
  std::uint64_t since_note_ = 0;  ///< satisfied States
  std::uint64_t moved_at_ = 0;    ///< the iteration that moved to where it stands
  std::uint64_t interval_ = 1;    ///< from sample to sample, in looks
  // While burning in.
  Walker left_;                 ///< where its animation was another one last
  std::uint64_t looks_ = 0;     ///< back to it
  std::uint64_t renewals_ = 0;  ///< how often the animation had become another one
  Walker noted_;
  std::optional<State> place_;  ///< where it begins, before the first iteration
};

}  // namespace retake
