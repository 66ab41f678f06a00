#include "sampler/diagnostics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "sampler/normal.h"

namespace retake {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool are_finite(const MatrixXd& draws) {
  return draws.size() > 0 && draws.allFinite();
}

/// Whether the draws are finite and differ, by posterior's absolute tolerance.
bool vary(const MatrixXd& draws) {
  return are_finite(draws) && draws.maxCoeff() - draws.minCoeff() >= std::numeric_limits<double>::epsilon();
}

/// Mean in two passes, so that equal values give exactly that value.
double mean_of(const Eigen::Ref<const VectorXd>& values) {
  const double mean = values.mean();
  return mean + (values.array() - mean).mean();
}

double variance_of(const Eigen::Ref<const VectorXd>& values) {
  return (values.array() - mean_of(values)).square().sum() / static_cast<double>(values.size() - 1);
}

VectorXd chain_means(const MatrixXd& chains) {
  VectorXd means(chains.cols());
  for (Index chain = 0; chain < chains.cols(); ++chain)
    means[chain] = mean_of(chains.col(chain));
  return means;
}

/// Each chain's first and second half as chains of their own, without the middle draw if their number is odd.
MatrixXd split_chains(const MatrixXd& draws) {
  const Index half = draws.rows() / 2;
  MatrixXd halves(half, 2 * draws.cols());
  halves << draws.topRows(half), draws.bottomRows(half);
  return halves;
}

/// R's type 7 quantile of all draws, rounded as R rounds it, so that the same draws lie below it.
double quantile(const MatrixXd& draws, double probability) {
  std::vector<double> values(draws.data(), draws.data() + draws.size());
  const double position = 1.0 + static_cast<double>(draws.size() - 1) * probability;
  const double fraction = position - std::floor(position);
  const auto lower = values.begin() + static_cast<Index>(position) - 1;
  std::nth_element(values.begin(), lower, values.end());
  if (fraction == 0.0) return *lower;
  const double upper = *std::min_element(lower + 1, values.end());
  return upper == *lower ? upper : (1.0 - fraction) * *lower + fraction * upper;
}

/// Distances from the median of all draws.
MatrixXd fold(const MatrixXd& draws) {
  return (draws.array() - quantile(draws, 0.5)).abs();
}

/// Each draw replaced by the normal quantile of its rank among all of them.
MatrixXd rank_normalise(const MatrixXd& draws) {
  const Index count = draws.size();
  const double* values = draws.data();
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [values](Index a, Index b) { return values[a] < values[b]; });

  MatrixXd scores(draws.rows(), draws.cols());
  for (auto first = order.begin(); first != order.end();) {
    const auto last = std::find_if(first, order.end(), [&](Index i) { return values[i] != values[*first]; });
    const double rank = 0.5 * static_cast<double>((first - order.begin()) + 1 + (last - order.begin()));
    const double score = normal_quantile((rank - 0.375) / (static_cast<double>(count) + 0.25));
    for (; first != last; ++first)
      scores.data()[*first] = score;
  }
  return scores;
}

/// The R-hat of Gelman and Rubin.
double potential_scale_reduction(const MatrixXd& chains) {
  if (chains.rows() < 2 || !vary(chains)) return kNaN;
  const double length = static_cast<double>(chains.rows());
  double within = 0.0;
  for (const auto& chain : chains.colwise())
    within += variance_of(chain);
  within /= static_cast<double>(chains.cols());
  const double between = length * variance_of(chain_means(chains));
  return std::sqrt((between / within + length - 1.0) / length);
}

/// The autocovariance at every lag, with the chain's length in the denominator, averaged over the chains.
VectorXd mean_autocovariance(const MatrixXd& chains) {
  const Index length = chains.rows();
  const Index padded_length = static_cast<Index>(std::bit_ceil(static_cast<std::size_t>(2 * length)));
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);

  VectorXd padded = VectorXd::Zero(padded_length);
  VectorXcd spectrum;
  VectorXcd power = VectorXcd::Zero(padded_length / 2 + 1);
  for (const auto& chain : chains.colwise()) {
    padded.head(length) = chain.array() - mean_of(chain);
    fft.fwd(spectrum, padded);
    power += spectrum.cwiseAbs2();
  }
  VectorXd lagged_products;
  fft.inv(lagged_products, power, padded_length);
  return lagged_products.head(length) / static_cast<double>(chains.size());
}

