// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/disturbance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>

namespace backwash::adapt {
namespace {

/// A loop with its delays and lag, in steps of 1 ms, under a push that is known; rows at `rate`.
struct FlownLoop {
  Vehicle vehicle;
  Vec3 p = Vec3::Zero(), v = Vec3::Zero(), rotors = Vec3::Zero(), a = Vec3::Zero();
  std::deque<std::pair<Vec3, Vec3>> seen;
  std::deque<Setpoint> sent;
  double t = 0;

  static Setpoint asked(double t) {
    Setpoint s;
    s.p_W = Vec3(std::sin(t), 0, 1), s.v_W = Vec3(std::cos(t), 0, 0), s.a_W = Vec3(-std::sin(t), 0, 0);
    return s;
  }
  static Vec3 push(double t) { return {0.4 * std::sin(6 * t), 0.2, -0.3 * std::cos(9 * t)}; }
  void step() {
    constexpr double kStep = 0.001;
    const auto& c = vehicle.controller;
    seen.emplace_front(p, v), sent.push_front(asked(t));
    const auto felt = seen[std::min(seen.size() - 1, static_cast<std::size_t>(std::lround(c.feedback_delay / kStep)))];
    const auto heard = sent[std::min(sent.size() - 1, static_cast<std::size_t>(std::lround(c.latency / kStep)))];
    const Vec3 u = heard.a_W + c.kp.horizontal * (heard.p_W - felt.first) + c.kd.horizontal * (heard.v_W - felt.second);
    rotors += (1 - std::exp(-kStep / c.attitude_lag)) * (u - rotors);
    a = rotors + push(t);
    p += kStep * v, v += kStep * a, t += kStep;
  }
};

/// Root mean square of what is told less the push, over 10 s.
double error(double rate_hz) {
  FlownLoop loop;
  auto& c = loop.vehicle.controller;
  c.kp = {6, 6}, c.kd = {4, 4}, c.latency = 0.03, c.feedback_delay = 0.02, c.attitude_lag = 0.06;
  Disturbance disturbance(loop.vehicle);
  double sum = 0, count = 0;
  const int each = static_cast<int>(std::lround(1000 / rate_hz));
  for (int k = 0; k < 10000; ++k) {
    loop.step();
    if (k % each != 0) continue;
    const auto w = disturbance.add({loop.t, {loop.p, loop.v}, loop.a, FlownLoop::asked(loop.t)});
    EXPECT_EQ(w.has_value(), loop.t > 0.3901) << loop.t;
    if (w) sum += (*w - FlownLoop::push(loop.t)).squaredNorm(), count += 1;
  }
  return std::sqrt(sum / count);
}

TEST(Disturbance, IsThePushThatTheLoopWasFlownWith) {
  EXPECT_LT(error(200), 0.02);
  EXPECT_LT(error(50), 0.05);
}

TEST(Disturbance, AfterAGapAndForWhatIsNotFiniteNothingIsTold) {
  Vehicle vehicle;
  vehicle.controller.kp = {6, 6}, vehicle.controller.kd = {4, 4}, vehicle.controller.attitude_lag = 0.05;
  Disturbance disturbance(vehicle);
  FlownSample sample;
  int told = 0;
  for (int k = 0; k < 100; ++k) sample.t_s += 0.02, told += disturbance.add(sample).has_value();
  EXPECT_NEAR(told, 85, 1);
  EXPECT_FALSE(disturbance.add(sample));  // not later
  sample.t_s += 0.02, sample.a_W.y() = std::nan("");
  EXPECT_FALSE(disturbance.add(sample));
  sample.a_W.y() = 0, sample.t_s += 0.02;
  EXPECT_TRUE(disturbance.add(sample));
  sample.t_s += 0.5;
  EXPECT_FALSE(disturbance.add(sample));
}

}  // namespace
}  // namespace backwash::adapt
