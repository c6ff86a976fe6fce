// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/replan.hpp"

#include <algorithm>
#include <utility>

#include "core/plan/rest.hpp"
#include "core/plan/search/ends.hpp"
#include "core/plan/stop.hpp"

namespace backwash::plan {
namespace {

constexpr double kAtGoal = 1e-6;       ///< m
constexpr double kLeastAdvance = 0.2;  ///< m: a nearer local goal is not worth a new path

/// The grid with its unknown voxels free.
map::OccupancyGrid hopeful(map::OccupancyGrid grid) {
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == map::Cell::unknown) grid.set(grid.voxel(n), map::Cell::free);
  return grid;
}

/// The farthest voxel of the way within the horizon that is safe to hover at, with the least clearance asked for, and
/// joined with the start.
std::optional<Index3> local_goal(const World& world, const std::vector<Index3>& way, const Vec3& from_W, double horizon,
                                 double least_clearance) {
  const SafeView safe(world.safe, {world.grid.index(from_W)});
  std::optional<Index3> farthest;
  for (const Index3& v : way) {
    if ((world.grid.center(v) - from_W).norm() > horizon) break;
    if (world.safe.passable(v) && safe.may_join(way.front(), v) &&
        may_rest_at(world, world.grid.center(v), least_clearance))
      farthest = v;
  }
  return farthest;
}

/// A candidate: commands, their tube from the route's start, and its clearance from `now` on.
struct Candidate {
  Route route;
  double clearance;
};
Candidate verified(const World& world, const Route& flying, std::vector<Setpoint> commands, std::size_t now,
                   double apart) {
  hold_until_settled(world.reach, commands);
  Candidate c{{flying.start, flying.previous, std::move(commands), {}}, 0};
  c.route.tube = tube_to_rest(world, flying.start, flying.previous, c.route.commands);
  c.clearance = tube_clearance(world, c.route.tube, now, apart);
  return c;
}

}  // namespace

std::vector<Index3> optimistic_way(const World& world, const Vec3& from_W, const Vec3& goal_W) {
  const map::OccupancyGrid grid = hopeful(world.grid);
  const map::DistanceField known(grid);  // to occupied voxels and the grid's sides
  const auto& vehicle = world.reach.vehicle;
  const double taken = vehicle.body.radius + vehicle.estimation.position + world.constant_margin.value_or(0.0);
  map::OccupancyGrid passable = world.hover.safe_voxels();
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    const bool unknown_is_nearer = known.at(v) > world.distance.at(v) + 1e-6;
    if (unknown_is_nearer && known.at(v) > taken) passable.set(v, map::Cell::free);
  }
  const SafeSpace space(passable);
  const Index3 from = grid.index(from_W), to = grid.index(goal_W);
  return SafeView(space, {from, to}).chain(from, to);
}

Replan replan(const World& world, const Route& flying, std::size_t now, std::size_t branch, const Vec3& goal_W,
              const ReplanOptions& options) {
  const auto ends_at_goal = [&](const Route& r) { return (r.commands.back().p_W - goal_W).norm() < kAtGoal; };
  Replan result{Replan::Kind::kept, {}, 0, false, {}, {}};
  const auto take = [&](Replan::Kind kind, Candidate c) {
    result.kind = kind;
    result.route = std::move(c.route);
    result.clearance_m = c.clearance;
    result.reaches_goal = ends_at_goal(result.route);
    return result;
  };
  const double least = options.limits.least_clearance_m;
  std::vector<Setpoint> held = flying.commands;
  while (held.size() <= branch) held.push_back({held.back().p_W, Vec3::Zero(), Vec3::Zero(), held.back().yaw});
  Candidate kept = verified(world, flying, std::move(held), now, least);
  const Setpoint from = kept.route.commands[branch];
  if (ends_at_goal(flying) && kept.clearance > least) return take(Replan::Kind::kept, std::move(kept));

  const auto way = optimistic_way(world, from.p_W, goal_W);
  const auto local = local_goal(world, way, from.p_W, options.horizon_m, least + options.reserve_m);
  if (way.empty()) result.message = "no way to the goal is left";
  if (local && (world.grid.center(*local) - from.p_W).norm() > kLeastAdvance) {
    const Vec3 to_W = *local == way.back() ? goal_W : world.grid.center(*local);
    PlanOptions limits = options.limits;
    limits.least_clearance_m += options.reserve_m;
    const Plan planned = plan(world, {kept.route.tube[branch].center, from}, to_W, limits);
    result.metrics = planned.metrics;
    result.message = planned.message;
    if (planned.status == PlanStatus::ok) {
      const auto& before = kept.route.commands;
      std::vector<Setpoint> commands(before.begin(), before.begin() + static_cast<std::ptrdiff_t>(branch));
      const double rate =
          branch > 0 ? (from.yaw - before[branch - 1].yaw) / kControlPeriod : 0.0;  // of the command given
      const auto turned = facing_ahead(planned.commands, {from.yaw - rate * kControlPeriod, rate}, options.limits.yaw);
      commands.insert(commands.end(), turned.begin(), turned.end());
      Candidate extended = verified(world, flying, std::move(commands), now, least);
      if (extended.clearance > least) return take(Replan::Kind::extended, std::move(extended));
      result.message = "the new path's tube from the route's start is not clear";
    }
  }
  if (kept.clearance > least) return take(Replan::Kind::kept, std::move(kept));
  Candidate stopped =
      verified(world, flying, stop_along(kept.route.commands, branch, options.limits.a_max), now, least);
  if (stopped.clearance > least) return take(Replan::Kind::stopping, std::move(stopped));
  return take(Replan::Kind::unsafe, kept.clearance > stopped.clearance ? std::move(kept) : std::move(stopped));
}

}  // namespace backwash::plan
