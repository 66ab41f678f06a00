// The standard normal distribution: its quantile function and its cumulative distribution function.
// Realises M. J. Wichura, "Algorithm AS 241: The Percentage Points of the Normal Distribution", Applied
// Statistics 37 (1988) 477-484, routine PPND16. Knows nothing of random draws or of chains.
#pragma once

#include <cmath>

namespace retake {

namespace as241 {

/// The polynomial in `x` with the given coefficients, that of the highest power first, by Horner's rule.
template <typename... Coefficients>
constexpr double polynomial(double x, double highest, Coefficients... lower) {
  double value = highest;
  ((value = value * x + lower), ...);
  return value;
}

/// normal_quantile where |p - 1/2| > 0.425 or p is NaN.
double tail_quantile(double p);

}  // namespace as241

/// The z with P(Z <= z) = p, with a relative error below 1e-15; -infinity at 0, infinity at 1, NaN outside
/// [0, 1].
inline double normal_quantile(double p) {
  const double q = p - 0.5;
  if (!(std::abs(q) <= 0.425)) return as241::tail_quantile(p);
  const double r = 0.180625 - q * q;
  return q *
         as241::polynomial(r, 2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4,
                           4.5921953931549871457e4, 1.3731693765509461125e4, 1.9715909503065514427e3,
                           1.3314166789178437745e2, 3.3871328727963666080e0) /
         as241::polynomial(r, 5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4,
                           2.1213794301586595867e4, 5.3941960214247511077e3, 6.8718700749205790830e2,
                           4.2313330701600911252e1, 1.0);
}

/// P(Z <= z), by std::erfc, so that the lower tail keeps its relative accuracy.
double normal_cdf(double z);

}  // namespace retake
