// SPDX-License-Identifier: BSD-3-Clause
// Gains, latency and lag of a vehicle file, from logs of a vehicle whose own are known.
#include "core/study/loop/loop_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/config/config.hpp"
#include "core/sim/flight.hpp"
#include "core/sim/vehicle/quadrotor.hpp"
#include "core/types/minimum_jerk.hpp"

namespace backwash::study {
namespace {

Vehicle shipped() { return config::load_vehicle("builtin:quad-5in").value(); }

Vehicle true_vehicle() {
  Vehicle v = shipped();
  v.controller.kp = {7, 9};
  v.controller.kd = {4.6, 5.2};
  v.controller.latency = 0.06;
  v.controller.attitude_lag = 0.07;
  return v;
}

/// Back and forth along each axis, or still, in gusts of a first-order process; 50 Hz, set-points held between rows.
log::FlightLog flown(const Vehicle& vehicle, unsigned seed, bool hover) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  sim::Quadrotor quad(vehicle, {Vec3(0, 0, 1.2), Vec3::Zero()});
  std::vector<Setpoint> commands = sim::hold_commands(Vec3(0, 0, 1.2), hover ? 60 : 2);
  Vec3 at(0, 0, 1.2);
  for (int leg = 0; !hover && leg < 16; ++leg) {
    const Vec3 next =
        leg % 2 == 0 ? Vec3(0, 0, 1.2) + Vec3(normal(random), normal(random), 0.4 * normal(random)) : Vec3(0, 0, 1.2);
    const auto way = rest_to_rest(at, next, 1.4, 2.0);
    commands.insert(commands.end(), way.begin() + 1, way.end());
    for (const auto& c : sim::hold_commands(next, 1.0)) commands.push_back(c);
    at = next;
  }
  std::vector<sim::FlightSample> samples;
  Vec3 gust = Vec3::Zero();
  for (const auto& command : commands) {
    sim::FlightSample s{};
    s.t = quad.time();
    s.truth = s.estimated = quad.state();
    s.acceleration = quad.acceleration();
    s.attitude = quad.attitude();
    s.thrust = quad.thrust();
    s.command = command;
    samples.push_back(s);
    quad.command(command);
    for (int k = 0; k < 20; ++k) {
      gust += -0.001 / 0.15 * gust +
              0.3 * std::sqrt(2 * 0.001 / 0.15) * Vec3(normal(random), normal(random), normal(random));
      quad.step(gust, quad.state());
    }
  }
  return sim::to_log(samples, false);
}

class LoopFitOf : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    for (const unsigned seed : {1u, 2u, 3u}) logs_.push_back(flown(true_vehicle(), seed, false));
  }
  static std::vector<LoopLog> named(const std::vector<log::FlightLog>& logs) {
    std::vector<LoopLog> all;
    for (std::size_t n = 0; n < logs.size(); ++n) all.push_back({"log" + std::to_string(n), &logs[n]});
    return all;
  }
  static std::vector<log::FlightLog> logs_;
};
std::vector<log::FlightLog> LoopFitOf::logs_;

TEST_F(LoopFitOf, ThreeLogsTellsAllKeysOfTheVehicleThatFlewThem) {
  const auto fit = fit_loop(named(logs_), shipped());
  ASSERT_TRUE(fit) << fit.error().what;
  EXPECT_TRUE(fit->by_attitude && fit->by_thrust);
  EXPECT_TRUE(fit->unexcited.empty());
  for (std::size_t k = 0; k < kLoopKeys; ++k) {
    const auto key = static_cast<LoopKey>(k);
    const double right = value_of(true_vehicle(), key), begun = value_of(shipped(), key);
    ASSERT_TRUE(fit->keys[k]) << name_of(key);
    const auto& e = *fit->keys[k];
    EXPECT_LE(e.low, right) << name_of(key);
    EXPECT_GE(e.high, right) << name_of(key);
    EXPECT_LT(std::abs(e.value - right), 0.5 * std::abs(begun - right)) << name_of(key) << ": " << e.value;
    EXPECT_TRUE(begun < e.low || begun > e.high) << name_of(key) << ": the wrong file lies inside";
  }
}

TEST_F(LoopFitOf, ALogOfHoverAloneIsNamedForTheLatencyItDoesNotExcite) {
  auto logs = logs_;
  logs[1] = flown(true_vehicle(), 7, true);
  const auto fit = fit_loop(named(logs), shipped());
  ASSERT_TRUE(fit) << fit.error().what;
  EXPECT_FALSE(fit->keys[kLatency]);
  bool named_it = false;
  for (const auto& u : fit->unexcited) {
    EXPECT_EQ(u.log, "log1") << name_of(u.key);
    named_it = named_it || u.key == kLatency;
  }
  EXPECT_TRUE(named_it);
}

TEST_F(LoopFitOf, LogsWithoutAttitudeAreFittedByPositionsAndKnowLess) {
  auto logs = logs_;
  for (auto& log : logs)
    for (const char* column : {"qw", "qx", "qy", "qz", "thrust"}) log.columns.erase(column);
  const auto fit = fit_loop(named(logs), shipped()), whole = fit_loop(named(logs_), shipped());
  ASSERT_TRUE(fit) << fit.error().what;
  EXPECT_FALSE(fit->by_attitude || fit->by_thrust);
  for (std::size_t k = 0; k < kLoopKeys; ++k) {
    if (!fit->keys[k]) continue;
    EXPECT_LE(fit->keys[k]->low, value_of(true_vehicle(), static_cast<LoopKey>(k))) << name_of(static_cast<LoopKey>(k));
    EXPECT_GE(fit->keys[k]->high, value_of(true_vehicle(), static_cast<LoopKey>(k)))
        << name_of(static_cast<LoopKey>(k));
    EXPECT_GT(fit->keys[k]->high - fit->keys[k]->low, whole->keys[k]->high - whole->keys[k]->low);
  }
}

TEST_F(LoopFitOf, ALogWithoutSetPointsOrFlownElsewhereIsRefusedByName) {
  auto logs = logs_;
  for (double& x : logs[2].columns.at("cmd_x_m")) x += 5;
  auto fit = fit_loop(named(logs), shipped());
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().log, "log2");
  EXPECT_THAT(fit.error().what, testing::HasSubstr("elsewhere"));
  logs[2].columns.erase("cmd_x_m");
  fit = fit_loop(named(logs), shipped());
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().what, testing::HasSubstr("no set-points"));
}

}  // namespace
}  // namespace backwash::study
