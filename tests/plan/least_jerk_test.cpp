// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/least_jerk.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "core/plan/planner.hpp"
#include "tests/plan/drawn.hpp"

namespace backwash::plan {
namespace {

using map::Cell;
using map::OccupancyGrid;

/// Room of 6 × 3 × 2 m with a block that leaves 1.7 m, or none.
const World& room(bool block, std::optional<double> margin = std::nullopt) {
  const auto build = [](bool with_block, std::optional<double> ball) {
    OccupancyGrid grid({0, 0, 0}, 0.1, {60, 30, 20}, Cell::free);
    for (int i = 25; i < 32 && with_block; ++i)
      for (int j = 0; j < 13; ++j)
        for (int k = 0; k < 20; ++k) grid.set({i, j, k}, Cell::occupied);
    Model model;
    model.ground.l_max = model.ground.l_footprint_max = model.corner.l_max = model.wall.l_max = 0.8;
    model.wall.k1 = {1.0, 0.4, 0.4};
    return build_world(grid, model, test_vehicle(), reach::Method::tight, ball);
  };
  static const auto empty = build(false, std::nullopt), sets = build(true, std::nullopt), ball = build(true, 0.15);
  return !block ? *empty : margin ? *ball : *sets;
}

BSpline wavy(unsigned seed, double y, const Vec3& v_start = {0.2, 0, 0}) {
  std::mt19937 random(seed);
  std::vector<Vec3> samples;
  for (int i = 0; i <= 14; ++i) samples.push_back(Vec3(1 + 4.0 * i / 14, y, 1) + random_vector(random, 0.05));
  return fit(samples, 0.25, v_start, Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
}

/// About the block, from 1.5 m before it to 1.8 m behind it.
BSpline around(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Vec3> samples;
  for (int i = 0; i <= 14; ++i)
    samples.push_back(Vec3(1 + 4.0 * i / 14, 0.8 + 1.4 * std::pow(std::sin(M_PI * i / 14), 2), 1) +
                      random_vector(random, 0.02));
  return fit(samples, 0.25, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
}

const MotionLimits kWide{Vec3::Constant(100), Vec3::Constant(100)};

reach::ReachTube tube_of(const World& world, const BSpline& s) {
  auto commands = s.commands();
  commands.insert(commands.end(), 50, Setpoint(commands.back()));
  return reach::tube_over_field(world.reach, {s.at(0).p_W, s.at(0).v_W}, s.at(0), commands, world.bounds);
}

double jerk(const BSpline& s) { return s.jerk2(); }

// Without a bound the least of a quadratic form: its normal equations, written with dense matrices, one axis at a time.
TEST(LeastJerk, IsTheSolutionOfTheNormalEquationsWhereNothingBinds) {
  const BSpline begun = wavy(1, 1.5);
  const auto& q = begun.control_points;
  const auto n = static_cast<Eigen::Index>(q.size());
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(n - 3, n);
  for (Eigen::Index i = 0; i < n - 3; ++i) D.block<1, 4>(i, i) << -1, 3, -3, 1;
  const BSpline found = least_jerk(room(false), begun, nullptr, 0, kWide).curve;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd fixed = Eigen::VectorXd::Zero(n);
    for (const Eigen::Index i : {0, 1, 2}) {
      fixed[i] = q[static_cast<std::size_t>(i)][axis];
      fixed[n - 1 - i] = q[static_cast<std::size_t>(n - 1 - i)][axis];
    }
    const Eigen::VectorXd least = D.middleCols(3, n - 6).colPivHouseholderQr().solve(-D * fixed);
    for (Eigen::Index i = 0; i < n - 6; ++i)
      EXPECT_NEAR(found.control_points[static_cast<std::size_t>(i) + 3][axis], least[i], 1e-6);
  }
}

// ∫‖p⃛‖² dt from rest to rest over d in T is at least 720 d²/T⁵, the quintic's; 14 spans leave 3 % of it.
TEST(LeastJerk, IsTheQuinticBetweenTwoPlacesOfRest) {
  const BSpline found = least_jerk(room(false), wavy(2, 1.5, Vec3::Zero()), nullptr, 0, kWide).curve;
  const double d = (found.at(found.duration()).p_W - found.at(0).p_W).norm();
  const double quintic = 720 * d * d / std::pow(found.duration(), 5);
  EXPECT_GE(jerk(found), quintic * (1 - 1e-9));
  EXPECT_LE(jerk(found), 1.03 * quintic);
}

TEST(LeastJerk, KeepsItsEndsAndItsLimits) {
  const BSpline begun = around(3);
  for (const auto& [v_max, a_max] : {std::pair(1.7, 9.0), std::pair(9.0, 1.75)}) {
    const MotionLimits limits{Vec3::Constant(v_max), Vec3::Constant(a_max)};
    const BSpline found = least_jerk(room(true), begun, nullptr, 0.02, limits).curve;
    EXPECT_EQ(found.knot_span, begun.knot_span);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(found.control_points[i], begun.control_points[i]);
      EXPECT_EQ(*(found.control_points.end() - 1 - static_cast<std::ptrdiff_t>(i)),
                *(begun.control_points.end() - 1 - static_cast<std::ptrdiff_t>(i)));
    }
    const auto worst = [v = v_max, a = a_max](const BSpline& s) {
      double most = 0;
      for (double t = 0; t < s.duration(); t += 0.01)
        most = std::max(
            {most, s.derivative(t, 1).cwiseAbs().maxCoeff() / v, s.derivative(t, 2).cwiseAbs().maxCoeff() / a});
      return most;
    };
    EXPECT_GT(worst(least_jerk(room(true), begun, nullptr, 0.02, kWide).curve), 1.1);  // without them it would not
    EXPECT_LT(worst(found), 1.03);
  }
}

// A vehicle that flies 5 cm beside its command keeps as much: the half-spaces are of the sets' places.
TEST(LeastJerk, KeepsTheMarginOfSetsBesideTheirCommands) {
  const World& world = room(true);
  const auto beside = [&](const BSpline& s) {
    auto tube = tube_of(world, s);
    for (auto& step : tube) step.center.p_W.y() -= 0.05;
    return tube;
  };
  const BSpline first = least_jerk(world, around(6), nullptr, 0.1, kWide).curve;
  const auto tube = beside(first);
  const Flown flown{first, tube};
  EXPECT_NEAR(tube_clearance(world, beside(least_jerk(world, first, &flown, 0.1, kWide).curve)), 0.1, 0.02);
}

// What keeps its margin by the sets of hovering keeps it, to millimetres, by those of the flight; what asks for more
// gets more; and no other curve near it that keeps as much has less jerk.
TEST(LeastJerk, LeavesTheMarginThatIsAskedAndNoMoreJerkThanThatCosts) {
  for (const auto& margin : {std::optional<double>(), std::optional(0.15)}) {
    const World& world = room(true, margin);
    double before = 0;
    for (const double asked : {0.02, 0.1, 0.2}) {
      const BSpline first = least_jerk(world, around(4), nullptr, asked, kWide).curve;
      const auto tube = tube_of(world, first);
      const Flown flown{first, tube};
      const BSpline found = least_jerk(world, first, &flown, asked, kWide).curve;
      const double left = tube_clearance(world, tube_of(world, found));
      EXPECT_NEAR(left, asked, 0.02);
      EXPECT_GT(jerk(found), before);
      before = jerk(found);
      std::mt19937 random(5);
      for (int draw = 0; draw < 50; ++draw) {
        BSpline other = found;
        for (std::size_t i = 3; i + 3 < other.control_points.size(); ++i)
          other.control_points[i] += random_vector(random, 0.004);
        if (tube_clearance(world, tube_of(world, other)) < left) continue;
        EXPECT_GT(jerk(other), 0.995 * jerk(found));
      }
    }
  }
}

TEST(LeastJerk, MovesATubeOffTheObstacleThatItTouches) {
  const World& world = room(true);
  const BSpline begun = wavy(7, 1.58);
  const auto tube = tube_of(world, begun);
  ASSERT_LT(tube_clearance(world, tube), 0);
  const Flown flown{begun, tube};
  EXPECT_GT(tube_clearance(world, tube_of(world, least_jerk(world, begun, &flown, 0.05, kWide).curve)), 0);
}

// The ball about a set's x, y and z holds it, so that more is kept.
TEST(LeastJerk, KeepsMoreByTheBallThanByThePrism) {
  const World& world = room(true);
  const BSpline begun = around(8);
  EXPECT_GT(jerk(least_jerk(world, begun, nullptr, 0.1, kWide, true).curve),
            1.01 * jerk(least_jerk(world, begun, nullptr, 0.1, kWide).curve));
}

}  // namespace
}  // namespace backwash::plan
