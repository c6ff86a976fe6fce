// SPDX-License-Identifier: BSD-3-Clause
// The disturbance field in a furnished room of 10 × 10 × 3 m with the default model, edges of 0.2, 0.1 and 0.05 m.
// `naive_us` and `naive_ratio`: a query by scanning the whole box in range, timed in the same run, and how many times
// longer it takes per point. `query_ratio`: the same for ProximityField::at, per voxel of the whole field.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <numbers>
#include <string>

#include "core/field/disturbance_field.hpp"
#include "core/field/field_update.hpp"
#include "core/map/distance_field.hpp"
#include "core/map/load_map.hpp"
#include "services/parallel/parallel.hpp"
#include "tests/bench/furnished_room.hpp"
#include "tests/bench/naive_box_scan.hpp"
#include "tests/support/changed_box.hpp"

namespace {

using backwash::Index3;
using backwash::Vec3;
using backwash::map::Cell;
using backwash::map::OccupancyGrid;
namespace field = backwash::field;
namespace bench = backwash::bench;
namespace test = backwash::test;

double edge_of(const benchmark::State& state) { return 1e-3 * static_cast<double>(state.range(0)); }

/// CPU time of one call of query(p) in the mean over the points, µs; every tenth of a second a look at the clock.
template <typename Query>
double microseconds(const std::vector<Vec3>& points, const Query& query) {
  const auto begun = std::clock();
  std::size_t count = 0;
  double seconds = 0;
  while (seconds < 0.3) {
    for (const Vec3& p : points) benchmark::DoNotOptimize(query(p));
    count += points.size();
    seconds = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
  }
  return 1e6 * seconds / static_cast<double>(count);
}

double naive_microseconds(const OccupancyGrid& grid) {
  const bench::NaiveBoxScan naive(grid);
  return microseconds(bench::free_points(grid, 64), [&](const Vec3& p) { return naive.at(p); });
}

void add_naive_ratio(benchmark::State& state, double naive_us, std::clock_t begun, double points_per_iteration) {
  const double us = 1e6 * static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
  state.counters["naive_us"] = naive_us;
  state.counters["naive_ratio"] = naive_us * points_per_iteration * static_cast<double>(state.iterations()) / us;
}

void exact_query(benchmark::State& state) {
  const OccupancyGrid grid = bench::furnished_room(edge_of(state));
  const double naive_us = naive_microseconds(grid);
  const field::ProximityField exact(grid, {});
  const auto points = bench::free_points(grid, 256);
  std::size_t n = 0;
  const auto begun = std::clock();
  for (auto _ : state) benchmark::DoNotOptimize(exact.at(points[n++ % points.size()]));
  add_naive_ratio(state, naive_us, begun, 1);
}
BENCHMARK(exact_query)->Arg(200)->Arg(100)->Arg(50)->Unit(benchmark::kMicrosecond);

void stored_lookup(benchmark::State& state) {
  const OccupancyGrid grid = bench::furnished_room(edge_of(state));
  const double naive_us = naive_microseconds(grid);
  const auto voxels = bench::free_voxels(grid);
  const field::WholeField whole(grid, {}, voxels);
  field::DisturbanceField stored(grid, voxels);
  stored.fill(whole, 0, whole.block_count());
  const auto points = bench::free_points(grid, 4096);
  std::size_t n = 0;
  const auto begun = std::clock();
  for (auto _ : state) benchmark::DoNotOptimize(stored.interpolated(points[n++ % points.size()], {}));
  add_naive_ratio(state, naive_us, begun, 1);
}
BENCHMARK(stored_lookup)->Arg(100)->Unit(benchmark::kNanosecond);

void prepare(benchmark::State& state) {
  const OccupancyGrid grid = bench::furnished_room(edge_of(state));
  for (auto _ : state) benchmark::DoNotOptimize(field::ProximityField(grid, {}));
}
BENCHMARK(prepare)->Arg(100)->Unit(benchmark::kMillisecond);

/// The whole field, preparation included, on one thread or on run_parallel's.
void whole_field_of(benchmark::State& state, const OccupancyGrid& grid, bool parallel) {
  const double naive_us = naive_microseconds(grid);
  const field::ProximityField exact(grid, {});
  const double query_us = microseconds(bench::free_points(grid, 256), [&](const Vec3& p) { return exact.at(p); });
  const auto voxels = bench::free_voxels(grid);
  const auto begun = std::clock();
  for (auto _ : state) {
    field::DisturbanceField stored(grid, voxels);
    const field::WholeField whole(grid, {}, voxels);
    const auto fill = [&](std::size_t begin, std::size_t end) { stored.fill(whole, begin, end); };
    parallel ? backwash::run_parallel(whole.block_count(), fill) : fill(0, whole.block_count());
    benchmark::DoNotOptimize(stored.has(Index3::Zero()));
  }
  add_naive_ratio(state, naive_us, begun, static_cast<double>(voxels.size()));
  state.counters["query_ratio"] = state.counters["naive_ratio"] * query_us / naive_us;
  state.counters["voxels"] = static_cast<double>(voxels.size());
}

/// Argument 2: 1 for one thread, 2 for run_parallel's.
void whole_field(benchmark::State& state) {
  whole_field_of(state, bench::furnished_room(edge_of(state)), state.range(1) > 1);
}
BENCHMARK(whole_field)
    ->Args({200, 1})
    ->Args({100, 1})
    ->Args({100, 2})
    ->Args({50, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

void whole_field_plain(benchmark::State& state) { whole_field_of(state, bench::plain_room(edge_of(state)), false); }
BENCHMARK(whole_field_plain)->Arg(100)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

/// The furnished room turned by the argument, degrees. `of_straight`: CPU time per voxel over that of the room as it
/// stands, timed in the same run.
void whole_field_turned(benchmark::State& state) {
  const auto evaluate = [](const OccupancyGrid& grid) {
    const auto voxels = bench::free_voxels(grid);
    const auto begun = std::clock();
    field::DisturbanceField stored(grid, voxels);
    const field::WholeField whole(grid, {}, voxels);
    stored.fill(whole, 0, whole.block_count());
    benchmark::DoNotOptimize(stored.has(Index3::Zero()));
    return static_cast<double>(std::clock() - begun) / static_cast<double>(voxels.size());
  };
  const OccupancyGrid straight = bench::furnished_room(0.1);
  const OccupancyGrid turned = bench::turned_room(0.1, static_cast<double>(state.range(0)) * std::numbers::pi / 180);
  double of_straight = 1e9, of_turned = 1e9;  // the least of all: other load only adds
  for (auto _ : state) {
    of_straight = std::min(of_straight, evaluate(straight));
    of_turned = std::min(of_turned, evaluate(turned));
  }
  state.counters["of_straight"] = of_turned / of_straight;
}
BENCHMARK(whole_field_turned)->Arg(0)->Arg(7)->Arg(23)->Arg(45)->Iterations(7)->Unit(benchmark::kMillisecond);

/// `field --slice z=1` of a forest: both layers of centres around the plane, preparation included. `exact_ratio`: how
/// many times longer the same voxels take asked one by one (every 64th is asked), in this run.
void slice(benchmark::State& state) {
  const OccupancyGrid grid = *backwash::map::load_map("builtin:forest-0");
  const int upper = grid.index(Vec3(0, 0, 1 + 0.5 * grid.resolution())).z();
  auto voxels = bench::free_voxels(grid);
  std::erase_if(voxels, [&](std::size_t n) { return std::abs(2 * grid.voxel(n).z() - 2 * upper + 1) > 1; });
  std::vector<Vec3> some;
  for (std::size_t n = 0; n < voxels.size(); n += 64) some.push_back(grid.center(grid.voxel(voxels[n])));
  const field::ProximityField exact(grid, {});
  const double query_us = microseconds(some, [&](const Vec3& p) { return exact.at(p); });
  const auto begun = std::clock();
  for (auto _ : state) {
    field::DisturbanceField stored(grid, voxels);
    const field::WholeField whole(grid, {}, voxels);
    stored.fill(whole, 0, whole.block_count());
    benchmark::DoNotOptimize(stored.has(Index3::Zero()));
  }
  const double clocks = static_cast<double>(std::clock() - begun) / static_cast<double>(state.iterations());
  state.counters["exact_ratio"] = 1e-6 * query_us * static_cast<double>(voxels.size()) * CLOCKS_PER_SEC / clocks;
}
BENCHMARK(slice)->Unit(benchmark::kMillisecond);

const std::string kBuilding = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";

void whole_field_building(benchmark::State& state) {
  const auto grid = backwash::map::load_map(kBuilding);
  if (!grid) return state.SkipWithError("geb079.bt is absent");
  whole_field_of(state, *grid, false);
}
BENCHMARK(whole_field_building)->Iterations(1)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

/// What two threads can give, from CPU time alone, so that other load does not enter: every block evaluated by itself,
/// as run_parallel does, and dealt in order to whichever of two threads is free. `factor`: the whole field on one
/// thread over preparation and the longer share. `work`: CPU time of the blocks one by one over that of all at once.
/// `longest`: the longest block's share of it.
void two_threads(benchmark::State& state) {
  const OccupancyGrid grid = bench::furnished_room(edge_of(state));
  const auto voxels = bench::free_voxels(grid);
  const auto clock = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  double prepared = 0, at_once = 0, one_by_one = 0, longer = 0, longest = 0;
  for (auto _ : state) {
    field::DisturbanceField stored(grid, voxels);
    const double begun = clock();
    const field::WholeField whole(grid, {}, voxels);
    const double filling = clock();
    prepared += filling - begun;
    stored.fill(whole, 0, whole.block_count());
    at_once += clock() - filling;
    std::array<double, 2> busy{};
    double most = 0;
    for (std::size_t n = 0; n < whole.block_count(); ++n) {
      const double start = clock();
      stored.fill(whole, n, n + 1);
      const double took = clock() - start;
      *std::ranges::min_element(busy) += took;
      most = std::max(most, took);
    }
    one_by_one += busy[0] + busy[1];
    longer += std::max(busy[0], busy[1]);
    longest += most;
  }
  state.counters["factor"] = (prepared + at_once) / (prepared + longer);
  state.counters["work"] = one_by_one / at_once;
  state.counters["longest"] = longest / one_by_one;
}
BENCHMARK(two_threads)->Arg(100)->Unit(benchmark::kMillisecond);

/// The interpolated field beside the exact one at random free points of geb079, distance to obstacles (of the voxel's
/// centre) at least the argument, mm. `largest`: largest deviation of an entry over the largest entry, at x, y, z, m.
void interpolation(benchmark::State& state) {
  const auto grid = backwash::map::load_map(kBuilding);
  if (!grid) return state.SkipWithError("geb079.bt is absent");
  const backwash::map::DistanceField distance(*grid);
  const field::ProximityField exact(*grid, {});
  field::DisturbanceField stored(*grid, bench::free_voxels(*grid));
  std::vector<double> deviations;
  double largest = -1;
  Vec3 where = Vec3::Zero();
  for (auto _ : state)
    for (const Vec3& p : bench::free_points(*grid, 20000)) {
      if (distance.at(grid->index(p)) < edge_of(state)) continue;
      std::vector<std::size_t> around;
      const Index3 low = grid->index(p - Vec3::Constant(0.5 * grid->resolution()));
      for (int n = 0; n < 8; ++n)
        if (const Index3 v = low + Index3(n & 1, n >> 1 & 1, n >> 2); grid->free(v)) around.push_back(grid->linear(v));
      stored.fill(exact, around);
      const auto s = stored.interpolated(p, {}), t = exact.at(p).sigma();
      const double scale = std::max({t.xx, t.yy, t.zz});
      const double off =
          std::max({std::abs(s.xx - t.xx), std::abs(s.xy - t.xy), std::abs(s.yy - t.yy), std::abs(s.zz - t.zz)});
      if (off / scale > largest) {
        largest = off / scale;
        where = p;
      }
      deviations.push_back(off / scale);
    }
  std::ranges::sort(deviations);
  state.counters["points"] = static_cast<double>(deviations.size());
  state.counters["median"] = deviations[deviations.size() / 2];
  state.counters["p99"] = deviations[deviations.size() * 99 / 100];
  state.counters["largest"] = largest;
  state.counters["x"] = where.x();
  state.counters["y"] = where.y();
  state.counters["z"] = where.z();
}
BENCHMARK(interpolation)->Arg(0)->Arg(180)->Iterations(1)->Unit(benchmark::kMillisecond);

/// A box of 1 m³ appears in the middle of the room: finding it, preparing and evaluating what it affects.
/// `of_rebuild`: CPU time over that of the whole field made anew.
void region_update(benchmark::State& state) {
  const OccupancyGrid before = bench::furnished_room(edge_of(state));
  OccupancyGrid after = before;
  for (std::size_t n = 0; n < after.cell_count(); ++n) {
    const Vec3 in = after.center(after.voxel(n)) - Vec3(4.5, 4.5, 0.5);
    if ((in.array() > 0).all() && (in.array() < 1).all()) after.set(after.voxel(n), Cell::occupied);
  }
  const auto fill = [&](field::DisturbanceField& stored, const OccupancyGrid& grid, std::span<const std::size_t> part) {
    const field::WholeField whole(grid, {}, part);
    stored.fill(whole, 0, whole.block_count());
  };
  field::DisturbanceField stored(before, bench::free_voxels(before));
  const auto rebuild = std::clock();
  fill(stored, before, bench::free_voxels(before));
  const auto rebuild_clocks = static_cast<double>(std::clock() - rebuild);
  const auto begun = std::clock();
  for (auto _ : state) {
    const auto columns = field::affected_columns(after, {}, test::changed_box(before, after));
    auto voxels = bench::free_voxels(after);
    std::erase_if(voxels, [&](std::size_t n) { return !columns.contains(after.voxel(n)); });
    field::DisturbanceField updated(after, voxels);
    fill(updated, after, voxels);
  }
  state.counters["of_rebuild"] =
      static_cast<double>(std::clock() - begun) / static_cast<double>(state.iterations()) / rebuild_clocks;
}
BENCHMARK(region_update)->Arg(200)->Arg(100)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
