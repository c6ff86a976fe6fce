// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/voxel_box.hpp"
#include "core/types/air_class.hpp"
#include "core/types/model.hpp"
#include "core/types/parallel.hpp"

namespace backwash::plan {

/// How much rougher than modelled the air is, by place: the class of each voxel (docs/model.md 7-1) and a factor on Σ
/// for each class. Precondition: a model without an extension.
struct AirScale {
  std::optional<field::DisturbanceField> sigma;  ///< as modelled, where the world has bounds; none: nobody asked
  std::vector<AirClass> classes;                 ///< of the grid's voxels, linear; of use where Σ is stored
  AirFactors factors = kModelledAir;

  bool known() const noexcept { return sigma.has_value(); }
  /// Finds Σ and the classes again in some columns of the map, and takes the others over: of ground, wall and corner by
  /// what each adds. `voxels`: all that have bounds now; `inside`: those in the columns.
  void update(const map::OccupancyGrid& grid, const Model& model, const map::VoxelBox& columns,
              std::span<const std::size_t> voxels, std::span<const std::size_t> inside, const Parallel& parallel);
  /// Σ times the factor of its class at a voxel with a Σ, by its linear index: what the sets are made of.
  Variance flown_at(std::size_t n) const noexcept;
};

/// Σ along x, y, z of W and the class at a place; zeros and none where the map has none.
struct AirPlace {
  Vec3 sigma = Vec3::Zero();  ///< (m/s²)²
  AirClass air = AirClass::none;
};
/// Real-time: wait-free, no allocation.
AirPlace air_at(const AirScale& scale, const map::OccupancyGrid& grid, const Vec3& p_W) noexcept;

}  // namespace backwash::plan
