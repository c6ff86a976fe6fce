// SPDX-License-Identifier: BSD-3-Clause
// 10⁵ plans (a thousandth in a block): the clearance that each was verified with is that of its prisms by an
// independent distance (separation.hpp), over every step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/plan/planner.hpp"
#include "tests/promises/flyers.hpp"
#include "tests/promises/separation.hpp"

namespace backwash::promises {
namespace {

constexpr double kExact = 1e-6, kCap = 2;  // m

/// Of every step: the hull of its prism here and at the next centre, from the obstacles.
void demand_clear(const plan::World& world, const Obstacles& obstacles, const reach::ReachTube& tube, double claimed) {
  const Vehicle& vehicle = world.reach.vehicle;
  const double taken = vehicle.body.radius + vehicle.estimation.position;
  double nearest = kCap + taken, longest = 0;
  for (std::size_t k = 0; k < tube.size(); ++k) {
    const Vec3& to = tube[std::min(k + 1, tube.size() - 1)].center.p_W;
    auto hull = prism_corners(tube[k].center.p_W, tube[k].half_widths_interval);
    const auto next = prism_corners(to, tube[k].half_widths_interval);
    hull.insert(hull.end(), next.begin(), next.end());
    nearest = obstacles.distance(hull, nearest);
    longest = std::max(longest, (to - tube[k].center.p_W).norm());
  }
  demand_at_most(claimed, nearest - taken + kExact, "clearance claimed and not there");
  // What is claimed is that of a prism around the hull: half the motion wider in each direction.
  demand_at_most(nearest - taken, claimed + 1.5 * longest + kExact, "clearance not claimed");
}

TEST(Promises, EveryPrismOfAPlanIsAsClearAsClaimed) {
  constexpr unsigned kWorlds = 10, kPlans = 10, kTries = 60;
  unsigned planned = 0;
  draw_all(3, kWorlds, [&](Random& random) {
    const auto world = draw_flyers_world(random, {24, 24, 12}, {40, 40, 18}).world;
    const Obstacles obstacles(world->grid);
    const auto places = safe_places(*world);
    const auto& limits = world->reach.vehicle.limits;
    for (unsigned tries = 0, found = 0; tries < kTries && found < kPlans; ++tries) {
      plan::PlanOptions options{.v_max = std::min(limits.v_max, 3.0), .a_max = std::min(limits.a_max, 4.0)};
      const Vec3 start = draw_place(random, *world, places), goal = draw_place(random, *world, places);
      const auto plan = plan::plan(*world, {{start, Vec3::Zero()}, {start}}, goal, options);
      if (plan.status != plan::PlanStatus::ok) continue;
      ++found;
      ++planned;
      demand_at_most(-plan.metrics.min_clearance_m, 0, "a plan that is not clear");
      demand_clear(*world, obstacles, plan.tube, plan.metrics.min_clearance_m);
    }
  });
  EXPECT_EQ(planned, kWorlds * kPlans);
}

}  // namespace
}  // namespace backwash::promises
