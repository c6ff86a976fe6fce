// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/field/element_buckets.hpp"
#include "core/field/extension.hpp"
#include "core/field/proximity_model.hpp"
#include "core/field/sight.hpp"
#include "core/field/whole_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/voxel_box.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Σ at a point and its parts, (m/s²)²: sigma = base + ground + corner + wall.
struct Breakdown {
  Variance base, ground, corner, wall;
  Variance sigma() const noexcept { return base + ground + corner + wall; }
};

/// Exact evaluation of docs/model.md section 2 at any point. Holds the elements in buckets and its own copy of the
/// occupied voxels, as they were when it was made; the grid must outlive it.
class ProximityField {
 public:
  /// O(cells).
  ProximityField(const map::OccupancyGrid& grid, const Model& model);
  ProximityField(map::OccupancyGrid&&, const Model&) = delete;  // would leave grid() dangling
  /// Σ(p) = Σ_0 + Σ_e over visible elements e, for any finite p. O(elements within the model's ranges). Thread-safe.
  Breakdown at(const Vec3& p_W) const;
  const Model& model() const noexcept { return model_; }
  const map::OccupancyGrid& grid() const noexcept { return *grid_; }

 private:
  const map::OccupancyGrid* grid_;
  Model model_;
  ProximityModel terms_;
  SightMap sight_;
  ElementBuckets up_, lateral_;
};

/// Σ stored at free voxel centres, (m/s²)² (docs/model.md section 2, last paragraph).
class DisturbanceField {
 public:
  /// Empty field over the grid's extent: every voxel's Σ is unset.
  explicit DisturbanceField(const map::OccupancyGrid& grid);

  /// Evaluates Σ at the centres of the listed free voxels (linear indices of the grid). Distinct voxels may be filled
  /// from several threads at once.
  void fill(const ProximityField& exact, std::span<const std::size_t> voxels);
  /// The same for the voxels in the tiles [begin, end) of `whole`, many times faster per voxel.
  void fill(const WholeField& whole, std::size_t begin, std::size_t end);

  /// Multiplies Σ at the listed voxels, where it is stored, by the factor that an extended model has there.
  void scale(const Extension& extension, std::span<const std::size_t> voxels);

  /// Unsets Σ in a box of voxels inside the grid. With affected_columns() and fill(), a field follows its map, bit for
  /// bit as if it were made anew.
  void clear(const map::VoxelBox& box) noexcept;

  /// Whether Σ is stored at a voxel; false outside the grid.
  bool has(const Index3& v) const noexcept;
  /// Σ at a voxel centre. Precondition: has(v).
  Variance at(const Index3& v) const noexcept;
  /// Trilinear interpolation, weights of the stored voxels renormalised; `fallback` where none of the eight is stored.
  /// Real-time: wait-free, no allocation.
  Variance interpolated(const Vec3& p_W, const Variance& fallback) const noexcept;

 private:
  void set(std::size_t n, const Variance& s) noexcept;
  std::size_t linear(const Index3& v) const noexcept;

  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  std::vector<std::array<float, 6>> sigma_;  // xx < 0: not stored
};

}  // namespace backwash::field
