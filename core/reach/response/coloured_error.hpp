// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/reach/response/error_dynamics.hpp"

// The control error that a coloured Gaussian disturbance s ξ(t) makes: covariance, turning, exits (docs/model.md
// section 5.3).
namespace backwash::reach {

/// One axis' loop driven by ξ over a step, of kControlPeriod/kPhases unless another is asked for, exact for a constant
/// s. States: p, v, a (lag), two of the delay. Feedback delay δ: Padé (2, 2), 1 − 12 δs/(δ²s² + 6 δs + 12), whose phase
/// is off by (ωδ)⁵/720: 1e-5 rad at ωδ = 0.4, far below a stable loop's bandwidth.
struct ColouredStep {
  static constexpr int kStates = 5;
  using Matrix = Eigen::Matrix<double, kStates, kStates>;
  using Vector = Eigen::Matrix<double, kStates, 1>;
  /// tau_w > 0, s. Errors: throws std::invalid_argument for tau_w ≤ 0.
  ColouredStep(const AxisLoop& axis, double tau_w, double period = kControlPeriod / AxisResponse::kPhases);
  AxisLoop axis;
  double period;       ///< s
  Matrix E;            ///< states after a phase from states before
  Vector g;            ///< … from ξ before, per unit of s
  double rho;          ///< ξ after from ξ before
  Matrix noise;        ///< covariance of the states from what is new in ξ, per s²
  Vector noise_to_xi;  ///< its covariance with the new ξ, per s
};

/// The error that a steady s = 1 m/s² leaves once the loop has settled.
struct SteadyError {
  double variance;  ///< σ_e² per s²
  double memory;    ///< s after which the correlation of e with itself stays below what was asked
};
/// `below` in (0, 1). Precondition: a stable loop whose correlation gets there within 30 s. Not real-time.
SteadyError steady_error(const ColouredStep& step, double below);

/// Covariance of one direction's Gaussian error and how fast it turns, for Rice's rate. Starts at zero error with ξ
/// stationary. `step` must outlive it.
class ErrorCovariance {
 public:
  explicit ErrorCovariance(const ColouredStep& step) : step_(&step) {}
  /// Moves on by one step under the scale s ≥ 0, m/s². Real-time: wait-free, no allocation.
  void advance(double s) noexcept;
  double position_deviation() const noexcept { return std::sqrt(std::max(0.0, P_(0, 0))); }  ///< σ_e, m
  /// Deviation of ė less what e foretells, over σ_e: √(σ_ė² − cov(e, ė)²/σ_e²)/σ_e, rad/s; 0 while σ_e is 0. Rice:
  /// e/σ_e rises above η (turn_rate/2π) e^{−η²/2} times per second, also while σ_e changes.
  double turn_rate() const noexcept;
  /// At least ∫ turn_rate dt over the last step, rad.
  double turned() const noexcept { return turned_; }
  /// Whether the last step was the first one with an error.
  bool started() const noexcept { return started_; }
  /// Bound on σ_e during the last step, ends included, m.
  double largest_deviation() const noexcept { return largest_; }

 private:
  double acceleration_deviation(double s) const noexcept;

  const ColouredStep* step_;
  ColouredStep::Matrix P_ = ColouredStep::Matrix::Zero();
  ColouredStep::Vector P_xi_ = ColouredStep::Vector::Zero();  // covariance of the states with ξ
  double turned_ = 0, largest_ = 0;
  bool started_ = false;
};

/// Smallest η with turned/π·e^{−η²/2} + max(0, erfc(η/√2) − erfc(η_before/√2)) ≤ probability: expected exits through
/// ±η while e/σ_e turns by `turned` rad (Rice, both sides), and the chance to be outside at once when the level falls
/// from η_before (infinity: at the start). Precondition: 0 < probability < 1.
double exit_level(double turned, double level_before, double probability);

}  // namespace backwash::reach