double effective_sample_size(const MatrixXd& chains) {
  const Index length = chains.rows();
  if (length < 3 || !vary(chains)) return kNaN;

  // Variance within the chains and over all of them
  const VectorXd autocovariance = mean_autocovariance(chains);
  const double within = autocovariance[0] * static_cast<double>(length) / static_cast<double>(length - 1);
  double overall = autocovariance[0];
  if (chains.cols() > 1) overall += variance_of(chain_means(chains));

  // Autocorrelations, up to the last pair of Geyer's initial positive sequence
  const auto autocorrelation = [&](Index lag) { return 1.0 - (within - autocovariance[lag]) / overall; };
  VectorXd rho = VectorXd::Zero(length);
  double even = rho[0] = 1.0;
  double odd = rho[1] = autocorrelation(1);
  Index last = 0;
  while (last < length - 5 && even + odd > 0.0) {
    last += 2;
    even = autocorrelation(last);
    odd = autocorrelation(last + 1);
    if (even + odd >= 0.0) {
      rho[last] = even;
      rho[last + 1] = odd;
    }
  }
  if (even > 0.0) rho[last] = even;

  // Geyer's initial monotone sequence
  for (Index lag = 2; lag <= last - 2; lag += 2) {
    const double previous_pair = rho[lag - 2] + rho[lag - 1];
    if (rho[lag] + rho[lag + 1] > previous_pair) rho[lag] = rho[lag + 1] = previous_pair / 2.0;
  }

  // Integrated autocorrelation time; without any later pair posterior still counts the first term
  const double draw_count = static_cast<double>(chains.size());
  const double tau = -1.0 + 2.0 * rho.head(std::max<Index>(last, 1)).sum() + rho[last];

  // Effective sample size, bounded for antithetic chains
  return draw_count / std::max(tau, 1.0 / std::log10(draw_count));
}

/// Effective sample size for a quantile: that of the indicator of the draws up to it.
double ess_quantile(const MatrixXd& draws, double probability) {
  const MatrixXd below = (draws.array() <= quantile(draws, probability)).cast<double>();
  return effective_sample_size(split_chains(below));
}

/// `scores` are the split draws, rank-normalised.
double rhat_of(const MatrixXd& scores, const MatrixXd& draws) {
  const double bulk = potential_scale_reduction(scores);
  const double tail = potential_scale_reduction(rank_normalise(split_chains(fold(draws))));
  return Eigen::Vector2d(bulk, tail).maxCoeff<Eigen::PropagateNaN>();
}

}  // namespace

double rank_normalised_split_rhat(const MatrixXd& draws) {
  return are_finite(draws) ? rhat_of(rank_normalise(split_chains(draws)), draws) : kNaN;
}

double ess_bulk(const MatrixXd& draws) {
  if (!are_finite(draws)) return kNaN;
  return effective_sample_size(rank_normalise(split_chains(draws)));
}

double ess_tail(const MatrixXd& draws) {
  if (!vary(draws)) return kNaN;
  return Eigen::Vector2d(ess_quantile(draws, 0.05), ess_quantile(draws, 0.95))
      .minCoeff<Eigen::PropagateNaN>();
}

double ess_mean(const MatrixXd& draws) {
  if (!are_finite(draws)) return kNaN;
  return effective_sample_size(split_chains(draws));
}

double ess_rough(const MatrixXd& draws) {
  if (draws.rows() < 4 || !vary(draws)) return kNaN;
  const double variance = variance_of(draws.reshaped());
  const auto by_means_of = [&](Index stretch) {
    const Index per_chain = draws.rows() / stretch;
    VectorXd means(per_chain * draws.cols());
    for (Index chain = 0; chain < draws.cols(); ++chain)
      for (Index i = 0; i < per_chain; ++i)
        means[chain * per_chain + i] = draws.col(chain).segment(i * stretch, stretch).mean();
    return static_cast<double>(means.size()) * variance / variance_of(means);
  };
  const Index root = static_cast<Index>(std::sqrt(static_cast<double>(draws.rows())));
  return std::min(by_means_of(root), by_means_of(draws.rows() / 2));
}

QuantityDiagnostics diagnose(const MatrixXd& draws) {
  const bool finite = are_finite(draws);
  const auto all_draws = draws.reshaped();
  const MatrixXd scores = finite ? rank_normalise(split_chains(draws)) : MatrixXd();
  return {.rhat = finite ? rhat_of(scores, draws) : kNaN,
          .ess_bulk = finite ? effective_sample_size(scores) : kNaN,
          .ess_tail = ess_tail(draws),
          .mean = finite ? mean_of(all_draws) : kNaN,
          .sd = finite ? std::sqrt(variance_of(all_draws)) : kNaN};
}

double integrated_autocorrelation_time(const VectorXd& draws) {
  return static_cast<double>(draws.size()) / effective_sample_size(draws);
}

}  // namespace retake
