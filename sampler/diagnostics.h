// Convergence diagnostics of Markov chains: rank-normalised split R-hat, bulk and tail effective sample size.
// Realises Vehtari, Gelman, Simpson, Carpenter & Buerkner, "Rank-normalization, folding, and localization",
// Bayesian Analysis 16 (2021) 667-718, sections 3 and 4. Knows nothing of what was drawn.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace retake {

/// What is reported of one quantity (a variable of the state or a measure). The first three are pure numbers.
struct QuantityDiagnostics {
  double rhat;      ///< near 1 if the chains agree; the paper asks for less than 1.01
  double ess_bulk;  ///< effective draws for the centre of the distribution
  double ess_tail;  ///< effective draws for its 5 % or 95 % quantile, whichever has fewer
  double mean;      ///< over all draws
  double sd;        ///< standard deviation over all draws, with S - 1 in the denominator
};

/// Draws of several chains, in their order. Chains may differ in length: each weighs as its draws.
using ChainDraws = std::vector<Eigen::VectorXd>;
/// A chain for every column.
ChainDraws chains_of(const Eigen::MatrixXd& columns);

// All functions are pure and, for chains of one length, agree with R's `posterior` 1.4.0, whose conventions
// they share: an odd chain loses its middle draw when it is split; tied draws share the mean of their ranks;
// the effective sample size of S draws is at most S log10(S). posterior takes no chains that differ in
// length: here variances within and between chains are means weighed by the chains' draws, unbiased as for
// equal ones, and the autocorrelation at a lag is that of the chains that reach so far. So a long chain does
// not hide short ones that disagree, nor do these count for more than they have seen.
//
// They give NaN where posterior gives NA: if all draws are equal, if R-hat has a chain of fewer than 4
// iterations or an ESS none of 6, and, for quantities with few values, if all draws lie equally far from
// their median (R-hat) or 5 % of them or more equal the largest (tail ESS). Beyond posterior, whose code lets
// infinities through the ranks and misreads chains of 2 or 3 draws, they give NaN for any draw that is not
// finite and any short chain.

/// The larger of two R-hats of the split, rank-normalised draws: as they are, and folded about their median.
double rank_normalised_split_rhat(const ChainDraws& draws);

/// Effective sample size of the split, rank-normalised draws.
double ess_bulk(const ChainDraws& draws);

/// The smaller of the effective sample sizes for the 5 % and the 95 % quantile.
double ess_tail(const ChainDraws& draws);

/// Effective sample size for the mean: that of the split draws, on their own scale.
double ess_mean(const ChainDraws& draws);

/// Effective sample size for the mean from how far the chains' means lie apart: what no chain can know of
/// itself. All draws' variance over that of the mean of all, as the means tell it. NaN for one chain, and
/// where all means are equal. Rough for few chains: as a variance from so many values.
double ess_across(const ChainDraws& draws);

/// A rough effective sample size for the mean, at a small part of the cost, by which the slowest of thousands
/// of quantities are found: draws over how much larger means of stretches vary than independent draws would
/// let them, for stretches of the square root of the shortest chain's length and of half of it, whichever
/// says less. NaN for fewer than 4 iterations.
double ess_rough(const ChainDraws& draws);

/// R-hat, bulk and tail ESS, mean and sd. The last two are NaN only without draws, if one is not finite, and
/// sd for a single one.
QuantityDiagnostics diagnose(const ChainDraws& draws);

/// 1 + 2 (rho_1 + rho_2 + ...) of one unsplit chain [iterations]: its length over its effective sample size.
double integrated_autocorrelation_time(const Eigen::VectorXd& draws);

}  // namespace retake
