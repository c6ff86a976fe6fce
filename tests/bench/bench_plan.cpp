// SPDX-License-Identifier: BSD-3-Clause
// Planning in a forest of 40 × 20 × 5 m with 150 pillars and 10 rings at 0.1 m (builtin:forest-1), quad-5in and its
// model, v_max 3 m/s, a_max 2 m/s²: what Fast-Planner's launch defaults fly (there: 200 queries, horizon 7 m, search
// 0.44 ms mean and 0.84 ms p95, optimisation 3.2 ms mean, 3 of 200 in collision, 105 of 200 beyond a limit).
//
// forest/N: 200 queries whose hover-safe start and goal are drawn at random, at rest, N m apart at most and 80 % of
// that at least, flown to a stop exactly at the goal. N is the ancestor's horizon of 7 m, where it may end moving
// anywhere beyond, and 20 and 60 m for the growth of the cost (60 m in two forests end to end, 300 pillars, 20 rings).
// jerk2: the sum over the queries of the trajectories' ∫‖jerk‖² dt. World (distance, field, hover map) is built before
// timing. Each query is planned three times and counts with its median; times are CPU time of the thread in ms (search:
// the same search called alone; verify: the planner's own wall clock). kernel: 10⁶ look-ups of the distance field at
// random points, in the same run. Judged here and not by the planner: a trajectory collides if a point of it, every
// millisecond, is nearer to an obstacle than the body's radius (exact distance); it breaks a limit if velocity or
// acceleration of an axis pass theirs.
//
// success/SCENE: pairs drawn anywhere; exists counts those that an exhaustive search over hover-safe voxels joins,
// found the plans, wrong the pairs it cannot join whose status is anything but no_path.
//
// search_tail/V: the search alone at v_max V mm/s, 1,000 queries: quantiles and largest.
//
// set_extent: what is taken off the distance, ‖h‖₂ of a set (the scalar way) over what its own prism
// takes (exact distance of the centre less that of the prism), over the steps of the forest's plans nearer than 0.5 m.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <map>
#include <memory>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"
#include "core/reach/clearance.hpp"
#include "core/types/quantile.hpp"
#include "tests/support/regions.hpp"

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

struct Tally {
  std::vector<double> search, total, verify, expanded, evaluations, length;
  double ok = 0, collisions = 0, violations = 0, jerk2 = 0;
};

void report(benchmark::State& state, const Tally& t, double kernel) {
  auto& c = state.counters;
  c["search_p50"] = quantile(t.search, 0.5);
  c["search_p95"] = quantile(t.search, 0.95);
  c["total_p50"] = quantile(t.total, 0.5);
  c["total_p95"] = quantile(t.total, 0.95);
  c["total_max"] = quantile(t.total, 1);
  c["verify_p50"] = quantile(t.verify, 0.5);
  c["kernel"] = kernel;
  c["search/kernel"] = quantile(t.search, 0.5) / kernel;
  c["total/kernel"] = quantile(t.total, 0.5) / kernel;
  c["expanded_p50"] = quantile(t.expanded, 0.5);
  c["expanded_p95"] = quantile(t.expanded, 0.95);
  c["evaluations_p50"] = quantile(t.evaluations, 0.5);
  c["evaluations_p95"] = quantile(t.evaluations, 0.95);
  c["length_p50"] = quantile(t.length, 0.5);
  c["jerk2"] = t.jerk2;
  c["queries"] = static_cast<double>(t.total.size());
  c["ok"] = t.ok;
  c["collisions"] = t.collisions;
  c["violations"] = t.violations;
}

plan::PlanStart at_rest(const Vec3& p_W) { return {{p_W, Vec3::Zero()}, {p_W, Vec3::Zero(), Vec3::Zero(), 0}}; }

const plan::PlanOptions kOptions{.v_max = kVMax, .a_max = kAMax};

double search_ms(const plan::World& world, const Query& q) {
  const double begun = cpu_ms();
  const plan::SafeView space(world.safe, {world.grid.index(q.start), world.grid.index(q.goal)});
  benchmark::DoNotOptimize(
      plan::search(space, {q.start, Vec3::Zero()}, q.goal,
                   {0.9 * kVMax, 0.9 * kAMax, kOptions.max_nodes, plan::Clock::now() + std::chrono::seconds(10)}));
  return cpu_ms() - begun;
}

Tally planned(const plan::World& world, const std::vector<Query>& queries, const plan::PlanOptions& options,
              std::string& refusal) {
  Tally tally;
  for (const Query& q : queries) {
    std::vector<double> search, total, verify;
    plan::Plan p;
    for (int repeat = 0; repeat < 3; ++repeat) {
      const double begun = cpu_ms();
      p = plan::plan(world, at_rest(q.start), q.goal, options);
      total.push_back(cpu_ms() - begun);
      search.push_back(search_ms(world, q));
      verify.push_back(p.metrics.verify_ms);
    }
    tally.search.push_back(quantile(search, 0.5));
    tally.total.push_back(quantile(total, 0.5));
    tally.verify.push_back(quantile(verify, 0.5));
    tally.expanded.push_back(static_cast<double>(p.metrics.expanded));
    tally.evaluations.push_back(static_cast<double>(p.metrics.evaluations));
    tally.length.push_back(p.metrics.length_m);
    tally.jerk2 += p.metrics.jerk2;
    if (p.status != plan::PlanStatus::ok) {
      refusal = "last refusal: " + p.message;
      continue;
    }
    tally.ok += 1;
    tally.collisions += collides(world, p.trajectory);
    tally.violations += breaks_limits(p.trajectory);
  }
  return tally;
}

