// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "core/field/proximity_model.hpp"
#include "core/reach/reach_tube.hpp"
#include "tests/reach/axis_rollouts.hpp"
#include "tests/support/rounded_up.hpp"

namespace backwash::reach {
namespace {

Vehicle quad() {
  Vehicle vehicle;
  vehicle.controller.kp = {10, 12};
  vehicle.controller.kd = {5.5, 6};
  vehicle.controller.latency = 0.02;
  vehicle.controller.attitude_lag = 0.05;
  vehicle.initial_error.position = 0.02;
  vehicle.initial_error.velocity = 0.05;
  return vehicle;
}

// From one point to another at constant speed, then held.
std::vector<Setpoint> straight(const Vec3& from, const Vec3& to, double speed, std::size_t count) {
  std::vector<Setpoint> commands;
  const double length = (to - from).norm();
  const Vec3 n = (to - from) / length;
  for (std::size_t k = 0; k < count; ++k) {
    const double s = speed * kControlPeriod * static_cast<double>(k);
    commands.push_back(s < length ? Setpoint{from + s * n, speed * n, Vec3::Zero(), 0} : Setpoint{to});
  }
  return commands;
}

// A corridor of 1.2 m between walls that face y, with Σ at every free voxel; the variance rises towards the walls.
struct Corridor {
  Corridor() : grid(Vec3(0, -1, 0), 0.1, Index3(30, 20, 20), map::Cell::free), field(stored()) {}
  map::OccupancyGrid grid;
  field::DisturbanceField field;

