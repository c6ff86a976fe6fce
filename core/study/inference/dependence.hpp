// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "core/study/inference/evidence.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {

struct Independence {
  double hsic, p;
};

/// Hilbert–Schmidt independence criterion given the flight, tr(K H L H)/n²: K and L Gaussian kernels of the rows of x
/// (n × d) and y (n × e), exp(−|·|²/2σ²), σ the median of the distances that are not 0; H centres within each flight,
/// whose rows first[f] … first[f + 1] − 1 are in the order of time. One flight: the usual (biased) HSIC.
/// p: share of `shifts` draws, the data counted, that are at least as large when each flight's y is turned round by an
/// amount of its own, which keeps the autocorrelation of both. Exact up to the seam where a flight's end meets its
/// beginning. Kernels are low rank (pivoted Cholesky, each entry to 1e-5). Precondition: n > 0. Offline.
Independence independence(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const std::vector<std::size_t>& first,
                          int shifts, unsigned seed);

/// p values multiplied by the number of those not smaller, made monotone, at most 1 (Holm); in the order given.
std::vector<double> holm(const std::vector<double>& p);

/// Whether what remains of a group of channels depends on a regressor.
struct Dependence {
  std::string regressor, group;
  double hsic, p, p_holm;
  bool found;  ///< p_holm is at most the level asked for, and both halves of the flights show it at 0.05
};

/// Each regressor (ranks; circular ones as points of the circle) against what the accepted columns and
/// free offsets leave of each group of channels; found ones first, then ascending in p_holm. Regressors that are
/// constant within every flight are not tested: the flights' means are taken out. `level` is family-wise. A pair's
/// draws end as soon as kRules.enough_turns of them are as large, and there are enough of them for half of the level of
/// the smallest p. About 0.1 s for 12 flights of 100 s.
std::vector<Dependence> remaining_dependence(const Evidence& evidence, const std::vector<Column>& accepted,
                                             unsigned seed, double level = kRules.dependence_level);

}  // namespace backwash::study
