// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <string>

#include "core/map/octomap_message.hpp"
#include "core/map/octomap_tree.hpp"

namespace backwash::map {

/// A binary OctoMap file (`.bt`) of a grid; replaces an existing one. True if it was written to its end.
inline bool write_octomap(const OccupancyGrid& grid, const std::string& path) {
  const auto data = encode_octomap(grid);
  const auto nodes = octomap_tree::walk(data, true, [](const Index3&, int, Cell) {}).nodes;
  std::ofstream file(path, std::ios::binary);
  file.precision(17);
  file << "# Octomap OcTree binary file\nid OcTree\nsize " << nodes << "\nres " << grid.resolution() << "\ndata\n";
  file.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  file.close();
  return file.good();
}

}  // namespace backwash::map
