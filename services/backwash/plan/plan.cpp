// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>

#include "core/plan/plan_along.hpp"
#include "core/plan/search/ends.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/site/world_cache.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct PlanOptions {
  std::string map, model, vehicle;
  reach::Method method = reach::Method::tight;
  std::optional<Vec3> start, goal;
  std::optional<double> margin, v_max, a_max, risk;
  bool json = false;
};

void print_text(const plan::Plan& plan, bool stated) {
  const auto& m = plan.metrics;
  std::printf("status         %s\n", plan::to_string(plan.status));
  if (plan.status == plan::PlanStatus::ok) {
    std::printf(
        "length         %.2f m\ntime           %.2f s\njerk squared   %.2f m2/s5\nclearance      %.3f m at least\n",
        m.length_m, m.time_s, m.jerk2, m.min_clearance_m);
    if (m.risk.largest > 0)
      std::printf(
          "risk           %.2g of touching at most, %.0f %% of it within a second at (%.2f, %.2f, %.2f), t %.1f s\n",
          m.risk.total, 100 * m.risk.largest / m.risk.total, m.risk.center_W.x(), m.risk.center_W.y(),
          m.risk.center_W.z(), m.risk.t);
    else if (stated)
      std::printf("risk           nothing is within 6 standard deviations\n");
  }
  std::printf(
      "search         %.1f ms, %zu states\noptimisation   %.1f ms, %zu evaluations\nsets           %.1f "
      "ms\nverification   %.1f ms\n",
      m.search_ms, m.expanded, m.optimise_ms, m.evaluations, m.tubes_ms, m.verify_ms);
}

int run(const PlanOptions& options) {
  if (options.risk && (options.margin || options.method != reach::Method::tight))
    throw Failure(kUsage, "--risk is of the exact sets; leave out --margin and --method paper");
  const auto [vehicle, model] = read_both(options.vehicle, options.model, options.risk);
  read_reachability(vehicle, options.method, reach::Loop::vehicle, options.vehicle);
  auto grid = read_map(options.map);
  const plan::PlanOptions limits{.v_max = options.v_max.value_or(vehicle.limits.v_max),
                                 .a_max = options.a_max.value_or(vehicle.limits.a_max)};
  Setpoint hover;
  hover.p_W = *options.start;
  const plan::PlanStart start{State{*options.start, Vec3::Zero()}, hover};
  const CachedWorld cached(
      {std::move(grid), model, options.model, vehicle, options.vehicle, options.method, options.margin});
  const auto planned = [&]() -> plan::Plan {
    if (const auto world = cached.kept()) return plan::plan(*world, start, *options.goal, limits);
    progress("looking at both ends");
    if (auto refused = plan::refused_at_once(cached.input().grid, model, vehicle, options.method, options.margin, start,
                                             *options.goal, limits))
      return *std::move(refused);
    const auto make = [&](map::OccupancyGrid part, const map::OccupancyGrid* around) {
      return world_of(
          {std::move(part), model, options.model, vehicle, options.vehicle, options.method, options.margin, around});
    };
    return plan::plan_along(cached.input().grid, model, vehicle, make, start, *options.goal, limits);
  };
  const plan::Plan plan = planned();
  options.json ? print(to_json(plan, options.method, options.risk.has_value()))
               : print_text(plan, options.risk.has_value());
  if (plan.status == plan::PlanStatus::ok) return kOk;
  throw Failure(kUnavailable, options.map + ":1: " + plan::to_string(plan.status) + ": " + plan.message);
}

}  // namespace

Verb plan_verb(Command& app) {
  auto options = std::make_shared<PlanOptions>();
  auto& command = app.add_subcommand("plan", "Trajectory whose clearance is its reachable set");
  command.add_option("--map", options->map, "OctoMap file or builtin:NAME").required();
  command.add_option("--model", options->model, "model file or builtin:NAME").required();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").required();
  add_point(command, "--start", options->start, "m").required();
  add_point(command, "--goal", options->goal, "m").required();
  command.add_option("--margin", options->margin, "constant margin in place of the sets, m").check(not_negative());
  command.add_option("--vmax", options->v_max, "m/s per axis; the vehicle's limit by default").check(positive());
  command.add_option("--amax", options->a_max, "m/s2 per axis; the vehicle's limit by default").check(positive());
  add_method(command, options->method);
  add_risk(command, options->risk);
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer(
      "Exit code 0 when a trajectory was found and verified, 69 otherwise.\nExample:\n"
      "  backwash plan --map builtin:narrow-gap --model builtin:quad-5in --vehicle builtin:quad-5in \\\n"
      "    --start 1,0,1 --goal 5,0,1 --json");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
