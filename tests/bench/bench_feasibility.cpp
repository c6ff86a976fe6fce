// SPDX-License-Identifier: BSD-3-Clause
// What Σ over the set costs in a map, quad-5in and its model, one thread. `looked_for_ratio`: CPU time of looking for
// both clearances of every voxel (tests/support/cost_of_set.hpp, the baseline) over that of plan::cost_of_set, in this
// run; `same`: whether both say the same within 1e-12 m.
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>
#include <string>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "services/parallel/parallel.hpp"
#include "tests/support/cost_of_set.hpp"

namespace {

using namespace backwash;

void cost_of_set(benchmark::State& state, const std::string& map) {
  const auto grid = map::load_map(map);
  if (!grid) return state.SkipWithError("the map is absent");
  const auto world =
      plan::build_world(*grid, *config::load_model("builtin:quad-5in"), *config::load_vehicle("builtin:quad-5in"),
                        reach::Method::tight, std::nullopt, run_parallel);
  std::clock_t looked_for = 0, bounded = 0;
  bool same = true;
  for (auto _ : state) {
    const auto begun = std::clock();
    const auto all = test::cost_of_set(*world);
    const auto between = std::clock();
    const auto found = plan::cost_of_set(*world);
    bounded += std::clock() - between;
    looked_for += between - begun;
    same = same && all.safe_at_centre == found.safe_at_centre && all.lost == found.lost &&
           std::abs(all.median_m - found.median_m) < 1e-12 && std::abs(all.quantile95_m - found.quantile95_m) < 1e-12;
  }
  state.counters["looked_for_ratio"] = static_cast<double>(looked_for) / static_cast<double>(bounded);
  state.counters["same"] = same;
}
BENCHMARK_CAPTURE(cost_of_set, forest, "builtin:forest-0")->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(cost_of_set, apartment, "builtin:apartment")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK_CAPTURE(cost_of_set, geb079, BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
