#include "sampler/diagnostics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "sampler/normal.h"

namespace retake {

namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Index count_of(const ChainDraws& chains) {
  Index count = 0;
  for (const VectorXd& chain : chains)
    count += chain.size();
  return count;
}

Index shortest(const ChainDraws& chains) {
  Index length = chains.empty() ? 0 : chains.front().size();
  for (const VectorXd& chain : chains)
    length = std::min(length, chain.size());
  return length;
}

Index longest(const ChainDraws& chains) {
  Index length = 0;
  for (const VectorXd& chain : chains)
    length = std::max(length, chain.size());
  return length;
}

/// One chain after the other.
VectorXd pooled(const ChainDraws& chains) {
  VectorXd all(count_of(chains));
  Index begin = 0;
  for (const VectorXd& chain : chains) {
    all.segment(begin, chain.size()) = chain;
    begin += chain.size();
  }
  return all;
}

/// `function` of each draw.
template <typename Function>
ChainDraws each(const ChainDraws& chains, Function&& function) {
  ChainDraws result;
  for (const VectorXd& chain : chains)
    result.push_back(chain.unaryExpr(function));
  return result;
}

bool are_finite(const ChainDraws& chains) {
  return !chains.empty() && std::all_of(chains.begin(), chains.end(), [](const VectorXd& chain) {
    return chain.size() > 0 && chain.allFinite();
  });
}

/// Whether the draws are finite and differ, by posterior's absolute tolerance.
bool vary(const ChainDraws& chains) {
  if (!are_finite(chains)) return false;
  double least = chains[0][0], most = least;
  for (const VectorXd& chain : chains) {
    least = std::min(least, chain.minCoeff());
    most = std::max(most, chain.maxCoeff());
  }
  return most - least >= std::numeric_limits<double>::epsilon();
}

/// Mean in two passes, so that equal values give exactly that value.
double mean_of(const Eigen::Ref<const VectorXd>& values) {
  const double mean = values.mean();
  return mean + (values.array() - mean).mean();
}

double variance_of(const Eigen::Ref<const VectorXd>& values) {
  return (values.array() - mean_of(values)).square().sum() / static_cast<double>(values.size() - 1);
}

/// Each chain's share of all draws.
VectorXd shares_of(const ChainDraws& chains) {
  VectorXd shares(static_cast<Index>(chains.size()));
  const double count = static_cast<double>(count_of(chains));
  for (Index chain = 0; chain < shares.size(); ++chain)
    shares[chain] = static_cast<double>(chains[static_cast<std::size_t>(chain)].size()) / count;
  return shares;
}

/// Variance of the chains' means, each weighed by its share of the draws; unbiased if chains agree in it.
/// Requires: at least two chains.
double variance_of_means(const ChainDraws& chains) {
  const VectorXd shares = shares_of(chains);
  VectorXd means(shares.size());
  for (Index chain = 0; chain < shares.size(); ++chain)
    means[chain] = mean_of(chains[static_cast<std::size_t>(chain)]);
  const double mean = means[0] + shares.dot((means.array() - means[0]).matrix());
  return shares.dot((means.array() - mean).square().matrix()) / (1 - shares.squaredNorm());
}

/// Variance within the chains, each weighed by its share of the draws.
double variance_within(const ChainDraws& chains) {
  const VectorXd shares = shares_of(chains);
  double within = 0;
  for (Index chain = 0; chain < shares.size(); ++chain)
    within += shares[chain] * variance_of(chains[static_cast<std::size_t>(chain)]);
  return within;
}

/// Each chain's first and second half as chains of their own, without the middle draw if their number is odd.
ChainDraws split_chains(const ChainDraws& chains) {
  ChainDraws halves;
  for (const VectorXd& chain : chains) {
    const Index half = chain.size() / 2;
    halves.push_back(chain.head(half));
    halves.push_back(chain.tail(half));
  }
  return halves;
}

/// R's type 7 quantile of all draws, rounded as R rounds it, so that the same draws lie below it.
double quantile(const ChainDraws& chains, double probability) {
  VectorXd values = pooled(chains);
  const double position = 1.0 + static_cast<double>(values.size() - 1) * probability;
  const double fraction = position - std::floor(position);
  const auto lower = values.begin() + static_cast<Index>(position) - 1;
  std::nth_element(values.begin(), lower, values.end());
  if (fraction == 0.0) return *lower;
  const double upper = *std::min_element(lower + 1, values.end());
  return upper == *lower ? upper : (1.0 - fraction) * *lower + fraction * upper;
}

/// Distances from the median of all draws.
ChainDraws fold(const ChainDraws& chains) {
  return each(chains, [median = quantile(chains, 0.5)](double draw) { return std::abs(draw - median); });
}

/// Each draw replaced by the normal quantile of its rank among all of them.
ChainDraws rank_normalise(const ChainDraws& chains) {
  const VectorXd values = pooled(chains);
  const Index count = values.size();
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return values[a] < values[b]; });

  VectorXd scores(count);
  for (auto first = order.begin(); first != order.end();) {
    const auto last = std::find_if(first, order.end(), [&](Index i) { return values[i] != values[*first]; });
    const double rank = 0.5 * static_cast<double>((first - order.begin()) + 1 + (last - order.begin()));
    const double score = normal_quantile((rank - 0.375) / (static_cast<double>(count) + 0.25));
    for (; first != last; ++first)
      scores[*first] = score;
  }
  ChainDraws normalised;
  Index begin = 0;
  for (const VectorXd& chain : chains) {
    normalised.push_back(scores.segment(begin, chain.size()));
    begin += chain.size();
  }
  return normalised;
}

