// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::reach {

/// The second-order loop ë = −k_p e − k_d ė + w as a recursion of constant cost (docs/model.md section 5.2).
/// Underdamped, with g = e^{−στ} sin(ωτ)/ω, T = π/ω and ρ = e^{−σT}: |g|(τ) = g(τ) + 2 Σ_{m≥1} ρᵐ g(τ − mT), so that
/// under w̄
///   h(t) = y(t) + 2 Σ_{m=1}^{M} ρᵐ y(t − mT) + at most `tail`·max w̄,   ÿ = −k_p y − k_d ẏ + w̄, y(0) = ẏ(0) = 0.
/// Exact at sample instants for w̄ constant in each step: y(t − mT) follows from the state at the sample before it by a
/// fixed fractional step. Otherwise (critically damped, overdamped) g ≥ 0, M = 0 and h = y.
struct DelayRecursion {
  /// 2ρᵐ y(N dt − mT) = y·y_{N−back} + v·ẏ_{N−back} + w·w̄_{N−back}, nothing for back > N.
  struct Echo {
    std::size_t back;  ///< steps, ≥ 2
    double y, v, w;
  };
  Eigen::Matrix2d E;  ///< (y, ẏ)_{k+1} = E (y, ẏ)_k + F w̄_k over 20 ms
  Eigen::Vector2d F;
  std::vector<Echo> echoes;  ///< m = 1 … M
  /// Steps before the one in progress in which echoes beyond the M-th have no part; at least 1.
  std::size_t memory;
  /// Bound on what echoes beyond the M-th add, per unit of the largest w̄ so far, s²; below 1e-6 of the hover half
  /// width.
  double tail;
};

inline constexpr std::size_t kMostEchoes = 16;

/// Empty where the FIR has to serve: more than kMostEchoes would be needed (damping ratio below about 0.25), or half an
/// oscillation is no longer than a step. Precondition: kp, kd > 0.
std::optional<DelayRecursion> delay_recursion(double kp, double kd);

}  // namespace backwash::reach
