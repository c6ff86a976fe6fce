// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/risk.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "core/reach/response/coloured_error.hpp"
#include "tests/reach/axis_rollouts.hpp"

namespace backwash::reach {
namespace {

constexpr double kBody = 0.1;  // m

/// Free but for what lies at x < 0 and, with `other`, at x > other.
map::OccupancyGrid beside_a_wall(double other = 5) {
  map::OccupancyGrid grid({-0.5, -4, -4}, 0.1, {60, 80, 80}, map::Cell::occupied);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const double x = grid.center(grid.voxel(n)).x();
    if (x > 0 && x < other) grid.set(grid.voxel(n), map::Cell::free);
  }
  return grid;
}

Vehicle with(const AxisLoop& axis) {
  Vehicle vehicle;
  vehicle.body.radius = kBody;
  vehicle.controller.kp = {axis.kp, axis.kp};
  vehicle.controller.kd = {axis.kd, axis.kd};
  vehicle.controller.attitude_lag = axis.attitude_lag;
  vehicle.controller.feedback_delay = axis.feedback_delay;
  vehicle.limits = {1.5, 2};
  return vehicle;
}

/// The centre x(t) from the wall, and the deviation s(t) of the disturbance, per entry.
struct Motion {
  std::vector<double> x, s;
  ReachTube tube() const {
    ReachTube tube;
    for (std::size_t k = 0; k < x.size(); ++k) {
      DisturbanceBound w;
      w.w.fill(s[k]);
      tube.push_back(
          {static_cast<double>(k) * kControlPeriod, {Vec3(x[k], 0, 0), Vec3::Zero()}, w, {}, {}, Mat3::Zero(), 0});
    }
    return tube;
  }
};

double stated(const AxisLoop& axis, double tau_w, const Motion& motion, const map::OccupancyGrid& grid) {
  return risk_of_touching(Reachability(with(axis)), grid, map::DistanceField(grid), BoundModel{1, 0, 0, tau_w},
                          motion.tube())
      .total;
}

/// Oracle: the share of many errors, by Runge–Kutta, that come to the wall.
double flown(const AxisLoop& axis, double tau_w, const Motion& motion, Eigen::Index flights, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::ArrayXd::NullaryExpr(flights, [&] { return normal(random); }).eval(); };
  const double keep = std::exp(-kRolloutStep / tau_w);
  AxisRollouts error(axis, false, kRolloutStep, Eigen::ArrayXd::Zero(flights), Eigen::ArrayXd::Zero(flights));
  Eigen::ArrayXd xi = draw();
  Eigen::Array<bool, Eigen::Dynamic, 1> touched = Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(flights, false);
  for (std::size_t k = 0; k < motion.x.size(); ++k)
    for (int i = 0; i < kRolloutSteps; ++i) {
      const double to_next = static_cast<double>(i) / kRolloutSteps;
      const double x = motion.x[k] + to_next * (motion.x[std::min(k + 1, motion.x.size() - 1)] - motion.x[k]);
      touched = touched || (error.p() + x <= kBody);
      error.step(motion.s[k] * xi);
      xi = keep * xi + std::sqrt(1 - keep * keep) * draw();
    }
  return static_cast<double>(touched.count()) / static_cast<double>(flights);
}

/// σ_e for s = 1 at rest, and how fast it turns.
std::pair<double, double> steady(const AxisLoop& axis, double tau_w) {
  const ColouredStep step(axis, tau_w);
  ErrorCovariance error(step);
  for (int i = 0; i < 400 * 30; ++i) error.advance(1);
  return {error.position_deviation(), error.turn_rate()};
}

