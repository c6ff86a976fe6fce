// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// Corners, m. Two or three that coincide make a line or a point of it.
using Triangle = std::array<Vec3, 3>;

/// Whether a triangle meets the closed cube of half edge `half` around `center` (all in one unit and frame): they do
/// exactly where none of 13 axes separates them, the cube's normals, the triangle's, and the edges' cross products.
bool meets_cube(const Triangle& triangle, const Vec3& center, double half) noexcept;

/// Marks every voxel of the grid that the triangle (m, W) touches as occupied; a triangle within kOnFace of a face
/// touches the voxels on both of its sides. By halves of the triangle's surroundings, so that a slanted wall costs its
/// voxels and not those of the box around it.
void add_triangle(OccupancyGrid& grid, const Triangle& triangle_W);

/// Whether the triangle lies in a plane of voxel faces, within kOnFace: then two layers of voxels are occupied by it.
bool on_faces(const OccupancyGrid& grid, const Triangle& triangle_W) noexcept;

/// Marks the voxels that hold at least `least` (≥ 1) of the points (m, W) as occupied; a point on a face counts for the
/// upper voxel, one outside the grid for none. Returns how many lie inside. O(points + cells).
std::size_t add_points(OccupancyGrid& grid, std::span<const Vec3> points_W, unsigned least);

}  // namespace backwash::map
