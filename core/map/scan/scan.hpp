// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/map/voxel_box.hpp"

namespace backwash::map {

/// What a scan, or a mapper's window, changed in the grid.
struct ScanChange {
  VoxelBox box;                  ///< around all voxels whose content changed; empty: none did
  std::vector<Index3> occupied;  ///< of them those that are occupied now, or not known any more
};

/// A grid that takes in range scans while flying. Within one scan occupied wins over free. A voxel that a point lies in
/// is occupied from that scan on; an unknown one that rays pass is free; an occupied one is free again after
/// kMissesToFree scans in a row whose rays pass it and in which no point lies in it, so that a single grazing ray opens
/// no wall. What lies outside the grid stays unknown.
class LiveMap {
 public:
  static constexpr int kMissesToFree = 5;

  explicit LiveMap(OccupancyGrid grid);

  const OccupancyGrid& grid() const noexcept { return grid_; }
  /// Another than a scan says what a voxel holds; scans begin anew to free it. Precondition: it is inside the grid.
  void set(const Index3& v, Cell c) noexcept {
    grid_.set(v, c);
    std::uint8_t& misses = misses_[grid_.linear(v)];
    misses = c == Cell::occupied && (misses & kFound) != 0 ? kFound : std::uint8_t{0};
  }
  /// Whether the voxel is occupied and a scan has found it so.
  bool found(const Index3& v) const noexcept { return grid_.inside(v) && (misses_[grid_.linear(v)] & kFound) != 0; }
  /// What scans have found so far is as if another had said it.
  void forget_found() noexcept {
    for (std::uint8_t& misses : misses_) misses &= static_cast<std::uint8_t>(~kFound);
  }
  /// Takes along what scans have found in another grid of the lattice: it is occupied in this one, until scans see
  /// through it. `low` is the voxel of that grid at this one's first.
  void take_along(const LiveMap& other, const Index3& low) noexcept;
  /// Casts a ray from the sensor to each point (m in W); the last voxel of a ray is not passed. Points farther than
  /// `max_range` (m) only free the way up to there. `misses`: scans in a row that free an occupied voxel, at most 127.
  /// Precondition: the sensor is inside the grid and max_range < 1 km. O(points · range/a).
  ScanChange insert(std::span<const Vec3> points_W, const Vec3& sensor_W, double max_range, int misses = kMissesToFree);

 private:
  enum class Seen : std::uint8_t { nothing, passed, hit };
  static constexpr std::uint8_t kFound = 0x80;  // of misses_
  void see(const Index3& v, Seen what);
  void pass(const Vec3& from, const Vec3& to);  // in voxels from the origin

  OccupancyGrid grid_;
  std::vector<std::uint8_t> misses_;  // per voxel: scans in a row that passed it while it was occupied; and kFound
  std::vector<Seen> seen_;            // by the scan under way
  std::vector<std::size_t> touched_;  // the voxels of seen_ that are not nothing
};

}  // namespace backwash::map