void forest(benchmark::State& state) {
  const auto horizon = static_cast<double>(state.range(0));
  const auto& w = world(horizon > 30 ? 2 : 1);
  std::string refusal;
  for (auto _ : state) {
    const double kernel = kernel_ms(w);
    report(state, planned(w, queries(w, 200, 0.8 * horizon, horizon), kOptions, refusal), kernel);
  }
  state.SetLabel(refusal);
}
BENCHMARK(forest)->Arg(7)->Arg(20)->Arg(60)->Unit(benchmark::kMillisecond)->Iterations(1);

/// The search alone, 1,000 queries of 5.6 to 7 m, v_max of the argument, mm/s: quantiles and largest, ms. The speeds of
/// the vehicle's own limit and below are where single queries once took half a second.
void search_tail(benchmark::State& state) {
  const auto& w = world(1);
  const double v_max = 1e-3 * static_cast<double>(state.range(0)), a_max = v_max < 1 ? 1 : kAMax;
  std::vector<double> ms, of_bound;
  for (auto _ : state)
    for (const Query& q : queries(w, 1000, 5.6, 7)) {
      const plan::SearchOptions options{0.9 * v_max, 0.9 * a_max, kOptions.max_nodes,
                                        plan::Clock::now() + std::chrono::seconds(60)};
      const double begun = cpu_ms();
      const plan::SafeView space(w.safe, {w.grid.index(q.start), w.grid.index(q.goal)});
      const auto found = plan::search(space, {q.start, Vec3::Zero()}, q.goal, options);
      ms.push_back(cpu_ms() - begun);
      if (found) of_bound.push_back(found->cost / found->lower_bound);
    }
  state.counters["p50"] = quantile(ms, 0.5);
  state.counters["p95"] = quantile(ms, 0.95);
  state.counters["p99"] = quantile(ms, 0.99);
  state.counters["max"] = quantile(ms, 1);
  state.counters["found"] = static_cast<double>(of_bound.size());
  state.counters["cost/bound_p50"] = quantile(of_bound, 0.5);
  state.counters["cost/bound_max"] = quantile(of_bound, 1);
}
BENCHMARK(search_tail)->Arg(1500)->Arg(500)->Arg(3000)->Unit(benchmark::kMillisecond)->Iterations(1);

void success(benchmark::State& state, const std::string& scene) {
  const auto vehicle = config::load_vehicle("builtin:quad-5in").value();
  const auto w =
      plan::build_world(map::builtin_scene(scene).value(), config::load_model("builtin:quad-5in").value(), vehicle);
  const plan::PlanOptions options{.v_max = vehicle.limits.v_max, .a_max = vehicle.limits.a_max};
  double exists = 0, found = 0, wrong = 0;
  for (auto _ : state) {
    const auto region = test::regions(w->grid, [&](const Index3& v) { return w->hover.safe(v); });
    for (const Query& q : queries(*w, static_cast<std::size_t>(state.range(0)), 0, INFINITY)) {
      const auto p = plan::plan(*w, at_rest(q.start), q.goal, options);
      const auto at = [&](const Vec3& x) { return region[w->grid.linear(w->grid.index(x))]; };
      if (at(q.start) != at(q.goal)) {
        wrong += p.status != plan::PlanStatus::no_path;
        continue;
      }
      exists += 1;
      found += p.status == plan::PlanStatus::ok;
      if (p.status != plan::PlanStatus::ok) state.SetLabel(std::string(plan::to_string(p.status)) + ": " + p.message);
    }
  }
  state.counters["exists"] = exists;
  state.counters["found"] = found;
  state.counters["wrong"] = wrong;
  state.counters["share"] = found / exists;
}
BENCHMARK_CAPTURE(success, apartment, "apartment")->Arg(1000)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(success, narrow_gap, "narrow-gap")->Arg(500)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(success, thin_wall, "thin-wall")->Arg(500)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(success, forest, "forest-2")->Arg(500)->Unit(benchmark::kMillisecond)->Iterations(1);

void set_extent(benchmark::State& state) {
  const auto& w = world(1);
  std::vector<double> ratio;
  for (auto _ : state)
    for (const Query& q : queries(w, 50, 5.6, 7)) {
      const auto p = plan::plan(w, at_rest(q.start), q.goal, kOptions);
      for (const auto& step : p.tube) {
        const auto& h = step.half_widths;
        const double prism = reach::prism_distance(w.grid, step.center.p_W, h, 0.5);
        if (prism <= 0 || prism >= 0.5) continue;
        ratio.push_back(Vec3(h[kX], h[kY], h[kZ]).norm() / (w.distance.exact(w.grid, step.center.p_W) - prism));
      }
    }
  state.counters["norm/prism_p5"] = quantile(ratio, 0.05);
  state.counters["norm/prism_p50"] = quantile(ratio, 0.5);
  state.counters["norm/prism_p95"] = quantile(ratio, 0.95);
}
BENCHMARK(set_extent)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
