// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight/around.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace backwash::field {
namespace {

constexpr std::size_t kRays = 32;

Vec3 level_direction(std::size_t k) {
  const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kRays;
  return {std::cos(angle), std::sin(angle), 0};
}

/// Distance to the first occupied voxel along a direction.
double ray(const map::OccupancyGrid& grid, const Vec3& from, const Vec3& direction, double range) {
  const double a = grid.resolution();
  Index3 v = grid.index(from), step;
  Vec3 next, per;
  for (int i = 0; i < 3; ++i) {
    step[i] = direction[i] >= 0 ? 1 : -1;
    per[i] = std::abs(direction[i]) > 1e-12 ? a / std::abs(direction[i]) : kNoSurface;
    const double face = grid.origin()[i] + a * (v[i] + (step[i] > 0 ? 1 : 0));
    next[i] = std::isfinite(per[i]) ? (face - from[i]) / direction[i] : kNoSurface;
  }
  double at = 0;
  while (at <= range) {
    if (grid.occupied(v)) return at;
    int axis = 0;
    at = next.minCoeff(&axis);
    v[axis] += step[axis];
    next[axis] += per[axis];
  }
  return kNoSurface;
}

}  // namespace

Around around(const map::OccupancyGrid& grid, const Vec3& p_W, const Sight& sight) {
  static const std::array<Vec3, kRays> kLevel = [] {
    std::array<Vec3, kRays> all;
    for (std::size_t k = 0; k < kRays; ++k) all[k] = level_direction(k);
    return all;
  }();
  Around found;
  if (sight.down > 0) found.height = ray(grid, p_W, -Vec3::UnitZ(), sight.down);
  if (sight.up > 0) found.ceiling_gap = ray(grid, p_W, Vec3::UnitZ(), sight.up);
  if (!(sight.level > 0)) return found;
  std::array<double, kRays> d;
  for (std::size_t k = 0; k < kRays; ++k) d[k] = ray(grid, p_W, kLevel[k], sight.level);
  for (std::size_t k = 0; k < kRays; ++k) {
    const double before = d[(k + kRays - 1) % kRays], after = d[(k + 1) % kRays];
    if (std::isfinite(d[k]) && d[k] < before && d[k] <= after) found.walls.emplace_back(d[k], kLevel[k]);
  }
  return found;
}

}  // namespace backwash::field
