// See learned.h.
#include "sampler/learned.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

using Eigen::ArrayXd;
using Eigen::ArrayXXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A kernel: mostly narrow, with tails that reach a neighbouring mode.
constexpr double kNarrowShare = 0.85;
constexpr double kWide = 3.5;
const double kNormal = 1 / std::sqrt(2 * std::numbers::pi);

// Widths to choose from, in standard deviations of the hits. Where a start is widened to the prior, a shifted
// coordinate, which has no prior of its own, is widened to kWidest.
constexpr std::array kWidths = {0.005, 0.01, 0.02, 0.04, 0.07, 0.12, 0.2, 0.35, 0.6, 1.0};
constexpr double kWidest = 1.5;
constexpr double kFirstWidth = 0.2;

// Shares of the prior to choose from, and the one for which widths are chosen.
constexpr std::array kShares = {0.9, 0.7, 0.5, 0.3, 0.2, 0.1};
constexpr double kTypicalShare = 0.5;

// Powers to choose from: a kernel's share is its hit's share of the target times the hit's p / q to the
// power. With 0 the kernels' density follows the target, p P(hit); the mean weight is least where it follows
// p sqrt(P(hit)), which is near 1/2.
constexpr std::array kPowers = {0.0, 0.25, 0.5, 0.75};

double kernel(double distance, double width) {
  const double z = distance / width, wide = z / kWide;
  return kNormal / width *
         (kNarrowShare * std::exp(-0.5 * z * z) + (1 - kNarrowShare) / kWide * std::exp(-0.5 * wide * wide));
}

ArrayXXd kernel(const ArrayXXd& distances, double width) {
  const ArrayXXd squares = (distances / width).square();
  return kNormal / width *
         (kNarrowShare * (-0.5 * squares).exp() +
          (1 - kNarrowShare) / kWide * (-0.5 / (kWide * kWide) * squares).exp());
}

VectorXd cumulated(const VectorXd& shares) {
  VectorXd sums(shares.size());
  std::partial_sum(shares.begin(), shares.end(), sums.begin());
  return sums;
}

/// What a fit looks at: for every coordinate the distances between hits, and the densities that the kernels
/// are measured against.
class Fitting {
  const Block& block_;

 public:
  Fitting(const Block& block, const std::vector<WeighedState>& hits)
      : block_(block), widths(static_cast<Index>(block.size())), weights_(static_cast<Index>(hits.size())) {
    const auto count = static_cast<Index>(hits.size()), coordinates = static_cast<Index>(block.size());
    centres.resize(coordinates, count);
    densities_.resize(coordinates, count);
    for (Index i = 0; i < count; ++i) {
      const WeighedState& hit = hits[static_cast<std::size_t>(i)];
      weights_[i] = hit.weight;
      for (Index j = 0; j < coordinates; ++j) {
        const auto coordinate = static_cast<std::size_t>(j);
        centres(j, i) = block.value(hit.state, coordinate);
        densities_(j, i) = std::exp(
            block.prior(coordinate).log_density(at(hit.state, block.coordinates()[coordinate].variable)));
      }
    }
    weights_ /= weights_.sum();
    shares = weights_;
    for (Index j = 0; j < coordinates; ++j) {
      const double mean = centres.row(j).dot(weights_);
      const double variance = (centres.row(j).array() - mean).square().matrix().dot(weights_);
      // Hits that agree to the last bit teach nothing about a width.
      spreads_.push_back(std::max(std::sqrt(variance),
                                  1e-9 * block.prior(static_cast<std::size_t>(j)).standard_deviation()));
      factors_.emplace_back();
      set_width(j, is_shifted(j) ? kFirstWidth * spreads_.back() : 0);
    }
  }

  void sweep(double prior_share) {
    // What is shifted was declared to matter most.
    for (const bool shifted : {true, false})
      for (Index j = 0; j < widths.size(); ++j)
        if (is_shifted(j) == shifted) choose_width(j, prior_share);
  }

  /// Gives the kernels where hits are rare among draws more than the target has of them.
  void flatten(double power) {
    shares = weights_;  // by which the weights are judged
    shares = weights_.array() * weights_left_out(product(), kTypicalShare).pow(power);
    shares /= shares.sum();
  }

  /// The weights of hits under this share of the prior: their mean, as the target has them and as q draws
  /// them.
  struct MeanWeight {
    double of_target;
    double of_draws;
  };
  MeanWeight mean_weight(double prior_share) const {
    const ArrayXd left_out = weights_left_out(product(), prior_share);
    return {.of_target = (left_out * weights_.array()).sum(),
            .of_draws = 1 / (weights_.array() / left_out).sum()};
  }

