// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/map/scan/regrid.hpp"
#include "services/maps/geometry.hpp"

namespace backwash::services {

/// Where a file's content goes, and with what voxels, as the options say it.
struct MapOptions {
  std::string file, up;
  std::string topic;                        ///< of a recording's clouds; empty: it has one
  double body_radius = 0;                   ///< m; of a recording: what is nearer to the vehicle is its own
  std::optional<double> resolution, scale;  ///< m; m per unit of the file
  map::Placement place;                     ///< its rotation is the one about W's axes, after `up`
  std::optional<std::pair<Vec3, Vec3>> crop;
  std::uint32_t points_least = 1;
  std::vector<Vec3> sensors;  ///< one place that a cloud was seen from, or none
};

/// A map, what it was made of, and what its maker should know of it.
struct MadeMap {
  map::OccupancyGrid grid;
  std::string kind;  ///< "octomap", "mesh" or "cloud"
  std::size_t points = 0, triangles = 0, not_finite = 0, freed = 0;
  std::vector<std::string> notes;
  maps::Geometry from{};  ///< what was placed, m in W
};

/// Reads an OctoMap file, built-in world, mesh or cloud and places it on a lattice of voxels. Throws Failure: 66 and 65
/// as the readers say, 65 for what has too many voxels, lies too far away or is larger than a building.
MadeMap make_map(const MapOptions& options);

/// Why a file is not the map that was made: empty, or the voxel that another program would read otherwise, or the
/// triangle of the source, with its line, of which places lie in voxels that are not occupied there. Asked of the
/// written file, by places sampled on every triangle: it shares nothing with what made the voxels. O(voxels +
/// triangles).
std::string lost_in(const std::string& written, const MadeMap& made, const std::string& source);

}  // namespace backwash::services
