// SPDX-License-Identifier: BSD-3-Clause
// The exact separable transform beside dynamicEDT3D's full and incremental update, in a furnished room of
// 10 × 10 × 3 m with edges of 0.1 and 0.05 m. Counter `library_ratio`: dynamicEDT3D's CPU time over ours in this run.
// Our update is held against a field made anew, voxel by voxel, before it counts.
#include <benchmark/benchmark.h>
#include <dynamicEDT3D/dynamicEDT3D.h>

#include <ctime>

#include "core/map/distance_field.hpp"
#include "tests/bench/furnished_room.hpp"

namespace {

using backwash::Index3;
using backwash::map::DistanceField;
using backwash::map::OccupancyGrid;

/// The library's map: [x][y][z] of bool, unbounded distances.
struct Library {
  explicit Library(const OccupancyGrid& grid) {
    const Index3 size = grid.size();
    bool*** cells = new bool**[static_cast<std::size_t>(size.x())];  // the library deletes them
    for (int x = 0; x < size.x(); ++x) {
      cells[x] = new bool*[static_cast<std::size_t>(size.y())];
      for (int y = 0; y < size.y(); ++y) {
        cells[x][y] = new bool[static_cast<std::size_t>(size.z())];
        for (int z = 0; z < size.z(); ++z) cells[x][y][z] = !grid.free(Index3(x, y, z));
      }
    }
    map.initializeMap(size.x(), size.y(), size.z(), cells);
  }
  DynamicEDT3D map{1'000'000};
};

double seconds_since(std::clock_t begun) { return static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC; }

void full(benchmark::State& state) {
  const OccupancyGrid grid = backwash::bench::furnished_room(1e-3 * static_cast<double>(state.range(0)));
  Library library(grid);
  const auto library_begun = std::clock();
  library.map.update();
  const double library_s = seconds_since(library_begun);
  const auto begun = std::clock();
  for (auto _ : state) benchmark::DoNotOptimize(DistanceField(grid));
  state.counters["library_ms"] = 1e3 * library_s;
  state.counters["library_ratio"] = library_s * static_cast<double>(state.iterations()) / seconds_since(begun);
}
BENCHMARK(full)->Arg(100)->Arg(50)->Unit(benchmark::kMillisecond);

/// A box of 1 m³ comes and goes: dynamicEDT3D's incremental update against ours. `whole_ratio`: our whole transform
/// over our update.
void change_of_one_cubic_metre(benchmark::State& state) {
  const double a = 1e-3 * static_cast<double>(state.range(0));
  OccupancyGrid grid = backwash::bench::furnished_room(a);
  Library library(grid);
  library.map.update();
  std::vector<Index3> box;
  for (const std::size_t n : backwash::bench::free_voxels(grid)) {
    const backwash::Vec3 in = grid.center(grid.voxel(n)) - backwash::Vec3(4.5, 4.5, 0.5);
    if ((in.array() > 0).all() && (in.array() < 1).all()) box.push_back(grid.voxel(n));
  }
  const auto library_begun = std::clock();
  for (const Index3& v : box) library.map.occupyCell(v.x(), v.y(), v.z());
  library.map.update();
  for (const Index3& v : box) library.map.clearCell(v.x(), v.y(), v.z());
  library.map.update();
  const double library_s = 0.5 * seconds_since(library_begun);
  backwash::map::VoxelBox changed;
  for (const Index3& v : box) changed.add(v);
  const auto set = [&](backwash::map::Cell cell) {
    for (const Index3& v : box) grid.set(v, cell);
  };
  DistanceField field(grid);
  double updates_s = 0, whole_s = 0;
  std::size_t updates = 0;
  for (auto _ : state)
    for (const auto cell : {backwash::map::Cell::occupied, backwash::map::Cell::free}) {
      set(cell);
      const auto begun = std::clock();
      field.update(grid, changed);
      updates_s += seconds_since(begun);
      ++updates;
      const auto anew_begun = std::clock();
      const DistanceField anew(grid);
      whole_s += seconds_since(anew_begun);
      for (std::size_t n = 0; n < grid.cell_count(); ++n)
        if (field.at(grid.voxel(n)) != anew.at(grid.voxel(n)))
          return state.SkipWithError("the update differs from a field made anew");
    }
  state.counters["library_ms"] = 1e3 * library_s;
  state.counters["update_ms"] = 1e3 * updates_s / static_cast<double>(updates);
  state.counters["library_ratio"] = library_s * static_cast<double>(updates) / updates_s;
  state.counters["whole_ratio"] = whole_s / updates_s;
}
BENCHMARK(change_of_one_cubic_metre)->Arg(100)->Arg(50)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
