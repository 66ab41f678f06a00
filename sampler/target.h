// Target: what a chain walks on - a model, ways to propose, what a Score measures - and the names of the
// methods that may walk on it. doc/design.md, sections 1 and 3. It must not know chains or walks.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sampler/guide.h"
#include "sampler/kernel.h"
#include "sampler/learned.h"
#include "sampler/model.h"
#include "sampler/placed_redraw.h"

namespace retake {

enum class Method {
  metropolis,   ///< walks p(A) by the world's proposals
  rejection,    ///< independent draws from the prior, kept with probability p_c
  conditional,  ///< walks p(A | satisfied): the way the world shows, or else by a redraw learned from hits
  tempering,    ///< replicas between the prior and p(A) that swap places
};
/// Every method, the simplest first.
inline constexpr std::array kMethods{Method::rejection, Method::metropolis, Method::conditional,
                                     Method::tempering};
std::string_view to_string(Method method);
std::optional<Method> method_from(std::string_view name);

inline constexpr std::array kRatios{Ratios::exact, Ratios::paper};
std::string_view to_string(Ratios ratios);
std::optional<Ratios> ratios_from(std::string_view name);

/// What a chain walks on. Immutable, shared by all chains of a scenario.
struct Target {
  std::shared_ptr<const Model> model;
  KernelTable kernels;
  std::vector<std::string> measure_names;
  /// The least log_constraint of a satisfied animation, minus infinity if unknown. 0: log_constraint is
  /// constant where the constraint is satisfied, so a satisfied State of any beta is a draw of p(A |
  /// satisfied).
  double least_satisfied = -std::numeric_limits<double>::infinity();
  /// What a redraw learns from hits; empty: every Variable that is always present.
  std::vector<Coordinate> learned{};
  /// How `conditional` walks where the world knows; null: it learns.
  std::shared_ptr<const Guide> guide{};
  /// How `conditional` puts draws where they satisfy, where the world can; null: it cannot. Without a guide.
  std::shared_ptr<const PlacedRedraw> placed{};
  /// Proposals on p(A) that look at Scores, which `metropolis` mixes with `kernels`; null: none.
  std::shared_ptr<const ScoredKernelTable> scored_kernels{};
};

}  // namespace retake
