// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "core/types/geometry.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::reach {

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// The paper's ellipsoidal reachable set of the error state (e_p, e_v) ∈ R⁶ (model.md section 5.1), kept as the
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
  const Mat6& Q() const noexcept { return Q_; }
  /// Position set: the block Q_pp, m².
  Mat3 position_shape() const noexcept { return Q_.topLeftCorner<3, 3>(); }

 private:
  Mat6 transition_;          // e^{Φ dt}
  std::array<Mat6, 3> X_;    // ∫₀^dt e^{−Φτ} D_i D_iᵀ e^{−Φᵀτ} dτ
  Mat6 Q_;
};

/// Position shape (m²) of the paper's infinite-time set under constant channel bounds w̄ (m/s²): the fixed point of the
/// recursion (closed form with equal gains, otherwise one scalar root, model.md section 5.1). O(1).
Mat3 hover_ellipsoid(const Vehicle& vehicle, const Vec3& w_bar);

}  // namespace backwash::reach
