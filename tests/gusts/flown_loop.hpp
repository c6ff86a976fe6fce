// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>

#include "core/adapt/in_flight.hpp"
#include "tests/gusts/gust_air.hpp"

namespace gusts {

/// What is flown and how it differs from what the vehicle and model file say.
struct Trial {
  Form form = Form::first_order;
  double tau_s = 0.15;                         ///< true
  double tau_low_s = 0.15, tau_high_s = 0.15;  ///< as calibrated
  Bursts bursts{};
  double rate_hz = 50;           ///< of the odometry
  double position_noise = 0;     ///< standard deviation of the odometry's position, m
  double velocity_noise = 0;     ///< of its velocity, m/s
  double vibration = 0;          ///< amplitude in its position, at 23.7 Hz, m
  double factor = 1;             ///< on the variance
  double since_s = 0;            ///< from then on
  bool walls_only = false;       ///< 4 s of every 10 are near a wall, and the factor acts only there
  double load = 0;               ///< share of the mass that the controller does not know of
  double delay = 0, lag = 0;     ///< of measurements and of the attitude, beside those of the vehicle file, s
  double command_delay = 0;      ///< of set-points, the same
  double push = 0, allowed = 0;  ///< steady, along x, m/s²; the largest that the model allows for
  double speed = 1;              ///< largest, m/s; 0: hovers
  double seconds = 120;
  std::uint64_t seed = 1;
};

using Controller = decltype(backwash::Vehicle::controller);
Controller quad_5in();
/// PX4's cascade with its default gains, 0.95 and 1.8.
Controller px4();

/// A vehicle of its own: position, velocity and attitude lag by Runge and Kutta in steps of 2.5 ms under GustAir, the
/// set-point of each tick held and late, what is fed back as late as the loop has it. Nothing of core/reach is in it.
class FlownLoop {
 public:
  FlownLoop(const Controller& controller, const Trial& trial);
  /// On to the next tick, 20 ms later.
  backwash::adapt::AirTick tick();
  double t() const noexcept { return t_; }
  double factor = 1;  ///< on the variance, from now on; the trial's is beside it
  backwash::Setpoint asked(double t) const;

 private:
  struct Body {
    Vec3 p = Vec3::Zero(), v = Vec3::Zero(), rotors = Vec3::Zero();
  };
  Body rate(const Body& body, const Vec3& asked, const Vec3& w) const;
  void step();

  Controller controller_;
  Trial trial_;
  GustAir air_;
  Body body_;
  std::deque<Body> seen_;                // newest first, in steps
  std::deque<backwash::Setpoint> sent_;  // the same
  double t_ = 0, next_ = 0;
  std::int64_t ticks_ = 0;
};

/// What it learned.
struct Learned {
  std::optional<double> alarm_s;    ///< when errors of any class were first called larger than promised
  std::optional<double> exposed_s;  ///< in the class that the factor acts in: time in it from then on until that, s
  double factor = 1;                ///< of that class, at the end
  backwash::adapt::Cause cause = backwash::adapt::Cause::none;  ///< the same
  bool air = false;                                             ///< any class was called rougher air at any time
  std::optional<double> calmer;                                 ///< of that class, at the end
  int beyond = 0;                                               ///< errors beyond the level of 1e-2
  double promised = 0;                                          ///< how many were
  double air_kept = 1;                                          ///< largest factor that outlives the flight
};
Learned fly(const Controller& controller, const Trial& trial);

}  // namespace gusts
