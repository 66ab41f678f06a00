// Kernel: a way to propose a candidate State from the current one; q of the paper.
// Paper, sections 5.1.2, A.2 and B.2, with the ratios of doc/design.md, section 3. It must not know what a
// simulation says.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sampler/check.h"
#include "sampler/model.h"
#include "sampler/random.h"

namespace retake {

/// Exact ratios leave p(A) invariant. The paper's printed ones reproduce its published behaviour and do not.
enum class Ratios { exact, paper };

/// Immutable. Thread safety: shared by all threads.
class Kernel {
 public:
  virtual ~Kernel() = default;
  /// Changes `candidate`, which equals `current` on entry.
  /// Returns log_hastings = log q(current|candidate) - log q(candidate|current).
  virtual double propose(const Model& model, const State& current, State& candidate,
                         RandomStream& random) const = 0;
};

/// Draws Variables anew from their priors: all of them, or a block. Overrides become absent. q is then the
/// prior of the block, so log_hastings = log p_w(current block) - log p_w(candidate block), and acceptance
/// depends on p_c alone.
class Redraw final : public Kernel {
 public:
  /// Requires: a block that holds a Switch holds everything that it governs.
  Redraw(const Model& model, std::vector<std::size_t> block, Ratios ratios);
  static Redraw all(const Model& model, Ratios ratios);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::vector<std::size_t> block_;
  Ratios ratios_;
};

/// Adds a symmetric random step to Variables; log_hastings is 0. Uniform Variables wrap, absent ones stay
/// absent.
class Perturb final : public Kernel {
 public:
  enum class Shape {
    uniform,   ///< each Variable by a number uniform on [-size, size]
    gaussian,  ///< each Variable by a Gaussian number of standard deviation `size`
    radial,    ///< two or three Variables along a random direction, by a Gaussian distance
  };
  /// Variables that move together, or not at all, with a probability.
  struct Group {
    std::vector<std::size_t> variables;
    Shape shape = Shape::gaussian;
    double size = 1;  ///< in the Variables' unit
    double probability = 1;
  };
  explicit Perturb(std::vector<Group> groups);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::vector<Group> groups_;
};

/// Turns switches: with probability 1/2 each switch that is on is turned off with probability t, else each
/// that is off is turned on with probability t and what it governs drawn from its prior. With n of N switches
/// on, turning j of them off has log_hastings = (N - 2n + j) log(1 - t) + log p_w(what they governed), and
/// turning on is its mirror image.
class Toggle final : public Kernel {
 public:
  /// Requires: every index is a Switch of the model; 0 < probability < 1.
  Toggle(const Model& model, std::vector<std::size_t> switches, double probability, Ratios ratios);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::vector<std::size_t> switches_;
  double probability_;
  Ratios ratios_;
};

/// A step of mixed scales that leaves the prior as it is, so that acceptance depends on p_c alone. With a
/// scale s = 10^(-2u), u uniform, a Gaussian Variable with z = (value - mean) / sd moves to sqrt(1 - s^2) z +
/// s n, and a uniform one by s (u - 1/2) of its width, wrapped. It moves one Variable of a block, or a part
/// of the block and perhaps of the rest, or a part of the rest, or everything. Switches and overrides stay as
/// they are.
class LocalMove final : public Kernel {
 public:
  /// `block`: the Variables that matter most. Requires: it is not empty; no Switch and no override
  /// is in it.
  LocalMove(const Model& model, std::vector<std::size_t> block);
  double propose(const Model& model, const State& current, State& candidate,
                 RandomStream& random) const override;

 private:
  std::vector<std::size_t> block_;
  std::vector<std::size_t> rest_;
};

/// One row of a world's table of proposals.
template <typename Proposal>
struct Weighted {
  std::string name;
  double weight;  ///< relative; positive
  std::shared_ptr<const Proposal> kernel;
};

/// A world's proposals: one is chosen an iteration, in proportion to its weight.
template <typename Proposal>
class WeightedTable {
 public:
  WeightedTable() = default;
  /// Requires: at least one row.
  explicit WeightedTable(std::vector<Weighted<Proposal>> rows) : rows_(std::move(rows)) {
    CHECK(!rows_.empty());
    double sum = 0;
    for (const auto& row : rows_) {
      CHECK(row.weight > 0 && row.kernel != nullptr, row.name);
      cumulative_.push_back(sum += row.weight);
    }
  }
  const std::vector<Weighted<Proposal>>& rows() const { return rows_; }
  /// The row for a number uniform on (0, 1).
  std::size_t choose(double u) const {
    const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), u * cumulative_.back());
    return std::min(static_cast<std::size_t>(found - cumulative_.begin()), rows_.size() - 1);
  }

 private:
  std::vector<Weighted<Proposal>> rows_;
  std::vector<double> cumulative_;
};

using WeightedKernel = Weighted<Kernel>;
using KernelTable = WeightedTable<Kernel>;

}  // namespace retake
