// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::report {

/// The surface of a map's obstacles: rectangles between occupied and free voxels, neighbours in one plane merged.
struct MapFaces {
  Vec3 origin_W;             ///< corner of voxel (0, 0, 0), m
  double side_m;             ///< of a voxel
  double around_m;           ///< the surface is that of the box around the path, and of so much more on each side
  std::size_t left_out = 0;  ///< rectangles in that box that would have been too many,
  double beyond_m = 0;       ///< the nearest of which is so far from the path

  /// Side 2·axis looks down the axis, 2·axis + 1 up it; its plane, then its lower and upper corners along the other two
  /// axes in their order, all counted in voxels' sides from the origin.
  struct Face {
    int side, plane;
    std::array<int, 2> low, high;
  };
  std::vector<Face> faces;
};

/// Those around a path that holds a point at least; the `most` nearest to it.
MapFaces map_faces(const map::OccupancyGrid& grid, std::span<const Vec3> path_W, std::size_t most = 30000,
                   double around_m = 12);

}  // namespace backwash::report
