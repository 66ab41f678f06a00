// See spread.h.
#include "sampler/spread.h"

#include <cmath>
#include <limits>

#include "sampler/check.h"

namespace retake {

using Eigen::VectorXd;

void RunMoments::add(const VectorXd& values, double weight) {
  weight_ += weight;
  const VectorXd step = values - mean_;
  mean_ += weight / weight_ * step;
  squares_ += weight * step.cwiseProduct(values - mean_);
}

VectorXd ess_by_spread(const std::vector<RunMoments>& runs) {
  CHECK(runs.size() >= 2, runs.size());
  const double count = static_cast<double>(runs.size());
  VectorXd within = VectorXd::Zero(runs[0].mean().size()), mean = within, between = within;
  for (const RunMoments& run : runs) {
    within += run.variance() / count;
    mean += run.mean() / count;
  }
  for (const RunMoments& run : runs)
    between += (run.mean() - mean).cwiseAbs2() / (count - 1);
  // The variance of the mixture of all runs, which is that of the target once they agree.
  const VectorXd variance = within + (count - 1) / count * between;
  VectorXd effective(mean.size());
  for (Eigen::Index i = 0; i < mean.size(); ++i) {
    const bool varies = variance[i] > 1e-24 * (1 + mean[i] * mean[i]);
    effective[i] = varies ? variance[i] / between[i] : std::numeric_limits<double>::quiet_NaN();
  }
  return effective;
}

double harmonic_mean(const VectorXd& values) {
  double sum = 0, count = 0;
  for (const double value : values)
    if (!std::isnan(value)) {
      sum += 1 / value;
      ++count;
    }
  return count > 0 ? count / sum : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace retake
