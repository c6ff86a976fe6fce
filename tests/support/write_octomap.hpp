// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <string>

#include "core/map/octomap/octomap_file.hpp"

namespace backwash::map {

/// A binary OctoMap file (`.bt`) of a grid; replaces an existing one. True if it was written to its end.
inline bool write_octomap(const OccupancyGrid& grid, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file << octomap_file(grid);
  file.close();
  return file.good();
}

}  // namespace backwash::map
