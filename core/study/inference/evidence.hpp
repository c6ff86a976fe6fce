// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "core/study/effects/regressors.hpp"
#include "core/study/inference/levels/anova.hpp"
#include "core/study/inference/normal_equations.hpp"

namespace backwash::study {

/// A column seen in axes of which the scatter is independent: ln variance along x, y and z wanders as one (gusts are
/// strong or weak along all axes), so its three channels become √3 times their mean, (x − y)/√2 and (x + y − 2z)/√6.
DesignColumn decorrelated(const DesignColumn& column);

/// Observations with the scatter of each channel (after `decorrelated`): within flights (σ_w²) and between them (σ_b²,
/// a random intercept), by analysis of variance of what the accepted columns leave. V = diag(σ_w²/weight) + σ_b² 11ᵀ
/// per flight and channel, and in the level means + σ_t² ZZᵀ, Z the body's two level axes: craft are trimmed anew
/// before each flight. Where several flights make one unit (days), flights of a unit have
/// σ_b², and units σ_u² beside it. A window's mean weighs more where its own variance, shrunk towards its flight's, is
/// small.
class Evidence {
 public:
  explicit Evidence(const Observations& seen);
  const Observations& seen() const noexcept { return *seen_; }

  /// Leaves columns free in all that follows, as if they were accepted each time.
  void leave_free(std::vector<DesignColumn> columns) { free_ = std::move(columns); }
  /// Takes the accepted columns (with the offsets of their channels) out and estimates the scatter of what is left, and
  /// how much older than assumed the set-points act, within what no log tells (docs/model.md 8-2b).
  void whiten(const std::vector<DesignColumn>& accepted);

  /// ln likelihood of each unit under the scatter of the last whiten(), `columns` and the offsets of every
  /// channel fitted to all flights.
  std::vector<double> ln_likelihood(const std::vector<DesignColumn>& columns) const;

  /// A flight that came after these, by itself, weighed with the scatter of these. Keeps a pointer to `flight`.
  Evidence next(const Observations& flight) const;

  /// Normal equations of `columns`, `nuisance` projected out (columns of it that others span are ignored).
  NormalEquations normal(const std::vector<DesignColumn>& columns, const std::vector<DesignColumn>& nuisance) const;
  /// Mean of x xᵀ, by weight, over the measured windows of the channels that the columns move: √(θᵀ size θ) is the root
  /// mean square of Σ θ x.
  SmallMatrix size(const std::vector<DesignColumn>& columns) const;
  /// What `columns`, fitted to all flights, leave of each channel (decorrelated), in units of its scatter within
  /// flights: each flight's own mean and, in the level means, its own trim (shrunk by σ_t²) taken out; 0 where not
  /// measured.
  DesignColumn whitened(const std::vector<DesignColumn>& columns) const;
  /// What `columns`, fitted to all flights, leave of each channel (decorrelated).
  DesignColumn residual(const std::vector<DesignColumn>& columns) const;
  /// Weight of a window in a channel (decorrelated): σ_w² over it is the variance of its noise; 0: not measured.
  double weight(Channel c, std::size_t window) const { return weight_[c][window]; }
  /// Whether a window measures a channel (decorrelated).
  bool measured(Channel c, std::size_t window) const { return weight_[c][window] > 0; }
  Scatter scatter(Channel c) const { return scatter_[c]; }

 private:
  /// XᵀV⁻¹X of each flight, X the columns and last y.
  std::vector<Eigen::MatrixXd> grams(const std::vector<const DesignColumn*>& columns) const;
  void take_flights_out(DesignColumn& residual) const;
  void add_channel(std::vector<Eigen::MatrixXd>& grams, Channel c, const std::vector<DesignColumn>& columns) const;
  void weigh_means(const std::vector<double>& ln_variance);
  double trim_scatter(const DesignColumn& residual) const;
  void set_age(double age);
  double likeliest_age(const std::vector<DesignColumn>& accepted) const;

  const Observations* seen_;
  DesignColumn y_;  // every channel, decorrelated
  std::array<std::vector<double>, kChannels> weight_;
  std::vector<DesignColumn> free_;
  std::vector<DesignColumn> tilts_;      // Z; empty without attitude
  std::vector<std::size_t> flight_end_;  // per window, where its flight ends
  std::array<Scatter, kChannels> scatter_{};
  double tilt_ = 0;  // σ_t²
  double age_ = 0;   // s, of the set-points, beyond the assumed one: taken out of y_
};

}  // namespace backwash::study
