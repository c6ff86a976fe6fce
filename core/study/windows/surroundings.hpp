// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/field/sight/around.hpp"

namespace backwash::study {

/// What stands around a point, and which of the walls reach all the way from the surface below to the one above: the
/// side of a table or of a lowered ceiling lets the air around it.
struct PlaceAround : Around {
  std::vector<std::pair<double, Vec3>> whole_walls = {};
};

/// Surfaces and modelled Σ about a point. Without a map: a floor at z = 0, nothing else, and Σ = Σ_0.
class MapView {
 public:
  MapView(const map::OccupancyGrid* grid, const Model& model);
  PlaceAround around(const Vec3& p_W) const;
  /// Diagonal of Σ at p, (m/s²)²: trilinear between points on a lattice of kWindowRules.sigma_lattice, evaluated
  /// exactly once each.
  Vec3 sigma(const Vec3& p_W);
  /// Whether a flight may be there: within sight of the map's box; without a map, of anything (kWindowRules.room).
  /// False for what is not finite. Precondition of all the others.
  bool near(const Vec3& p_W) const;
  bool inside_solid(const Vec3& p_W) const { return grid_ && grid_->occupied(grid_->index(p_W)); }
  bool has_map() const noexcept { return grid_ != nullptr; }
  /// Correlation time of the model's gusts, s.
  double tau_w() const noexcept { return tau_w_; }

 private:
  bool whole(const Vec3& p_W, const Around& around, const std::pair<double, Vec3>& wall) const;
  const Vec3& lattice_ln_sigma(const Index3& at);
  /// Whether a lattice point is within a solid, or on its face: it says nothing of the air beside it.
  bool lattice_in_solid(const Index3& at);

  const map::OccupancyGrid* grid_;
  Vec3 base_;
  double tau_w_;
  std::optional<field::ProximityField> field_;
  Vec3 low_;
  Index3 size_;
  std::vector<std::optional<Vec3>> lattice_;
  std::vector<std::optional<bool>> lattice_solid_;
};

}  // namespace backwash::study
