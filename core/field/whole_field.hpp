// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/field/lateral/lateral_columns.hpp"
#include "core/field/proximity_model.hpp"
#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"

namespace backwash::field {

/// Σ of docs/model.md section 2 at many voxel centres at once: the same elements, gates, terms and lines of sight as
/// ProximityField::at, reordered. Nothing is quantised; what differs is the rounding.
///
/// Ground: rows of 64 voxels along x are words of one bit each. Seen from a voxel's centre, the up element at the
/// lattice offset o lies at a constant place, so one list of voxels per o says what its line of sight meets, and
///   visible = elements(q + o) & ~OR of occupied(q + d) over the list's offsets d
/// decides for 64 voxels q, and for eight such rows with wide vectors, at once. Corner and wall: LateralColumns.
class WholeField {
 public:
  static constexpr std::size_t kMostSteps = 16'000'000;  ///< 64 MB

  /// Prepares Σ at the centres of the listed free voxels (linear indices of the grid, which must outlive this).
  /// O(cells + listed voxels + a⁻⁴). The lists of voxels on the paths are kept up to 64 MB (a ≥ 0.05 m with the default
  /// model) and made anew for each block beyond; `most_steps`: that limit in entries of 4 bytes.
  WholeField(const map::OccupancyGrid& grid, const Model& model, std::span<const std::size_t> voxels,
             std::size_t most_steps = kMostSteps);
  WholeField(map::OccupancyGrid&&, const Model&, std::span<const std::size_t>, std::size_t = kMostSteps) = delete;

  /// The listed voxels in parts: every block of columns that holds one of them.
  std::size_t block_count() const noexcept { return blocks_.size(); }

  /// Calls store(linear index, Σ) for each listed voxel of the blocks [begin, end). Thread-safe; the values' bits
  /// depend neither on how the blocks are divided among calls nor on voxels farther away than the model's ranges.
  void evaluate(std::size_t begin, std::size_t end,
                const std::function<void(std::size_t, const Variance&)>& store) const;

 private:
  friend class BlockSweep;

  static constexpr std::size_t kRows = 16;  // of a block

  /// Columns x … x + width − 1, y … y + kRows − 1.
  struct Block {
    int x, y, width;
  };
  /// Offsets of up elements within the gates.
  struct Stencil {
    struct Term {
      float horizontal, vertical;  // (m/s²)²
    };
    std::vector<std::uint32_t> first;  // offsets at (dx, dy), dy running fastest
    std::vector<Index3> offsets;
    std::vector<Term> terms;
    std::vector<std::uint32_t> step_first;  // of steps; empty: not kept
    std::vector<std::int32_t> steps;        // what is on the path, from the vehicle's word in a window
  };

  void add_rows(std::span<const std::size_t> voxels);
  void add_blocks(std::span<const std::size_t> voxels);
  void add_stencil();
  void add_paths(std::size_t most_steps);
  /// What is on the path of an offset, kept or made in `scratch`.
  std::span<const std::int32_t> path(std::uint32_t offset, std::vector<std::int32_t>& scratch) const;

  const map::OccupancyGrid* grid_;
  Model model_;
  ProximityModel terms_;
  LateralColumns lateral_;
  int radius_;                                         // of the stencil along x and y
  int width_;                                          // 2 radius_ + 1
  std::size_t row_words_;                              // an empty word before each row, two behind
  std::vector<std::uint64_t> occupied_, up_, listed_;  // rows of voxels: occupied, with an up element, listed
  std::vector<Block> blocks_;
  Stencil stencil_;
};

}  // namespace backwash::field
