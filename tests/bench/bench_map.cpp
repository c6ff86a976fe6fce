// SPDX-License-Identifier: BSD-3-Clause
// Box queries and hover maps on a real building, each beside the plain way to the same answer in the same run.
// From the repository's root: build/release/tests/bench/bench_map [MAP], default geb079.bt of the data beside the
// clone.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/world/world.hpp"

namespace {

using namespace backwash;
using Boxes = std::vector<std::array<Vec3, 2>>;

std::string map_file = BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt";

const plan::World& world(reach::Method method) {
  static std::map<reach::Method, std::shared_ptr<const plan::World>> built;
  auto& w = built[method];
  if (!w) {
    w = plan::build_world(map::load_map(map_file).value(), config::load_model("builtin:quad-5in").value(),
                          config::load_vehicle("builtin:quad-5in").value(), method);
  }
  return *w;
}

/// Boxes of up to 0.6 m around hover-safe places: each alone, or along ways of 64 steps of half a voxel.
Boxes boxes(std::size_t steps) {
  const plan::World& w = world(reach::Method::tight);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> u(0, 1);
  Boxes found;
  while (found.size() < 1 << 16) {
    const Index3 v = w.grid.voxel(random() % w.grid.cell_count());
    if (!w.hover.safe(v)) continue;
    const Vec3 half = 0.3 * Vec3(u(random), u(random), u(random));
    const Vec3 step = w.grid.resolution() / 2 * Vec3(u(random) - 0.5, u(random) - 0.5, 0).normalized();
    Vec3 p = w.grid.center(v);
    for (std::size_t n = 0; n < steps; ++n, p += step) found.push_back({p - half, p + half});
  }
  return found;
}

/// Every voxel that meets the box, until one is not free.
bool scan(const map::OccupancyGrid& grid, const Vec3& low_W, const Vec3& high_W) {
  const double a = grid.resolution();
  const Index3 low = ((low_W - grid.origin()) / a).array().ceil().cast<int>() - 1;
  const Index3 high = ((high_W - grid.origin()) / a).array().floor().cast<int>();
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i)
        if (!grid.free({i, j, k})) return false;
  return true;
}

template <class Query>
void run_queries(benchmark::State& state, std::size_t steps, const Query& query) {
  const Boxes all = boxes(steps);
  std::size_t free = 0;
  for (auto _ : state)
    for (const auto& [low, high] : all) free += query(low, high);
  benchmark::DoNotOptimize(free);
  state.counters["units"] = static_cast<double>(all.size());
}
void box_scan(benchmark::State& state, std::size_t steps) {
  const auto& grid = world(reach::Method::tight).grid;
  run_queries(state, steps, [&](const Vec3& low, const Vec3& high) { return scan(grid, low, high); });
}
void box_sums(benchmark::State& state, std::size_t steps) {
  const auto& sums = world(reach::Method::tight).sums;
  run_queries(state, steps, [&](const Vec3& low, const Vec3& high) { return sums.box_free(low, high); });
}
void sums_build(benchmark::State& state) {
  const auto& grid = world(reach::Method::tight).grid;
  for (auto _ : state) benchmark::DoNotOptimize(map::OccupancySums(grid));
  state.counters["units"] = static_cast<double>(grid.cell_count());
}
void sums_update_middle(benchmark::State& state) {
  const auto& grid = world(reach::Method::tight).grid;
  map::OccupancySums sums(grid);
  for (auto _ : state) sums.update(grid, grid.size() / 2, grid.size() / 2);
  state.counters["units"] = static_cast<double>(grid.cell_count());
}

/// Voxels that build_world hands over: free, and the body may be in them.
std::vector<std::size_t> listed(const plan::World& w) {
  const double least = w.reach.vehicle.body.radius - w.grid.resolution() * std::sqrt(3.0) / 2;
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < w.grid.cell_count(); ++n)
    if (w.grid.at(n) == map::Cell::free && w.distance.at(w.grid.voxel(n)) >= least) voxels.push_back(n);
  return voxels;
}
void hover_exact(benchmark::State& state, reach::Method method) {
  const plan::World& w = world(method);
  const auto voxels = listed(w);
  std::size_t safe = 0;
  for (auto _ : state)
    for (const std::size_t n : voxels)
      safe += reach::hover_set(w.reach, w.grid, w.distance, w.bounds, w.grid.center(w.grid.voxel(n))).safe();
  benchmark::DoNotOptimize(safe);
  state.counters["units"] = static_cast<double>(voxels.size());
}
void hover_map(benchmark::State& state, reach::Method method) {
  const plan::World& w = world(method);
  const auto voxels = listed(w);
  for (auto _ : state) {
    const map::OccupancySums sums(w.grid);
    reach::HoverMap hover(w.grid);
    hover.fill(w.reach, w.grid, w.distance, sums, w.bounds, voxels);
    benchmark::DoNotOptimize(hover.safe({0, 0, 0}));
  }
  state.counters["units"] = static_cast<double>(voxels.size());
}

// "A/B": the table divides the cost of A/baseline by that of A/B.
BENCHMARK_CAPTURE(box_scan, way, 64)->Name("box_along_a_way/baseline");
BENCHMARK_CAPTURE(box_sums, way, 64)->Name("box_along_a_way/sums");
BENCHMARK_CAPTURE(box_scan, anywhere, 1)->Name("box_anywhere/baseline");
BENCHMARK_CAPTURE(box_sums, anywhere, 1)->Name("box_anywhere/sums");
BENCHMARK(sums_build)->Name("sums/baseline");
BENCHMARK(sums_update_middle)->Name("sums/update_at_the_middle");
BENCHMARK_CAPTURE(hover_exact, tight, reach::Method::tight)->Name("hover_tight/baseline");
BENCHMARK_CAPTURE(hover_map, tight, reach::Method::tight)->Name("hover_tight/map");
BENCHMARK_CAPTURE(hover_exact, paper, reach::Method::paper)->Name("hover_paper/baseline");
BENCHMARK_CAPTURE(hover_map, paper, reach::Method::paper)->Name("hover_paper/map");

class Ratios : public benchmark::ConsoleReporter {
 public:
  Ratios() : ConsoleReporter(OO_None) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs)
      rows_.push_back({run.benchmark_name(), run.cpu_accumulated_time / static_cast<double>(run.iterations),
                       run.counters.at("units")});
  }
  void Finalize() override {
    ConsoleReporter::Finalize();
    std::printf("\n%-32s %12s %12s %14s   thread CPU time\n", "", "ms", "ns each", "baseline/this");
    double baseline = 0;
    for (const Row& row : rows_) {
      if (row.name.ends_with("/baseline")) baseline = row.seconds;
      std::printf("%-32s %12.3f %12.2f %14.1f\n", row.name.c_str(), 1e3 * row.seconds, 1e9 * row.seconds / row.units,
                  baseline / row.seconds);
    }
  }

 private:
  struct Row {
    std::string name;
    double seconds, units;
  };
  std::vector<Row> rows_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc > 1) map_file = argv[1];
  Ratios reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return 0;
}
