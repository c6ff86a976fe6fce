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
  /// All of them, of one line after the other.
  std::span<const ColumnOffset> crossings() const noexcept { return crossings_; }
  /// Of each: n if the part of the way left there is at most (n + 1)/kParts; and 8 more entries.
  std::span<const std::uint8_t> left() const noexcept { return left_; }
  static constexpr int kParts = 16;

 private:
  using Limits = std::array<double, 2>;

  void make(const Bundle& bundle, int dx, int dy, Line& line);
  void add_slab(const Limits& lead, const Limits& side, int s);

  int radius_, width_, bundles_;
  double end_;               ///< part of the way that is not the last 2 voxel edges, of the longest line
  std::vector<Line> lines_;  ///< per dy, dx and bundle: in the order of the segments of a row
  std::vector<ColumnOffset> crossings_;
  std::vector<std::uint8_t> left_;
  struct Made {
    int lead, side;
    double in;  ///< least part of the way up to it
    bool must;
  };
  std::vector<Made> made_;  ///< of the line in the making
};

/// Bits low … high of a word; none if low > high or all are outside it.
inline std::uint64_t bits(int low, int high) noexcept {
  low = low < 0 ? 0 : low;
  high = high > 63 ? 63 : high;
  return low > high ? 0 : ~std::uint64_t{0} >> (63 - high + low) << low;
}

}  // namespace backwash::field
