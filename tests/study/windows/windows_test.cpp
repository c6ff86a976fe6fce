// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/hover_windows.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/config/config.hpp"
#include "core/sim/vehicle/quadrotor.hpp"
#include "core/sim/vehicle/vio.hpp"
#include "core/study/windows/observer.hpp"

namespace backwash::study {
namespace {

Vehicle five_inch() { return config::load_vehicle("builtin:quad-5in").value(); }

void add(log::FlightLog& log, const std::string& prefix, const std::string& unit, const Vec3& value) {
  for (int axis = 0; axis < 3; ++axis)
    log.columns[prefix + std::string("xyz")[static_cast<std::size_t>(axis)] + unit].push_back(value[axis]);
}

/// Sum of sines: its power in any band is known without a filter.
struct Tones {
  std::vector<std::pair<double, double>> hz_amplitude;
  double at(double t) const {
    double x = 0;
    for (const auto& [hz, amplitude] : hz_amplitude) x += amplitude * std::sin(2 * std::numbers::pi * hz * t);
    return x;
  }
};

/// A log of a real simulated vehicle that `push` shakes along x (and half as much along z), hovering at (1, 2, 1.5).
log::FlightLog shaken(const Vehicle& vehicle, const Tones& push, double seconds, double steady = 0) {
  const State start{Vec3(1, 2, 1.5), Vec3::Zero()};
  sim::Quadrotor quad(vehicle, start);
  const sim::EmulatedVio vio(0.015, 3);
  Setpoint hold;
  hold.p_W = start.p_W;
  log::FlightLog log;
  State estimated = vio.estimate(start, 0);
  for (int k = 0; k * kControlPeriod < seconds; ++k) {
    log.t_s.push_back(k * kControlPeriod);
    add(log, "", "_m", estimated.p_W);
    add(log, "v", "_mps", estimated.v_W);
    add(log, "a", "_mps2", quad.acceleration());
    add(log, "cmd_", "_m", hold.p_W);
    add(log, "cmd_v", "_mps", hold.v_W);
    add(log, "cmd_a", "_mps2", hold.a_W);
    log.columns["thrust"].push_back(quad.thrust());
    log.columns["segment"].push_back(0);
    quad.command(hold);
    for (int i = 0; i < 20; ++i) {
      const double w = steady + push.at(quad.time());
      quad.step({w, 0, 0.5 * w}, estimated);
      estimated = vio.estimate(quad.state(), quad.time());
    }
  }
  return log;
}

void remove(log::FlightLog& log, const std::vector<std::string>& columns) {
  for (const auto& name : columns) log.columns.erase(name);
}

const std::vector<std::string> kCommands = {"cmd_x_m",    "cmd_y_m",     "cmd_z_m",     "cmd_vx_mps", "cmd_vy_mps",
                                            "cmd_vz_mps", "cmd_ax_mps2", "cmd_ay_mps2", "cmd_az_mps2"};

Vec3 mean_variance(const FlightWindows& flight) {
  Vec3 sum = Vec3::Zero();
  for (const auto& w : flight.windows) sum += w.variance / static_cast<double>(flight.windows.size());
  return sum;
}

TEST(Windows, GiveTheDisturbanceThatShookTheVehicleBackFromItsSetPoints) {
  const Tones push{{{0.5, 0.4}, {2, 0.3}, {7, 0.2}}};  // power Σ A²/2
  const auto log = shaken(five_inch(), push, 61, 0.3);
  const auto flight = flight_windows(log, five_inch(), {}, "log.csv");
  ASSERT_TRUE(flight) << flight.error().message;
  EXPECT_EQ(flight->signal, Signal::commanded);
  ASSERT_EQ(flight->windows.size(), 30u);
  const double power = (0.16 + 0.09 + 0.04) / 2;
  const Vec3 variance = mean_variance(*flight);
  EXPECT_NEAR(variance.x(), power, 0.02 * power);
  EXPECT_NEAR(variance.z(), 0.25 * power, 0.02 * 0.25 * power);
  EXPECT_LT(variance.y(), 1e-4);
  for (const auto& w : flight->windows) {
    EXPECT_NEAR(w.mean.x(), 0.3, 0.01);  // all tones have whole periods in a window
    EXPECT_NEAR(w.mean.y(), 0, 0.01);
    EXPECT_LT((w.p_W - Vec3(1, 2, 1.5)).norm(), 0.08);
  }
}

TEST(Windows, CountOnlyPowerWithinTheBand) {
  // Inside 2 Hz; below 0.05 Hz and, at 250 Hz rate, above 60 Hz: a thinned-out log would fold 60 Hz into the band.
  log::FlightLog log;
  for (int k = 0; k < 250 * 61; ++k) {
    const double t = k / 250.0;
    log.t_s.push_back(t);
    add(log, "", "_m", {0.01 * std::sin(t), 0, 1});
    add(log, "a", "_mps2", {Tones{{{2, 0.3}}}.at(t), Tones{{{0.05, 1.0}}}.at(t), Tones{{{60, 1.0}}}.at(t)});
  }
  const auto flight = flight_windows(log, std::nullopt, {}, "log.csv");
  ASSERT_TRUE(flight) << flight.error().message;
  EXPECT_EQ(flight->signal, Signal::raw);
  const Vec3 variance = mean_variance(*flight);
  EXPECT_NEAR(variance.x(), 0.045, 0.001);
  EXPECT_LT(variance.y(), 0.02 * 0.5);
  EXPECT_LT(variance.z(), 0.02 * 0.5);
}

/// Noise with exactly known autocorrelation ρ^|k|: variance 1.
std::vector<double> autoregressive(double rho, std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x{normal(random)};
  while (x.size() < n) x.push_back(rho * x.back() + std::sqrt(1 - rho * rho) * normal(random));
  return x;
}

TEST(Windows, DividesOutTheAttenuationOfTheLoopWithoutSetPoints) {
  // The two figures of docs/model.md section 3, from residues (closed form) for a second-order loop without band.
  loop::PositionLoop loop;
  loop.kp.setConstant(6);
  loop.kd.setConstant(4);
  EXPECT_NEAR(loop_attenuation(loop, 0, 0.2, {1e-4, 1e5 / 0.2}), 0.64, 0.005);
  EXPECT_NEAR(loop_attenuation(loop, 0, 0.5, {1e-4, 1e5 / 0.5}), 0.39, 0.005);
  // A push of that correlation time, through the simulated vehicle, logged without set-points.
  auto vehicle = five_inch();
  vehicle.controller.kp = {6, 6};
  vehicle.controller.kd = {4, 4};
  vehicle.controller.attitude_lag = 0;
  const auto w = autoregressive(std::exp(-0.001 / 0.2), 400000, 9);
  std::vector<double> logged;
  sim::Quadrotor quad(vehicle, {Vec3(0, 0, 1), Vec3::Zero()});
  log::FlightLog log;
  for (std::size_t k = 0; k < w.size(); ++k) {
    quad.step({0.5 * w[k], 0, 0}, quad.state());
    if (k % 20 != 0) continue;
    log.t_s.push_back(0.001 * static_cast<double>(k));
    logged.push_back(0.5 * w[k]);
    add(log, "", "_m", quad.state().p_W);
    add(log, "v", "_mps", quad.state().v_W);
    add(log, "a", "_mps2", quad.acceleration());
    log.columns["segment"].push_back(0);
  }
  WindowOptions options;
  options.tau_w = 0.2;
  const auto flight = flight_windows(log, vehicle, options, "log.csv");
  ASSERT_TRUE(flight) << flight.error().message;
  EXPECT_EQ(flight->signal, Signal::divided);
  double in_band = 0;  // of the push itself
  for (const double x : band_passed(logged, 50, flight->band)) in_band += x * x / static_cast<double>(logged.size());
  EXPECT_NEAR(mean_variance(*flight).x(), in_band, 0.06 * in_band);
  EXPECT_EQ(flight->gust_shape(), GustShape::first_order) << "the loop is no part of the gust";
  EXPECT_NEAR(flight->tau_w(flight->windows.front()), 0.2, 0.02);
}

class Gates : public ::testing::Test {
 protected:
  log::FlightLog log_ = shaken(five_inch(), {{{0.7, 0.4}, {3, 0.3}}}, 41);  // 1 s settling, 20 windows
  FlightWindows cut() const {
    auto flight = flight_windows(log_, five_inch(), {}, "log.csv");
    EXPECT_TRUE(flight) << flight.error().message;
    return *flight;
  }
  std::size_t count(const FlightWindows& flight, Gate gate) const {
    return flight.gated[static_cast<std::size_t>(gate)];
  }
  /// Rows of window n and what to do with them.
  template <typename Change>
  void change(std::size_t n, Change what) {
    for (std::size_t k = 50 + 100 * n; k < 150 + 100 * n; ++k) what(k);
  }
};

TEST_F(Gates, LeaveACleanFlightAlone) {
  const auto flight = cut();
  EXPECT_EQ(flight.windows.size(), 20u);
  for (const Gate gate : {Gate::frozen, Gate::perched, Gate::saturated, Gate::gap}) EXPECT_EQ(count(flight, gate), 0u);
}

TEST_F(Gates, CountFrozenPerchedAndSaturatedWindowsOnceEach) {
  for (const std::size_t n : {3u, 4u}) {
    change(n, [&](std::size_t k) {
      for (auto& [name, column] : log_.columns) column[k] = column[50 + 100 * n];
    });
  }
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 5e-5);
  change(8, [&](std::size_t k) {  // stands on the ground: tracker noise is all that moves
    log_.columns["x_m"][k] = 1 + noise(random);
    log_.columns["y_m"][k] = 2 + noise(random);
    log_.columns["z_m"][k] = 0.03 + noise(random);
  });
  change(11, [&](std::size_t k) { log_.columns["thrust"][k] = 0.1; });  // moved about by hand, rotors idle
  for (const std::size_t n : {14u, 16u, 18u}) {
    change(n, [&](std::size_t k) { log_.columns["thrust"][k] = k % 10 == 0 ? 1.0 : log_.columns["thrust"][k]; });
  }
  const auto flight = cut();
  EXPECT_EQ(count(flight, Gate::frozen), 2u);
  EXPECT_EQ(count(flight, Gate::perched), 2u);
  EXPECT_EQ(count(flight, Gate::saturated), 3u);
  EXPECT_EQ(flight.windows.size(), 13u);
}

TEST_F(Gates, JudgeWhoStandsByTheLogsOwnThrustAndNoFilesWeight) {
  Vehicle heavy = five_inch();
  heavy.propulsion.max_thrust /= 4;  // or a thrust stand's figure of one rotor
  const auto hovering = flight_windows(log_, heavy, {}, "log.csv");
  ASSERT_TRUE(hovering);
  EXPECT_EQ(count(*hovering, Gate::perched), 0u);
  // Lands in mid log, the rotors on; stands longer than it flies.
  for (std::size_t k = 350; k < log_.t_s.size() - 400; ++k)
    log_.columns["thrust"][k] = 0.12 + 0.01 * std::sin(0.1 * static_cast<double>(k));
  const auto landed = flight_windows(log_, heavy, {}, "log.csv");
  ASSERT_TRUE(landed);
  EXPECT_GE(count(*landed, Gate::perched), 11u);
  EXPECT_GE(landed->windows.size(), 5u);
  // A rotor at its limit now and then is no hover.
  for (std::size_t k = 0; k < log_.t_s.size(); k += 60) log_.columns["thrust"][k] = 1;
  EXPECT_GE(count(cut(), Gate::perched), 11u);
}

TEST_F(Gates, KeepWhatIsWrongOutOfTheWindowsBesideIt) {
  const auto clean = cut();
  change(9, [&](std::size_t k) {
    log_.columns["ax_mps2"][k] = 40;
    log_.columns["thrust"][k] = 1.0;  // a crash, say
  });
  const auto flight = cut();
  ASSERT_EQ(flight.windows.size(), 19u);
  EXPECT_NEAR(flight.windows[8].variance.x(), clean.windows[8].variance.x(), 0.15 * clean.windows[8].variance.x());
  EXPECT_NEAR(flight.windows[9].variance.x(), clean.windows[10].variance.x(), 0.15 * clean.windows[10].variance.x());
}

TEST_F(Gates, CountGapsAndTransit) {
  for (auto& [name, column] : log_.columns) column.erase(column.begin() + 1000, column.begin() + 1150);
  log_.t_s.erase(log_.t_s.begin() + 1000, log_.t_s.begin() + 1150);
  for (std::size_t k = 1500; k < 1700; ++k) log_.columns["segment"][k] = -1;
  const auto flight = cut();
  EXPECT_EQ(count(flight, Gate::gap), 2u);                     // 3 s
  EXPECT_EQ(count(flight, Gate::transit), 1u + 1u + 2u + 1u);  // settling three times, 4 s on the way
  for (const auto& w : flight.windows) EXPECT_TRUE(w.t_s + 2 <= 20.0 || w.t_s >= 22.99);
}

/// Windows that calibration leaves out of a log for one reason, and that a study does; none: it keeps some window.
void expect_left_out(const log::FlightLog& log, Gate gate) {
  const auto flight = flight_windows(log, five_inch(), {}, "log.csv");
  ASSERT_TRUE(flight) << flight.error().message;
  EXPECT_EQ(flight->gated[static_cast<std::size_t>(gate)], 20u) << to_string(gate);
  EXPECT_TRUE(flight->windows.empty()) << to_string(gate);
  Observer observer(five_inch(), config::load_model("builtin:quad-5in").value(), nullptr);
  observer.add(log);
  const Observations seen = observer.finish();
  EXPECT_EQ(seen.gated_out.at(gate), 20u) << to_string(gate);
  EXPECT_TRUE(seen.windows.empty()) << to_string(gate);
}

TEST_F(Gates, AreTheSameForCalibrationAndStudy) {
  auto frozen = log_, resting = log_, standing = log_, stopped = log_;
  for (const char* axis : {"x_m", "y_m", "z_m"})  // the tracker has stopped, the accelerometer has not
    for (double& p : frozen.columns[axis]) p = 1;
  expect_left_out(frozen, Gate::frozen);
  for (const char* motor : {"motor1", "motor2", "motor3", "motor4"})
    resting.columns[motor] = std::vector<double>(log_.t_s.size(), 0.03);
  expect_left_out(resting, Gate::perched);
  standing.columns["stood_z_m"] = standing.columns["z_m"];
  expect_left_out(standing, Gate::perched);
  for (std::size_t k = 0; k < log_.t_s.size(); ++k)  // one rotor at its lower end, the others at work
    for (const char* motor : {"motor1", "motor2", "motor3", "motor4"})
      stopped.columns[motor].push_back(motor[5] == '2' ? 0.0 : 0.5);
  expect_left_out(stopped, Gate::saturated);
}

TEST(Windows, FindHoverPositionsWithoutASegmentColumn) {
  log::FlightLog log;
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise;
  for (int k = 0; k < 3000; ++k) {  // hover at 0 for 20 s, 20 s at 0.3 m/s, hover at 6 m
    const double t = 0.02 * k, x = std::clamp(0.3 * (t - 20), 0.0, 6.0);
    log.t_s.push_back(t);
    add(log, "", "_m", {x + 0.005 * std::sin(3 * t), 0.005 * std::cos(2 * t), 1});
    add(log, "a", "_mps2", 0.1 * Vec3(noise(random), noise(random), noise(random)));
  }
  const auto flight = flight_windows(log, std::nullopt, {}, "log.csv");
  ASSERT_TRUE(flight) << flight.error().message;
  ASSERT_GE(flight->windows.size(), 16u);
  for (const auto& w : flight->windows) {
    EXPECT_TRUE(w.p_W.x() < 0.05 || w.p_W.x() > 5.95) << w.p_W.x();
    EXPECT_EQ(w.segment, w.p_W.x() < 1 ? flight->windows.front().segment : flight->windows.back().segment);
  }
  EXPECT_GE(flight->gated[static_cast<std::size_t>(Gate::transit)], 9u);
  EXPECT_FALSE(flight->not_tested.empty());
}

TEST(Windows, RefuseALogWithoutAccelerationByName) {
  auto log = shaken(five_inch(), {{{1, 0.1}}}, 5);
  remove(log, {"ay_mps2"});
  const auto flight = flight_windows(log, five_inch(), {}, "log.csv");
  ASSERT_FALSE(flight);
  EXPECT_EQ(flight.error().message.find("log.csv:1: no column 'ay_mps2'"), 0u) << flight.error().message;
}

}  // namespace
}  // namespace backwash::study
