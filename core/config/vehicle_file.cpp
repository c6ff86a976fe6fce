// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <sstream>

#include "core/config/strict_table.hpp"
#include "core/types/geometry.hpp"

namespace backwash::config {
namespace {

/// PX4's cascaded position control, its parameters' names and defaults.
struct Px4Gains {
  double xy_p = 0.95, xy_vel_p_acc = 1.8, z_p = 1.0, z_vel_p_acc = 4.0;
  double xy_vel_i_acc = 0, z_vel_i_acc = 0;  // these only as they are written
};

constexpr Range kKp{0, 200, true};    // 1/s²
constexpr Range kKd{0, 100, true};    // 1/s
constexpr Range kDelay{0, 0.3};       // s
constexpr Range kRadius{0, 5, true};  // m
constexpr Range kPx4Gain{0, 20, true};
constexpr Range kKi{0, 20};  // 1/s²

std::vector<NumberKey> vehicle_keys(Vehicle& v, Px4Gains& px4) {
  using enum NumberKey::Presence;
  return {
      {"body.radius", &v.body.radius, kRadius},
      {"body.diagonal_radius", &v.body.diagonal_radius, kRadius},
      {"body.rotor_radius", &v.body.rotor_radius, kRadius},
      {"body.mass", &v.body.mass, {0, 100, true}},
      {"controller.kp.horizontal", &v.controller.kp.horizontal, kKp, with_parent},
      {"controller.kp.vertical", &v.controller.kp.vertical, kKp, with_parent},
      {"controller.kd.horizontal", &v.controller.kd.horizontal, kKd, with_parent},
      {"controller.kd.vertical", &v.controller.kd.vertical, kKd, with_parent},
      {"controller.px4.MPC_XY_P", &px4.xy_p, kPx4Gain, optional},
      {"controller.px4.MPC_XY_VEL_P_ACC", &px4.xy_vel_p_acc, kPx4Gain, optional},
      {"controller.px4.MPC_Z_P", &px4.z_p, kPx4Gain, optional},
      {"controller.px4.MPC_Z_VEL_P_ACC", &px4.z_vel_p_acc, kPx4Gain, optional},
      {"controller.px4.MPC_XY_VEL_I_ACC", &px4.xy_vel_i_acc, kKi, optional},
      {"controller.px4.MPC_Z_VEL_I_ACC", &px4.z_vel_i_acc, kKi, optional},
      {"controller.velocity_integrator.horizontal", &v.controller.velocity_integrator.horizontal, kKi, with_parent},
      {"controller.velocity_integrator.vertical", &v.controller.velocity_integrator.vertical, kKi, with_parent},
      {"controller.latency", &v.controller.latency, kDelay, optional},
      {"controller.feedback_delay", &v.controller.feedback_delay, kDelay, optional},
      {"controller.attitude_lag", &v.controller.attitude_lag, {0, 1}, optional},
      {"estimation.position", &v.estimation.position, {0, 1}},
      {"propulsion.max_thrust", &v.propulsion.max_thrust, {0, 5000, true}},
      {"propulsion.thr_mdl_fac", &v.propulsion.thr_mdl_fac, {0, 1}},
      {"limits.v_max", &v.limits.v_max, {0, 20, true}},
      {"limits.a_max", &v.limits.a_max, {0, 30, true}},
      {"initial_error.position", &v.initial_error.position, {0, 1}},
      {"initial_error.velocity", &v.initial_error.velocity, {0, 5}},
  };
}

/// Whether s²(lag·s + 1) + (kd·s + kp)(1 + ki/(kd·s))·e^(−delay·s) has its zeros in the left half plane. The open
/// loop's magnitude falls monotonically, so it has one crossover ω, and by Nyquist the loop is stable iff the phase
/// margin there is positive: atan(kd ω/kp) > atan(lag ω) + delay·ω + atan(ki/(kd ω)).
bool stable(double kp, double kd, double ki, double delay, double lag) {
  double low = 0, high = 1;
  const auto loop_gain = [&](double w) {
    return std::hypot(kp, kd * w) * std::hypot(1, ki / (kd * w)) / (w * w * std::hypot(1, lag * w));
  };
  while (loop_gain(high) > 1) high *= 2;
  for (int i = 0; i < 100; ++i) (loop_gain((low + high) / 2) > 1 ? low : high) = (low + high) / 2;
  return std::atan(kd * high / kp) > std::atan(lag * high) + delay * high + std::atan(ki / (kd * high));
}

/// What the ranges of single keys cannot say.
tl::expected<void, ConfigError> check_together(const StrictTable& file, const Vehicle& v) {
  const double weight = v.body.mass * kGravity;
  if (v.propulsion.max_thrust <= weight) {
    std::ostringstream right;
    right << "needs more than the vehicle's weight, " << weight << " N";
    return tl::unexpected(file.error("propulsion.max_thrust", right.str()));
  }
  const auto& c = v.controller;
  const auto& ki = c.velocity_integrator;
  if ((ki.horizontal > 0) != (ki.vertical > 0))
    return tl::unexpected(file.error("controller.velocity_integrator",
                                     "needs both horizontal and vertical above 0, or neither (an autopilot that holds "
                                     "height by another integrator: its equal here)"));
  if (!stable(c.kp.horizontal, c.kd.horizontal, ki.horizontal, c.feedback_delay, c.attitude_lag) ||
      !stable(c.kp.vertical, c.kd.vertical, ki.vertical, c.feedback_delay, c.attitude_lag))
    return tl::unexpected(
        file.error("controller",
                   "loop is unstable; needs more kd/kp, or less feedback_delay, attitude_lag and velocity_integrator"));
  return {};
}

}  // namespace

tl::expected<Vehicle, ConfigError> load_vehicle(const std::string& path) {
  constexpr std::string_view kReadElsewhere[] = {"name"};
  const auto file = StrictTable::open(path, ".vehicle.toml");
  if (!file) return tl::unexpected(file.error());
  Vehicle vehicle;
  Px4Gains px4;
  if (auto read = file->read(vehicle_keys(vehicle, px4), kReadElsewhere); !read) return tl::unexpected(read.error());
  auto name = file->text("name");
  if (!name) return tl::unexpected(name.error());
  vehicle.name = std::move(*name);

  const bool has_px4 = file->has("controller.px4");
  for (const char* gain : {"controller.kp", "controller.kd"})
    if (file->has(gain) == has_px4)
      return tl::unexpected(file->error(gain, "needs either both kp and kd, or px4 and neither of them"));
  if (has_px4) {
    vehicle.controller.kp = {px4.xy_p * px4.xy_vel_p_acc, px4.z_p * px4.z_vel_p_acc};
    vehicle.controller.kd = {px4.xy_vel_p_acc, px4.z_vel_p_acc};
    if (file->has("controller.velocity_integrator"))
      return tl::unexpected(file->error("controller.velocity_integrator", "needs kp and kd; px4 has MPC_XY_VEL_I_ACC"));
    vehicle.controller.velocity_integrator = {px4.xy_vel_i_acc, px4.z_vel_i_acc};
  }
  if (auto sound = check_together(*file, vehicle); !sound) return tl::unexpected(sound.error());
  return vehicle;
}

}  // namespace backwash::config
