// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::field {

/// Voxels that the line of sight from the centre of voxel 0 to the point c = o + `face` (voxel edges) meets: closed
/// boxes, the line's last 2 voxel edges left out (docs/model.md section 1, "Visible"), voxel 0 itself left out. Exactly
/// those that meets() finds. Sorted from the element to the vehicle: what hides an element is most often near it.
/// O(|o|).
std::vector<Index3> cells_on_path(const Index3& o, const Vec3& face);

}  // namespace backwash::field
