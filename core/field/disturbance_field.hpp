// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/field/extension.hpp"
#include "core/field/lateral/element_buckets.hpp"
#include "core/field/proximity_model.hpp"
#include "core/field/sight/sight.hpp"
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

/// Σ stored at free voxel centres, (m/s²)² (docs/model.md section 2, last paragraph): xx, xy, yy and zz in single
/// precision at the listed voxels alone, since xz and yz are zero in every term of the model. 16 bytes per listed
/// voxel, 3/16 per voxel of the grid.
class DisturbanceField {
 public:
  /// Room for Σ at the listed voxels (linear indices of the grid, any order), where it is unset. O(voxels of the grid).
  DisturbanceField(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels);
  /// The same, with Σ of `old` at those listed voxels outside the box `anew` where it has one. With affected_columns()
  /// and set(), a field follows its map, bit for bit as if it were made anew. Precondition: of grids of one size.
  DisturbanceField(const map::OccupancyGrid& grid, std::span<const std::size_t> voxels, const DisturbanceField& old,
                   const map::VoxelBox& anew);

  /// Evaluates Σ at the centres of some of the listed voxels. Distinct ones may be filled from several threads at once.
  void fill(const ProximityField& exact, std::span<const std::size_t> voxels);
  /// The same for the voxels in the tiles [begin, end) of `whole`, many times faster per voxel.
  void fill(const WholeField& whole, std::size_t begin, std::size_t end);
  /// Σ at a listed voxel, by its linear index. Distinct ones may be set from several threads at once.
  void set(std::size_t n, const Variance& s) noexcept;

  /// Multiplies Σ at the given voxels, where it is stored, by the factor that an extended model has there.
  void scale(const Extension& extension, std::span<const std::size_t> voxels);

  /// Whether Σ is stored at a voxel; false outside the grid. Real-time: wait-free, no allocation.
  bool has(const Index3& v) const noexcept;
  /// Σ at a voxel centre. Precondition: has(v). Real-time: wait-free, no allocation.
  Variance at(const Index3& v) const noexcept;
  /// The same by the voxel's linear index.
  Variance at(std::size_t n) const noexcept;
  /// Trilinear interpolation, weights of the stored voxels renormalised; `fallback` where none of the eight is stored.
  /// Real-time: wait-free, no allocation.
  Variance interpolated(const Vec3& p_W, const Variance& fallback) const noexcept;

 private:
  using Stored = std::array<float, 4>;  // xx, xy, yy, zz; xx < 0: not filled
  static constexpr std::size_t kWord = 64;
  bool listed(std::size_t n) const noexcept { return listed_[n / kWord] >> n % kWord & 1; }
  std::size_t slot(std::size_t n) const noexcept;  // of a listed voxel in sigma_
  bool has(std::size_t n) const noexcept { return listed(n) && sigma_[slot(n)][0] >= 0; }

  Vec3 origin_W_;
  double resolution_;
  Index3 size_;
  std::vector<std::uint64_t> listed_;  // a bit per voxel of the grid
  std::vector<std::uint32_t> before_;  // per word: listed voxels in the words before it
  std::vector<Stored> sigma_;          // of the listed voxels
};

}  // namespace backwash::field
