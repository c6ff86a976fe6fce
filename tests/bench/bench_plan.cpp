// SPDX-License-Identifier: BSD-3-Clause
// Planning in a forest of 40 × 20 × 5 m with 150 pillars and 10 rings at 0.1 m (builtin:forest-1), quad-5in and its
// model, v_max 3 m/s, a_max 2 m/s²: what Fast-Planner's launch defaults fly (there: 200 queries, horizon 7 m, search
// 0.44 ms mean and 0.84 ms p95, optimisation 3.2 ms mean, 3 of 200 in collision, 105 of 200 beyond a limit).
//
// Queries: hover-safe start and goal drawn at random, at rest. local: the goal 5.5 to 7 m from the start, flown to the
// end. horizon: start and goal anywhere, planned up to the horizon and to a stop there. The 60 m horizon flies in two
// forests end to end (80 × 20 × 5 m, 300 pillars, 20 rings). World (distance, field, hover map) is built before timing.
// Each query is planned three times and counts with its median; all times are CPU time of the thread but the parts
// (search, verify), which are the planner's own. kernel: 10⁶ look-ups of the distance field at random points, same run.
//
// Judged here and not by the planner: a trajectory collides if a point of it, every millisecond, is nearer to an
// obstacle than the body's radius (exact distance); it breaks a limit if velocity or acceleration of an axis pass
// theirs.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <map>
#include <memory>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"

namespace {

using namespace backwash;

constexpr double kVMax = 3, kAMax = 2;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// Forests 1 … count side by side along x.
map::OccupancyGrid forests(int count) {
  const auto first = map::builtin_scene("forest-1", 0.1).value();
  const int nx = first.size().x();
  map::OccupancyGrid all(first.origin(), 0.1, {count * nx, first.size().y(), first.size().z()}, map::Cell::free);
  for (int n = 0; n < count; ++n) {
    const auto forest = map::builtin_scene("forest-" + std::to_string(n + 1), 0.1).value();
    for (std::size_t i = 0; i < forest.cell_count(); ++i) all.set(forest.voxel(i) + Index3(n * nx, 0, 0), forest.at(i));
  }
  return all;
}

const plan::World& world(int count) {
  static std::map<int, std::shared_ptr<const plan::World>> worlds;
  auto& w = worlds[count];
  if (!w)
    w = plan::build_world(forests(count), config::load_model("builtin:quad-5in").value(),
                          config::load_vehicle("builtin:quad-5in").value());
  return *w;
}

struct Query {
  Vec3 start, goal;
};

std::vector<Query> queries(const plan::World& world, std::size_t count, double nearest, double farthest) {
  std::mt19937_64 random(7);
  const auto draw = [&] {
    for (;;) {
      const Index3 v = world.grid.voxel(random() % world.grid.cell_count());
      if (world.hover.safe(v)) return world.grid.center(v);
    }
  };
  std::vector<Query> result;
  while (result.size() < count) {
    const Query q{draw(), draw()};
    const double d = (q.goal - q.start).norm();
    if (d >= nearest && d <= farthest) result.push_back(q);
  }
  return result;
}

double kernel_ms(const plan::World& world) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(0, 1);
  std::vector<Vec3> points(1'000'000);
  const Vec3 extent = world.grid.resolution() * world.grid.size().cast<double>();
  for (Vec3& p : points) p = world.grid.origin() + extent.cwiseProduct(Vec3(u(random), u(random), u(random)));
  const double begun = cpu_ms();
  double sum = 0;
  for (const Vec3& p : points) sum += world.distance.interpolated(p);
  benchmark::DoNotOptimize(sum);
  return cpu_ms() - begun;
}

bool collides(const plan::World& world, const plan::BSpline& spline) {
  for (double t = 0; t <= spline.duration(); t += 1e-3)
    if (world.distance.exact(world.grid, spline.derivative(t, 0)) < world.reach.vehicle.body.radius) return true;
  return false;
}

bool breaks_limits(const plan::BSpline& spline) {
  for (double t = 0; t <= spline.duration(); t += 1e-3)
    if (spline.derivative(t, 1).cwiseAbs().maxCoeff() > kVMax * (1 + 1e-6) ||
        spline.derivative(t, 2).cwiseAbs().maxCoeff() > kAMax * (1 + 1e-6))
      return true;
  return false;
}

double quantile(std::vector<double> values, double q) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Tally {
  std::vector<double> search, total, verify, expanded, evaluations, length;
  double ok = 0, collisions = 0, violations = 0;
};

void report(benchmark::State& state, const Tally& t, double kernel) {
  auto& c = state.counters;
  c["search_p50"] = quantile(t.search, 0.5), c["search_p95"] = quantile(t.search, 0.95);
  c["total_p50"] = quantile(t.total, 0.5), c["total_p95"] = quantile(t.total, 0.95);
  c["total_max"] = quantile(t.total, 1), c["verify_p50"] = quantile(t.verify, 0.5);
  c["kernel"] = kernel, c["search/kernel"] = quantile(t.search, 0.5) / kernel;
  c["total/kernel"] = quantile(t.total, 0.5) / kernel;
  c["expanded_p50"] = quantile(t.expanded, 0.5), c["expanded_p95"] = quantile(t.expanded, 0.95);
  c["evaluations_p50"] = quantile(t.evaluations, 0.5), c["evaluations_p95"] = quantile(t.evaluations, 0.95);
  c["length_p50"] = quantile(t.length, 0.5);
  c["queries"] = static_cast<double>(t.total.size()), c["ok"] = t.ok;
  c["collisions"] = t.collisions, c["violations"] = t.violations;
}

void run(benchmark::State& state, const plan::World& world, const std::vector<Query>& queries, double horizon) {
  plan::PlanOptions options{.v_max = kVMax, .a_max = kAMax};
  (void)horizon;
  for (auto _ : state) {
    const double kernel = kernel_ms(world);
    Tally tally;
    for (const Query& q : queries) {
      std::vector<double> search, total, verify;
      plan::Plan p;
      for (int repeat = 0; repeat < 3; ++repeat) {
        const double begun = cpu_ms();
        p = plan::plan(world, {{q.start, Vec3::Zero()}, {q.start, Vec3::Zero(), Vec3::Zero(), 0}}, q.goal, options);
        total.push_back(cpu_ms() - begun);
        search.push_back(p.metrics.search_ms), verify.push_back(p.metrics.verify_ms);
      }
      tally.search.push_back(quantile(search, 0.5)), tally.total.push_back(quantile(total, 0.5));
      tally.verify.push_back(quantile(verify, 0.5));
      tally.expanded.push_back(static_cast<double>(p.metrics.expanded));
      tally.evaluations.push_back(static_cast<double>(p.metrics.evaluations));
      tally.length.push_back(p.metrics.length_m);
      if (p.status != plan::PlanStatus::ok) {
        state.SetLabel("last refusal: " + p.message);
        continue;
      }
      tally.ok += 1;
      tally.collisions += collides(world, p.trajectory);
      tally.violations += breaks_limits(p.trajectory);
    }
    report(state, tally, kernel);
  }
}

void local(benchmark::State& state) { run(state, world(1), queries(world(1), 200, 5.5, 7), INFINITY); }
BENCHMARK(local)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