/// The R-hat of Gelman and Rubin.
double potential_scale_reduction(const ChainDraws& chains) {
  if (shortest(chains) < 2 || !vary(chains)) return kNaN;
  const double length = static_cast<double>(count_of(chains)) / static_cast<double>(chains.size());
  return std::sqrt(variance_of_means(chains) / variance_within(chains) + (length - 1.0) / length);
}

/// A chain's autocovariance at every lag, times its length.
VectorXd lagged_products(const VectorXd& chain) {
  const auto padded_length = static_cast<Index>(std::bit_ceil(2 * static_cast<std::size_t>(chain.size())));
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  VectorXd padded = VectorXd::Zero(padded_length);
  padded.head(chain.size()) = chain.array() - mean_of(chain);
  VectorXcd spectrum;
  fft.fwd(spectrum, padded);
  const VectorXcd power = spectrum.cwiseAbs2().cast<std::complex<double>>();
  VectorXd products;
  fft.inv(products, power, padded_length);
  return products.head(chain.size());
}

/// The autocorrelation at every lag of the longest chain, as Vehtari et al. combine chains: of those that
/// reach so far. (Were the others to say how far chains lie apart where they say nothing of what is
/// remembered, many short ones would make a long one worth nothing.)
VectorXd autocorrelations(const ChainDraws& chains) {
  std::vector<VectorXd> products;
  std::vector<Index> lengths;
  for (const VectorXd& chain : chains) {
    products.push_back(lagged_products(chain));
    lengths.push_back(chain.size());
  }
  std::sort(lengths.begin(), lengths.end());
  lengths.erase(std::unique(lengths.begin(), lengths.end()), lengths.end());

  VectorXd correlations(lengths.back());
  Index begin = 0;
  for (const Index length : lengths) {
    ChainDraws reaching;
    VectorXd sum = VectorXd::Zero(length);
    for (std::size_t i = 0; i < chains.size(); ++i)
      if (chains[i].size() >= length) {
        reaching.push_back(chains[i]);
        sum += products[i].head(length);
      }
    // Autocovariances have the chains' lengths in the denominator; variance within the chains, and over all.
    const VectorXd autocovariance = sum / static_cast<double>(count_of(reaching));
    const double within = variance_within(reaching);
    const double overall = autocovariance[0] + (reaching.size() > 1 ? variance_of_means(reaching) : 0);
    for (Index lag = begin; lag < length; ++lag)
      correlations[lag] = overall > 0 ? 1.0 - (within - autocovariance[lag]) / overall : 1.0;
    begin = length;
  }
  return correlations;
}

