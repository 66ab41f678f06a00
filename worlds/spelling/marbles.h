// Marbles: what is uncertain in a box of marbles, and how candidates are proposed.
// Paper, appendix B. It must not know wishes or how marbles move.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "sampler/kernel.h"
#include "sampler/model.h"
#include "worlds/spelling/box.h"

namespace retake::spelling {

/// Standard deviation of each component of a vertex group's offset [m] (B.1).
inline constexpr double kOffsetDeviation = 0.0001;

/// What a State says of a box of marbles.
struct Drops {
  /// Where each marble is dropped [m], (x, z); none: it takes no part.
  std::vector<std::optional<Eigen::Vector2d>> places;
  std::vector<Eigen::Vector3d> offsets;  ///< [m] of the box's vertex groups
};

/// The Variables, in this order: of each marble a Switch and where it is dropped, x and z; of each vertex
/// group of the box x, y and z of its offset. p_w is B.1's: every set of marbles alike, each dropped
/// uniformly over the drop area, every component of an offset Gaussian. An offset with a component beyond
/// what the box allows, ten standard deviations, has zero density. Immutable. Thread safety: shared by all
/// threads.
class MarbleModel {
 public:
  /// Requires: marbles > 0.
  MarbleModel(const Box& box, std::size_t marbles);

  std::shared_ptr<const Model> model() const { return model_; }
  std::size_t marble_count() const { return marbles_; }
  std::size_t group_count() const { return groups_; }
  Drops read(const State& state) const;
  /// B.2's proposals, with exact ratios or as published: see README.md.
  KernelTable kernels(Ratios ratios) const;

  std::size_t switch_of(std::size_t marble) const { return 3 * marble; }
  /// Of its x; its z is the next one.
  std::size_t drop_of(std::size_t marble) const { return 3 * marble + 1; }
  /// Of its x; its y and z are the next ones.
  std::size_t offset_of(std::size_t group) const { return 3 * marbles_ + 3 * group; }

 private:
  std::size_t marbles_, groups_;
  std::shared_ptr<const Model> model_;
};

}  // namespace retake::spelling
