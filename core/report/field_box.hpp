// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "core/plan/world/world.hpp"
#include "core/reach/bound/bound_code.hpp"

namespace backwash::report {

/// The voxel of a map nearest to a place.
Index3 nearest_voxel(const map::OccupancyGrid& grid, const Vec3& p_W);

/// Which part of a field a flight's page shows: the voxels around its path, 2 m more on each side, and the layer at its
/// mean height.
struct FieldView {
  Index3 low, high;  ///< voxels, both included
  double height_m;
  int layer;  ///< along z
};
/// Precondition: the path holds a point.
FieldView field_view(const map::OccupancyGrid& grid, std::span<const Vec3> path_W);

/// Bounds of the vertical disturbance at voxels of a box: what the page's slice shows, at more heights.
struct FieldBox {
  Vec3 first_W;                         ///< centre of the first voxel, m
  double side_m;                        ///< of a voxel
  Index3 stride;                        ///< voxels from one to the next along each axis
  Index3 count;                         ///< along each axis
  int level;                            ///< of the view's layer, counted along z in what is kept
  std::vector<reach::BoundCode> codes;  ///< x fastest, z slowest; 0: the vehicle's centre cannot be there
};
/// All heights between which the view's box holds a bound. Where that is more than `most`, every other layer or fewer,
/// the view's own among them; where one layer alone is, every other voxel of it or fewer.
FieldBox field_box(const plan::World& world, const FieldView& view, std::size_t most = 300000);

}  // namespace backwash::report
