// SPDX-License-Identifier: BSD-3-Clause
// A change of 1 m³: from the changed grid to a whole new snapshot (grid, distance, bounds, hover map), by region beside
// the rebuild, on one thread and on the daemon's. In a furnished room of 10 × 10 × 3 m, in the building geb079, whose
// walls stand at any angle, and on an office floor of 100 × 60 × 5 m, all at 0.1 m or the building's own 0.05 m.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"
#include "services/parallel/parallel.hpp"

namespace {

using namespace backwash;

map::OccupancyGrid furnished_room() {
  map::OccupancyGrid grid(Vec3(0, 0, 0), 0.1, Index3(100, 100, 30), map::Cell::free);
  const auto box = [&](const Index3& from, const Index3& to) {
    for (int k = std::max(0, from.z()); k < std::min(30, to.z()); ++k)
      for (int j = std::max(0, from.y()); j < std::min(100, to.y()); ++j)
        for (int i = std::max(0, from.x()); i < std::min(100, to.x()); ++i) grid.set({i, j, k}, map::Cell::occupied);
  };
  box({0, 0, 0}, {100, 100, 1});
  box({0, 0, 29}, {100, 100, 30});
  box({0, 0, 0}, {1, 100, 30});
  box({99, 0, 0}, {100, 100, 30});
  box({0, 0, 0}, {100, 1, 30});
  box({0, 99, 0}, {100, 100, 30});
  std::mt19937 random(1);
  const auto draw = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  for (int n = 0; n < 25; ++n) {
    const Index3 from(draw(0, 95), draw(0, 95), 0);
    box(from, from + Index3(draw(3, 12), draw(3, 12), draw(4, 20)));
  }
  return grid;
}

struct Change {
  map::OccupancyGrid grid;
  map::VoxelBox box;
};

/// A hollow crate of 1 m³ appears around the given place: what a scan sees of one.
Change with_crate(map::OccupancyGrid grid, const Index3& low) {
  Change change{std::move(grid), {}};
  for (int k = 0; k < 10; ++k)
    for (int j = 0; j < 10; ++j)
      for (int i = 0; i < 10; ++i) {
        const bool shell = std::min({i, j, k}) == 0 || std::max({i, j, k}) == 9;
        const Index3 v = low + Index3(i, j, k);
        change.grid.set(v, shell ? map::Cell::occupied : map::Cell::unknown);
        change.box.add(v);
      }
  return change;
}

/// Rooms of 6 × 6 m in two rows on both sides of corridors of 2.4 m, 2.9 m high, with doors of 0.9 m, a table each and
/// an attic that nobody sees: 30 million voxels.
map::OccupancyGrid office() {
  map::OccupancyGrid grid(Vec3(0, 0, 0), 0.1, Index3(1000, 600, 50), map::Cell::free);
  const auto box = [&](const Index3& from, const Index3& to, map::Cell cell = map::Cell::occupied) {
    for (int k = std::max(0, from.z()); k < std::min(50, to.z()); ++k)
      for (int j = std::max(0, from.y()); j < std::min(600, to.y()); ++j)
        for (int i = std::max(0, from.x()); i < std::min(1000, to.x()); ++i) grid.set({i, j, k}, cell);
  };
  for (int x = 0; x < 1000; x += 62) box({x, 0, 0}, {x + 2, 600, 50});
  for (int y = 0; y < 600; y += 86) {  // a room, a wall, a corridor, a wall
    box({0, y, 0}, {1000, y + 2, 50});
    box({0, y + 60, 0}, {1000, y + 62, 50});
    box({0, y + 62, 1}, {1000, y + 86, 49}, map::Cell::free);
    for (int x = 0; x < 1000; x += 62) {
      box({x + 25, y + 60, 1}, {x + 34, y + 62, 21}, map::Cell::free);  // doors to the corridor on both sides
      box({x + 40, y, 1}, {x + 49, y + 2, 21}, map::Cell::free);
      box({x + 12, y + 20, 1}, {x + 20, y + 36, 8});  // a table
    }
  }
  box({0, 0, 0}, {1000, 600, 1});
  box({0, 0, 49}, {1000, 600, 50});
  box({0, 0, 0}, {1, 600, 50});
  box({999, 0, 0}, {1000, 600, 50});
  box({0, 0, 0}, {1000, 1, 50});
  box({0, 599, 0}, {1000, 600, 50});
  return grid;
}

enum Place { room, building, floor_of_offices };
map::OccupancyGrid map_of(std::int64_t place) {
  if (place == room) return furnished_room();
  if (place == floor_of_offices) return office();
  return map::load_map(BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt").value();
}

const Vehicle kVehicle = config::load_vehicle("builtin:quad-5in").value();
const Model kModel = config::load_model("builtin:quad-5in").value();
Parallel threads(const benchmark::State& state) {
  return state.range(0) == 1 ? Parallel(run_serial) : Parallel(run_parallel);
}

/// A crate near the middle of the map, where a vehicle can be.
Change change_of(const plan::World& world) {
  Index3 low = world.grid.size() / 2;
  std::mt19937 random(1);
  while (!world.hover.safe(low))
    low = world.grid.size() / 2 + Index3(random() % 81 - 40, random() % 81 - 40, random() % 11 - 5);
  return with_crate(world.grid, low);
}

void rebuild(benchmark::State& state) {
  const map::OccupancyGrid grid = map_of(state.range(1));
  for (auto _ : state)
    benchmark::DoNotOptimize(
        plan::build_world(grid, kModel, kVehicle, reach::Method::tight, std::nullopt, threads(state)));
}
BENCHMARK(rebuild)
    ->ArgNames({"threads", "map"})
    ->ArgsProduct({{1, 2}, {room, building, floor_of_offices}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void by_region(benchmark::State& state) {
  const auto old =
      plan::build_world(map_of(state.range(1)), kModel, kVehicle, reach::Method::tight, std::nullopt, run_parallel);
  const Change change = change_of(*old);
  for (auto _ : state)
    benchmark::DoNotOptimize(plan::rebuilt(*old, {.grid = change.grid, .voxels = change.box}, threads(state)));
}
BENCHMARK(by_region)
    ->ArgNames({"threads", "map"})
    ->ArgsProduct({{1, 2}, {room, building, floor_of_offices}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
