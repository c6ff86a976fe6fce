// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::field {

/// A piece of surface that throws the wash back at the vehicle (model.md section 1).
struct Element {
  enum class Kind { up, lateral } kind;
  Vec3 c_W;                   ///< position, m
  Vec3 normal;                ///< unit, W: +z for up, horizontal for lateral
  double area;                ///< A, m²
  std::optional<Vec3> corner_W;  ///< lateral only: top of the floor below the element, horizontally at c (model.md section 2)
};

/// All elements of a map, in a fixed order (by voxel, then up before lateral, then +x, −x, +y, −y).
/// model.md section 1: up element of every occupied voxel whose top neighbour is free; lateral elements with the
/// normal m = g/|g| from the voxel's surroundings, or one per exposed face where m does not exist.
std::vector<Element> surface_elements(const map::OccupancyGrid& grid);

/// Whether the segment from p to c, its last 2a left out, meets no occupied voxel (model.md section 1, "Visible").
/// Voxels are closed boxes: a segment through exactly an edge or a corner is blocked if any voxel that touches that
/// point is occupied. Unknown voxels do not block. Does not test the normal. O(|c − p|/a).
bool line_of_sight(const map::OccupancyGrid& grid, const Vec3& p_W, const Vec3& c_W) noexcept;

}  // namespace backwash::field
