// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/field/lateral/lateral_kernels.hpp"
#include "core/field/sight/sight_lines.hpp"

namespace backwash::field {

/// Voxels that may hide elements from a column of targets, listed first and looked at together.
class HidingRuns {
 public:
  /// An element, the line to it, and the columns that this may cross: n of `left`, and what may be crossed where at
  /// most (n + 1)/16 of the way is left, from below and from above. Bit kCentre is the element's height.
  struct Source {
    std::uint32_t element, line;
    const ColumnOffset* crossings;
    const std::uint8_t* left;
    const std::uint64_t *below, *above;
  };
  /// Lists what may be crossed of the voxels inside[n] of column n; n: bits of `some`.
  void list(const Source& source, const std::uint64_t* inside, std::uint64_t some);
  /// hidden[element] |= heights from which it is hidden, for all that are listed; empties the list.
  void hide(const LineFromAbove* lines, std::uint64_t* hidden);
  std::size_t size() const noexcept { return count_; }
  /// Forgets what was listed after that.
  void cut(std::size_t size) noexcept { count_ = size; }

 private:
  void reserve(std::size_t most);
  void split();

  std::size_t count_ = 0;
  std::vector<std::uint32_t> element_, line_;
  std::vector<std::int32_t> x_, y_, low_, high_;
  std::vector<std::uint64_t> words_;  ///< voxels of a column, later the heights that they hide
};

}  // namespace backwash::field
