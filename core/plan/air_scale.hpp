// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/air_class.hpp"
#include "core/types/model.hpp"

namespace backwash::plan {

/// Fills Σ of a model at the voxels in question.
using FillField = std::function<void(field::DisturbanceField&, const Model&)>;

/// How much rougher than modelled the air is, by place: the class of each voxel (docs/model.md 7-1) and a factor on Σ
/// for each class.
struct AirScale {
  std::vector<AirClass> classes;  ///< of the grid's voxels, linear; of use where Σ is stored. Empty: nobody asked
  AirFactors factors = kModelledAir;

  bool known() const noexcept { return !classes.empty(); }
  /// Finds the class of the listed voxels again: of ground, wall and corner by what each adds to `sigma`, which is of
  /// this model. Two fields more, of the ground alone and of the walls alone. Precondition: no extension.
  void classify(const map::OccupancyGrid& grid, const field::DisturbanceField& sigma, const Model& model,
                std::span<const std::size_t> voxels, const FillField& fill);
  /// Σ times the factor of each voxel's class: what the sets are made of. Nothing: `sigma` itself is.
  std::optional<field::DisturbanceField> flown(const field::DisturbanceField& sigma) const;
};

/// Σ along x, y, z of W and the class at a place; zeros and none where the map has none.
struct AirPlace {
  Vec3 sigma = Vec3::Zero();  ///< (m/s²)²
  AirClass air = AirClass::none;
};
/// Real-time: wait-free, no allocation.
AirPlace air_at(const AirScale& scale, const map::OccupancyGrid& grid, const field::DisturbanceField& sigma,
                const Vec3& p_W) noexcept;

}  // namespace backwash::plan
