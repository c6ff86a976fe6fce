// SPDX-License-Identifier: BSD-3-Clause
// A change of 1 m³ in a furnished room of 10 × 10 × 3 m at 0.1 m: from the changed grid to a whole new snapshot (grid,
// distance, field, bounds, hover map), by region beside the rebuild, on one thread and on the daemon's.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>

#include "core/config/config.hpp"
#include "core/plan/world.hpp"
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

const Vehicle kVehicle = config::load_vehicle("builtin:quad-5in").value();
const Model kModel = config::load_model("builtin:quad-5in").value();
plan::Parallel threads(const benchmark::State& state) {
  return state.range(0) == 1 ? plan::Parallel(plan::run_serial) : plan::Parallel(run_parallel);
}

void rebuild(benchmark::State& state) {
  const Change change = with_crate(furnished_room(), {45, 45, 1});
  for (auto _ : state)
    benchmark::DoNotOptimize(
        plan::build_world(change.grid, kModel, kVehicle, reach::Method::tight, std::nullopt, threads(state)));
}
BENCHMARK(rebuild)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void by_region(benchmark::State& state) {
  const auto old =
      plan::build_world(furnished_room(), kModel, kVehicle, reach::Method::tight, std::nullopt, run_parallel);
  const Change change = with_crate(old->grid, {45, 45, 1});
  for (auto _ : state)
    benchmark::DoNotOptimize(plan::update_world(*old, change.grid, change.box, kModel, threads(state)));
}
BENCHMARK(by_region)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
