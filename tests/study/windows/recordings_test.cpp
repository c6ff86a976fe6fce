// SPDX-License-Identifier: BSD-3-Clause
// What recordings without thrust and set-points leave out, and days that hold several flights.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "core/map/occupancy_grid.hpp"
#include "core/study/findings/page_sections.hpp"
#include "core/study/inference/evidence.hpp"
#include "core/study/windows/observer.hpp"

namespace {

using namespace backwash;
using namespace backwash::study;

/// 8 s at 50 Hz along x with a trembling that no gate should mind.
log::FlightLog flown(double speed, double z) {
  log::FlightLog log;
  std::mt19937 rng(1);
  std::normal_distribution<double> tremble(0, 0.002);
  for (int k = 0; k < 400; ++k) {
    const double t = 0.02 * k;
    log.t_s.push_back(t);
    const auto add = [&](const char* name, double value) { log.columns[name].push_back(value); };
    add("x_m", speed * t + tremble(rng));
    add("y_m", tremble(rng));
    add("z_m", z + 0.1 * tremble(rng));
    add("vx_mps", speed);
    add("vy_mps", 0);
    add("vz_mps", 0);
    add("ax_mps2", 100 * tremble(rng));
    add("ay_mps2", 100 * tremble(rng));
    add("az_mps2", 100 * tremble(rng));
  }
  return log;
}

Observations observed(const log::FlightLog& log) {
  Observer observer(Vehicle{}, Model{}, nullptr);
  observer.add(log);
  return observer.finish();
}

void add_column(log::FlightLog& log, const std::string& name, double value) {
  log.columns[name].assign(log.t_s.size(), value);
}

TEST(StudyGates, LeaveOutRotorsAtRestAndFeetThatMayTouch) {
  auto idle = flown(0, 0.5), turning = idle;
  for (const char* motor : {"motor1", "motor2", "motor3", "motor4"}) {
    add_column(turning, motor, 0.6);
    add_column(idle, motor, 0.6);
    for (std::size_t i = 0; i < 200; ++i) idle.columns[motor][i] = 0;
  }
  EXPECT_EQ(observed(turning).gated_out.size(), 0u);
  EXPECT_EQ(observed(idle).gated_out[Gate::perched], 2u);
  auto low = flown(0, 0.503), clear = flown(0, 0.508);
  add_column(low, "stood_z_m", 0.5);
  add_column(clear, "stood_z_m", 0.5);
  EXPECT_EQ(observed(low).gated_out[Gate::perched], 4u);
  EXPECT_EQ(observed(clear).windows.size(), 4u);
}

TEST(StudyGates, CompareAPassOnlyWhereSomethingSimulatesIt) {
  const auto hover = observed(flown(0.02, 0.5));
  EXPECT_TRUE(hover.measured(kVarZ));
  EXPECT_FALSE(hover.measured(kMeanX)) << "a change of velocity is no push";
  EXPECT_EQ(observed(flown(0.4, 0.5)).gated_out[Gate::transit], 4u);
  auto told = flown(0.4, 0.5);
  for (std::size_t i = 0; i < told.t_s.size(); ++i) {
    told.columns["cmd_x_m"].push_back(0.4 * told.t_s[i]);
    told.columns["cmd_vx_mps"].push_back(0.4);
  }
  for (const char* zero : {"cmd_y_m", "cmd_vy_mps", "cmd_vz_mps"}) add_column(told, zero, 0);
  add_column(told, "cmd_z_m", 0.5);
  const auto pass = observed(told);
  EXPECT_EQ(pass.windows.size(), 4u);
  EXPECT_TRUE(pass.measured(kVarZ) && pass.measured(kMeanX));
  auto motors = flown(0.4, 0.5);
  for (const char* motor : {"motor1", "motor2", "motor3", "motor4"}) add_column(motors, motor, 0.6);
  const auto shares = observed(motors);
  EXPECT_TRUE(shares.measured(kMotor1));
  EXPECT_FALSE(shares.measured(kVarZ));
}

TEST(StudyGates, GustsOfAHoverAreNoSpeedWithoutSetPoints) {
  auto hover = flown(0, 0.5);
  std::mt19937 rng(4);
  std::normal_distribution<double> gust(0, 0.1);
  for (const char* v : {"vx_mps", "vy_mps", "vz_mps"})
    for (double& value : hover.columns[v]) value = gust(rng);
  const auto seen = observed(hover);
  ASSERT_EQ(seen.windows.size(), 4u);
  for (const auto& w : seen.windows) {
    EXPECT_LT(w.speed, 0.05);  // the mean of |v| is 0.16
    for (const double v : w.speeds) EXPECT_LT(v, 0.05);
  }
}

TEST(StudyGates, LeaveOutWhatIsFarOutsideTheMapHoweverFar) {
  const auto room = map::OccupancyGrid({-2, -2, 0}, 0.1, {40, 40, 25}, map::Cell::free);
  for (const double away : {6.0, 1e12, 1e200}) {
    auto log = flown(0, 0.5);
    for (std::size_t i = 0; i < 100; ++i) log.columns["x_m"][i] += away;
    Observer observer(Vehicle{}, Model{}, &room);
    observer.add(log);
    const auto seen = observer.finish();
    EXPECT_EQ(seen.gated_out.at(Gate::outside), 1u) << away;
    EXPECT_EQ(seen.windows.size(), 3u) << away;
  }
}

TEST(TooFew, SaysHowManyMoreAndWhatWasLeftOut) {
  auto low = flown(0, 0.503);
  add_column(low, "stood_z_m", 0.5);
  EXPECT_EQ(too_few(observed(low)),
            "0 flights with good windows, 10 are needed to warrant a name: fly 10 more (windows left out: 4 perched).");
}

struct Days {
  Observations seen;
  std::vector<int> day;
  std::vector<double> x;
};

/// 30 days of four flights of five windows; ln variance along all axes alike: sd 0.6 between days, 0.4 between flights
/// of a day, 0.5 between windows.
Days days(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  Days made;
  made.seen.flights = 120;
  for (int day = 0; day < 30; ++day) {
    const double of_day = 0.6 * normal(rng);
    for (int flight = 0; flight < 4; ++flight) {
      const double level = of_day + 0.4 * normal(rng), x = normal(rng);
      for (int w = 0; w < 5; ++w) {
        WindowRow row{};
        row.flight = static_cast<std::size_t>(4 * day + flight);
        row.sigma = Vec3::Ones();
        row.p_W = row.v_W = row.measured_variance = Vec3::Zero();
        made.seen.windows.push_back(row);
        const double y = level + 0.5 * normal(rng);
        for (std::size_t c = 0; c < kChannels; ++c) {
          const bool variance = c == kVarX || c == kVarY || c == kVarZ;
          made.seen.y[c].push_back(variance ? y : 0);
          made.seen.weight[c].push_back(variance ? 1 : 0);
        }
        made.day.push_back(day);
        made.x.push_back(x + 0.3 * normal(rng));
      }
    }
    made.seen.units.first.push_back(made.seen.windows.size());
  }
  for (const Source source : {Source::attitude, Source::map}) made.seen.missing[source] = "none";
  return made;
}

/// The three axes alike are √3 times one of them (`decorrelated`).
TEST(DaysOfFlights, HaveAScatterOfTheirOwnBesideThatOfFlightsAndWindows) {
  std::mt19937 rng(2);
  double within = 0, between = 0, units = 0;
  constexpr int kDraws = 30;
  for (int k = 0; k < kDraws; ++k) {
    const auto made = days(rng);
    const Evidence evidence(made.seen);
    const Scatter scatter = evidence.scatter(kVarX);
    within += scatter.within / 3 / kDraws;
    between += scatter.between / 3 / kDraws;
    units += scatter.units / 3 / kDraws;
  }
  EXPECT_NEAR(within, 0.25, 0.01);
  EXPECT_NEAR(between, 0.16, 0.02);
  EXPECT_NEAR(units, 0.36, 0.06);
}

TEST(DaysOfFlights, NormalEquationsAreThoseOfTheWholeCovariance) {
  std::mt19937 rng(3);
  const auto made = days(rng);
  const Evidence evidence(made.seen);
  DesignColumn column;
  for (const Channel c : {kVarX, kVarY, kVarZ}) column.parts.push_back({c, made.x});
  const NormalEquations normal = evidence.normal({column}, {});
  const auto n = static_cast<Eigen::Index>(made.x.size());
  const Scatter scatter = evidence.scatter(kVarX);
  Eigen::MatrixXd V = scatter.within * Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd x(n), y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto a = static_cast<std::size_t>(i);
    x[i] = std::sqrt(3.0) * made.x[a];
    y[i] = std::sqrt(3.0) * made.seen.y[kVarX][a];
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto b = static_cast<std::size_t>(j);
      if (made.seen.windows[a].flight == made.seen.windows[b].flight) V(i, j) += scatter.between;
      if (made.day[a] == made.day[b]) V(i, j) += scatter.units;
    }
  }
  const Eigen::VectorXd solved = V.ldlt().solve(x);
  double b = 0;
  for (const auto& day : normal.b) b += day[0];
  EXPECT_EQ(normal.b.size(), 30u);
  EXPECT_NEAR(normal.total(0, 0), x.dot(solved), 1e-9 * x.dot(solved));
  EXPECT_NEAR(b, y.dot(solved), 1e-9 * x.dot(solved));
}

}  // namespace
