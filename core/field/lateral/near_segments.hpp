// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/field/lateral/lateral_columns.hpp"

namespace backwash::field {

/// Segments of LateralColumns within the model's ranges that look at a column, in their order.
struct NearSegments {
  /// `low`, `high`: heights of elements that may have a term.
  void find(const LateralColumns& columns, int x, int y, int low, int high);

  std::size_t count = 0;
  std::vector<std::uint32_t> number;  ///< of the segment
  std::vector<std::int32_t> dx, dy;   ///< its column from the one that looks
  std::vector<double> m_x, m_y;       ///< normal
  std::vector<double> along, flat2;   ///< r·m and |r|² from above, voxel edges
  std::vector<double> decay;          ///< exp(−k_w2 d_c²)

 private:
  void reserve(std::size_t most);
};

}  // namespace backwash::field
