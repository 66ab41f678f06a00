// How many independent draws a run is worth, judged by how far runs of different seeds disagree.
// Within a run correlation hides: a chain that never leaves one mode looks mixed. Knows nothing of what was
// drawn.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace retake {

/// Weighted mean and variance of some quantities over one run, gathered draw by draw.
class RunMoments {
 public:
  explicit RunMoments(Eigen::Index quantities)
      : mean_(Eigen::VectorXd::Zero(quantities)), squares_(Eigen::VectorXd::Zero(quantities)) {}
  /// Requires: weight > 0.
  void add(const Eigen::VectorXd& values, double weight);
  double weight() const { return weight_; }
  const Eigen::VectorXd& mean() const { return mean_; }
  Eigen::VectorXd variance() const { return squares_ / weight_; }

 private:
  double weight_ = 0;
  Eigen::VectorXd mean_;
  Eigen::VectorXd squares_;  ///< weighted, about the mean
};

/// Independent draws that one run is worth, for each quantity: the variance of all runs' draws over the
/// variance of the runs' means. NaN for a quantity that does not vary. Its inverse is unbiased, so average it
/// harmonically. Requires: at least two runs, each with a draw.
Eigen::VectorXd ess_by_spread(const std::vector<RunMoments>& runs);

/// The harmonic mean over those that are not NaN; NaN if there are none.
double harmonic_mean(const Eigen::VectorXd& values);

}  // namespace retake
