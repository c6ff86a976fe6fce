// SPDX-License-Identifier: BSD-3-Clause
// The way to a goal: by one whole plan, or towards what the map does not show yet.
#include <spdlog/spdlog.h>

#include <cmath>

#include "core/types/text.hpp"
#include "services/backwashd/planner_worker.hpp"

namespace backwash::daemon {
namespace {

constexpr int kPlans = 5;          // of one route, while the state moves on
constexpr double kPatience = 2.0;  // s at rest in which more of the way may become known

constexpr double kReserve = 0.1;        // m of clearance towards what may turn out to be a wall
constexpr double kLeastReserve = 0.02;  // m, where there is no room for that: for the set, larger since the start

/// `apart_m`: AcceptedSegment::apart_m.
plan::PlanOptions limits_of(const plan::World& world, double apart_m) {
  plan::PlanOptions options{};
  options.least_clearance_m = apart_m;
  options.v_max = world.reach.vehicle.limits.v_max;
  options.a_max = world.reach.vehicle.limits.a_max;
  return options;
}

/// Whether more of the map may make hovering at p safe: it is unknown there, or unknown voxels are nearer than any
/// obstacle within a metre.
bool may_become_clear(const map::OccupancyGrid& grid, const Vec3& p_W) {
  const Index3 at = grid.index(p_W);
  if (!grid.inside(at) || grid.occupied(at)) return false;
  const int reach = static_cast<int>(std::ceil(1.0 / grid.resolution()));
  double unknown = INFINITY, occupied = INFINITY;
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const Index3 v = at + Index3(i, j, k);
        if (!grid.inside(v) || grid.free(v)) continue;
        double& nearest = grid.occupied(v) ? occupied : unknown;
        nearest = std::min(nearest, (grid.center(v) - p_W).norm());
      }
  return unknown < occupied;
}

}  // namespace

/// Where the map ends the airflow of what is behind is not known: a way with something to spare comes first. From rest
/// at last one with nothing to spare: what has come to light may have left nothing where the vehicle is already.
plan::Replan PlannerWorker::onward(const plan::World& world, const plan::Route& route, std::size_t now,
                                   std::size_t branch, const Vec3& goal_W, double apart_m) const {
  plan::ReplanOptions options{limits_of(world, apart_m)};
  plan::Replan next;
  for (const double reserve : {kReserve, kLeastReserve, 0.0}) {
    if (reserve == 0 && branch > 0) break;
    options.reserve_m = reserve;
    next = plan::replan(world, route, now, branch, goal_W, options);
    if (next.kind == plan::Replan::Kind::extended) break;
  }
  return next;
}

/// Plans again from the newest state when the tube of the one planned from no longer holds.
std::optional<std::string> PlannerWorker::go_to(const PlanJob& job) {
  std::optional<std::string> why;
  for (int attempt = 0; attempt < kPlans; ++attempt) {
    const bool partial = channels_.map_partial;  // before the newest world is taken
    if (!current()) return kEnded;
    if (partial && !world_->grid.inside(world_->grid.index(job.position)))
      return "the map is still being made there; what is around the vehicle can be flown: ask again";
    if (channels_.world_moves && !world_->grid.inside(world_->grid.index(job.position))) {
      const auto& grid = world_->grid;
      const Vec3 high = grid.origin() + grid.resolution() * grid.size().cast<double>();
      return "goal " + to_text(job.position) + " is outside the world of the window, " + to_text(grid.origin()) +
             " to " + to_text(high) + ": use waypoints in it";
    }
    const auto world = world_;  // a newer one may come while this is planned in
    const std::uint32_t closures = view_.closures;
    const auto options = limits_of(*world, view_.residual_m);
    auto planned = plan::plan(*world, {view_.state, view_.command}, job.position, options);
    const bool stated = world->bounds.model().stated.has_value();
    spdlog::info("plan: {} ({:.0f} ms search, {:.0f} ms optimisation, {:.0f} ms verification, clearance {:.3f} m{})",
                 plan::to_string(planned.status), planned.metrics.search_ms, planned.metrics.optimise_ms,
                 planned.metrics.verify_ms, planned.metrics.min_clearance_m,
                 stated ? ", risk " + fmt::format("{:.2g}", planned.metrics.risk.total) : "");
    const bool hidden =
        planned.status == plan::PlanStatus::no_path ||
        (planned.status == plan::PlanStatus::goal_blocked && may_become_clear(world->grid, job.position));
    if (hidden && !plan::optimistic_way(*world, view_.command.p_W, job.position).empty()) return explore(job);
    if (planned.status != plan::PlanStatus::ok)
      return std::string(plan::to_string(planned.status)) + ": " + planned.message;
    if (job.yaw) {
      const auto turn = plan::turned_to(planned.commands.back(), *job.yaw, options.yaw);
      planned.commands.insert(planned.commands.end(), turn.begin(), turn.end());
    }
    why = fly(std::move(planned.commands), planned.metrics, std::nullopt, closures);
    if (why) continue;  // current() ends this for what has been ended
    pursuit_ = Pursuit{job.position, job.yaw};
    return why;
  }
  return why;
}

/// From rest, the first segment of a flight whose way is not known yet; waits a little for scans that show more of it.
/// A world that came while a plan was made is planned in once more, however long that took.
std::optional<std::string> PlannerWorker::explore(const PlanJob& job) {
  const std::int64_t until_ns = view_.t_ns + static_cast<std::int64_t>(kPatience * 1e9);
  std::string why;
  while (!channels_.stop) {
    if (!current()) return kEnded;
    const bool last = view_.t_ns >= until_ns;
    const auto world = world_;
    new_world_ = false;
    const std::uint32_t closures = view_.closures;
    plan::Route here{view_.state, view_.command, {}, {}};
    here.commands.assign(1, {view_.command.p_W, Vec3::Zero(), Vec3::Zero(), view_.command.yaw});
    auto next = onward(*world, here, 0, 0, job.position, view_.residual_m);
    why = next.message;
    if (next.kind == plan::Replan::Kind::extended) {
      spdlog::info("towards a goal that is not known to be clear yet: {} commands", next.route.commands.size());
      auto refused = fly(std::move(next.route.commands), next.metrics, std::nullopt, closures);
      if (!refused) pursuit_ = Pursuit{job.position, job.yaw};
      return refused;
    }
    while (current() && !new_world_ && view_.t_ns < until_ns && !channels_.stop) pause_();
    if (last || !new_world_) break;
  }
  return "nothing more of the way became known" + (why.empty() ? "" : ": " + why);
}

}  // namespace backwash::daemon
