// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "core/field/disturbance_field.hpp"
#include "core/map/occupancy_grid.hpp"
#include "tests/support/line_of_sight.hpp"

namespace backwash::bench {

/// What a query replaces: every voxel of the box in range, its elements known, one line of sight through the grid for
/// each element with a term.
class NaiveBoxScan {
 public:
  explicit NaiveBoxScan(const map::OccupancyGrid& grid)
      : grid_(grid), terms_(model_, grid.resolution()), of_voxel_(grid.cell_count()) {
    for (const field::Element& e : field::surface_elements(grid)) {
      const Vec3 inside = e.c_W - 0.5 * grid.resolution() * e.normal;
      of_voxel_[grid.linear(grid.index(inside))].push_back(e);
    }
  }
  Variance at(const Vec3& p) const {
    const double wide = std::max(model_.ground.l_max, model_.wall.l_max);
    const Vec3 below(wide, wide, std::max(wide, model_.ground.l_footprint_max)), above(wide, wide, model_.wall.l_max);
    const Index3 low = grid_.index(p - below).cwiseMax(0);
    const Index3 high = grid_.index(p + above).cwiseMin(grid_.size() - Index3::Ones());
    Variance sum;
    for (int k = low.z(); k <= high.z(); ++k)
      for (int j = low.y(); j <= high.y(); ++j)
        for (int i = low.x(); i <= high.x(); ++i)
          for (const field::Element& e : of_voxel_[grid_.linear(Index3(i, j, k))]) {
            if (e.normal.dot(p - e.c_W) <= 0) continue;
            const Variance term = terms_.ground(e, p) + terms_.corner(e, p) + terms_.wall(e, p);
            if (term.zz > 0 && field::line_of_sight(grid_, p, e.c_W)) sum += term;
          }
    return sum;
  }

 private:
  const map::OccupancyGrid& grid_;
  Model model_;
  field::ProximityModel terms_;
  std::vector<std::vector<field::Element>> of_voxel_;
};

}  // namespace backwash::bench