TEST(RiskOfTouching, IsHeldByFlightsOfTheLoopsOwnEquationsAndNotTenTimesTooLarge) {
  const auto grid = beside_a_wall();
  std::mt19937_64 random(11);
  const auto any = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  double over = 0, under = 1e9;
  for (int trial = 0; trial < 50; ++trial) {
    const double kp = any(1.5, 16), kd = any(1.2, 2.4) * std::sqrt(kp);
    const AxisLoop axis{kp, kd, trial % 3 == 0 ? 0.02 : 0, trial % 2 == 0 ? any(0.01, 0.08) : 0};
    const double tau_w = any(0.05, 0.5), gust = trial % 2 == 0 ? any(0, 3) : 0, at = any(1, 4), wide = any(0.1, 1);
    const double sigma = steady(axis, tau_w).first, s = 0.05 / sigma, near = kBody + any(1.6, 2.8) * 0.05;
    const double away = trial % 3 == 1 ? 0 : any(0.1, 0.5), period = any(1, 4);  // there and back, or holding there
    Motion motion;
    for (int k = 0; k < 250; ++k) {
      const double t = k * kControlPeriod;
      motion.x.push_back(near + away * (1 - std::cos(2 * std::numbers::pi * t / period)) / 2);
      motion.s.push_back(s * (1 + gust * std::exp(-std::pow((t - at) / wide, 2))));
    }
    const double risk = stated(axis, tau_w, motion, grid), share = flown(axis, tau_w, motion, 2000, 100 + trial);
    const double least = 1 - std::exp(-risk);  // of touches that come one by one
    const double ratio = share / least;
    over = std::max(over, ratio);
    under = std::min(under, ratio);
    EXPECT_LE(share, least + 4 * std::sqrt(least / 2000)) << trial << ": stated " << risk;
    EXPECT_GE(share, 0.1 * least - 4 * std::sqrt(least / 2000)) << trial << ": stated " << risk;
  }
  std::printf("touched over stated: %.2f to %.2f\n", under, over);
}

TEST(RiskOfTouching, OfHoldingBesideAWallIsRicesRateHoweverManyVoxelsItHas) {
  const AxisLoop axis{6, 4, 0, 0.05};
  const auto [sigma, turn] = steady(axis, 0.15);
  for (const double level : {2.0, 3.0, 4.0}) {
    const double s = 0.1 / (level * sigma);
    const Motion motion{std::vector<double>(3000, kBody + 0.1), std::vector<double>(3000, s)};
    const double rate = turn / (2 * std::numbers::pi) * std::exp(-level * level / 2),
                 outside = std::erfc(level / std::numbers::sqrt2) / 2;
    EXPECT_NEAR(stated(axis, 0.15, motion, beside_a_wall()), 60 * rate + outside, 0.03 * 60 * rate);
    // One wall on each side counts twice.
    EXPECT_NEAR(stated(axis, 0.15, motion, beside_a_wall(2 * kBody + 0.2)), 2 * (60 * rate + outside),
                0.07 * 60 * rate);
  }
}

TEST(RiskOfTouching, OfOneObstacleIsNotLessBecauseAnotherRecedes) {
  const AxisLoop axis{6, 4, 0, 0.05};
  const double between = 2 * kBody + 0.4;
  Motion there, back;  // across, from near one wall to near the other
  for (int k = 0; k < 200; ++k) {
    const double along = std::clamp((k - 100) / 10.0, 0.0, 1.0);
    there.x.push_back(kBody + 0.1 + 0.2 * along);
    back.x.push_back(between - there.x.back());
    there.s.push_back(1.2);
    back.s.push_back(1.2);
  }
  const auto wall = beside_a_wall();
  EXPECT_NEAR(stated(axis, 0.15, there, beside_a_wall(between)),
              stated(axis, 0.15, there, wall) + stated(axis, 0.15, back, wall), 0.02);
}

TEST(RiskOfTouching, OfFlyingAlongAWallIsThatOfHoldingBesideIt) {
  const AxisLoop axis{6, 4, 0, 0.05};
  const auto [sigma, turn] = steady(axis, 0.15);
  const auto wall = beside_a_wall();
  Motion motion{std::vector<double>(100, kBody + 0.1), std::vector<double>(100, 0.1 / (3 * sigma))};
  const double held = stated(axis, 0.15, motion, wall);
  for (const double v : {0.5, 1.0, 1.5}) {
    ReachTube tube = motion.tube();
    for (std::size_t k = 0; k < tube.size(); ++k)
      tube[k].center.p_W.y() = v * (static_cast<double>(k) * kControlPeriod - 1);
    const double along =
        risk_of_touching(Reachability(with(axis)), wall, map::DistanceField(wall), {1, 0, 0, 0.15}, tube).total;
    EXPECT_NEAR(along, held, 0.1 * held) << v;
  }
}

