// See odds.h.
#include "sampler/odds.h"

#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

#include "sampler/normal.h"

namespace retake {
namespace {

constexpr double kTail = 0.025;        // of a 95 % interval, on either side
constexpr double kLargestShape = 1e5;  // chosen: Eigen's series for igamma is cut off a little above 1e6

/// The quantile of a gamma distribution with this shape and scale 1.
double gamma_quantile(double shape, double probability) {
  if (shape > kLargestShape) {
    // Wilson and Hilferty's cube root; of counts so large within 0.001.
    const double spread = 1 / (9 * shape);
    const double root = 1 - spread + normal_quantile(probability) * std::sqrt(spread);
    return shape * root * root * root;
  }
  double low = 0, high = shape + 20 * (1 + std::sqrt(shape));
  for (int i = 0; i < 200 && high - low > 1e-12 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (Eigen::numext::igamma(shape, middle) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

std::string_view to_string(OddsBasis basis) {
  switch (basis) {
    case OddsBasis::none:
      break;
    case OddsBasis::ladder:
      return "ladder";
    case OddsBasis::rejection:
      return "rejection";
    case OddsBasis::learned:
      return "learned";
  }
  return "";
}

OddsBasis odds_basis_from(std::string_view name) {
  for (const OddsBasis basis : {OddsBasis::ladder, OddsBasis::rejection, OddsBasis::learned})
    if (to_string(basis) == name) return basis;
  return OddsBasis::none;
}

std::optional<Odds> odds(const OddsTally& tally) {
  if (tally.draws == 0) return std::nullopt;
  const double draws = static_cast<double>(tally.draws);
  // A weighted sum of Poisson counts, matched by a gamma distribution; with equal weights the exact interval.
  // One more hit of the largest weight is what may just have been missed.
  const double estimate = tally.sum / draws, variance = tally.squares / (draws * draws);
  const double step = (tally.hits > 0 ? tally.largest : 1) / draws;
  const auto gamma = [](double mean, double spread, double probability) {
    return spread / mean * gamma_quantile(mean * mean / spread, probability);
  };
  return Odds{.probability = std::min(estimate, 1.0),
              .low = tally.hits > 0 ? std::min(gamma(estimate, variance, kTail), 1.0) : 0,
              .high = std::min(gamma(estimate + step, variance + step * step, 1 - kTail), 1.0)};
}

}  // namespace retake
