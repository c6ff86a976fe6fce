// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::bench {

inline const Vec3 kRoom(10, 10, 3);  ///< m

/// Occupies the voxels whose centres lie in the box, m.
inline void add_box(map::OccupancyGrid& grid, const Vec3& from, const Vec3& to) {
  const double a = grid.resolution();
  const Index3 low = (from / a - Vec3::Constant(0.499)).array().ceil().cast<int>().max(0);
  const Index3 high = (to / a - Vec3::Constant(0.501)).array().floor().cast<int>().min(grid.size().array() - 1);
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) grid.set(Index3(i, j, k), map::Cell::occupied);
}

/// Room of 10 × 10 × 3 m; floor, walls and, if wanted, ceiling one voxel thick.
inline map::OccupancyGrid empty_room(double a, bool ceiling) {
  map::OccupancyGrid grid(Vec3::Zero(), a, (kRoom / a).array().round().cast<int>(), map::Cell::free);
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 thick = kRoom;
    thick[axis] = a;
    add_box(grid, Vec3::Zero(), thick);
    if (axis < 2 || ceiling) add_box(grid, kRoom - thick, kRoom);
  }
  return grid;
}

/// Floor, four walls, a table-high box, a cupboard and a pillar.
inline map::OccupancyGrid plain_room(double a) {
  map::OccupancyGrid grid = empty_room(a, false);
  add_box(grid, {2, 2, 0}, {3.6, 2.8, 0.7});
  add_box(grid, {8.5, 4, 0}, {9.9, 5, 2});
  add_box(grid, {5, 7, 0}, {5.3, 7.3, 3});
  return grid;
}

/// Opposite corners of 25 random boxes standing on the floor, on a lattice of 0.1 m.
inline std::vector<std::pair<Vec3, Vec3>> furniture() {
  std::vector<std::pair<Vec3, Vec3>> boxes;
  std::mt19937 random(1);
  const auto draw = [&](int low, int high) { return 0.1 * std::uniform_int_distribution(low, high)(random); };
  for (int n = 0; n < 25; ++n) {
    const double x = draw(0, 95), y = draw(0, 95), dx = draw(3, 12), dy = draw(3, 12), dz = draw(4, 20);
    boxes.emplace_back(Vec3(x, y, 0), Vec3(x + dx, y + dy, dz));
  }
  return boxes;
}

/// Closed room with the furniture.
inline map::OccupancyGrid furnished_room(double a) {
  map::OccupancyGrid grid = empty_room(a, true);
  for (const auto& [from, to] : furniture()) add_box(grid, from, to);
  return grid;
}

/// The same turned by an angle, rad; walls 1.5 voxels thick, so that they stay closed; unknown outside.
inline map::OccupancyGrid turned_room(double a, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), across = kRoom.x() * (std::abs(c) + std::abs(s));
  const int n = static_cast<int>(std::ceil(across / a)) + 2, layers = static_cast<int>(std::lround(kRoom.z() / a));
  map::OccupancyGrid grid(Vec3::Zero(), a, Index3(n, n, layers), map::Cell::unknown);
  const auto boxes = furniture();
  const auto within = [](const Vec3& q, const Vec3& from, const Vec3& to) {
    return ((q - from).array() > 0).all() && ((to - q).array() > 0).all();
  };
  for (std::size_t k = 0; k < grid.cell_count(); ++k) {
    const Vec3 p = grid.center(grid.voxel(k)), d = p - Vec3(0.5 * n * a, 0.5 * n * a, 0);
    const Vec3 q(c * d.x() + s * d.y() + 5, c * d.y() - s * d.x() + 5, d.z()), thick(1.5 * a, 1.5 * a, a);
    if (!within(q, Vec3::Zero(), kRoom)) continue;
    bool occupied = !within(q, thick, kRoom - thick);
    for (const auto& [from, to] : boxes) occupied = occupied || within(q, from, to);
    grid.set(grid.voxel(k), occupied ? map::Cell::occupied : map::Cell::free);
  }
  return grid;
}

inline std::vector<Vec3> free_points(const map::OccupancyGrid& grid, std::size_t count) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  const Vec3 extent = grid.resolution() * grid.size().cast<double>();
  std::vector<Vec3> points;
  while (points.size() < count) {
    const double x = unit(random), y = unit(random), z = unit(random);
    const Vec3 p = grid.origin() + extent.cwiseProduct(Vec3(x, y, z));
    if (grid.free(grid.index(p))) points.push_back(p);
  }
  return points;
}

inline std::vector<std::size_t> free_voxels(const map::OccupancyGrid& grid) {
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == map::Cell::free) voxels.push_back(n);
  return voxels;
}

}  // namespace backwash::bench
