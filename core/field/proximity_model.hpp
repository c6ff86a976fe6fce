// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/field/surface.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Contribution of one visible element to Σ at p, (m/s²)²: the three terms of docs/model.md section 2 (paper Eq. 1–3),
/// gates included, visibility not. With r = c − p, l = max(|r|, a/2) and θ the angle between r and straight down. Each
/// term is zero for the wrong kind of element. Gates include their limit within 1e-9 (m or rad), so that a wall voxel
/// exactly level with the vehicle (θ = π/2) counts whatever the rounding.
class ProximityModel {
 public:
  /// `voxel_edge`: a, m.
  ProximityModel(const Model& model, double voxel_edge) noexcept;

  /// Up elements: s = A [λ_g/l² + k_g1 exp(−k_g2 l²)] per component (horizontal, vertical) if (θ ≤ θ̄_g and l ≤ l̄_g) or
  /// (l sin θ ≤ r0 and θ < π/2 and l ≤ l̄_u).
  Variance ground(const Element& element, const Vec3& p_W) const noexcept;
  /// Lateral elements with a corner k: s = A (φ̄_c − φ) λ_c/(d_c² + h_c⁶) per component (normal, tangential, vertical)
  /// if φ ≤ φ̄_c, l_c ≤ l̄_c and |r| ≤ l̄_w. The denominator is at least (a/2)⁶, its value half a voxel straight above k,
  /// so that s is finite at k itself, where no vehicle can be.
  Variance corner(const Element& element, const Vec3& p_W) const noexcept;
  /// Lateral elements: s = A k_w1 exp(−k_w2 l²) per component if θ_w ≤ θ ≤ π/2 and l ≤ l̄_w.
  Variance wall(const Element& element, const Vec3& p_W) const noexcept;

  /// (φ̄_c − φ)/(d_c² + h_c⁶), with the gates φ̄_c and l̄_c, the denominator as in corner(): `d2` = d_c², m²; `h` = h_c,
  /// m.
  double corner_factor(double d2, double h) const noexcept;
  /// exp(−k_w2 l²) with the gates of wall(): `r2` = |r|², m²; `r_z`: vertical component of r, m.
  double wall_factor(double r2, double r_z) const noexcept;
  /// The gates of wall() as limits of |r|², m² (high < low: never), for the vertical component r_z of r, m.
  struct Gate {
    double low, high;
  };
  Gate wall_gate(double r_z) const noexcept;
  /// Whether |r| ≤ l̄_w, the gate of an element in corner(): `r2` = |r|², m².
  bool in_wall_range(double r2) const noexcept;
  /// Whether l_c ≤ l̄_c: `l2` = l_c², m².
  bool in_corner_range(double l2) const noexcept { return l2 <= corner_l2_max_; }

 private:
  Model model_;
  double least_l_;  ///< a/2, m
  double corner_l2_max_, tan_phi_max_;
  // Angles are compared by their cosines: θ̄ ≤ θ' exactly where cos θ̄ ≥ cos θ'.
  double cos_ground_max_, cos_wall_min_, cos_level_;
};

}  // namespace backwash::field
