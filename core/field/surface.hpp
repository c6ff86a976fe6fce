// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::field {

/// A piece of surface that throws the wash back at the vehicle (docs/model.md section 1).
struct Element {
  enum class Kind { up, lateral } kind;
  Vec3 c_W;     ///< position, m
  Vec3 normal;  ///< unit, W: +z for up, horizontal for lateral
  double area;  ///< A, m²
  std::optional<Vec3>
      corner_W;  ///< lateral only: top of the floor below the element, horizontally at c (docs/model.md section 2)
};

/// All elements of a map, in a fixed order (by voxel, then up before lateral, then +x, −x, +y, −y).
/// docs/model.md section 1: up element of every occupied voxel whose top neighbour is free; lateral elements with the
/// normal m = g/|g| from the voxel's surroundings, or one per exposed face where m does not exist. `unknown_floor`: an
/// up element of every unknown voxel under a free one, too (Model::unknown_floor).
std::vector<Element> surface_elements(const map::OccupancyGrid& grid, bool unknown_floor = false);

}  // namespace backwash::field
