// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/types/geometry.hpp"

namespace backwash {

/// Variance of the vehicle's linear acceleration: a symmetric 3×3 tensor Σ in W, (m/s²)² (docs/model.md section 2).
/// A variance is not a bound: bound() below is the only conversion.
struct Variance {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  Variance& operator+=(const Variance& o) noexcept {
    xx += o.xx;
    xy += o.xy;
    xz += o.xz;
    yy += o.yy;
    yz += o.yz;
    zz += o.zz;
    return *this;
  }
  friend Variance operator+(Variance a, const Variance& b) noexcept { return a += b; }
  friend Variance operator*(double s, const Variance& v) noexcept {
    return {s * v.xx, s * v.xy, s * v.xz, s * v.yy, s * v.yz, s * v.zz};
  }

  /// nᵀ Σ n for a unit vector n, (m/s²)².
  double along(const Vec3& n) const noexcept {
    return xx * n.x() * n.x() + yy * n.y() * n.y() + zz * n.z() * n.z() +
           2 * (xy * n.x() * n.y() + xz * n.x() * n.z() + yz * n.y() * n.z());
  }
  /// s_n m mᵀ + s_t t tᵀ + s_z z zᵀ with t = z × m, for a horizontal unit normal m (docs/model.md section 2, wall and
  /// corner).
  static Variance about_normal(const Vec3& m, double s_n, double s_t, double s_z) noexcept {
    const double x = m.x(), y = m.y();
    return {s_n * x * x + s_t * y * y, (s_n - s_t) * x * y, 0, s_n * y * y + s_t * x * x, 0, s_z};
  }
  /// diag(s_h, s_h, s_z).
  static Variance horizontal_vertical(double s_h, double s_z) noexcept { return {s_h, 0, 0, s_h, 0, s_z}; }
};

/// Largest disturbance acceleration w̄_n in each Direction, m/s²: the set of disturbances is the intersection of the
/// slabs |nᵀw| ≤ w̄_n.
struct DisturbanceBound {
  PerDirection w{};  ///< m/s²
};

/// A risk that is kept in place of the worst case (docs/model.md 5.3-5): κ of the bounds is made for it.
struct StatedRisk {
  double touch = 0;    ///< probability of a touch, at most, in each way from the vehicle on and each minute at rest
  double at_rest = 1;  ///< sets at rest are so many times as wide: a minute asks for more than a moment
  double worst = 1;    ///< the file's κ over that of the bounds, ≥ 1; over that of rest: worst / at_rest, ≥ 1
};

/// How a variance becomes a bound (docs/model.md section 3); the `[bound]` table of a model file.
struct BoundModel {
  double kappa = 3.0;                  ///< bound in standard deviations
  double mean_horizontal = 0.0;        ///< largest steady push in any horizontal direction, m/s²
  double mean_vertical = 0.0;          ///< largest steady push along z, m/s²
  double tau_w = 0.15;                 ///< correlation time of the disturbance, s (chance-constrained mode)
  std::optional<StatedRisk> stated{};  ///< of no file: plan::model_for(). Without it the worst case is kept
  double at_rest() const noexcept { return stated ? stated->at_rest : 1; }
};

/// w̄_n = mean_n + κ √(nᵀΣn) in the five directions (docs/model.md section 3): the one conversion from variance to
/// bound. Negative variances from rounding count as 0. Real-time: wait-free, no allocation.
inline DisturbanceBound bound(const Variance& sigma, const BoundModel& model) noexcept {
  // Along an axis the other products are zeros, unless one of them is no number.
  const bool finite = std::isfinite(sigma.xx + sigma.xy + sigma.xz + sigma.yy + sigma.yz + sigma.zz);
  const auto along = [&](Direction d) { return sigma.along(unit(d)); };
  PerDirection variances;
  variances[kX] = finite ? sigma.xx : along(kX);
  variances[kY] = finite ? sigma.yy : along(kY);
  variances[kZ] = finite ? sigma.zz : along(kZ);
  variances[kXyPlus] = along(kXyPlus);
  variances[kXyMinus] = along(kXyMinus);
  const auto root = [](double variance) { return std::sqrt(variance > 0 ? variance : 0.0); };
  // Roots are dear, and Σ is often the same along both axes and both diagonals.
  PerDirection roots;
  roots[kX] = root(variances[kX]);
  roots[kXyPlus] = root(variances[kXyPlus]);
  roots[kZ] = root(variances[kZ]);
  roots[kY] = variances[kY] == variances[kX] ? roots[kX] : root(variances[kY]);
  roots[kXyMinus] = variances[kXyMinus] == variances[kXyPlus] ? roots[kXyPlus] : root(variances[kXyMinus]);
  DisturbanceBound b;
  for (std::size_t d = 0; d < kDirections; ++d)
    b.w[d] = (d == kZ ? model.mean_vertical : model.mean_horizontal) + model.kappa * roots[d];
  return b;
}

}  // namespace backwash
