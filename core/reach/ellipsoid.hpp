// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/types/geometry.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::reach {

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// The paper's ellipsoidal reachable set of the error state (e_p, e_v) ∈ R⁶ (docs/model.md section 5.1), kept as the
/// reference. {e : eᵀ Q⁻¹ e ≤ 1}; Q in m², m²/s, m²/s². Second-order loop only.
class EllipsoidRecursion {
 public:
  static constexpr double kEpsilon = 1e-10;  ///< ε: regularisation only

  /// Starts at Q_0 = diag(position² I, velocity² I) of the vehicle's initial error.
  explicit EllipsoidRecursion(const Vehicle& vehicle);
  /// One step of 20 ms under the channel bounds w̄_x, w̄_y, w̄_z (m/s², ≥ 0): Q_i = dt w̄_i² X_i + ε dt² I, then
  /// Q⁺ = e^{Φdt}((1 + b/a) Q + (1 + a/b) Q_d) e^{Φᵀdt}. X_i is constant: no Lyapunov solve here.
  /// Real-time: wait-free, no allocation.
  void step(const Vec3& w_bar) noexcept;
  /// Shape matrix, order (p_x, p_y, p_z, v_x, v_y, v_z).
  Mat6 Q() const noexcept;
  /// Position set: the block Q_pp, m².
  Mat3 position_shape() const noexcept;

 private:
  // Axes never couple: Q_0, every X_i and e^{Φdt} are block diagonal, so Q is carried as one (p, v) block per axis.
  std::array<Eigen::Matrix2d, 3> transition_;  // e^{Φ dt}
  std::array<Eigen::Matrix2d, 3> X_;  // block i of ∫₀^dt e^{−Φτ} D_i D_iᵀ e^{−Φᵀτ} dτ; the others are 0
  std::array<Eigen::Matrix2d, 3> Q_;
};

/// X_i of one axis over 20 ms, block (p, v), the solution of
/// −ΦX − XΦᵀ = e^{−Φdt} D Dᵀ e^{−Φᵀdt} − D Dᵀ for Φ = (0 1; −k_p −k_d), D = (0, 1).
Eigen::Matrix2d step_gramian(double kp, double kd);

/// Position shape (m²) of the paper's infinite-time set under constant channel bounds w̄ (m/s², ≥ 0): the fixed point of
/// the 20 ms recursion above, not of its limit dt → 0 (0.8 % smaller at (6, 4)), rounded up. With r = √(tr Q_d/tr Q) a
/// fixed point solves Q = (1 + r) e^{Φdt}(Q + Q_d/r) e^{Φᵀdt}, linear in Q; r is the root of one increasing scalar
/// function. O(1). Errors: throws std::invalid_argument for gains that are not positive.
Mat3 hover_ellipsoid(const Vehicle& vehicle, const Vec3& w_bar);

/// hover_ellipsoid() of one vehicle for many bounds. With ε = 0 its root r depends on the vertical share
/// θ = √tr Q_z/Σ_i √tr Q_i alone, and Q_pp is Σ_i √tr Q_i · √tr Q_i · u(θ) per axis, so u is tabulated over θ.
class HoverEllipsoid {
 public:
  static constexpr double kLeastBound = 0.1;  ///< m/s²: below it ε shows, and the root is solved
  /// About a millisecond. Errors: as hover_ellipsoid().
  explicit HoverEllipsoid(const Vehicle& vehicle);
  /// Half axes x, y, z of the position set, m: those of hover_ellipsoid() or up to 1e-3 of them more (chords of a
  /// convex curve). Tens of nanoseconds where every bound is at least kLeastBound.
  Vec3 half_axes(const Vec3& w_bar) const;

 private:
  static constexpr int kShares = 256;
  Vehicle vehicle_;
  Vec3 root_trace_;                      // √tr Q_i per unit of w̄
  std::vector<Eigen::Vector2d> square_;  // u of a horizontal and the vertical axis, θ = sin²(π/2·n/kShares)
};

}  // namespace backwash::reach
