// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::field {

/// A column of voxels, counted from the one that is looked from.
struct ColumnOffset {
  std::int16_t x, y;
};

/// Lines of sight from one column of voxel centres to the lateral elements of another, seen from above, for a bundle of
/// normals at once: a box that holds them. Interval arithmetic over the box tells which columns of voxels some line
/// crosses before its last 2 voxel edges, and which of them every line crosses.
class SightLines {
 public:
  /// Limits of the normals' components, which do not change sign between them.
  struct Bundle {
    std::array<double, 2> low, high;
  };
  struct Line {
    std::uint32_t first = 0;  ///< of the crossings
    std::uint16_t count = 0;  ///< number of crossings
    std::uint16_t must = 0;   ///< so many of them, the first, are crossed by every line, whatever its slope
  };

  /// `radius`: of the columns' surroundings; `range2`: the longest line, voxel edges². O(bundles · radius³).
  SightLines(std::span<const Bundle> bundles, int radius, double range2);

  const Line& at(int bundle, int dx, int dy) const noexcept {
    return lines_[static_cast<std::size_t>(((dy + radius_) * width_ + dx + radius_) * bundles_ + bundle)];
  }
  /// The columns crossed; of those that must be and of the others, the ones near the element first.
  std::span<const ColumnOffset> crossings(const Line& line) const noexcept {
    return std::span(crossings_).subspan(line.first, line.count);
  }

 private:
  using Limits = std::array<double, 2>;

  void make(const Bundle& bundle, int dx, int dy, Line& line);
  void add_slab(const Limits& lead, const Limits& side, int s);

  int radius_, width_, bundles_;
  double end_;               ///< part of the way that is not the last 2 voxel edges, of the longest line
  std::vector<Line> lines_;  ///< per dy, dx and bundle: in the order of the segments of a row
  std::vector<ColumnOffset> crossings_;
  struct Crossing {
    int lead, side;
    bool must;
  };
  std::vector<Crossing> made_;  ///< of the line in the making
};

/// One line of sight from above, from the centre of a column to an element: which heights a crossed column hides.
/// Heights count from the element's; parts of the way from the column.
class LineFromAbove {
 public:
  static constexpr int kCentre = 31;  ///< bit of a word of heights that is the element's own

  /// `c_x`, `c_y`: the element's place; `range`: its height above or below the column's voxels at most. Voxel edges.
  LineFromAbove(double c_x, double c_y, int range) noexcept;
  /// Takes a column in hand; false if the line does not cross it.
  bool cross(const ColumnOffset& column) noexcept;
  /// Heights from which the voxels low … high of the column in hand hide the element.
  std::uint64_t hidden(int low, int high) const noexcept;

 private:
  double per_x_, per_y_;       ///< 1/c_x, 1/c_y
  double flat_, flat2_;        ///< length from above, voxel edges, and its square
  double end_;                 ///< part of the way that is not the last 2 voxel edges, of the longest line
  double far_ = 1, near_ = 1;  ///< one over the part that is left where the line enters and leaves the column
  int gap_ = 0;                ///< heights below this have the column in their last 2 voxel edges
};

/// Bits low … high of a word; none if low > high or all are outside it.
inline std::uint64_t bits(int low, int high) noexcept {
  low = low < 0 ? 0 : low, high = high > 63 ? 63 : high;
  return low > high ? 0 : ~std::uint64_t{0} >> (63 - high + low) << low;
}

}  // namespace backwash::field
