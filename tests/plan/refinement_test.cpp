// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/refinement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/search/kinodynamic_astar.hpp"
#include "core/plan/world/safe_space.hpp"

namespace backwash::plan {
namespace {

const World& open_world() {
  static const auto world = build_world(map::builtin_scene("parallel-walls-4m", 0.2).value(), Model{},
                                        config::load_vehicle("builtin:quad-5in").value());
  return *world;
}

PlanStart moving(const Vec3& p_W, const Vec3& v_W) { return {{p_W, v_W}, {p_W, v_W, Vec3::Zero(), 0}}; }

// Short ways from a fast start are those that no timing suits.
TEST(Refinement, WhatPlansReturnKeepsTheLimitsFromAnyMotion) {
  const Vec3 from(0, 0, 1.2);
  const PlanOptions options{.v_max = 1.5, .a_max = 1.0};
  int flown = 0;
  for (const Vec3& v : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 0.8, 0), Vec3(0.7, -0.7, 0)})
    for (const Vec3& goal : {Vec3(2, 0, 1.2), Vec3(1, 0.6, 1.4), Vec3(0.6, 0, 1.2), Vec3(-0.6, 0.4, 1)}) {
      const Plan p = plan(open_world(), moving(from, v), goal, options);
      if (p.status != PlanStatus::ok) continue;
      ++flown;
      double fastest = 0, hardest = 0;
      for (double t = 0; t <= p.trajectory.duration(); t += 0.005) {
        fastest = std::max(fastest, p.trajectory.derivative(t, 1).cwiseAbs().maxCoeff());
        hardest = std::max(hardest, p.trajectory.derivative(t, 2).cwiseAbs().maxCoeff());
      }
      EXPECT_LE(fastest, 1.5 + 1e-6) << v.transpose() << " to " << goal.transpose();
      EXPECT_LE(hardest, 1.0 + 1e-6) << v.transpose() << " to " << goal.transpose();
    }
  EXPECT_GT(flown, 5);
}

// No timing suits every motion: what is tried ends soon, and is no flight of minutes.
TEST(Refinement, StartsFromAnyMotionEndSoonAndInFlightsOfSeconds) {
  const auto world =
      build_world(map::builtin_scene("apartment", 0.2).value(), config::load_model("builtin:quad-5in").value(),
                  config::load_vehicle("builtin:quad-5in").value());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  int flown = 0;
  for (int draw = 0; draw < 200; ++draw) {
    const Vec3 from(5 + 4 * unit(random), 4 + 3.5 * unit(random), 1.2 + 0.5 * unit(random)),
        goal(5 + 4 * unit(random), 4 + 3.5 * unit(random), 1.2 + 0.5 * unit(random));
    PlanStart start = moving(from, 0.5 * Vec3(unit(random), unit(random), unit(random)));
    start.command.a_W = 0.7 * Vec3(unit(random), unit(random), unit(random));
    const Plan p = plan(*world, start, goal, {.v_max = 1.5, .a_max = 2});
    EXPECT_NE(p.status, PlanStatus::deadline);
    if (p.status != PlanStatus::ok) continue;
    ++flown;
    EXPECT_LT(p.metrics.time_s, 10 + 4 * p.metrics.length_m);
  }
  EXPECT_GT(flown, 30);
}

// The searched pace is that of a cubic: a smoother curve need not take as long.
TEST(Refinement, TrajectoriesFromRestTakeAsLittleTimeAsTheLimitsAllow) {
  const double v_max = 1.5, a_max = 1.5;
  for (const Vec3& goal : {Vec3(2, 0, 1.2), Vec3(1, 1.2, 1.6), Vec3(-0.5, 0.3, 1.2), Vec3(-1.2, -0.8, 1.0)}) {
    const Plan p = plan(open_world(), moving({-1.5, 0, 1.2}, Vec3::Zero()), goal, {.v_max = v_max, .a_max = a_max});
    ASSERT_EQ(p.status, PlanStatus::ok);
    EXPECT_GT(nearest_approach(open_world(), p.tube).clearance, 0);
    double used = 0;
    for (double t = 0; t <= p.trajectory.duration(); t += 0.005) {
      const double v = p.trajectory.derivative(t, 1).cwiseAbs().maxCoeff() / v_max;
      const double a = p.trajectory.derivative(t, 2).cwiseAbs().maxCoeff() / a_max;
      used = std::max({used, v, a});
    }
    EXPECT_LE(used, 1 + 1e-6);
    EXPECT_GT(used, 0.97);
  }
}

// Of 900 pairs in three scenes the one whose tube touches, by 0.7 mm, at the pace that the limits alone would let it
// have.
TEST(Refinement, WhatIsMadeQuickerIsStillClear) {
  const auto world =
      build_world(map::builtin_scene("apartment", 0.1).value(), config::load_model("builtin:quad-5in").value(),
                  config::load_vehicle("builtin:quad-5in").value());
  const Plan p = plan(*world, moving({7.75, 3.15, 0.45}, Vec3::Zero()), {8.05, 3.95, 1.85}, {.v_max = 1.5, .a_max = 2});
  ASSERT_EQ(p.status, PlanStatus::ok) << p.message;
  EXPECT_GT(tube_clearance(*world, p.tube), 0);
}

TEST(Refinement, EndsAtItsDeadlineAndSaysSo) {
  const PlanStart start = moving({-2, 0, 1.2}, Vec3::Zero());
  const Vec3 goal(2, 0.4, 1.2);
  const PlanOptions options{.v_max = 1.5, .a_max = 2};
  const World& world = open_world();
  const SafeView view(world.safe, {world.grid.index(start.command.p_W), world.grid.index(goal)});
  const auto path = search(view, start.estimated, goal, {1.35, 1.8, options.max_nodes, Clock::time_point::max()});
  ASSERT_TRUE(path);
  const Refinement late = refine(world, path->motions, start, goal, options, Clock::now());
  EXPECT_TRUE(late.out_of_time);
  EXPECT_FALSE(late.found);
  EXPECT_TRUE(refine(world, path->motions, start, goal, options, Clock::time_point::max()).found);
}

}  // namespace
}  // namespace backwash::plan
