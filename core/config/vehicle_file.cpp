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

std::vector<Key> vehicle_keys(Vehicle& v, Px4Gains& px4) {
  using enum Key::Presence;
  // clang-format off
  return {
      {"name", &v.name, {}, required, "", "for people"},
      {"body.radius", &v.body.radius, kRadius, required, "m", "collision radius", "from the centre to the farthest tip of a turning propeller, plus guard"},
      {"body.diagonal_radius", &v.body.diagonal_radius, kRadius, required, "m", "r0 of the ground term", "from the centre to the rotor axis, plus the rotor's radius"},
      {"body.rotor_radius", &v.body.rotor_radius, kRadius, required, "m", "of one rotor", "half the propeller's diameter"},
      {"body.mass", &v.body.mass, {0, 100, true}, required, "kg", "take-off mass", "scale, battery in"},
      {"controller.kp.horizontal", &v.controller.kp.horizontal, kKp, with_parent, "1/s²", "position gain", "autopilot's gains, or acceleration per metre of error after a step in a log", "or `px4`"},
      {"controller.kp.vertical", &v.controller.kp.vertical, kKp, with_parent, "1/s²", "along z", {}, "or `px4`"},
      {"controller.kd.horizontal", &v.controller.kd.horizontal, kKd, with_parent, "1/s", "velocity gain", "acceleration per m/s of velocity error", "or `px4`"},
      {"controller.kd.vertical", &v.controller.kd.vertical, kKd, with_parent, "1/s", "along z", {}, "or `px4`"},
      {"controller.px4.MPC_XY_P", &px4.xy_p, kPx4Gain, optional, "1/s", "in place of kp and kd: k_p = P·P_vel, k_d = P_vel"},
      {"controller.px4.MPC_XY_VEL_P_ACC", &px4.xy_vel_p_acc, kPx4Gain, optional, "1/s", "P_vel"},
      {"controller.px4.MPC_Z_P", &px4.z_p, kPx4Gain, optional, "1/s", "along z"},
      {"controller.px4.MPC_Z_VEL_P_ACC", &px4.z_vel_p_acc, kPx4Gain, optional, "1/s", "along z"},
      {"controller.px4.MPC_XY_VEL_I_ACC", &px4.xy_vel_i_acc, kKi, optional, "1/s²", "as velocity_integrator; not PX4's own default"},
      {"controller.px4.MPC_Z_VEL_I_ACC", &px4.z_vel_i_acc, kKi, optional, "1/s²", "along z"},
      {"controller.velocity_integrator.horizontal", &v.controller.velocity_integrator.horizontal, kKi, with_parent, "1/s²", "integral gain of the velocity loop, with kp and kd; both axes above 0, or neither", "MPC_XY_VEL_I_ACC, PSC_VELXY_I", "0"},
      {"controller.velocity_integrator.vertical", &v.controller.velocity_integrator.vertical, kKi, with_parent, "1/s²", "along z", "MPC_Z_VEL_I_ACC; where another integrator holds height (PSC_ACCZ_I), k_d over the time in which a shift decays", "0"},
      {"controller.latency", &v.controller.latency, kDelay, optional, "s", "set-point to controller", "from a set-point's stamp to its echo in the autopilot's log; half of TIMESYNC's round trip at least"},
      {"controller.feedback_delay", &v.controller.feedback_delay, kDelay, optional, "s", "measurement to action", "estimator's delay in its log"},
      {"controller.attitude_lag", &v.controller.attitude_lag, {0, 1}, optional, "s", "first-order lag of the acceleration", "∫(1 − angle/set-point) dt after a step of the attitude's set-point"},
      {"estimation.position", &v.estimation.position, {0, 1}, required, "m", "VIO and map error", "largest distance from truth (tape, motion capture, return to the start) after a typical flight"},
      {"propulsion.max_thrust", &v.propulsion.max_thrust, {0, 5000, true}, required, "N", "all rotors, nominal battery; more than the weight", "thrust stand, or mass·g over f u² + (1 − f) u at the hover's u"},
      {"propulsion.thr_mdl_fac", &v.propulsion.thr_mdl_fac, {0, 1}, required, "", "f of T = max_thrust (f u² + (1 − f) u)", "PX4's THR_MDL_FAC; thrust stand at several u"},
      {"limits.v_max", &v.limits.v_max, {0, 20, true}, required, "m/s", "per axis", "what you want to fly; the sets are from hover data, so stay slow indoors"},
      {"limits.a_max", &v.limits.a_max, {0, 30, true}, required, "m/s²", "per axis", "below the autopilot's tilt limit"},
      {"initial_error.position", &v.initial_error.position, {0, 1}, required, "m", "half axis of the first set", "estimate against command in hover, 3 standard deviations"},
      {"initial_error.velocity", &v.initial_error.velocity, {0, 5}, required, "m/s", "half axis of the first set", "the same of velocity"},
  };
  // clang-format on
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

std::string vehicle_file_keys() {
  Vehicle vehicle;
  Px4Gains px4;
  return markdown(vehicle_keys(vehicle, px4));
}

tl::expected<Vehicle, ConfigError> load_vehicle_with(const std::string& path, const std::vector<ChangedKey>& changed) {
  auto file = StrictTable::open(path, ".vehicle.toml");
  if (!file) return tl::unexpected(file.error());
  for (const auto& [key, value] : changed) file->change(key, value);
  Vehicle vehicle;
  Px4Gains px4;
  if (auto read = file->read(vehicle_keys(vehicle, px4)); !read) return tl::unexpected(read.error());
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

tl::expected<Vehicle, ConfigError> load_vehicle(const std::string& path) { return load_vehicle_with(path, {}); }

}  // namespace backwash::config
