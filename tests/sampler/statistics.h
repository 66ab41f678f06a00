// The statistics that the tests of sampler/ and worlds/ judge by. Every p-value is two-sided or upper-tail,
// and a test fails below kErrorRate: seeds are fixed, so that is the chance that a correct program fails
// after a change of draws.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <vector>

#include "sampler/distribution.h"
#include "sampler/normal.h"
#include "sampler/random.h"

namespace retake::tests {

inline constexpr double kErrorRate = 1e-6;   ///< of one comparison
inline constexpr double kLargestZ = 4.8917;  ///< |z| of a two-sided comparison at kErrorRate

inline RandomStream stream(std::uint64_t seed, std::uint64_t iteration = 0,
                           Purpose purpose = Purpose::initial) {
  return RandomStream({.seed = seed, .chain = 0, .replica = 0, .purpose = purpose, .iteration = iteration});
}

struct Moments {
  double mean = 0;
  double variance = 0;
  double count = 0;
  double standard_error() const { return std::sqrt(variance / count); }
};

inline Moments moments(const std::vector<double>& draws) {
  Moments of{.mean = 0, .variance = 0, .count = static_cast<double>(draws.size())};
  of.mean = std::accumulate(draws.begin(), draws.end(), 0.0) / of.count;
  for (const double draw : draws)
    of.variance += (draw - of.mean) * (draw - of.mean) / (of.count - 1);
  return of;
}

/// How many standard errors the mean of independent draws lies above `expected`.
inline double z_of_mean(const std::vector<double>& draws, double expected) {
  const Moments of = moments(draws);
  if (of.variance == 0) return of.mean == expected ? 0 : std::numeric_limits<double>::infinity();
  return (of.mean - expected) / of.standard_error();
}

/// How many standard errors the means of two independent sets of independent draws differ by.
inline double z_of_means(const std::vector<double>& left, const std::vector<double>& right) {
  const Moments a = moments(left), b = moments(right);
  const double error = std::hypot(a.standard_error(), b.standard_error());
  if (error == 0) return a.mean == b.mean ? 0 : std::numeric_limits<double>::infinity();
  return (a.mean - b.mean) / error;
}

/// How many standard errors `hits` of `trials` lie above a probability.
inline double z_of_share(double hits, double trials, double probability) {
  return (hits - trials * probability) / std::sqrt(trials * probability * (1 - probability));
}

/// P(chi-square > statistic), by Wilson and Hilferty's cube root; within a factor 2 of the truth down to
/// 1e-8.
inline double chi_square_p(double statistic, double degrees) {
  const double spread = 2 / (9 * degrees);
  return normal_cdf((1 - spread - std::cbrt(statistic / degrees)) / std::sqrt(spread));
}

/// Of counts against what was expected of them. Requires: no expectation much below 5.
inline double chi_square_p(const std::vector<double>& counts, const std::vector<double>& expected) {
  double statistic = 0;
  for (std::size_t i = 0; i < counts.size(); ++i)
    statistic += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
  return chi_square_p(statistic, static_cast<double>(counts.size() - 1));
}

/// Kolmogorov's tail, with Stephens' correction for an effective number of draws.
inline double kolmogorov_p(double distance, double effective) {
  const double root = std::sqrt(effective);
  const double lambda = (root + 0.12 + 0.11 / root) * distance;
  if (lambda < 0.3) return 1;
  double sum = 0;
  for (int k = 1; k <= 100; ++k)
    sum += (k % 2 == 1 ? 2 : -2) * std::exp(-2.0 * k * k * lambda * lambda);
  return std::min(1.0, sum);
}

/// Kolmogorov-Smirnov test of independent draws against a cumulative distribution function.
template <typename Cdf>
double kolmogorov_smirnov_p(std::vector<double> draws, Cdf&& cdf) {
  std::sort(draws.begin(), draws.end());
  const double count = static_cast<double>(draws.size());
  double distance = 0;
  for (std::size_t i = 0; i < draws.size(); ++i) {
    const double below = static_cast<double>(i) / count, expected = cdf(draws[i]);
    distance = std::max({distance, expected - below, below + 1 / count - expected});
  }
  return kolmogorov_p(distance, count);
}

/// Kolmogorov-Smirnov test of two independent sets of independent draws.
inline double kolmogorov_smirnov_p(std::vector<double> left, std::vector<double> right) {
  std::sort(left.begin(), left.end());
  std::sort(right.begin(), right.end());
  const double m = static_cast<double>(left.size()), n = static_cast<double>(right.size());
  double distance = 0;
  for (std::size_t i = 0, j = 0; i < left.size() && j < right.size();) {
    const double value = std::min(left[i], right[j]);
    while (i < left.size() && left[i] == value)
      ++i;
    while (j < right.size() && right[j] == value)
      ++j;
    distance = std::max(distance, std::abs(static_cast<double>(i) / m - static_cast<double>(j) / n));
  }
  return kolmogorov_p(distance, m * n / (m + n));
}

/// P(draw <= value) of a uniform or a Gaussian.
inline double cdf(const Distribution& distribution, double value) {
  if (distribution.kind() == Distribution::Kind::uniform)
    return std::clamp((value - distribution.low()) / (distribution.high() - distribution.low()), 0.0, 1.0);
  return normal_cdf((value - distribution.mean()) / distribution.standard_deviation());
}

/// Simpson's rule with an even number of intervals.
template <typename Function>
double integrate(Function&& function, double from, double to, int intervals = 2000) {
  const double width = (to - from) / intervals;
  double sum = function(from) + function(to);
  for (int i = 1; i < intervals; ++i)
    sum += (i % 2 == 1 ? 4 : 2) * function(from + i * width);
  return sum * width / 3;
}

}  // namespace retake::tests
