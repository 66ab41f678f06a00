// LearnedRedraw: a frozen proposal q, the mixture of the prior and a kernel density of States that satisfied
// the constraint; how it is drawn, weighed and learned. doc/design.md, section 3, "Conditional". It must not
// know chains.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "sampler/bytes.h"
#include "sampler/model.h"
#include "sampler/random.h"

namespace retake {

/// One Variable as a redraw learns it: as it is, or as value + shift(State), so that what matters is one
/// coordinate (where a ball arrives, rather than where it starts).
struct Coordinate {
  std::size_t variable;
  /// Does not read the Variable itself, nor later coordinates of the list: the change of coordinates then has
  /// unit Jacobian. Null: no shift.
  std::function<double(const State&)> shift{};
};

/// The coordinates and how States are brought to them and back.
class Block {
 public:
  /// Empty `coordinates` mean every Variable that is always present and no switch.
  /// Requires: those given are such, and each is given once.
  Block(const Model& model, std::vector<Coordinate> coordinates);

  const Model& model() const { return *model_; }
  const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  std::size_t size() const { return coordinates_.size(); }
  std::vector<std::size_t> variables() const;
  /// The other Variables, in the order of the Model.
  const std::vector<std::size_t>& rest() const { return rest_; }
  const Distribution& prior(std::size_t coordinate) const {
    return model_->variables()[coordinates_[coordinate].variable].prior;
  }
  double value(const State& state, std::size_t coordinate) const;

 private:
  const Model* model_;
  std::vector<Coordinate> coordinates_;
  std::vector<std::size_t> rest_;
};

/// A State that satisfied the constraint, and its weight p / q under the q that drew it.
struct WeighedState {
  State state;
  double weight = 1;
};

/// Thins weighed States to about `count`, so that sums over them stay what they are in the mean: a State of
/// weight w is kept with probability min(1, w / c), and then weighs at least c.
std::vector<WeighedState> thin(std::vector<WeighedState> states, std::size_t count, RandomStream& random);

/// q(c) = e p(c) + (1 - e) sum_i W_i prod_j K_j(c_j - c_ij) over the coordinates of a Block; what is not in
/// the Block is drawn from the prior. K_j is 0.85 N(0, h_j) + 0.15 N(0, 3.5 h_j), or the prior where a
/// coordinate does not matter. Immutable once made.
class LearnedRedraw {
 public:
  /// The prior alone: every weight is 1.
  LearnedRedraw() = default;

  /// Draws a State of the Block's Model. It may lie outside the prior's support.
  void draw(const Block& block, RandomStream& random, State& state) const;
  /// log (p / q), at most -log e; where p > 0.
  double log_weight(const Block& block, const State& state) const;

  const Eigen::VectorXd& widths() const { return widths_; }
  bool is_prior() const { return kernels() == 0; }
  std::size_t kernels() const { return static_cast<std::size_t>(shares_.size()); }
  double prior_share() const { return prior_share_; }
  /// The mean weight of a hit, left out of the kernels: the smaller, the better. 1 for the prior.
  double mean_weight() const { return mean_weight_; }
  /// About the mean weight of the hits that q draws. 1 for the prior.
  double drawn_weight() const { return drawn_weight_; }

  struct Fit {
    std::size_t most_kernels = 200;
    int sweeps = 1;
    /// How many hits the prior alone has given, or would have. About one in so many lies where no kernel is.
    double plain_hits = 1;
  };
  /// Chooses a width for every coordinate by coordinate descent on the mean weight, each hit left out of the
  /// kernels that weigh it; then the kernels' shares W and the share e of the prior by the mean weight and
  /// 1 / (e plain_hits), which hits where no kernel is will add: they weigh up to 1 / e.
  /// Requires: at least two hits.
  static LearnedRedraw learn(const Block& block, const std::vector<WeighedState>& hits, const Fit& fit,
                             RandomStream& random);

  void write(ByteWriter& out) const;
  /// Throws: std::out_of_range.
  static LearnedRedraw read(ByteReader& in, const Block& block);

 private:
  double prior_share_ = 1;
  double mean_weight_ = 1;
  double drawn_weight_ = 1;
  Eigen::VectorXd shares_;      ///< W, sums to 1 [kernels]
  Eigen::MatrixXd centres_;     ///< [coordinates, kernels]
  Eigen::VectorXd widths_;      ///< h [coordinates]; 0: the prior
  Eigen::VectorXd cumulative_;  ///< of shares_
};

}  // namespace retake
