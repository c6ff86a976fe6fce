// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::map {

/// Why a map could not be had. `message` is one line that names the file and what would be right.
struct MapError {
  enum class Kind { not_found, corrupt, unknown_name, too_large, bad_resolution } kind;
  std::string message;
};

/// Reads an OctoMap `.bt` or `.ot` file (OcTree, ColorOcTree or OcTreeStamped) into a grid over the tree's known
/// extent, at the tree's finest resolution. A leaf is occupied from p = 0.5 (OcTree's default threshold; the files
/// carry none), otherwise free; what the tree does not know is unknown. Errors: not_found, corrupt (wrong magic,
/// truncated, empty tree …), too_large (file or decoded size above `max_bytes`, checked before anything of that size is
/// allocated).
tl::expected<OccupancyGrid, MapError> load_octomap(const std::string& path, std::size_t max_bytes = 512u << 20);

/// One of the built-in worlds: parallel-walls-4m, -2m, -1m, narrow-gap, corridors, apartment, thin-wall,
/// forest-SEED, at `resolution` (m). Every cell is known; what each looks like, with routes to fly: README.md here.
/// The faces lie exactly on the grid for 0.1 and 0.05 m, else to the nearest voxel. Same result on every platform.
/// Errors: unknown_name (lists the names), bad_resolution (outside 0.02 … 0.2 m).
tl::expected<OccupancyGrid, MapError> builtin_scene(const std::string& name, double resolution = 0.1);

/// Names accepted by builtin_scene (forest with its seed left open).
std::vector<std::string> builtin_scene_names();

/// `builtin:NAME` or the path of an OctoMap file.
tl::expected<OccupancyGrid, MapError> load_map(const std::string& map);

}  // namespace backwash::map
