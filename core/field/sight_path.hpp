// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::field {

/// Normals m between two limits, each component for itself. A single normal: low = high.
struct NormalRange {
  Vec3 low, high;
};

/// A range that holds every horizontal unit normal m within 45° of `face` (horizontal, unit) with m·o < −1/2: those of
/// the elements in voxel o that a vehicle at the centre of voxel 0 can be in front of. Nothing if there are none.
std::optional<NormalRange> facing_normals(const Index3& o, const Index3& face) noexcept;

/// Voxels that the line of sight from the centre of voxel 0 to the element c = o + m/2 of voxel o (voxel edges) meets
/// for some m of the range: closed boxes, the line's last 2 voxel edges left out (model.md section 1, "Visible"), voxel
/// 0 itself left out. Exactly these voxels for a single normal, these and a few more for a range. Sorted from the
/// element to the vehicle: what hides an element is most often near it. O(|o|).
std::vector<Index3> cells_on_path(const Index3& o, const NormalRange& normals);

}  // namespace backwash::field
