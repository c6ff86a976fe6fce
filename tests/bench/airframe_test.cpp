// SPDX-License-Identifier: BSD-3-Clause
// The vehicle that a controller in the loop flies, against closed forms.
#include "services/bench/emulation/airframe.hpp"

#include <gtest/gtest.h>

#include "core/config/config.hpp"

namespace backwash::bench {
namespace {

constexpr double kG = 9.80665;

struct AirframeTest : testing::Test {
  const Vehicle vehicle =
      config::load_vehicle(std::string(BACKWASH_SOURCE_DIR) + "/tests/autopilots/px4.vehicle.toml").value();
  const Vec3 ground{1, 2, 0.25};
  Airframe airframe{vehicle, ground};
  /// Command at which a rotor carries a quarter of `share` of the weight; the vehicle's thrust curve is a line.
  double u(double share) const { return share * vehicle.body.mass * kG / vehicle.propulsion.max_thrust; }
  void run(double seconds, const Airframe::Rotors& commands, const Vec3& w = Vec3::Zero()) {
    for (int n = 0; n < static_cast<int>(seconds / Airframe::kStep); ++n) airframe.step(commands, w);
  }
  void lift_off() {
    const double up = u(1.5);
    run(0.5, {up, up, up, up});
    ASSERT_FALSE(airframe.on_ground());
  }
};

TEST_F(AirframeTest, StandsAndFeelsTheGroundUntilItsRotorsCarryMoreThanItsWeight) {
  const double most = u(0.999);
  run(2, {most, most, most, most}, Vec3(3, 0, 0));
  EXPECT_TRUE(airframe.on_ground());
  EXPECT_EQ(airframe.state().p_W, ground);
  EXPECT_NEAR((airframe.specific_force() - Vec3(0, 0, kG)).norm(), 0, 1e-12);
  const double more = u(1.01);
  run(1, {more, more, more, more});
  EXPECT_FALSE(airframe.on_ground());
}

TEST_F(AirframeTest, ClimbsAsItsThrustLessDragLetsItAndFallsWithoutThrust) {
  lift_off();
  const double up = u(1.5), v0 = airframe.state().v_W.z();
  run(2, {up, up, up, up});
  const double k = Airframe::kDrag / vehicle.body.mass, final = 0.5 * kG / k;
  EXPECT_NEAR(airframe.state().v_W.z(), final + (v0 - final) * std::exp(-2 * k), 0.01);
  EXPECT_NEAR(airframe.thrust(), 1.5 * u(1), 1e-6);
  run(0.5, {});  // the rotors run down within it
  const double falling = airframe.state().v_W.z();
  run(0.1, {});
  EXPECT_NEAR(airframe.state().v_W.z(), -kG / k + (falling + kG / k) * std::exp(-0.1 * k), 0.002);
}

TEST_F(AirframeTest, TurnsAboutEachAxisAsItsRotorsStand) {
  const double arm = airframe.arm(), m = vehicle.body.mass, r = vehicle.body.radius;
  const double less = 0.9 * u(1), more = 1.1 * u(1), spread = 0.1 * m * kG / 4;  // N of one rotor
  struct Case {
    Airframe::Rotors commands;
    Vec3 moment;
  };
  // Order: front right, rear left, front left, rear right.
  for (const auto& [commands, moment] : {Case{{more, less, more, less}, {0, -4 * arm * spread, 0}},
                                         Case{{less, more, more, less}, {4 * arm * spread, 0, 0}},
                                         Case{{more, more, less, less}, {0, 0, -4 * Airframe::kYawMoment * spread}}}) {
    airframe = Airframe(vehicle, ground);
    lift_off();
    const double even = u(1);
    run(1, {even, even, even, even});
    const Vec3 before = airframe.rates();
    run(0.3, commands);
    const Vec3 settled = airframe.rates();
    run(0.01, commands);
    const Vec3 angular = (airframe.rates() - settled) / 0.01;
    const Vec3 inertia = m * r * r * Vec3(0.25, 0.25, 0.5);
    EXPECT_NEAR((angular - moment.cwiseQuotient(inertia)).norm(), 0, 1e-3 * angular.norm()) << angular.transpose();
    EXPECT_NEAR(before.norm(), 0, 1e-12);
  }
}

TEST_F(AirframeTest, ATiltedThrustMovesItThatWayAndTheAirPushesIt) {
  lift_off();
  const double even = u(1);
  run(1, {even, even, even, even});
  const Vec3 before = airframe.state().v_W;
  run(0.2, {0.95 * even, 1.05 * even, 0.95 * even, 1.05 * even});  // nose down
  EXPECT_GT(airframe.state().v_W.x() - before.x(), 0.01);
  airframe = Airframe(vehicle, ground);
  lift_off();
  run(0.1, {even, even, even, even}, Vec3(0, 2, 0));
  EXPECT_NEAR(airframe.state().v_W.y(), 0.2, 0.005);
  EXPECT_NEAR(airframe.specific_force().y(), 2 - Airframe::kDrag * airframe.state().v_W.y(), 0.01);
}

}  // namespace
}  // namespace backwash::bench
