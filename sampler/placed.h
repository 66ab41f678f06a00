// Placed: independent draws that are put where they satisfy once it is known how they move.
// doc/design.md, section 3, "Symmetry sampling". Internal to the sampler.
#pragma once

#include <string>
#include <vector>

#include "sampler/placed_redraw.h"
#include "sampler/walk.h"

namespace retake {

/// One iteration is one draw of the prior, simulated, then placed. As the motion stays as it is, the second
/// simulation costs next to nothing in a world that resumes. What satisfies counts a whole number of times,
/// whose mean is proportional to p p_c / q, as in Conditional; so what is counted are independent draws of
/// p(A | satisfied), and the weights give the odds.
///
/// Where the world can tell on the way what promises little, most of that is given up by roulette.
class Placed final : public Walk {
 public:
  /// Requires: target.placed.
  Placed(const Target& target, const ChainSettings& settings, ChainCounts& counts);
  static std::vector<std::string> kernel_names() { return {"placed"}; }
  bool step(Simulator& simulator) override;

 private:
  bool draw(RandomStream& draws, Simulator& simulator);
  bool place(RandomStream& draws, Simulator& simulator);

  // Of the iteration under way.
  double survival_ = 1;
  double log_weight_ = 0;
};

}  // namespace retake