 private:
  field::DisturbanceField stored() {
    std::vector<std::size_t> voxels;
    for (std::size_t n = 0; n < grid.cell_count(); ++n) {
      const Index3 v = grid.voxel(n);
      if (v.z() == 0 || v.y() < 4 || v.y() > 15)
        grid.set(v, map::Cell::occupied);
      else
        voxels.push_back(n);
    }
    field::DisturbanceField result(grid, voxels);
    result.fill(field::ProximityField(grid, Model{}), voxels);
    return result;
  }
};

TEST(ReachTube, HasOneEntryMoreThanCommandsEachTwentyMillisecondsApart) {
  const auto commands = straight(Vec3(0, 0, 1), Vec3(1, 0, 1), 1, 40);
  std::vector<DisturbanceBound> bounds(40);
  for (std::size_t k = 0; k < 40; ++k) bounds[k].w.fill(0.1 * static_cast<double>(k));
  for (const Method method : {Method::tight, Method::paper}) {
    const Reachability reach(quad(), method);
    const State start{commands[0].p_W, commands[0].v_W};
    const ReachTube tube = tube_with_bounds(reach, start, commands[0], commands, bounds);
    ASSERT_EQ(tube.size(), 41u);
    CentrePredictor predictor(quad(), Loop::vehicle, start, commands[0].a_W, commands[0]);
    for (std::size_t k = 0; k < tube.size(); ++k) {
      EXPECT_NEAR(tube[k].t, 0.02 * static_cast<double>(k), 1e-12);
      EXPECT_EQ(tube[k].w_bar.w, bounds[std::min<std::size_t>(k, 39)].w);
      EXPECT_LT((tube[k].center.p_W - predictor.state().p_W).norm(), 1e-14);
      if (k < 40) predictor.step(commands[k]);
      for (std::size_t d = 0; d < kDirections; ++d) {
        EXPECT_GE(tube[k].half_widths_interval[d], tube[k].half_widths[d]);
        if (k < 40) {
          EXPECT_GE(tube[k].half_widths_interval[d], tube[k + 1].half_widths[d]);
        }
      }
      const PerDirection& h = tube[k].half_widths;
      if (method == Method::tight) {
        EXPECT_NEAR(tube[k].r_max, std::sqrt(h[kX] * h[kX] + h[kY] * h[kY] + h[kZ] * h[kZ]), 1e-15);
        EXPECT_EQ(tube[k].shape, Mat3::Zero());
      } else {
        EXPECT_NEAR(h[kX] * h[kX], tube[k].shape(0, 0), 1e-15);
        EXPECT_NEAR(h[kXyPlus] * h[kXyPlus], (tube[k].shape(0, 0) + tube[k].shape(1, 1)) / 2, 1e-15);
        EXPECT_NEAR(tube[k].r_max, std::max({h[kX], h[kY], h[kZ]}), 1e-15);
      }
    }
    EXPECT_NEAR(tube[0].half_widths[kX], 0.02, 1e-15);
  }
  EXPECT_EQ(tube_with_bounds(Reachability(quad()), {}, {}, {}, {}).size(), 1u);
  EXPECT_THROW(tube_with_bounds(Reachability(quad()), {}, {}, commands, {}), std::invalid_argument);
}

// The start's acceleration is what the controller commands there, so that an offset start keeps the sets' assumption of
// no error of the acceleration: under a steady push w at rest at w/k_p the motion stays inside the tube at once.
TEST(ReachTube, ContainsAVehicleThatASteadyPushHoldsOffItsSetPoint) {
  Vehicle vehicle = quad();
  vehicle.initial_error.position = vehicle.initial_error.velocity = 0;
  const double w = 1.5, offset = w / vehicle.controller.kp.horizontal;
  std::vector<DisturbanceBound> bounds(100);
  for (DisturbanceBound& b : bounds) b.w.fill(w);
  const std::vector<Setpoint> commands(100);
  const ReachTube tube =
      tube_with_bounds(Reachability(vehicle), {Vec3(offset, 0, 0), Vec3::Zero()}, {}, commands, bounds);
  for (const TubeStep& step : tube)
    EXPECT_LE(std::abs(offset - step.center.p_W.x()), step.half_widths[kX] * (1 + 1e-6) + 1e-12) << step.t;
}

TEST(ReachTube, PaperIntervalContainsRolloutsBetweenSamples) {
  constexpr double h = 2e-3;
  Vehicle vehicle = quad();
  vehicle.controller.latency = 0;
  const Reachability reach(vehicle, Method::paper, Loop::continuous);
  std::vector<DisturbanceBound> bounds(80);
  for (std::size_t k = 0; k < bounds.size(); ++k) bounds[k].w = {k % 30 < 15 ? 2.0 : 0.0, 0, 0, 0, 0};
  const std::vector<Setpoint> commands(80);
  const ReachTube tube = tube_with_bounds(reach, {}, {}, commands, bounds);
  // Pushes that end at every 2 ms: the worst for one channel.
  for (int until = 10; until < 800; until += 7) {
    AxisRollouts push({10, 5.5, 0, 0}, false, h, Eigen::ArrayXd{{0.0}}, Eigen::ArrayXd{{0.0}});
    std::vector<double> integral{0};  // of g, at every 2 ms
    for (int i = 0; i < until; ++i) {
      push.step(Eigen::ArrayXd{{1.0}});
      integral.push_back(push.p()[0]);
    }
    AxisRollouts e({10, 5.5, 0, 0}, false, h, Eigen::ArrayXd{{0.02}}, Eigen::ArrayXd{{0.0}});
    for (int i = 0; i < 800; ++i) {
      ASSERT_LE(std::abs(e.p()[0]), tube[static_cast<std::size_t>(i / 10)].half_widths_interval[kX] * (1 + 1e-9));
      const bool rising = i >= until || integral[static_cast<std::size_t>(until - i)] >=
                                            integral[static_cast<std::size_t>(until - i - 1)];
      e.step(Eigen::ArrayXd{{(rising ? 1 : -1) * bounds[static_cast<std::size_t>(i / 10)].w[kX]}});
    }
  }
  // And is no looser than the larger end by more than a millimetre.
  for (std::size_t k = 0; k + 1 < tube.size(); ++k)
    EXPECT_LE(tube[k].half_widths_interval[kX], std::max(tube[k].half_widths[kX], tube[k + 1].half_widths[kX]) + 1e-3);
}

// The vehicle already has the acceleration that its controller commands for where it is and how fast it moves.
TEST(ReachTube, CentreStartsWithTheAccelerationThatTheErrorOfTheStartCommands) {
  constexpr double h = 2e-3;
  Vehicle vehicle = quad();
  vehicle.controller.latency = vehicle.controller.feedback_delay = 0;
  const Vec3 at(1, 2, 1.5), p(0.2, -0.1, 0.15), v(-0.4, 0.3, 0.5);
  const std::vector<Setpoint> commands(60, Setpoint{at});
  const ReachTube tube = tube_with_bounds(Reachability(vehicle, Method::tight, Loop::vehicle), {at + p, v}, commands[0],
                                          commands, std::vector<DisturbanceBound>(60));
  for (const int axis : {0, 1, 2}) {
    const double kp = axis == 2 ? 12 : 10, kd = axis == 2 ? 6 : 5.5;
    AxisRollouts error({kp, kd, 0, 0.05}, false, h, Eigen::ArrayXd{{p[axis]}}, Eigen::ArrayXd{{v[axis]}},
                       Eigen::ArrayXd{{-kp * p[axis] - kd * v[axis]}});
    for (std::size_t k = 0; k < tube.size(); ++k) {
      ASSERT_NEAR(tube[k].center.p_W[axis], at[axis] + error.p()[0], 1e-7) << axis << " step " << k;
      for (int i = 0; i < 10; ++i) error.step(Eigen::ArrayXd{{0.0}});
    }
  }
}

// An error that turns back between two samples is larger there than at both.
TEST(ReachTube, PaperIntervalHoldsTheTurnOfAnErrorBetweenTwoSamples) {
  constexpr double h = 5e-4;
  int turns_between = 0;
  for (double kp = 6; kp < 16; kp += 0.5) {
    Vehicle vehicle = quad();
    vehicle.controller.kp = {kp, kp};
    vehicle.initial_error = {1e-4, 0.5};
    const std::vector<Setpoint> commands(40);
    const ReachTube tube = tube_with_bounds(Reachability(vehicle, Method::paper, Loop::continuous), {}, {}, commands,
                                            std::vector<DisturbanceBound>(40));
    AxisRollouts e({kp, 5.5, 0, 0}, false, h, Eigen::ArrayXd{{1e-4, 0}}, Eigen::ArrayXd{{0, 0.5}});
    for (std::size_t k = 0; k < 40; ++k) {
      double largest = 0;
      for (int i = 0; i <= 40; ++i) {
        largest = std::max(largest, e.p().matrix().norm());  // the support of the ellipse of first errors
        if (i < 40) e.step(Eigen::ArrayXd{{0, 0}});
      }
      ASSERT_LE(largest, tube[k].half_widths_interval[kX]) << kp << " step " << k;
      turns_between += largest > std::max(tube[k].half_widths[kX], tube[k + 1].half_widths[kX]);
    }
  }
  EXPECT_GT(turns_between, 5);
}

TEST(ReachTube, PaperSetsIgnoreLagAndDelayAndContainTheExactOnesOfTheSecondOrderLoop) {
  Vehicle vehicle = quad();
  vehicle.controller.feedback_delay = 0.03;
  std::vector<DisturbanceBound> bounds(150);
  for (DisturbanceBound& b : bounds) b.w = {1, 0.6, 0.8, 1, 1};
  const std::vector<Setpoint> commands(150);
  const auto tube_of = [&](Method method, Loop loop) {
    return tube_with_bounds(Reachability(vehicle, method, loop), {}, {}, commands, bounds);
  };
  const ReachTube paper = tube_of(Method::paper, Loop::vehicle), same = tube_of(Method::paper, Loop::continuous);
  const ReachTube exact = tube_of(Method::tight, Loop::continuous);
  for (std::size_t k = 0; k < paper.size(); ++k) {
    EXPECT_EQ(paper[k].half_widths, same[k].half_widths);
    for (const Direction d : {kX, kY, kZ}) {
      EXPECT_GE(paper[k].half_widths[d], exact[k].half_widths[d] * (1 - 1e-9));
    }
  }
}

TEST(ReachTube, BoundOfEachStepIsTheMaximumOverTheVoxelsThatItsOwnSetMeets) {
  const Corridor corridor;
  const BoundField bounds(corridor.grid, corridor.field, BoundModel{});
  const auto commands = straight(Vec3(0.5, -0.2, 0.8), Vec3(2.5, 0.25, 1.2), 1.2, 120);
  for (const Method method : {Method::tight, Method::paper}) {
    const Reachability reach(quad(), method);
    const ReachTube tube = tube_over_field(reach, {commands[0].p_W, commands[0].v_W}, commands[0], commands, bounds);
    ASSERT_EQ(tube.size(), commands.size() + 1);
    double least = 1e9, most = 0;
    for (std::size_t k = 0; k < commands.size(); ++k) {
      const PerDirection& h = tube[k].half_widths_interval;
      const Vec3 reach_of_set(h[kX], h[kY], h[kZ]);
      const Vec3 a = tube[k].center.p_W, b = tube[k + 1].center.p_W;
      const Vec3 low = a.cwiseMin(b) - reach_of_set, high = a.cwiseMax(b) + reach_of_set;
      PerDirection maximum{};
      for (std::size_t n = 0; n < corridor.grid.cell_count(); ++n) {
        const Vec3 center = corridor.grid.center(corridor.grid.voxel(n));
        if (!corridor.field.has(corridor.grid.voxel(n))) continue;
        if (((center.array() + 0.05) < low.array()).any() || ((center.array() - 0.05) > high.array()).any()) continue;
        const DisturbanceBound w = bound(corridor.field.at(corridor.grid.voxel(n)), BoundModel{});
        for (std::size_t d = 0; d < kDirections; ++d) maximum[d] = std::max(maximum[d], w.w[d]);
      }
      for (std::size_t d = 0; d < kDirections; ++d)
        EXPECT_NEAR(tube[k].w_bar.w[d], rounded_up(maximum[d]), 1e-6) << k << " " << d;
      least = std::min(least, maximum[kY]);
      most = std::max(most, maximum[kY]);
    }
    EXPECT_GT(most, 1.1 * least);  // the field does vary along the way
    // The same sets as with these bounds given.
    std::vector<DisturbanceBound> given;
    for (std::size_t k = 0; k < commands.size(); ++k) given.push_back(tube[k].w_bar);
    const ReachTube again = tube_with_bounds(reach, {commands[0].p_W, commands[0].v_W}, commands[0], commands, given);
    for (std::size_t k = 0; k < tube.size(); ++k) EXPECT_EQ(tube[k].half_widths, again[k].half_widths);
  }
}

// Where a step's bound lets its own set reach much stronger wash, a few rounds do not settle it: the result must still
// cover the set it leads to, up to the whole field.
TEST(ReachTube, BoundCoversItsOwnSetWhereTheFieldRunsAway) {
  map::OccupancyGrid grid(Vec3::Zero(), 0.02, Index3(100, 3, 3), map::Cell::free);
  for (int y = 0; y < 3; ++y)
    for (int z = 0; z < 3; ++z) grid.set({99, y, z}, map::Cell::occupied);
  Model model;
  model.wall.k1 = {3e8, 3e8, 3e8};
  model.wall.l_max = 3;
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < grid.cell_count(); ++n)
    if (grid.at(n) == map::Cell::free) voxels.push_back(n);
  field::DisturbanceField field(grid, voxels);
  field.fill(field::ProximityField(grid, model), voxels);
  const std::vector<Setpoint> commands(3, Setpoint{Vec3(0.05, 0.03, 0.03)});
  bool settled = false, ran_away = false;
  for (double kappa = 1; kappa < 400; kappa *= 1.2) {
    const BoundField bounds(grid, field, BoundModel{kappa, 0, 0, 0.15});
    const ReachTube tube =
        tube_over_field(Reachability(quad()), {commands[0].p_W, Vec3::Zero()}, commands[0], commands, bounds);
    for (std::size_t k = 0; k < commands.size(); ++k) {
      const PerDirection& h = tube[k].half_widths_interval;
      const Vec3 p = tube[k].center.p_W, reach(h[kX], h[kY], h[kZ]);
      const DisturbanceBound met = bounds.max_over(p - reach, p + reach);
      for (std::size_t d = 0; d < kDirections; ++d) EXPECT_GE(tube[k].w_bar.w[d], met.w[d]) << kappa;
    }
    const double greatest = bounds.max_over(Vec3::Constant(-1), Vec3::Constant(3)).w[kX];
    (tube[0].w_bar.w[kX] == greatest ? ran_away : settled) = true;
  }
  EXPECT_TRUE(settled && ran_away);
}

}  // namespace
}  // namespace backwash::reach
