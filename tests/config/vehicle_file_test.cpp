// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include "tests/config/file_texts.hpp"

namespace backwash::config {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kKp = "kp = { horizontal = 10.0, vertical = 12.0 }   # 1/s²\n";
constexpr const char* kKd = "kd = { horizontal = 5.5, vertical = 6.0 }     # 1/s\n";

TEST(LoadVehicle, MultipliesPx4CascadedGains) {
  // docs/model.md section 4: k_p = P_pos·P_vel, k_d = P_vel; PX4's defaults 0.95, 1.8, 1.0, 4.0 where a key is absent.
  std::string text = replaced(shipped("quad-5in.vehicle.toml"), kKp, "px4 = { MPC_XY_P = 1.5, MPC_Z_VEL_P_ACC = 5 }\n");
  const TemporaryFile file(replaced(text, kKd, ""));
  const auto v = load_vehicle(file.path);
  ASSERT_TRUE(v) << v.error().message;
  EXPECT_DOUBLE_EQ(v->controller.kp.horizontal, 1.5 * 1.8);
  EXPECT_DOUBLE_EQ(v->controller.kd.horizontal, 1.8);
  EXPECT_DOUBLE_EQ(v->controller.kp.vertical, 1.0 * 5);
  EXPECT_DOUBLE_EQ(v->controller.kd.vertical, 5);
}

TEST(LoadVehicle, WantsEitherGainsOrPx4) {
  const std::string text = shipped("quad-5in.vehicle.toml");
  const std::string right = "needs either both kp and kd, or px4 and neither of them";
  EXPECT_THAT(message(true, replaced(text, kKp, "px4 = {}\n")), HasSubstr(right));
  EXPECT_THAT(message(true, replaced(text, kKd, "")), HasSubstr("key 'controller.kd' = (missing): " + right));
  EXPECT_THAT(message(true, replaced(replaced(text, kKd, ""), kKp, "")), HasSubstr(right));
  EXPECT_THAT(message(true, replaced(text, kKp, std::string(kKp) + "px4 = {}\n")), HasSubstr(right));
}

TEST(LoadVehicle, RefusesAnUnstableLoop) {
  // Without delay s²(lag s + 1) + kd s + kp is stable iff kd > kp·lag (Routh): for kp 12, kd 6 the limit is lag 0.5 s,
  // for the horizontal 10, 5.5 it is 0.55 s.
  const std::string text = shipped("quad-5in.vehicle.toml"), lag = "attitude_lag = 0.05";
  EXPECT_EQ(message(true, replaced(text, lag, "attitude_lag = 0.499")), "");
  EXPECT_THAT(message(true, replaced(text, lag, "attitude_lag = 0.501")), HasSubstr("unstable"));
  // Double integrator with delay d: |L| = 1 at ω² = (kd² + √(kd⁴ + 4kp²))/2, limit d = atan(kd ω/kp)/ω = 0.2007 s for
  // (12, 6) and 0.2194 s for (10, 5.5).
  const std::string no_lag = replaced(text, lag, "attitude_lag = 0.0"), delay = "feedback_delay = 0.0 ";
  EXPECT_EQ(message(true, replaced(no_lag, delay, "feedback_delay = 0.200 ")), "");
  EXPECT_THAT(message(true, replaced(no_lag, delay, "feedback_delay = 0.201 ")), HasSubstr("unstable"));
}

TEST(LoadVehicle, ReadsTheVelocitysIntegratorAndHasNoneWithoutTheKey) {
  const std::string text = shipped("quad-5in.vehicle.toml"),
                    with = "velocity_integrator = { horizontal = 0.4, vertical = 2 }\n";
  const auto integrator = [](const std::string& content) {
    const TemporaryFile file(content);
    const auto v = load_vehicle(file.path);
    EXPECT_TRUE(v) << v.error().message;
    return v ? v->controller.velocity_integrator : Vehicle::HorizontalVertical{-1, -1};
  };
  EXPECT_EQ(integrator(text).horizontal, 0);
  EXPECT_EQ(integrator(text).vertical, 0);
  EXPECT_EQ(integrator(replaced(text, kKp, with + kKp)).horizontal, 0.4);
  EXPECT_EQ(integrator(replaced(text, kKp, with + kKp)).vertical, 2);
  const auto px4 = [&](const char* gains) { return replaced(replaced(text, kKd, ""), kKp, gains); };
  EXPECT_EQ(integrator(px4("px4 = {}\n")).horizontal, 0);
  EXPECT_EQ(integrator(px4("px4 = { MPC_XY_VEL_I_ACC = 0.4, MPC_Z_VEL_I_ACC = 2 }\n")).vertical, 2);
  EXPECT_THAT(message(true, px4(("px4 = {}\n" + with).c_str())), HasSubstr("px4 has MPC_XY_VEL_I_ACC"));
  EXPECT_THAT(message(true, px4("px4 = { MPC_XY_VEL_I_ACC = 0.4 }\n")),
              HasSubstr("needs both horizontal and vertical"));
  EXPECT_THAT(message(true, replaced(text, kKp, std::string(kKp) + "velocity_integrator = { horizontal = 0.4 }\n")),
              HasSubstr("velocity_integrator.vertical"));
}

TEST(LoadVehicle, RefusesAnIntegratorThatMakesTheLoopUnstable) {
  // Without lag and delay s³ + kd s² + (kp + ki) s + ki kp/kd is stable iff kd² (kp + ki) > ki kp (Routh). With kp 20
  // and kd 2 that is ki < 5.
  const auto file = [&](const char* ki) {
    std::string text = replaced(shipped("quad-5in.vehicle.toml"), "attitude_lag = 0.05", "attitude_lag = 0.0");
    text = replaced(text, kKp,
                    std::string("velocity_integrator = { horizontal = ") + ki +
                        ", vertical = 1 }\nkp = { horizontal = 20.0, vertical = 12.0 }\n");
    return replaced(text, kKd, "kd = { horizontal = 2.0, vertical = 6.0 }\n");
  };
  EXPECT_EQ(message(true, file("4.99")), "");
  EXPECT_THAT(message(true, file("5.01")), HasSubstr("unstable"));
}

TEST(LoadVehicle, RefusesThrustBelowWeight) {
  EXPECT_THAT(message(true, replaced(shipped("quad-5in.vehicle.toml"), "max_thrust = 18.0", "max_thrust = 8.8")),
              HasSubstr("key 'propulsion.max_thrust' = 8.8: needs more than the vehicle's weight"));
}

TEST(LoadVehicle, RefusesAMissingOrEmptyName) {
  const std::string text = shipped("quad-5in.vehicle.toml");
  EXPECT_THAT(message(true, replaced(text, "name = \"quad-5in\"", "")), HasSubstr("key 'name' = (missing)"));
  EXPECT_THAT(message(true, replaced(text, "\"quad-5in\"", "\"\"")), HasSubstr("key 'name' = "));
  EXPECT_THAT(message(true, replaced(text, "\"quad-5in\"", "5")), HasSubstr("key 'name' = 5: needs a string"));
}

TEST(LoadVehicle, TellsWhatCannotBeFound) {
  for (const char* path : {"builtin:quad-6in", "/nonexistent/v.toml", "/tmp"}) {
    const auto v = load_vehicle(path);
    ASSERT_FALSE(v);
    EXPECT_EQ(v.error().kind, ConfigError::Kind::not_found);
    EXPECT_THAT(v.error().message, StartsWith(std::string(path) + ": "));
  }
  EXPECT_THAT(load_vehicle("builtin:quad-6in").error().message, HasSubstr("builtin:quad-5in builtin:quad-7in"));
}

}  // namespace
}  // namespace backwash::config
