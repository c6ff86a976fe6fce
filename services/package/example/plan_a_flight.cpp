// SPDX-License-Identifier: BSD-3-Clause
// Plans a flight between two walls with the library alone: cmake -B build && cmake --build build && build/plan_a_flight
#include <cstdio>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"

int main() {
  using namespace backwash;
  auto grid = map::load_map("builtin:parallel-walls-4m");
  const auto vehicle = config::load_vehicle("builtin:quad-5in");
  const auto model = config::load_model("builtin:quad-5in");
  if (!grid || !vehicle || !model) return 1;
  const auto world = plan::build_world(std::move(*grid), *model, *vehicle);

  plan::PlanStart start;
  start.estimated.p_W = start.command.p_W = {-2, 0, 1.2};
  const Vec3 goal_W(2, 0, 1.2);
  const auto plan = plan::plan(*world, start, goal_W, {vehicle->limits.v_max, vehicle->limits.a_max});
  if (plan.status != plan::PlanStatus::ok) {
    std::printf("%s: %s\n", to_string(plan.status), plan.message.c_str());
    return 1;
  }
  std::printf("%.2f m in %.2f s, clearance beyond the reachable sets %.3f m, %zu set-points\n", plan.metrics.length_m,
              plan.metrics.time_s, plan.metrics.min_clearance_m, plan.commands.size());
}
