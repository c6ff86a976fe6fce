// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/rest.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/plan/search/ends.hpp"
#include "core/plan/stop.hpp"
#include "core/plan/verified_stops.hpp"
#include "core/reach/rest.hpp"
#include "core/types/minimum_jerk.hpp"
#include "tests/plan/drawn.hpp"

namespace backwash::plan {
namespace {

struct Gains {
  const char* name;
  double kp, kd, lag;
};
/// From PX4's own default gains, whose loop takes 5 s to settle, to a stiff one.
constexpr Gains kLoops[] = {{"PX4's defaults", 1.71, 1.8, 0.05},
                            {"slow", 1.0, 2.5, 0.0},
                            {"quad-5in", 10, 5.5, 0.05},
                            {"ringing", 6, 1.2, 0.0}};

Vehicle vehicle_of(const Gains& gains) {
  Vehicle v = config::load_vehicle("builtin:quad-5in").value();
  v.controller.kp = {gains.kp, gains.kp};
  v.controller.kd = {gains.kd, gains.kd};
  v.controller.attitude_lag = gains.lag;
  return v;
}

/// A room of 5 x 5 x 2.5 m with some boxes in it.
std::shared_ptr<const World> drawn_room(std::mt19937& random, const Vehicle& vehicle) {
  map::OccupancyGrid grid({-0.1, -0.1, -0.1}, 0.1, {52, 52, 27}, map::Cell::occupied);
  fill(grid, {0, 0, 0}, {5, 5, 2.5}, map::Cell::free);
  for (int n = 0; n < 3; ++n) {
    const Vec3 at = Vec3(2.5, 2.5, 1) + random_vector(random, 2);
    fill(grid, (at - Vec3(0.2, 0.2, 1)).cwiseMax(0), (at + Vec3(0.2, 0.2, 1)).cwiseMin(Vec3(5, 5, 2.5)),
         map::Cell::occupied);
  }
  Model model = config::load_model("builtin:quad-5in").value();
  model.ground.l_max = model.ground.l_footprint_max = model.corner.l_max = model.wall.l_max = 0.6;  // builds fast
  return build_world(std::move(grid), model, vehicle);
}

/// Flights straight on from drawn places at 1 m/s.
template <typename Each>
void draw_flights(const World& world, std::mt19937& random, const Each& each) {
  for (int n = 0; n < 150; ++n) {
    const Vec3 from = Vec3(2.5, 2.5, 1.2) + random_vector(random, 1).cwiseProduct(Vec3(2, 2, 0.6));
    Vec3 way = random_vector(random, 1).cwiseProduct(Vec3(1, 1, 0.2));
    way = 2 * way.normalized();
    std::vector<Setpoint> commands = rest_to_rest(from, from + way, 1.0, 2.0);
    if (may_rest_at(world, from, 0)) each(commands);
  }
}

TEST(Rest, EveryVerifiedStopRestsWhereHoveringIsClearForEachLoop) {
  std::mt19937 random(48);
  for (const Gains& gains : kLoops) {
    const auto world = drawn_room(random, vehicle_of(gains));
    std::size_t stops = 0;
    draw_flights(*world, random, [&](const std::vector<Setpoint>& commands) {
      const State start{commands.front().p_W, Vec3::Zero()};
      const auto clearance = [&](const reach::ReachTube& tube) { return tube_clearance(*world, tube); };
      for (const Stop& s : verified_stops(*world, start, commands.front(), commands, 0, 10, clearance)) {
        ++stops;
        const Vec3& p = s.commands.back().p_W;
        const auto hover = reach::hover_set(world->reach, world->grid, world->distance, world->bounds, p);
        EXPECT_TRUE(hover.safe()) << gains.name << ": rests at " << p.transpose() << ", " << hover.clearance << " m";
      }
    });
    EXPECT_GT(stops, 50u) << gains.name;
  }
}

// Judged by sweeping on: no set of the next 30 s is wider than the one that is to hold for ever, and one comes near it.
TEST(Rest, TheLastSetOfATubeHoldsForEver) {
  std::mt19937 random(49);
  for (const Gains& gains : kLoops) {
    const auto world = drawn_room(random, vehicle_of(gains));
    std::size_t judged = 0;
    double nearest = 0;
    draw_flights(*world, random, [&](std::vector<Setpoint> commands) {
      const State start{commands.front().p_W, Vec3::Zero()};
      const Setpoint first = commands.front();
      commands = stop_along(commands, std::min<std::size_t>(40, commands.size() - 1), 2.0);
      hold_until_settled(world->reach, commands);
      const auto last = tube_to_rest(*world, start, first, commands).back();
      if (!(tube_clearance(*world, {last}) > 0)) return;
      ++judged;
      const std::size_t end = commands.size();
      commands.resize(end + 1500, commands.back());
      const auto on = reach::tube_over_field(world->reach, start, first, commands, world->bounds);
      for (std::size_t k = end; k < on.size(); ++k)
        for (std::size_t d = 0; d < kDirections; ++d) {
          const double off = std::abs(unit(static_cast<Direction>(d)).dot(on[k].center.p_W - last.center.p_W));
          ASSERT_LE(on[k].half_widths[d] + off, last.half_widths[d] + 1e-9) << gains.name << " at " << k;
          nearest = std::max(nearest, on[k].half_widths[d] / last.half_widths[d]);
        }
    });
    EXPECT_GT(judged, 5u) << gains.name;
    EXPECT_GT(nearest, 0.97) << gains.name;
  }
}

// As far as a loop of any gains remembers, and no farther.
TEST(Rest, IsHeldUntilTheLoopHasSettled) {
  std::vector<std::size_t> held;
  for (const Gains& gains : kLoops) {
    const reach::Reachability reach(vehicle_of(gains));
    std::vector<Setpoint> commands(3);
    commands.front().p_W.x() = 1;
    commands.front().yaw = 2;
    hold_until_settled(reach, commands);
    held.push_back(commands.size() - 1);
    EXPECT_EQ(held.back(), std::max<std::size_t>(2, reach::settling_periods(reach)));
    const auto left = [&](std::size_t from) {  // of a hover set that grows from nothing
      const std::vector<double>& P = reach.horizontal.P;
      return 1 - P[std::min(P.size() - 1, from * reach::AxisResponse::kPhases)] / reach.horizontal.h_inf;
    };
    EXPECT_LE(left(held.back()), 0.02 + 1e-6) << gains.name;
    EXPECT_GT(left(held.back() - 2), 0.02 * 0.8) << gains.name;
    const auto once = commands;
    hold_until_settled(reach, commands);
    EXPECT_EQ(commands.size(), once.size()) << "what rests already counts";
  }
  EXPECT_GT(held[0] * kControlPeriod, 3.5);
  EXPECT_LT(held[2] * kControlPeriod, 2.0);
}

}  // namespace
}  // namespace backwash::plan
