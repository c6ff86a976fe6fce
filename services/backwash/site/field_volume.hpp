// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/types/model.hpp"

namespace backwash::services {

/// Σ of hovering at the centre of every free voxel of a map (docs/model.md section 2), with the factor of an extended
/// model: float [z][y][x][6], entries xx, xy, xz, yy, yz, zz, (m/s²)². Where no air is known, in voxels that are not
/// free, each is NaN, as numpy has it. Shown as progress; O(cells) and that of field::WholeField.
std::vector<float> field_volume(const map::OccupancyGrid& grid, const Model& model);

/// Writes `sigma` (the above), `cells` (uint8 [z][y][x]: 0 unknown, 1 free, 2 occupied), `origin` (double [3]: minimum
/// corner of voxel 0, m in W) and `resolution` (double, m) as numpy.savez does: a ZIP file of .npy files, not
/// compressed. Throws Failure as write_stream() does.
void write_npz(const std::string& path, bool force, const map::OccupancyGrid& grid, const std::vector<float>& sigma);

}  // namespace backwash::services
