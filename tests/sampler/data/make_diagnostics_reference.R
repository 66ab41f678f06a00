# Writes diagnostics_reference.txt: draws, and what R's `posterior` says of them, for diagnostics_test.cpp.
# Run from this folder: Rscript make_diagnostics_reference.R (Debian: apt-get install r-cran-posterior).
# The build and the tests need neither R nor this file.
suppressPackageStartupMessages(library(posterior))
stopifnot(packageVersion("posterior") == "1.4.0")

exact <- function(x) sprintf("%.17g", x)

# One column per chain, each started in its stationary distribution.
autoregression <- function(iterations, chains, coefficient) {
  one <- function(chain) {
    x <- rnorm(iterations)
    for (i in seq_len(iterations)[-1]) x[i] <- coefficient * x[i - 1] + sqrt(1 - coefficient^2) * x[i]
    x
  }
  sapply(seq_len(chains), one)
}

normal <- function(iterations, chains) matrix(rnorm(iterations * chains), iterations)

set.seed(20000723)
cases <- list(
  normal_4_chains = normal(100, 4),
  normal_3_chains = normal(75, 3),
  normal_2_chains_odd = normal(101, 2),
  normal_1_chain = normal(250, 1),
  normal_1_chain_odd = normal(251, 1),
  normal_quantile_is_a_draw = normal(101, 1),
  autoregression_0.9 = autoregression(250, 4, 0.9),
  autoregression_0.9_1_chain_odd = autoregression(333, 1, 0.9),
  autoregression_0.99 = autoregression(300, 2, 0.99),
  random_walk = apply(normal(200, 2), 2, cumsum),
  antithetic_0.5 = autoregression(150, 4, -0.5),
  antithetic_0.9 = autoregression(150, 2, -0.9),
  shifted_means = normal(100, 4) + rep(c(0, 0, 0, 2), each = 100),
  shifted_variances = normal(100, 4) * rep(c(1, 1, 1, 5), each = 100),
  trend = normal(120, 2) + seq(0, 3, length.out = 120),
  cauchy = matrix(rcauchy(100 * 4), 100),
  large_offset = 1e3 + normal(60, 2),
  small_scale = 1e-12 * normal(60, 2),
  ties_poisson = matrix(as.double(rpois(200 * 4, 3)), 200),
  ties_rounded_walk = round(2 * autoregression(201, 3, 0.95)),
  binary_rare = matrix(as.double(runif(200 * 2) < 0.03), 200),
  binary_often = matrix(as.double(runif(200 * 2) < 0.3), 200),
  binary_balanced = matrix(rep(c(0, 1, 1, 0), 25), 50),
  three_values = matrix(as.double(sample(-1:1, 150, replace = TRUE)), 50),
  metropolis_repeats = apply(normal(120, 2), 2, function(x) x[cummax(ifelse(runif(120) < 0.2, 1:120, 1))]),
  alternating = cbind(rep(c(-1, 1), 40), rep(c(1, -1), 40)) + 0.01 * normal(80, 2),
  periodic = sin(matrix(1:160, 80) / 5),
  stuck_apart_2_chains = matrix(rep(c(1, 2), each = 20), 20),
  one_stuck_chain = cbind(normal(40, 2), 0.25),
  constant = matrix(0.1, 30, 2),
  constant_but_one = matrix(c(rep(0.1, 59), 0.2), 30),
  length_1 = normal(1, 1),
  length_4 = normal(4, 2),
  length_5 = normal(5, 1),
  length_6 = normal(6, 2),
  length_7 = normal(7, 1),
  length_10 = normal(10, 2),
  length_11 = normal(11, 3),
  length_12 = normal(12, 1),
  length_13 = normal(13, 2),
  length_14 = autoregression(14, 1, 0.9)
)

reference <- function(name) {
  x <- cases[[name]]
  first_chain <- x[, 1]
  suppressWarnings(c(
    paste("case", name, nrow(x), ncol(x)),
    paste("rhat", exact(rhat(x))),
    paste("ess_bulk", exact(ess_bulk(x))),
    paste("ess_tail", exact(ess_tail(x))),
    paste("ess_mean", exact(ess_mean(x))),
    paste("mean", exact(mean(x))),
    paste("sd", exact(sd(x))),
    paste("tau_of_first_chain", exact(length(first_chain) / ess_basic(first_chain, split = FALSE))),
    "draws",
    apply(x, 1, function(row) paste(exact(row), collapse = " "))
  ))
}

writeLines(c(
  "# By make_diagnostics_reference.R; posterior 1.4.0. A row of draws per iteration, a column per chain.",
  unlist(lapply(names(cases), reference))
), "diagnostics_reference.txt")
