// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/field/sight/around.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/voxel_box.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Effects that depend on place, at a point.
Air air_around(std::span<const ModelEffect> effects, const Around& around);
/// Effects that depend on the velocity, and constant ones. Real-time: wait-free, no allocation; O(effects).
Air air_moving(std::span<const ModelEffect> effects, const Vec3& v_W) noexcept;

/// A model's extension over a map: effects that depend on place stored at voxel centres, the others computed.
class Extension {
 public:
  /// No effects: everything is 0.
  Extension() = default;
  /// Stores room for the effects by place; nothing is stored yet, which counts as 0.
  Extension(const map::OccupancyGrid& grid, const Model& model);

  bool none() const noexcept { return effects_.empty(); }
  bool by_place() const noexcept { return !voxels_.empty(); }
  /// How far a changed voxel moves the air level, m. Straight up and down it may be any distance.
  double level_range() const noexcept { return sight_.level; }
  /// Computes the listed free voxels (linear indices of the grid that it was made of); distinct voxels may be computed
  /// from several threads at once. Without effects by place nothing happens.
  void fill(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels);

  /// What is stored at a voxel; 0 outside the grid and where nothing is stored. Real-time: wait-free, no allocation.
  Air at(const Index3& v) const noexcept;
  /// Mean push on a vehicle that moves with v at p, m/s²: trilinear between stored voxels, their weights renormalised.
  /// Real-time: wait-free, no allocation.
  Vec3 push(const Vec3& p_W, const Vec3& v_W) const noexcept;
  /// air_moving() of its effects.
  Air moving(const Vec3& v_W) const noexcept { return air_moving(effects_, v_W); }

 private:
  struct Stored {
    std::array<float, 3> push{};
    float level = 0, vertical = 0, ln_variance = 0;
    bool set = false;
  };
  std::vector<ModelEffect> effects_;
  Sight sight_{0, 0, 0};
  Vec3 origin_W_ = Vec3::Zero();
  double resolution_ = 1;
  Index3 size_ = Index3::Zero();
  std::vector<Stored> voxels_;
};

}  // namespace backwash::field
