// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "core/map/occupancy_grid.hpp"

namespace backwash::scene {

using map::Cell;
using map::OccupancyGrid;

/// Fills the voxels whose centres satisfy a predicate.
template <typename Predicate>
void paint(OccupancyGrid& grid, Cell value, const Predicate& inside) {
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (const Index3 v = grid.voxel(n); inside(grid.center(v))) grid.set(v, value);
}

/// Floor, random blobs, a staircase, a one-voxel wall, scattered voxels and patches of unknown space.
inline OccupancyGrid random_map(unsigned seed, double a) {
  std::mt19937 random(seed);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const Index3 size(18, 16, 14);
  OccupancyGrid grid(Vec3(draw(-3, 3), draw(-3, 3), draw(-3, 3)), a, size, Cell::free);
  const Vec3 extent = a * size.cast<double>();
  const auto point = [&]() -> Vec3 {
    return grid.origin() + Vec3(draw(0, extent.x()), draw(0, extent.y()), draw(0, extent.z()));
  };
  const auto ball = [&](Cell value, double radius) {
    paint(grid, value, [c = point(), radius](const Vec3& x) { return (x - c).norm() < radius; });
  };
  paint(grid, Cell::occupied, [&](const Vec3& x) { return x.z() < grid.origin().z() + a; });
  for (int n = 0; n < 3; ++n) ball(Cell::occupied, draw(1, 3) * a);
  const double yaw = draw(0, 6.28);
  const Vec3 middle = grid.origin() + extent / 2, m(std::cos(yaw), std::sin(yaw), 0);
  paint(grid, Cell::occupied, [&](const Vec3& x) {  // a staircase that climbs along m
    const double along = m.dot(x - middle) - 0.2 * extent.x();
    return along > 0 && x.z() - grid.origin().z() < along + a;
  });
  const int wall_i = static_cast<int>(draw(2, 6));
  for (int j = 3; j < 10; ++j)
    for (int k = 0; k < 8; ++k) grid.set(Index3(wall_i, j, k), Cell::occupied);
  for (int n = 0; n < 40; ++n) grid.set(grid.index(point()).cwiseMin(size - Index3::Ones()), Cell::occupied);
  for (int n = 0; n < 2; ++n) ball(Cell::unknown, draw(1, 3) * a);
  return grid;
}

/// A room of 3.2 × 2.6 × 1.8 m with a table, a shelf and a pillar, by hand.
inline OccupancyGrid small_room(double a = 0.1) {
  OccupancyGrid grid(Vec3(-0.4, 0.3, 0), a, Index3(32, 26, 18), Cell::free);
  const Vec3 low = grid.origin(), high = low + a * grid.size().cast<double>();
  const auto box = [&](const Vec3& from, const Vec3& to) {
    paint(grid, Cell::occupied,
          [&](const Vec3& x) { return ((x - low - from).array() > 0).all() && ((low + to - x).array() > 0).all(); });
  };
  paint(grid, Cell::occupied,
        [&](const Vec3& x) { return ((x - low).array() < a).any() || ((high - x).array() < a).any(); });
  box({0.8, 0.8, 0.6}, {1.6, 1.5, 0.7});  // table top
  box({0.8, 0.8, 0}, {0.9, 0.9, 0.7});
  box({1.5, 1.4, 0}, {1.6, 1.5, 0.7});  // two legs
  box({2.7, 0, 0}, {3.2, 1.2, 1.2});    // shelf
  box({2.0, 2.0, 0}, {2.1, 2.1, 1.8});  // pillar
  return grid;
}

/// A room of 3 × 2.4 m turned by an angle, rad, with a thin wall, a pillar and a table; unknown outside.
inline OccupancyGrid turned_room(double angle, double a, double height = 1.5) {
  const int across = static_cast<int>(4.2 / a);
  OccupancyGrid grid(Vec3(1, -2, 0.3), a, Index3(across, across, static_cast<int>(std::lround(height / a))),
                     Cell::unknown);
  const Vec3 middle = grid.origin() + 0.5 * a * Vec3(across, across, 0);
  const double c = std::cos(angle), s = std::sin(angle), thick = 1.5 * a;
  const auto in_room = [&](const Vec3& x) -> Vec3 {
    const Vec3 d = x - middle;
    return {c * d.x() + s * d.y() + 1.5, c * d.y() - s * d.x() + 1.2, d.z()};
  };
  const auto within = [](const Vec3& q, const Vec3& from, const Vec3& to) {
    return ((q - from).array() >= 0).all() && ((to - q).array() >= 0).all();
  };
  paint(grid, Cell::free, [&](const Vec3& x) { return within(in_room(x), Vec3::Zero(), Vec3(3, 2.4, height)); });
  paint(grid, Cell::occupied, [&](const Vec3& x) {
    const Vec3 q = in_room(x);
    if (!within(q, Vec3::Zero(), Vec3(3, 2.4, height))) return false;
    const bool shell = !within(q, Vec3(thick, thick, a), Vec3(3 - thick, 2.4 - thick, height - a));
    return shell || within(q, Vec3(1, 0, 0), Vec3(1 + a, 1.3, 0.8 * height)) ||
           within(q, Vec3(2, 1.5, 0), Vec3(2.2, 1.7, height)) || within(q, Vec3(1.6, 0.4, 0.5), Vec3(2.4, 0.9, 0.6));
  });
  return grid;
}

/// Numbers of the free voxels, ascending.
inline std::vector<std::size_t> free_voxels(const OccupancyGrid& grid) {
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == Cell::free) voxels.push_back(n);
  return voxels;
}

}  // namespace backwash::scene