// The error towards a pole turns as the vehicle goes round it: flown by Runge–Kutta, both axes.
TEST(RiskOfTouching, IsHeldWhereTheVehicleGoesRoundAPole) {
  map::OccupancyGrid grid({-3.05, -3.05, -3.05}, 0.1, {61, 61, 61}, map::Cell::free);
  for (int k = 0; k < 61; ++k) grid.set({30, 30, k}, map::Cell::occupied);
  const AxisLoop axis{1.71, 1.8, 0, 0};
  const double sigma = steady(axis, 0.15).first, s = 0.03 / sigma, radius = 0.05 + kBody + 0.2 + 2.5 * 0.03;
  Vehicle vehicle = with(axis);
  vehicle.body.radius = kBody + 0.2;
  ReachTube tube;
  DisturbanceBound w;
  w.w.fill(s);
  const auto angle = [&](double t) { return 2.0 * t / radius; };  // 2 m/s
  for (int k = 0; k < 150; ++k) {
    const double a = angle(k * kControlPeriod);
    tube.push_back(
        {k * kControlPeriod, {radius * Vec3(std::cos(a), std::sin(a), 0), Vec3::Zero()}, w, {}, {}, Mat3::Zero(), 0});
  }
  const double risk =
      risk_of_touching(Reachability(vehicle), grid, map::DistanceField(grid), {1, 0, 0, 0.15}, tube).total;
  constexpr Eigen::Index kFlights = 2000;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::ArrayXd::NullaryExpr(kFlights, [&] { return normal(random); }).eval(); };
  const Eigen::ArrayXd zero = Eigen::ArrayXd::Zero(kFlights);
  AxisRollouts ex(axis, false, kRolloutStep, zero, zero), ey(axis, false, kRolloutStep, zero, zero);
  Eigen::ArrayXd xi = draw(), eta = draw();
  Eigen::Array<bool, Eigen::Dynamic, 1> touched = Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(kFlights, false);
  const double keep = std::exp(-kRolloutStep / 0.15);
  for (int i = 0; i < 149 * kRolloutSteps; ++i) {
    const double a = angle(i * kRolloutStep);
    const Eigen::ArrayXd x = ((radius * std::cos(a) + ex.p()).abs() - 0.05).max(0),
                         y = ((radius * std::sin(a) + ey.p()).abs() - 0.05).max(0);
    touched = touched || ((x.square() + y.square()).sqrt() <= vehicle.body.radius);
    ex.step(s * xi);
    ey.step(s * eta);
    xi = keep * xi + std::sqrt(1 - keep * keep) * draw();
    eta = keep * eta + std::sqrt(1 - keep * keep) * draw();
  }
  const double share = static_cast<double>(touched.count()) / kFlights, least = 1 - std::exp(-risk);
  EXPECT_LE(share, least + 3 * std::sqrt(least / kFlights)) << risk;
  EXPECT_GE(share, 0.1 * least) << risk;
}

TEST(RiskOfTouching, IsNoLessThanEachDirectionsOwnAndInfiniteForWhatIsNoNumber) {
  const AxisLoop axis{6, 4, 0, 0};
  const auto grid = beside_a_wall();
  const map::DistanceField distance(grid);
  const Reachability reach(with(axis));
  Motion motion{std::vector<double>(50, kBody + 0.05), std::vector<double>(50, 0.4)};
  const auto risk = [&](const ReachTube& tube) {
    return risk_of_touching(reach, grid, distance, {1, 0, 0, 0.15}, tube).total;
  };
  ReachTube tube = motion.tube();
  const double alike = risk(tube);
  for (auto& step : tube) step.w_bar.w[kXyPlus] = step.w_bar.w[kXyMinus] = 0.6;
  EXPECT_GT(risk(tube), alike);
  tube[20].center.p_W.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(risk(tube), std::numeric_limits<double>::infinity());
  tube = motion.tube();
  tube[20].w_bar.w[kX] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(risk(tube), std::numeric_limits<double>::infinity());
  motion.x.assign(50, 0.0);  // in the wall's face
  EXPECT_GE(risk(motion.tube()), 0.99);
  motion.x.resize(1);
  motion.s.resize(1);  // before anything blows
  EXPECT_EQ(risk(motion.tube()), 1);
}

