// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/field/lateral_columns.hpp"
#include "core/field/layers.hpp"
#include "core/field/sight_lines.hpp"

namespace backwash::field {

/// Evaluates LateralColumns column after column of a block, from a window of its surroundings.
class LateralSweep {
 public:
  explicit LateralSweep(const LateralColumns& columns);
  /// Takes the columns x … x + LateralColumns::kWindow − 1, y … y + height − 1 in hand, and the layers first_z …
  /// first_z + LateralColumns::kLayers − 1.
  void open(int x, int y, int height, int first_z);
  /// Adds the terms in the voxels of column (x, y) of the block that `targets` marks: bit z is layer first_z + z.
  /// Entries of `sums` outside them hold nothing. Bits do not depend on what was evaluated before.
  void add(int x, int y, std::uint64_t targets, LateralColumns::Sums& sums);

 private:
  using ElementSegment = LateralColumns::ElementSegment;
  static constexpr int kBelow = 32;  ///< bit n of a column of the window is layer first_z − kBelow + n
  /// Free heights, below < z < above.
  struct FreeStretch {
    int below, above;
  };
  /// A segment as seen from the column in hand; heights count from first_z.
  struct View : LateralColumns::Reach {
    const ElementSegment* segment;
    double d2;                           ///< d_c², m²
    int first_up, last_up;               ///< heights above the floor's voxel that may have a corner term
    int from, to;                        ///< elements
    std::uint64_t targets, with_corner;  ///< with_corner: heights that may have a corner term
    int low, high;                       ///< first and last target
  };

  void add(const ElementSegment& segment, std::uint64_t targets, LateralColumns::Sums& sums);
  bool meet(const ElementSegment& segment, std::uint64_t targets, View& view) const noexcept;
  void add_corner(View& view) const noexcept;
  void look_along(const SightLines::Line& line);
  bool common_stretch(const View& view, FreeStretch& stretch);
  static std::uint64_t in_range(const View& view, int z) noexcept;
  void add_uncertain(const View& view, const FreeStretch& stretch) noexcept;
  std::uint64_t seen_from(const View& view, int z, std::uint64_t targets) const noexcept;
  std::uint64_t looked_at(const View& view, int z, std::uint64_t targets) const noexcept;

  const LateralColumns& columns_;
  int first_x_ = 0, first_y_ = 0, first_z_ = 0;          ///< of the window and the layers
  int x_ = 0, y_ = 0;                                    ///< the column in hand
  const Layers* home_ = nullptr;                         ///< the same, in the window
  std::vector<Layers> window_;                           ///< occupied voxels
  std::vector<const ElementSegment*> near_;              ///< segments of one row that may have a term
  const SightLines::Line* line_ = nullptr;               ///< to the segment in hand
  std::vector<Layers> crossed_;                          ///< the columns that it crosses
  Layers all_ = 0;                                       ///< what is occupied in any of them
  std::vector<std::pair<ColumnOffset, Layers>> hiding_;  ///< those that are not empty at the heights in question
  std::size_t hiding_count_ = 0;
  std::array<double, LateralColumns::kLayers> wall_{}, seen_{};  ///< per layer: Σ exp(−k_w2 a² n²), number of elements
};

}  // namespace backwash::field
