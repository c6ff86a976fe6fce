// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/plan/search/ends.hpp"
#include "core/study/design/design_rules.hpp"
#include "core/study/design/ways.hpp"

namespace backwash::study {

FlownWay flown_way(const plan::World& world, const Vec3& start_W, const Way& way, double flight_time) {
  const auto refused = [](std::string why) { return FlownWay{{}, {}, std::move(why)}; };
  if (way.points.empty()) return refused(way.why_not);
  for (const Waypoint& p : way.points)
    if (const auto why = plan::why_no_rest(world, p.p_W, 0)) return refused(*why);
  const auto& limits = world.reach.vehicle.limits;
  const plan::PlanOptions options{
      .v_max = limits.v_max, .a_max = limits.a_max, .deadline_s = kDesignRules.design_plan_deadline, .polish = 0};
  const auto most = static_cast<std::size_t>(flight_time / kControlPeriod);
  const std::size_t around = way.points.size();
  const bool facing = std::ranges::any_of(way.points, [](const Waypoint& p) { return p.yaw.has_value(); });
  const double most_rows = facing ? kDesignRules.design_most_facing : kDesignRules.design_most_rows;
  std::vector<std::vector<Setpoint>> legs(around);  // to each point, from the one before it
  FlownWay flown;
  Setpoint now;
  now.p_W = start_W;
  for (std::size_t k = 0; flown.points.size() < static_cast<std::size_t>(most_rows); ++k) {
    const Waypoint& goal = way.points[k % around];
    auto commands = k > 0 ? legs[k % around] : std::vector<Setpoint>();
    if (commands.empty()) {
      auto leg = plan::plan(world, {{now.p_W, Vec3::Zero()}, now}, goal.p_W, options);
      if (leg.status != plan::PlanStatus::ok) return refused(leg.message);
      commands = std::move(leg.commands);
      if (k > 0) legs[k % around] = commands;
    }
    commands = plan::facing_ahead(std::move(commands), {now.yaw, 0}, options.yaw);
    if (goal.yaw) {
      const auto turn = plan::turned_to(commands.back(), *goal.yaw, options.yaw);
      commands.insert(commands.end(), turn.begin(), turn.end());
    }
    flown.commands.insert(flown.commands.end(), commands.begin(), commands.end());
    now.p_W = goal.p_W;
    now.yaw = commands.back().yaw;
    flown.points.push_back(goal);
    if (flown.commands.size() >= most) break;
  }
  return flown;
}

}  // namespace backwash::study
