// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <functional>

#include "core/adapt/in_flight.hpp"
#include "tests/gusts/gust_air.hpp"

namespace backwash::adapt::test {

inline const Vec3 kSigma(0.06, 0.03, 0.035);
inline constexpr std::int64_t kBegin_ns = 1'700'000'000'000'000'000;  // stamps are of wall clocks

inline InFlightConstants constants() {
  InFlightConstants c;
  c.controller = {{10, 12}, {5.5, 6}, 0.02, 0, 0.05};
  return c;
}

/// A vehicle in steps of 2.5 ms under gusts of a known variance, with the loop's delays, and the ticks that see it.
struct GustyFlight {
  gusts::GustAir air;
  InFlight learnt;
  double rate_hz = 50, velocity_noise = 0, factor = 1;
  Vec3 sigma = kSigma;
  AirClass place = AirClass::wall;
  std::function<void(AirTick&)> spoil = [](AirTick&) {};
  Vec3 p = Vec3::Zero(), v = Vec3::Zero(), rotors = Vec3::Zero();
  std::deque<Setpoint> sent = std::deque<Setpoint>(1);
  double t = 0, next = 0;
  int rises = 0;

  explicit GustyFlight(std::uint64_t seed, const InFlightConstants& c = constants(),
                       gusts::Form form = gusts::Form::first_order)
      : air(form, 0.15, {}, seed), learnt(c) {}

  static Setpoint asked(double t) {
    return {Vec3(std::sin(t), 0, 1), Vec3(std::cos(t), 0, 0), Vec3(-std::sin(t), 0, 0), 0};
  }
  void step() {
    constexpr double dt = gusts::GustAir::kStep;
    constexpr std::size_t kLatency = 8;  // steps: 20 ms
    const Vec3 w = std::sqrt(factor) * kSigma.cwiseSqrt().cwiseProduct(air.step());
    const Setpoint& heard = sent[std::min(sent.size() - 1, kLatency)];
    const auto c = constants().controller;
    const Vec3 kp(c.kp.horizontal, c.kp.horizontal, c.kp.vertical), kd(c.kd.horizontal, c.kd.horizontal, c.kd.vertical);
    const Vec3 u = heard.a_W + kp.cwiseProduct(heard.p_W - p) + kd.cwiseProduct(heard.v_W - v);
    rotors += (1 - std::exp(-dt / c.attitude_lag)) * (u - rotors);
    p += dt * v, v += dt * (rotors + w), t += dt;
    if (t < next - dt / 2)
      sent.push_front(sent.front());
    else
      see();
    if (sent.size() > kLatency + 1) sent.pop_back();
  }
  void see() {
    next += 1 / rate_hz;
    const Setpoint command = asked(t);
    sent.push_front(command);
    const Vec3 noise(air.normal(), air.normal(), air.normal());
    AirTick tick{kBegin_ns + std::llround(t * 1e9), 0, {p, v + velocity_noise * noise}, command, sigma, place};
    spoil(tick);
    const AirFactors before = learnt.factors();
    const bool grew = learnt.add(tick);
    rises += grew;
    EXPECT_EQ(grew, learnt.factors() != before);
    for (std::size_t k = 0; k < kAirClasses && !tick.rests; ++k)
      EXPECT_GE(learnt.factors()[k], before[k]) << "a factor fell in motion";
  }
  /// Starts on the trajectory, so that the loop's own transient is none of the air's.
  GustyFlight& fly(double seconds) {
    if (t == 0) p = asked(0).p_W, v = asked(0).v_W, rotors = asked(0).a_W, sent.front() = asked(0);
    for (const double end = t + seconds; t < end;) step();
    return *this;
  }
  double wall() const { return learnt.factors()[static_cast<std::size_t>(AirClass::wall)]; }
};

}  // namespace backwash::adapt::test
