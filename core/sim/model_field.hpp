// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unordered_map>

#include "core/field/disturbance_field.hpp"

namespace backwash::sim {

/// Σ of a model about a place, for air that is the model's own: evaluated exactly on a lattice where a flight passes,
/// once each, and trilinear between. Not for several threads at once.
class ModelField {
 public:
  /// The grid must outlive it. The model's extension is left out: its simulation terms are AirTerms'.
  ModelField(const map::OccupancyGrid& grid, const Model& model);
  ModelField(map::OccupancyGrid&&, const Model&) = delete;
  /// (m/s²)²; lattice points within solids are left out, their weights go to the others.
  Variance sigma(const Vec3& p_W);
  /// Correlation time of the disturbance, s.
  double tau_w() const noexcept { return field_.model().bound.tau_w; }

 private:
  static constexpr double kLattice = 0.1;  // m
  const Variance& at(const Index3& lattice);

  const map::OccupancyGrid* grid_;
  field::ProximityField field_;
  std::unordered_map<std::uint64_t, Variance> known_;
};

}  // namespace backwash::sim
