// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/octomap/octomap_file.hpp"

#include <limits>
#include <sstream>

#include "core/map/octomap/octomap_message.hpp"
#include "core/map/octomap/octomap_tree.hpp"

namespace backwash::map {

std::string octomap_file(const OccupancyGrid& grid) {
  const auto data = encode_octomap(grid);
  const auto nodes = octomap_tree::walk(data, true, 0, [](const Index3&, int, Cell) {}).nodes;
  std::ostringstream file;
  file.precision(std::numeric_limits<double>::max_digits10);
  file << "# Octomap OcTree binary file\nid OcTree\nsize " << nodes << "\nres " << grid.resolution() << "\ndata\n";
  file.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  return std::move(file).str();
}

}  // namespace backwash::map
