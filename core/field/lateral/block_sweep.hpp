// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/field/lateral/lateral_sweep.hpp"
#include "core/field/whole_field.hpp"

namespace backwash::field {

/// Evaluates blocks one after the other. A word is a row of 64 voxels along x; bit x' is voxel x + x'.
class BlockSweep {
 public:
  explicit BlockSweep(const WholeField& whole);

  /// Calls store(linear index, Σ) for the listed voxels of each block.
  void run(std::span<const WholeField::Block> blocks, const std::function<void(std::size_t, const Variance&)>& store);

 private:
  static constexpr std::size_t kRows = WholeField::kRows;

  void sweep(const WholeField::Block& block);
  template <typename Lateral, typename Store>
  void each(Lateral& lateral, const Store& store);
  void open(const WholeField::Block& block);
  void open_plane(int dx);
  void sweep_plane(int dx);
  void take_over_sums();
  /// 64 voxels of a row of the map from x on; bits outside the map are 0.
  std::uint64_t row_of(const std::vector<std::uint64_t>& bits, int x, int y, int z) const noexcept;
  std::size_t sum_row(std::size_t z, std::size_t y) const noexcept { return 64 * (z * kRows + y); }
  std::uint64_t column_targets(std::size_t x, std::size_t y, std::size_t z) const noexcept;

  const WholeField& whole_;
  std::size_t layers_, height_;          // height_: rows of a window
  std::vector<std::uint64_t> occupied_;  // [dx][z][row of the window]
  std::vector<std::uint64_t> targets_;   // [z][row of the block]
  std::vector<std::uint64_t> elements_;  // [z][row of the window] at the dx in hand
  std::vector<std::uint64_t> eight_;     // the same in any of eight rows from there on
  std::vector<std::uint64_t> targeted_;  // [z][half of the rows of the block]: targets in any
  std::vector<int> levels_;              // layers that hold elements there
  std::vector<float> h_part_, v_part_;   // [z][row][64]: sums over one dx: short sums round less
  std::vector<float> h_, v_;             // the same over all
  std::vector<std::int32_t> path_;       // of one offset, where the stencil keeps none
  WholeField::Block block_{};
};

}  // namespace backwash::field