double effective_sample_size(const ChainDraws& chains) {
  const Index length = longest(chains);
  if (length < 3 || shortest(chains) < 2 || !vary(chains)) return kNaN;

  // Autocorrelations, up to the last pair of Geyer's initial positive sequence
  const VectorXd autocorrelation = autocorrelations(chains);
  VectorXd rho = VectorXd::Zero(length);
  double even = rho[0] = 1.0;
  double odd = rho[1] = autocorrelation[1];
  Index last = 0;
  while (last < length - 5 && even + odd > 0.0) {
    last += 2;
    even = autocorrelation[last];
    odd = autocorrelation[last + 1];
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
  const double draw_count = static_cast<double>(count_of(chains));
  const double tau = -1.0 + 2.0 * rho.head(std::max<Index>(last, 1)).sum() + rho[last];

  // Effective sample size, bounded for antithetic chains
  return draw_count / std::max(tau, 1.0 / std::log10(draw_count));
}

/// Effective sample size for a quantile: that of the indicator of the draws up to it.
double ess_quantile(const ChainDraws& draws, double probability) {
  const double limit = quantile(draws, probability);
  return effective_sample_size(
      split_chains(each(draws, [&](double draw) { return draw <= limit ? 1.0 : 0.0; })));
}

/// `scores` are the split draws, rank-normalised.
double rhat_of(const ChainDraws& scores, const ChainDraws& draws) {
  const double bulk = potential_scale_reduction(scores);
  const double tail = potential_scale_reduction(rank_normalise(split_chains(fold(draws))));
  return Eigen::Vector2d(bulk, tail).maxCoeff<Eigen::PropagateNaN>();
}

}  // namespace

ChainDraws chains_of(const Eigen::MatrixXd& columns) {
  ChainDraws chains;
  for (const auto& column : columns.colwise())
    chains.emplace_back(column);
  return chains;
}

double rank_normalised_split_rhat(const ChainDraws& draws) {
  return are_finite(draws) ? rhat_of(rank_normalise(split_chains(draws)), draws) : kNaN;
}

double ess_bulk(const ChainDraws& draws) {
  if (!are_finite(draws)) return kNaN;
  return effective_sample_size(rank_normalise(split_chains(draws)));
}

double ess_tail(const ChainDraws& draws) {
  if (!vary(draws)) return kNaN;
  return Eigen::Vector2d(ess_quantile(draws, 0.05), ess_quantile(draws, 0.95))
      .minCoeff<Eigen::PropagateNaN>();
}

double ess_mean(const ChainDraws& draws) {
  if (!are_finite(draws)) return kNaN;
  return effective_sample_size(split_chains(draws));
}

double ess_across(const ChainDraws& draws) {
  if (draws.size() < 2 || !are_finite(draws)) return kNaN;
  // All draws together, not within each chain: chains that never leave their place are one draw each.
  const VectorXd shares = shares_of(draws);
  const double of_means = variance_of_means(draws) * (1 - shares.squaredNorm());
  return of_means > 0 ? static_cast<double>(draws.size() - 1) * variance_of(pooled(draws)) / of_means : kNaN;
}

double ess_rough(const ChainDraws& draws) {
  const Index length = shortest(draws);
  if (length < 4 || !vary(draws)) return kNaN;
  const double variance = variance_of(pooled(draws));
  const auto by_means_of = [&](Index stretch) {
    std::vector<double> means;
    for (const VectorXd& chain : draws)
      for (Index i = 0; i + stretch <= chain.size(); i += stretch)
        means.push_back(chain.segment(i, stretch).mean());
    const Eigen::Map<const VectorXd> all(means.data(), static_cast<Index>(means.size()));
    return static_cast<double>(all.size()) * variance / variance_of(all);
  };
  const Index root = static_cast<Index>(std::sqrt(static_cast<double>(length)));
  return std::min(by_means_of(root), by_means_of(length / 2));
}

QuantityDiagnostics diagnose(const ChainDraws& draws) {
  const bool finite = are_finite(draws);
  const VectorXd all = pooled(draws);
  const ChainDraws scores = finite ? rank_normalise(split_chains(draws)) : ChainDraws();
  return {.rhat = finite ? rhat_of(scores, draws) : kNaN,
          .ess_bulk = finite ? effective_sample_size(scores) : kNaN,
          .ess_tail = ess_tail(draws),
          .mean = finite ? mean_of(all) : kNaN,
          .sd = finite ? std::sqrt(variance_of(all)) : kNaN};
}

double integrated_autocorrelation_time(const VectorXd& draws) {
  return static_cast<double>(draws.size()) / effective_sample_size({draws});
}

}  // namespace retake
