// SPDX-License-Identifier: BSD-3-Clause
// Exact query time of the disturbance field beside the naive scan, in a furnished room of 10 × 10 × 3 m at 0.1 m.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>

#include "core/field/disturbance_field.hpp"

namespace {

using backwash::Index3;
using backwash::Vec3;
using backwash::map::Cell;
using backwash::map::OccupancyGrid;
namespace field = backwash::field;

/// Closed room with 25 random boxes standing on the floor.
OccupancyGrid furnished_room() {
  OccupancyGrid grid(Vec3(0, 0, 0), 0.1, Index3(100, 100, 30), Cell::free);
  const auto box = [&](const Index3& from, const Index3& to) {
    for (int k = std::max(0, from.z()); k < std::min(30, to.z()); ++k)
      for (int j = std::max(0, from.y()); j < std::min(100, to.y()); ++j)
        for (int i = std::max(0, from.x()); i < std::min(100, to.x()); ++i) grid.set(Index3(i, j, k), Cell::occupied);
  };
  box({0, 0, 0}, {100, 100, 1}), box({0, 0, 29}, {100, 100, 30});
  box({0, 0, 0}, {1, 100, 30}), box({99, 0, 0}, {100, 100, 30});
  box({0, 0, 0}, {100, 1, 30}), box({0, 99, 0}, {100, 100, 30});
  std::mt19937 random(1);
  const auto draw = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  for (int n = 0; n < 25; ++n) {
    const Index3 from(draw(0, 95), draw(0, 95), 0);
    box(from, from + Index3(draw(3, 12), draw(3, 12), draw(4, 20)));
  }
  return grid;
}

std::vector<Vec3> free_points(const OccupancyGrid& grid) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vec3> points;
  while (points.size() < 256) {
    const Vec3 p(10 * unit(random), 10 * unit(random), 3 * unit(random));
    if (grid.free(grid.index(p))) points.push_back(p);
  }
  return points;
}

void exact_query(benchmark::State& state) {
  const OccupancyGrid grid = furnished_room();
  const field::ProximityField exact(grid, {});
  const auto points = free_points(grid);
  std::size_t n = 0;
  for (auto _ : state) benchmark::DoNotOptimize(exact.at(points[n++ % points.size()]));
}
BENCHMARK(exact_query)->Unit(benchmark::kMicrosecond);

/// What the query replaces: every voxel of the box in range, its elements known, one line of sight through the grid for
/// each element with a term.
void naive_box_scan(benchmark::State& state) {
  const OccupancyGrid grid = furnished_room();
  const backwash::Model model;
  const field::ProximityModel terms(model, grid.resolution());
  std::vector<std::vector<field::Element>> of_voxel(grid.cell_count());
  for (const field::Element& e : field::surface_elements(grid)) {
    const Vec3 inside = e.c_W - 0.5 * grid.resolution() * e.normal;
    of_voxel[grid.linear(grid.index(inside))].push_back(e);
  }
  const auto points = free_points(grid);
  const double wide = std::max(model.ground.l_max, model.wall.l_max);
  const Vec3 below(wide, wide, std::max(wide, model.ground.l_footprint_max)), above(wide, wide, model.wall.l_max);
  std::size_t n = 0;
  for (auto _ : state) {
    const Vec3& p = points[n++ % points.size()];
    const Index3 low = grid.index(p - below).cwiseMax(0);
    const Index3 high = grid.index(p + above).cwiseMin(grid.size() - Index3::Ones());
    backwash::Variance sum;
    for (int k = low.z(); k <= high.z(); ++k)
      for (int j = low.y(); j <= high.y(); ++j)
        for (int i = low.x(); i <= high.x(); ++i)
          for (const field::Element& e : of_voxel[grid.linear(Index3(i, j, k))]) {
            if (e.normal.dot(p - e.c_W) <= 0) continue;
            const backwash::Variance term = terms.ground(e, p) + terms.corner(e, p) + terms.wall(e, p);
            if (term.zz > 0 && field::line_of_sight(grid, p, e.c_W)) sum += term;
          }
    benchmark::DoNotOptimize(sum);
  }
}
BENCHMARK(naive_box_scan)->Unit(benchmark::kMicrosecond);

void build(benchmark::State& state) {
  const OccupancyGrid grid = furnished_room();
  for (auto _ : state) benchmark::DoNotOptimize(field::ProximityField(grid, {}));
}
BENCHMARK(build)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
