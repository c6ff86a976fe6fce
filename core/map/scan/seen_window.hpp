// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/map/voxel_box.hpp"

namespace backwash::map {

/// What a mapper's moving window has said of the voxels of a lattice that has a corner at the origin of W, in parts of
/// kEdge³ voxels. It holds `most_parts` of them and those of one window: beyond that the parts farthest from the window
/// are let go, none that it meets. Where it says nothing, a whole map speaks, or nobody (docs/interfaces.md, "A window
/// that moves"). Indices lie within ± 2^20 parts. Pure: stamps are the caller's.
class SeenWindow {
 public:
  static constexpr int kShift = 4, kEdge = 1 << kShift;
  static constexpr std::size_t kRecent = 4;
  static constexpr std::size_t kPartVoxels = std::size_t{kEdge} * kEdge * kEdge;
  /// Of one part at most, with what the table and the allocator take for it.
  static constexpr std::size_t kPartBytes = kPartVoxels + 112;

  explicit SeenWindow(std::size_t most_parts) : most_(most_parts) {}

  /// Parts that a box of so many voxels meets at most.
  static std::size_t parts_of(const Index3& size) noexcept;

  /// These are occupied since the stamp; what the cloud does not list stays as it was said. Returns the voxels of which
  /// that was not known.
  std::vector<Index3> occupied(std::span<const Index3> voxels, std::int64_t stamp_ns);
  /// These are free since the stamp, but for those that an occupied cloud lists at this stamp or later. Of the newest
  /// kRecent stamps that is known voxel by voxel; at an older one, and where two clouds share a stamp, nothing that is
  /// occupied is freed.
  std::vector<Index3> freed(std::span<const Index3> voxels, std::int64_t stamp_ns);
  /// Another mapper speaks: its stamps count from anew. What was said stays.
  void restart() noexcept;
  /// What was said; unknown: nothing.
  Cell at(const Index3& v) const noexcept;

  /// A voxel of a part that was let go, and what had been said of it.
  using Evicted = std::vector<std::pair<Index3, Cell>>;
  /// Lets go of what is too much, the farthest from the window first.
  Evicted evict(const VoxelBox& window);
  /// A whole map is newer: what it calls occupied is not free any more. What was said to be occupied stays.
  void forget_free();

  std::size_t parts() const noexcept { return parts_.size(); }

 private:
  using Part = std::array<Cell, kPartVoxels>;
  using Key = std::uint64_t;
  static Key key(const Index3& v) noexcept;
  static Index3 low(Key key) noexcept;
  static std::size_t within(const Index3& v) noexcept;
  std::vector<Index3> say(std::span<const Index3> voxels, Cell cell);

  std::size_t most_;
  std::unordered_map<Key, std::unique_ptr<Part>> parts_;
  std::map<std::int64_t, std::vector<Index3>> recent_;  // occupied voxels of the newest clouds, in order, by stamp
  std::int64_t forgotten_ns_ = INT64_MIN;               // the newest stamp of which not all is in recent_
};

}  // namespace backwash::map