  MatrixXd centres;  ///< [coordinates, hits]
  VectorXd shares;   ///< of the kernels [hits]
  VectorXd widths;

 private:
  bool is_shifted(Index j) const {
    return static_cast<bool>(block_.coordinates()[static_cast<std::size_t>(j)].shift);
  }

  /// K(c_a - c_i) / p(c_a), a row a hit that is weighed, a column a kernel. Empty for the prior: all 1.
  ArrayXXd factor(Index j, double width) const {
    if (width == 0) return {};
    const Index count = weights_.size();
    const ArrayXXd distances =
        centres.row(j).transpose().array().replicate(1, count) - centres.row(j).array().replicate(count, 1);
    return kernel(distances, width).colwise() / densities_.row(j).transpose().array();
  }

  void set_width(Index j, double width) {
    widths[j] = width;
    factors_[static_cast<std::size_t>(j)] = factor(j, width);
  }

  void choose_width(Index j, double prior_share) {
    const Index count = weights_.size();
    ArrayXXd others = ArrayXXd::Ones(count, count);
    for (std::size_t k = 0; k < factors_.size(); ++k)
      if (k != static_cast<std::size_t>(j) && factors_[k].size() > 0) others *= factors_[k];
    const double spread = spreads_[static_cast<std::size_t>(j)];
    double best_width = is_shifted(j) ? kWidest * spread : 0;
    const auto judge = [&](double width) {
      const ArrayXXd product = width == 0 ? others : ArrayXXd(others * factor(j, width));
      return (weights_left_out(product, prior_share) * weights_.array()).sum();
    };
    double best = judge(best_width);
    for (const double width : kWidths)
      if (const double said = judge(width * spread); said < best) {
        best = said;
        best_width = width * spread;
      }
    set_width(j, best_width);
  }

  ArrayXXd product() const {
    ArrayXXd product = ArrayXXd::Ones(weights_.size(), weights_.size());
    for (const ArrayXXd& factor : factors_)
      if (factor.size() > 0) product *= factor;
    return product;
  }

  /// p / q of every hit, its own kernel left out.
  ArrayXd weights_left_out(const ArrayXXd& product, double prior_share) const {
    const ArrayXd density =
        (product.matrix() * shares).array() - product.matrix().diagonal().array() * shares.array();
    const ArrayXd left = (1 - shares.array()).max(1e-9);
    return 1 / (prior_share + (1 - prior_share) * (density / left).max(0));
  }

  VectorXd weights_;    ///< of the hits under the target; sums to 1 [hits]
  MatrixXd densities_;  ///< of each hit's Variable under its prior [coordinates, hits]
  std::vector<double> spreads_;
  std::vector<ArrayXXd> factors_;
};

}  // namespace

// --- Block ------------------------------------------------------------------------------------

Block::Block(const Model& model, std::vector<Coordinate> coordinates)
    : model_(&model), coordinates_(std::move(coordinates)) {
  const auto fits = [&](std::size_t i) {
    return !model.variables()[i].switch_index &&
           model.variables()[i].prior.kind() != Distribution::Kind::on_off;
  };
  if (coordinates_.empty())
    for (std::size_t i = 0; i < model.size(); ++i)
      if (fits(i)) coordinates_.push_back({.variable = i});
  std::vector<bool> taken(model.size(), false);
  for (const Coordinate& coordinate : coordinates_) {
    CHECK(coordinate.variable < model.size() && fits(coordinate.variable), coordinate.variable);
    CHECK(!taken[coordinate.variable], coordinate.variable);
    taken[coordinate.variable] = true;
  }
  for (std::size_t i = 0; i < model.size(); ++i)
    if (!taken[i]) rest_.push_back(i);
}

std::vector<std::size_t> Block::variables() const {
  std::vector<std::size_t> all;
  for (const Coordinate& coordinate : coordinates_)
    all.push_back(coordinate.variable);
  return all;
}

double Block::value(const State& state, std::size_t coordinate) const {
  const Coordinate& read = coordinates_[coordinate];
  return at(state, read.variable) + (read.shift ? read.shift(state) : 0);
}

std::vector<WeighedState> thin(std::vector<WeighedState> states, std::size_t count, RandomStream& random) {
  if (states.size() <= count) return states;
  // The c at which `count` are expected to be kept.
  double low = 0, high = 0;
  for (const WeighedState& state : states)
    high += state.weight / static_cast<double>(count);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    double kept = 0;
    for (const WeighedState& state : states)
      kept += std::min(1.0, state.weight / middle);
    (kept > static_cast<double>(count) ? low : high) = middle;
  }
  std::vector<WeighedState> kept;
  for (WeighedState& state : states)
    if (state.weight >= high || random.bernoulli(state.weight / high)) {
      state.weight = std::max(state.weight, high);
      kept.push_back(std::move(state));
    }
  return kept;
}

