// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backwash {

/// The vehicle and its controller, the content of a vehicle file (docs/interfaces.md, "Vehicle file").
struct Vehicle {
  struct HorizontalVertical {
    double horizontal = 0, vertical = 0;
  };
  std::string name;
  struct {
    double radius = 0;           ///< collision radius, m
    double diagonal_radius = 0;  ///< r0 of the ground term, m
    double rotor_radius = 0;     ///< m
    double mass = 0;             ///< kg
  } body;
  struct {
    HorizontalVertical kp;      ///< position gain, 1/s²
    HorizontalVertical kd;      ///< velocity gain, 1/s
    double latency = 0;         ///< set-point to controller, s
    double feedback_delay = 0;  ///< measurement to action, s
    double attitude_lag = 0;    ///< first-order lag of the acceleration, s
    /// Integral gain of the velocity loop, 1/s²: a push is held off, not rested against. 0: none; both or neither.
    HorizontalVertical velocity_integrator = {};
  } controller;
  struct {
    double position = 0;  ///< VIO and map error, m
  } estimation;
  struct {
    double max_thrust = 0;   ///< all rotors at nominal battery, N
    double thr_mdl_fac = 0;  ///< f of T = max_thrust·(f u² + (1 − f) u)
  } propulsion;
  struct {
    double v_max = 0;  ///< m/s, per axis
    double a_max = 0;  ///< m/s², per axis
  } limits;
  struct {
    double position = 0;  ///< half axis of the first set, m
    double velocity = 0;  ///< half axis of the first set, m/s
  } initial_error;
};

}  // namespace backwash