TEST(RiskOfTouching, TakesWhatIsKnownOnlyAsABoundOffTheClearance) {
  const auto grid = beside_a_wall();
  const map::DistanceField distance(grid);
  const Motion motion{std::vector<double>(500, kBody + 0.2), std::vector<double>(500, 1.0)};
  Vehicle vehicle = with({6, 4, 0, 0.05});
  const auto risk = [&](const BoundModel& model) {
    ReachTube tube = motion.tube();
    for (auto& step : tube)
      for (std::size_t d = 0; d < kDirections; ++d)
        step.w_bar.w[d] += d == kZ ? model.mean_vertical : model.mean_horizontal;
    return risk_of_touching(Reachability(vehicle), grid, distance, model, tube);
  };
  const Risk plain = risk({1, 0, 0, 0.15});
  EXPECT_NEAR(plain.clearance, 0.2, 1e-6);
  const Risk pushed = risk({1, 0.1, 0, 0.15});
  EXPECT_NEAR(pushed.clearance, 0.2 - 0.1 * Reachability(vehicle).horizontal.h_inf, 1e-6);
  EXPECT_NEAR(pushed.sigma, plain.sigma, 0.05 * plain.sigma);  // of another moment of the same air
  EXPECT_GT(pushed.total, 1.1 * plain.total);
  EXPECT_NEAR(risk({1, 0, 0.1, 0.15}).total, plain.total, 1e-6 * plain.total);  // it pushes along the wall
  vehicle.estimation.position = 0.03;
  EXPECT_NEAR(risk({1, 0, 0, 0.15}).clearance, 0.17, 1e-6);
  const double later = risk({1, 0, 0, 0.15}).total;
  EXPECT_GT(later, 1.1 * plain.total);
  vehicle.initial_error.position = 0.1;
  EXPECT_GT(risk({1, 0, 0, 0.15}).total, 1.01 * later);
  EXPECT_NEAR(plain.obstacle_W.x(), 0, 1e-9);
}

TEST(RiskOfTouching, IsUnknownForLoopsItHasNoCovarianceOf) {
  const auto grid = beside_a_wall();
  const map::DistanceField distance(grid);
  const Motion motion{{1}, {1}};
  Vehicle vehicle = with({6, 4, 0, 0});
  const auto risk = [&](const Reachability& reach, const BoundModel& model) {
    return risk_of_touching(reach, grid, distance, model, motion.tube());
  };
  EXPECT_THROW(risk(Reachability(vehicle), {0, 0, 0, 0.15}), std::invalid_argument);
  EXPECT_THROW(risk(Reachability(vehicle, Method::tight, Loop::sampled), {1, 0, 0, 0.15}), std::invalid_argument);
  vehicle.controller.velocity_integrator = {0.5, 0.5};
  EXPECT_THROW(risk(Reachability(vehicle), {1, 0, 0, 0.15}), std::invalid_argument);
  for (const double wrong : {0.0, 1.0, -1.0})
    EXPECT_THROW(kappa_of(Reachability(with({6, 4, 0, 0})), 0.15, wrong, 1), std::invalid_argument);
}

TEST(KappaOf, AMinuteBesideAWallIsHeldByTheLoopsOwnEquations) {
  for (const AxisLoop& axis : {AxisLoop{6, 4, 0, 0.05}, AxisLoop{1.71, 1.8, 0.02, 0.1}}) {
    const Reachability reach(with(axis));
    const double touch = 0.1, s = 0.3, width = kappa_of(reach, 0.15, touch, 60) * s * reach.horizontal.h_inf;
    const Motion motion{std::vector<double>(3000, kBody + width), std::vector<double>(3000, s)};
    const double share = flown(axis, 0.15, motion, 500, 5);
    EXPECT_LE(share, touch + 3 * std::sqrt(touch / 500));
    EXPECT_GE(share, touch / 10);
    const auto grid = beside_a_wall();
    const auto risk = risk_of_touching(reach, grid, map::DistanceField(grid), {1, 0, 0, 0.15}, motion.tube());
    EXPECT_LE(risk.a_minute, 1.05 * touch);
    EXPECT_GE(risk.a_minute, touch / 3);
    // Of what is still to come.
    const auto half = risk_of_touching(reach, grid, map::DistanceField(grid), {1, 0, 0, 0.15}, motion.tube(), 1, 1500);
    EXPECT_NEAR(half.total, risk.total / 2, 0.02 * risk.total);
  }
}

TEST(KappaOf, FallsWithTheRiskAndWithWhatTheLoopAveragesAway) {
  const Reachability quick(with({16, 8, 0, 0.03})), slow(with({1.71, 1.8, 0, 0.1}));
  EXPECT_GT(kappa_of(quick, 0.15, 1e-4, 0.05), kappa_of(quick, 0.15, 1e-3, 0.05));
  EXPECT_GT(kappa_of(quick, 0.15, 1e-3, 0.05), kappa_of(slow, 0.15, 1e-3, 0.05));
  EXPECT_GT(kappa_of(slow, 0.5, 1e-3, 0.05), kappa_of(slow, 0.15, 1e-3, 0.05));
}

}  // namespace
}  // namespace backwash::reach