// --- LearnedRedraw ----------------------------------------------------------------------------

void LearnedRedraw::draw(const Block& block, RandomStream& random, State& state) const {
  const Model& model = block.model();
  if (is_prior() || random.bernoulli(prior_share_)) {
    model.draw(random, state);
    return;
  }
  state.resize(static_cast<Index>(model.size()));
  for (const std::size_t i : block.rest())
    at(state, i) = model.draw_one(i, random, state);
  const auto place = std::upper_bound(cumulative_.begin(), cumulative_.end(), random.uniform());
  const Index chosen = std::min<Index>(place - cumulative_.begin(), cumulative_.size() - 1);
  for (std::size_t j = 0; j < block.size(); ++j) {
    const Coordinate& coordinate = block.coordinates()[j];
    const double width = widths_[static_cast<Index>(j)];
    if (width == 0) {
      at(state, coordinate.variable) = block.prior(j).draw(random);
      continue;
    }
    const double reach = random.bernoulli(kNarrowShare) ? width : kWide * width;
    const double value = centres_(static_cast<Index>(j), chosen) + reach * random.gaussian();
    at(state, coordinate.variable) = value - (coordinate.shift ? coordinate.shift(state) : 0);
  }
}

double LearnedRedraw::log_weight(const Block& block, const State& state) const {
  if (is_prior()) return 0;
  ArrayXd products = shares_.array();
  for (std::size_t j = 0; j < block.size(); ++j) {
    const auto row = static_cast<Index>(j);
    if (widths_[row] == 0) continue;
    const double value = block.value(state, j);
    const double density = std::exp(block.prior(j).log_density(at(state, block.coordinates()[j].variable)));
    for (Index i = 0; i < products.size(); ++i)
      if (products[i] > 0) products[i] *= kernel(value - centres_(row, i), widths_[row]) / density;
  }
  return -std::log(prior_share_ + (1 - prior_share_) * products.sum());
}

LearnedRedraw LearnedRedraw::learn(const Block& block, const std::vector<WeighedState>& hits, const Fit& fit,
                                   RandomStream& random) {
  CHECK(hits.size() >= 2, hits.size());
  Fitting fitting(block, thin(hits, fit.most_kernels, random));
  for (int sweep = 0; sweep < fit.sweeps; ++sweep)
    fitting.sweep(kTypicalShare);
  LearnedRedraw redraw;
  double best = std::numeric_limits<double>::infinity();
  for (const double power : kPowers) {
    fitting.flatten(power);
    for (const double share : kShares) {
      const auto mean = fitting.mean_weight(share);
      const double unmet = 1 / (share * std::max(fit.plain_hits, 1.0));
      if (mean.of_target + unmet >= best) continue;
      best = mean.of_target + unmet;
      redraw.mean_weight_ = mean.of_target;
      redraw.drawn_weight_ = mean.of_draws;
      redraw.prior_share_ = share;
      redraw.shares_ = fitting.shares;
    }
  }
  redraw.centres_ = fitting.centres;
  redraw.widths_ = fitting.widths;
  redraw.cumulative_ = cumulated(redraw.shares_);
  return redraw;
}

void LearnedRedraw::write(ByteWriter& out) const {
  out.put(prior_share_);
  out.put(mean_weight_);
  out.put(drawn_weight_);
  out.put_numbers(shares_.data(), static_cast<std::size_t>(shares_.size()));
  out.put_numbers(widths_.data(), static_cast<std::size_t>(widths_.size()));
  out.put_numbers(centres_.data(), static_cast<std::size_t>(centres_.size()));
}

LearnedRedraw LearnedRedraw::read(ByteReader& in, const Block& block) {
  LearnedRedraw redraw;
  redraw.prior_share_ = in.get<double>();
  redraw.mean_weight_ = in.get<double>();
  redraw.drawn_weight_ = in.get<double>();
  VectorXd centres;
  in.get_numbers(redraw.shares_);
  in.get_numbers(redraw.widths_);
  in.get_numbers(centres);
  const auto coordinates = static_cast<Index>(block.size());
  if (!(redraw.prior_share_ > 0 && redraw.drawn_weight_ > 0))
    throw std::out_of_range("shares that cannot be");
  if (redraw.shares_.size() > 0 && redraw.widths_.size() != coordinates)
    throw std::out_of_range("other coordinates");
  if (centres.size() != redraw.shares_.size() * redraw.widths_.size())
    throw std::out_of_range("other kernels");
  redraw.centres_ = centres.reshaped(redraw.widths_.size(), redraw.shares_.size());
  redraw.cumulative_ = cumulated(redraw.shares_);
  return redraw;
}

}  // namespace retake
