// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/map/load_map.hpp"

namespace backwash::map {

/// The `data` field of octomap_msgs/Octomap with `binary` = true and `id` = "OcTree": byte for byte what
/// OcTree::writeBinaryData writes for the pruned tree. Empty for a grid without known cells. O(cells).
/// Precondition: the grid's corner is a multiple of its resolution (to 1e-3 voxels) and within 32768 voxels of the
/// world's origin, as in every grid of load_map; std::invalid_argument otherwise, since a shifted map would be a lie.
std::vector<std::int8_t> encode_octomap(const OccupancyGrid& grid);

/// Grid of an octomap_msgs/Octomap: `resolution` (m), `binary` and `id` as in the message, extents and cells as in
/// load_octomap. Accepted whole or not at all. Errors: corrupt (truncated, left-over bytes, too deep, empty, an id
/// other than OcTree, ColorOcTree and OcTreeStamped, whose occupancy is read, resolution outside 1 mm … 10 m),
/// too_large (checked before anything of that size is allocated).
tl::expected<OccupancyGrid, MapError> decode_octomap(std::span<const std::int8_t> data, double resolution, bool binary,
                                                     const std::string& id, std::size_t max_bytes = 512u << 20);

}  // namespace backwash::map
