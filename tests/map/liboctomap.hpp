// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <random>
#include <sstream>
#include <vector>

#include "core/map/occupancy_grid.hpp"

// liboctomap as the oracle of our own OctoMap code.
namespace backwash::map {

using Bytes = std::vector<std::int8_t>;

inline octomap::point3d point(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// The grid as liboctomap's own pruned tree.
inline octomap::OcTree tree_of(const OccupancyGrid& grid) {
  octomap::OcTree tree(grid.resolution());
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    if (grid.at(i) == Cell::unknown) continue;
    const float value = grid.at(i) == Cell::occupied ? tree.getClampingThresMaxLog() : tree.getClampingThresMinLog();
    tree.setNodeValue(point(grid.center(grid.voxel(i))), value, true);
  }
  tree.updateInnerOccupancy();
  tree.prune();
  return tree;
}

inline Cell cell_of(const octomap::OcTree& tree, const Vec3& p) {
  const auto* node = tree.search(point(p));
  return !node ? Cell::unknown : tree.isNodeOccupied(node) ? Cell::occupied : Cell::free;
}

inline Bytes bytes_of(const std::stringstream& stream) {
  const std::string text = stream.str();
  return {text.begin(), text.end()};
}

/// `loaded` covers exactly the bounding box of `grid`'s known cells, and both agree everywhere.
inline void expect_same_world(const OccupancyGrid& loaded, const OccupancyGrid& grid) {
  Index3 low = grid.size();
  Index3 high = Index3::Zero();
  for (std::size_t i = 0; i < grid.cell_count(); ++i) {
    const Index3 v = grid.voxel(i);
    ASSERT_EQ(loaded.at(loaded.index(grid.center(v))), grid.at(i)) << v.transpose();
    if (grid.at(i) == Cell::unknown) continue;
    low = low.cwiseMin(v);
    high = high.cwiseMax(v + Index3::Ones());
  }
  EXPECT_EQ(loaded.size(), Index3(high - low));
  EXPECT_NEAR((loaded.origin() - grid.origin() - grid.resolution() * low.cast<double>()).norm(), 0, 1e-9);
  EXPECT_EQ(loaded.resolution(), grid.resolution());
}

inline bool has_known_cells(const OccupancyGrid& grid) {
  return std::ranges::any_of(grid.cells(), [](Cell c) { return c != Cell::unknown; });
}

}  // namespace backwash::map
