// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/map/occupancy_grid.hpp"
#include "core/types/around.hpp"

namespace backwash::field {

/// By rays: one down, one up, 32 around. O(voxels on the rays); allocates for walls.
Around around(const map::OccupancyGrid& grid, const Vec3& p_W, const Sight& sight = {});

}  // namespace backwash::field
