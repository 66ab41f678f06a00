// See odds.h.
#include "sampler/odds.h"

#include <algorithm>
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

/// The quantile of a beta distribution, a and b at least 1/2.
double beta_quantile(double a, double b, double probability) {
  double low = 0, high = 1;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (Eigen::numext::betainc(a, b, middle) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// The interval of a share that is not small, where a Poisson count would say that it may exceed 1.
Odds of_share(double hits, double draws) {
  constexpr double kMany = 1e5;  // chosen: the normal interval is then right to 1e-5 of its width
  const double share = hits / draws, misses = draws - hits;
  if (std::min(hits, misses) > kMany) {
    const double spread = normal_quantile(1 - kTail) * std::sqrt(share * (1 - share) / draws);
    return {.probability = share, .low = share - spread, .high = share + spread};
  }
  return {.probability = share,
          .low = beta_quantile(hits, misses + 1, kTail),
          .high = misses > 0 ? beta_quantile(hits + 1, misses, 1 - kTail) : 1};
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

void OddsPool::add(const OddsTally& tally) {
  OddsTally* const pools[] = {nullptr, &ladder_, &rejection_, &learned_};
  OddsTally* const pool = pools[static_cast<std::size_t>(tally.basis)];
  if (!pool) return;
  pool->basis = tally.basis;
  pool->add(tally);
}

OddsTally OddsPool::tally() const {
  if (learned_.draws == 0 && rejection_.draws == 0) return ladder_;
  return learned_.hits > 0 && learned_.hits >= rejection_.hits ? learned_ : rejection_;
}

std::optional<Odds> odds(const OddsTally& tally) {
  if (tally.draws == 0) return std::nullopt;
  const double draws = static_cast<double>(tally.draws), hits = static_cast<double>(tally.hits);
  constexpr double kSmall = 0.01;  // share, below which a Poisson count is as good
  const bool is_equal = hits * tally.squares <= tally.sum * tally.sum * (1 + 1e-9);
  if (tally.hits > 0 && is_equal && hits >= kSmall * draws && hits <= draws) {
    const Odds share = of_share(hits, draws);
    const double weight = tally.sum / hits;
    return Odds{.probability = std::min(weight * share.probability, 1.0),
                .low = std::min(weight * share.low, 1.0),
                .high = std::min(weight * share.high, 1.0)};
  }
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
