// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/map/tiles.hpp"
#include "core/reach/bound/bound_code.hpp"
#include "core/types/disturbance.hpp"
#include "core/types/parallel.hpp"

namespace backwash::reach {

/// Codes of w̄ in the five directions.
using BoundCodes = std::array<BoundCode, kDirections>;

inline bool some(const BoundCodes& codes) noexcept {
  return std::ranges::any_of(codes, [](BoundCode code) { return code != 0; });
}

/// Computes w̄ at voxels and calls store(linear index, codes) for each of them once, possibly from several threads.
using FillBounds = std::function<void(const std::function<void(std::size_t, const BoundCodes&)>& store)>;

/// Codes of w̄ at the voxels of a grid, and their maxima over all cubes of 1, 2 and 4 voxels whose lowest voxel is v,
/// for the v where one is not zero: 32 bytes per entry, 1.03 bytes per voxel of the grid, in tiles of 16³ voxels that
/// copies share.
class BoundTiles {
 public:
  static constexpr int kLevels = 3;  // cubes of 1 << level voxels
  static constexpr int kShift = 4;   // of a tile's edge

  /// Zero everywhere.
  explicit BoundTiles(const Index3& size);
  /// w̄ anew at the voxels of a box inside the grid: what `fill` stores, at voxels of the box that are `listed` (linear
  /// indices), and zero at its others. Tiles are made by `parallel`. O(voxels of the tiles that meet the box).
  void update(const map::VoxelBox& changed, std::span<const std::size_t> listed, const FillBounds& fill,
              const Parallel& parallel);
  /// Other codes at the voxels where some are not zero: anew(linear index, codes so far), possibly from several
  /// threads. As update() of all with these. Tiles in reach of no other code stay shared. O(voxels of the others).
  template <class Anew>
  void recode(const Anew& anew, const Parallel& parallel) {
    Fresh fresh(tiles_.count());
    std::vector<std::uint8_t> pooled(tiles_.count());
    // From the last one on: cubes reach ahead, and what was just written is still near.
    parallel(tiles_.count(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = end; n-- > begin;) {
        fresh[n] = recoded(n, anew);
        if (fresh[n]) tiles_.replace(n, fresh[n]);
        pooled[n] = pool_before(end, n, fresh);
      }
    });
    pool_rest(pooled, fresh, parallel);
  }

  struct alignas(32) Entry {
    std::array<BoundCodes, kLevels> level{};
  };
  const Index3& size() const noexcept { return tiles_.size(); }
  /// Precondition: v inside the grid. Real-time: wait-free, no allocation.
  const Entry& at(const Index3& v) const noexcept { return tiles_.of(v).at(Grid::within(v)); }
  /// The maximum over the cubes of a level at the voxels i0, i0 + step … of a row, the last one moved back to `end`.
  /// Precondition: i0 ≤ end, all within the grid. Real-time: wait-free, no allocation.
  void raise_along(BoundCodes& maximum, int level, int i0, int end, int step, int j, int k) const noexcept {
    const auto* const tiles = tiles_.row(j, k);
    const std::size_t row = Grid::within({0, j, k});
    for (int i = i0;; i = std::min(i + step, end)) {
      const Tile& tile = *tiles[i >> kShift];
      const BoundCodes& codes =
          tile.at(row | static_cast<std::size_t>(i & (Grid::kEdge - 1))).level[static_cast<std::size_t>(level)];
      for (std::size_t d = 0; d < kDirections; ++d) maximum[d] = std::max(maximum[d], codes[d]);
      if (i == end) return;
    }
  }
  /// Largest code of each direction. O(tiles).
  BoundCodes largest() const noexcept;

 private:
  static constexpr std::size_t kVoxels = std::size_t{1} << 3 * kShift, kRun = 128;
  struct Tile {
    std::array<std::uint8_t, kVoxels> rank{};            // of a voxel's entry within the run, from 1; 0: none
    std::array<std::uint16_t, kVoxels / kRun> before{};  // per run: entries of the runs before it
    std::vector<Entry> entries{1};                       // the first is zero, of the voxels without one
    BoundCodes largest{};
    std::size_t entry_of(std::size_t n) const noexcept {
      const std::uint32_t some = 0u - std::uint32_t{rank[n] != 0};  // all bits or none
      return (std::uint32_t{before[n / kRun]} + rank[n]) & some;
    }
    const Entry& at(std::size_t n) const noexcept { return entries[entry_of(n)]; }
  };
  using Grid = map::Tiles<Tile, kShift>;
  template <class Visit>
  void for_each_entry(const map::VoxelBox& box, const Visit& visit) const;
  struct Marks;  // which voxels of a box have an entry
  Marks entered(const map::VoxelBox& changed, std::span<const std::size_t> listed) const;
  Tile renumbered(std::size_t tile, const map::VoxelBox& changed, const Marks& marks) const;
  using Fresh = std::vector<std::shared_ptr<Tile>>;  // null: a tile stays
  template <class Anew>
  std::shared_ptr<Tile> recoded(std::size_t tile, const Anew& anew) const;
  std::vector<std::size_t> reached(std::size_t tile) const;
  Tile& own(std::size_t tile, const Fresh& fresh);
  bool pool_before(std::size_t end, std::size_t tile, const Fresh& fresh);
  void pool_rest(const std::vector<std::uint8_t>& pooled, const Fresh& fresh, const Parallel& parallel);
  void pool(Tile& tile, const map::VoxelBox& box) const;

  Grid tiles_;
};

// Null: no code of the tile differs.
template <class Anew>
std::shared_ptr<BoundTiles::Tile> BoundTiles::recoded(std::size_t tile, const Anew& anew) const {
  if (tiles_[tile].entries.size() <= 1) return nullptr;
  auto fresh = std::make_shared<Tile>(tiles_[tile]);
  const map::VoxelBox box = tiles_.voxels(tile);
  bool changed = false;
  for (int k = box.low.z(); k <= box.high.z(); ++k)
    for (int j = box.low.y(); j <= box.high.y(); ++j) {
      const std::size_t row = Grid::within({0, j, k}), n = map::linear(size(), {box.low.x(), j, k});
      for (int i = box.low.x(); i <= box.high.x(); ++i) {
        const std::size_t e = fresh->entry_of(row | static_cast<std::size_t>(i & (Grid::kEdge - 1)));
        BoundCodes& codes = fresh->entries[e].level[0];
        if (e == 0 || !some(codes)) continue;
        const BoundCodes other = anew(n + static_cast<std::size_t>(i - box.low.x()), codes);
        changed = changed || other != codes;
        codes = other;
      }
    }
  return changed ? fresh : nullptr;
}

}  // namespace backwash::reach
