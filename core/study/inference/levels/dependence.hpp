// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "core/study/inference/evidence.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {

/// Φ, n × r: ΦΦᵀ is the Gaussian kernel exp(−|·|²/2σ²) of the rows of `points` (n × d), σ the median of their distances
/// that are not 0. Low rank (pivoted Cholesky), each entry to kRules.kernel_error. Precondition: n > 0.
Eigen::MatrixXd kernel_features(const Eigen::MatrixXd& points);

/// Features less their mean over each flight, whose rows are first[f] … first[f + 1] − 1.
Eigen::MatrixXd centred(Eigen::MatrixXd phi, const std::vector<std::size_t>& first);

struct Independence {
  double hsic, p;
};

/// Hilbert–Schmidt independence criterion given the flight, tr(K H L H)/n² = |ΦᵀΨ|²/n² with K = ΦΦᵀ, L = ΨΨᵀ, H that
/// centres within each flight (`phi` is centred). Rows are in the order of time. One flight: the usual (biased) HSIC.
/// p: share of `shifts` draws, the data counted, that are at least as large when each flight's psi is turned round by
/// an amount of its own, which keeps the autocorrelation of both. Exact up to the seam where a flight's end meets its
/// beginning. Ends when more than `enough` draws are as large as the data. Offline.
Independence turn_test(const Eigen::MatrixXd& phi, const Eigen::MatrixXd& psi, const std::vector<std::size_t>& first,
                       int shifts, int enough, unsigned seed);

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
std::vector<Dependence> remaining_dependence(const Evidence& evidence, const std::vector<DesignColumn>& accepted,
                                             unsigned seed, double level = kRules.dependence_level);

}  // namespace backwash::study
