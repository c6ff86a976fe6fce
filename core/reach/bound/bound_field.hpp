// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "core/field/disturbance_field.hpp"
#include "core/field/extension.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/map/voxel_box.hpp"
#include "core/reach/bound/bound_tiles.hpp"
#include "core/types/disturbance.hpp"
#include "core/types/parallel.hpp"

namespace backwash::reach {

/// Computes Σ at voxels, with the factor that an extended model has there, and calls store(linear index, Σ) for each of
/// them once, possibly from several threads.
using FillVariance = std::function<void(const std::function<void(std::size_t, const Variance&)>& store)>;

/// The most that blows anywhere in a field, for what a loop may hold of it (integrator.hpp).
struct FieldExtremes {
  Vec3 push_range = Vec3::Zero();  ///< of the known pushes and of none, along each axis, m/s²
  double level = 0, vertical = 0;  ///< steady push of unknown sign, m/s²
  DisturbanceBound gusts;          ///< w̄ less its steady part, m/s²
};

/// w̄ at every voxel of a field, for maxima over sets (docs/model.md section 3, "Over the set, not at its centre"), and
/// the mean push that an extended model has there: the disturbance at p is push(p, v) ± w̄. Σ itself is not kept.
/// Bounds are kept in 16 bits and rounded up (bound_code.hpp): what is read is w̄ to w̄·(1 + kBoundGrowth). Copies share
/// what is equal in them (bound_tiles.hpp).
class BoundField {
 public:
  /// w̄ is 0 everywhere: what is not stored counts so (the vehicle's centre cannot be there). `extension`: filled where
  /// w̄ will be. What it does not know of the push is added to w̄.
  BoundField(const map::OccupancyGrid& grid, const BoundModel& model, field::Extension extension = {});
  /// Of a stored field, in which the extension's factor of Σ by place is expected.
  BoundField(const map::OccupancyGrid& grid, const field::DisturbanceField& field, const BoundModel& model,
             field::Extension extension = {});
  /// The voxels of a box inside the grid anew: w̄ of what `fill` stores at the listed ones (linear indices, inside the
  /// box), 0 at the others. O(voxels of the tiles met); by an extension by place O(voxels).
  void update(const map::VoxelBox& changed, std::span<const std::size_t> listed, const FillVariance& fill,
              const Parallel& parallel = run_serial);
  /// The same with another Σ at the voxels where w̄ is stored, by linear index; nothing: w̄ stays there. As update() of
  /// all of them, and cheaper: O(voxels) where much changes, and what does not change stays shared.
  template <class Sigma>
  void revalue(const Sigma& sigma, const Parallel& parallel = run_serial) {
    tiles_.recode(
        [&](std::size_t n, const BoundCodes& old) {
          const std::optional<Variance> other = sigma(n);
          return other ? coded(n, *other) : old;
        },
        parallel);
    update_pushes();
  }
  /// What is kept at a voxel inside the grid, and the whole field anew from that: codes[i] belongs to listed[i] (linear
  /// indices), all others are 0. Cost as that of update() of all, without `fill`.
  const BoundCodes& codes(const Index3& v) const noexcept { return tiles_.at(v).level[0]; }
  void restore(std::span<const std::size_t> listed, std::span<const BoundCodes> codes,
               const Parallel& parallel = run_serial);
  /// What the extension adds by place anew at the listed voxels of the grid; update() of them must follow.
  void extend(const map::OccupancyGrid& grid, std::span<const std::size_t> listed, const Parallel& parallel) {
    parallel(listed.size(),
             [&](std::size_t begin, std::size_t end) { extension_.fill(grid, listed.subspan(begin, end - begin)); });
  }
  /// Largest w̄ of all voxels, m/s². O(voxels / 4096).
  DisturbanceBound largest() const noexcept;
  /// Over all stored voxels and velocities of up to v_max along each axis, m/s. O(voxels / 4096).
  FieldExtremes extremes(double v_max) const noexcept;
  const BoundModel& model() const noexcept { return model_; }
  const field::Extension& extension() const noexcept { return extension_; }
  /// Mean push on a vehicle that moves with v at p, m/s². Real-time: wait-free, no allocation.
  Vec3 push(const Vec3& p_W, const Vec3& v_W) const noexcept { return extension_.push(p_W, v_W); }
  /// Largest deviation from `push_W` in each direction over the closed box, of a vehicle that moves with v: max_over
  /// without an extension. Larger boxes of voxels than kFew are bounded by the whole field's spread of pushes.
  /// Real-time: wait-free, no allocation.
  DisturbanceBound max_about(const Vec3& push_W, const Vec3& v_W, const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// Of that, what the push alone deviates by, m/s².
  PerDirection push_spread(const Vec3& push_W, const Vec3& v_W, const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// max_about without any push: what is left of w̄ where a loop's integrator takes the pushes.
  DisturbanceBound max_without_push(const Vec3& v_W, const Vec3& low_W, const Vec3& high_W) const noexcept;
  DisturbanceBound max_without_push_over(const Vec3& v_W, const Index3& low, const Index3& high) const noexcept;
  /// max_about over the voxels from low to high.
  DisturbanceBound max_about_voxels(const Vec3& push_W, const Vec3& v_W, const Index3& low,
                                    const Index3& high) const noexcept;
  /// Component-wise maximum of w̄ over the voxels, closed cubes, that meet the closed box [low, high], m in W; 0 if none
  /// does. Exact but for the rounding up. 1 look-up for boxes over 1, 2 or 4 voxels per axis, 8 up to 8 per axis, then
  /// O(voxels/64). Real-time: wait-free, no allocation.
  DisturbanceBound max_over(const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// The same over the voxels from low to high, both included; what lies outside the grid counts as 0.
  DisturbanceBound max_over_voxels(Index3 low, Index3 high) const noexcept;
  /// The voxels, closed cubes, that meet a closed box, m in W; an empty box if none does.
  map::VoxelBox meeting(const Vec3& low_W, const Vec3& high_W) const noexcept;
  /// w̄ at a voxel's centre, m/s²; 0 outside the grid.
  DisturbanceBound at(const Index3& v) const noexcept;

 private:
  static constexpr int kFew = 512;  // voxels
  bool inside(const Index3& v) const noexcept { return map::inside(tiles_.size(), v); }
  DisturbanceBound moving(DisturbanceBound w, const Vec3& v_W) const noexcept;
  BoundCodes coded(std::size_t n, const Variance& sigma) const noexcept;
  void update_pushes();
  bool stored(const Index3& v) const noexcept { return tiles_.at(v).level[0][kZ] != 0; }

  Vec3 origin_W_;
  double resolution_;
  BoundTiles tiles_;
  field::Extension extension_;
  BoundModel model_;
  Vec3 least_push_ = Vec3::Zero(), largest_push_ = Vec3::Zero();  // of the stored voxels
  double unknown_level_ = 0, unknown_vertical_ = 0;               // the same, of what is not known of the push, m/s²
};

}  // namespace backwash::reach
