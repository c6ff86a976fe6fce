// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/config/config.hpp"
#include "core/reach/response/error_dynamics.hpp"
#include "core/sim/vehicle/quadrotor.hpp"
#include "tests/sim/five_inch.hpp"

namespace backwash::sim {
namespace {

const State kStart{.p_W = Vec3(1, 2, 1.5), .v_W = Vec3::Zero()};

/// Specific force of the logged thrust command by the vehicle's thrust curve, m/s².
double specific_force(const Vehicle& v, double u) {
  const double f = v.propulsion.thr_mdl_fac;
  return v.propulsion.max_thrust * (f * u * u + (1 - f) * u) / v.body.mass;
}

void fly(Quadrotor& quad, double seconds, const Vec3& w_W = Vec3::Zero()) {
  for (int i = 0; i < std::lround(seconds / Quadrotor::kStep); ++i) quad.step(w_W, quad.state());
}

TEST(Quadrotor, HoversWhereItIsWithThrustEqualToWeight) {
  const Vehicle v = five_inch();
  Quadrotor quad(v, kStart);
  fly(quad, 5);
  EXPECT_LT((quad.state().p_W - kStart.p_W).norm(), 1e-12);
  EXPECT_LT(quad.state().v_W.norm(), 1e-12);
  EXPECT_NEAR(specific_force(v, quad.thrust()), kGravity, 1e-9);
  EXPECT_NEAR(quad.attitude().angularDistance(Eigen::Quaterniond::Identity()), 0, 1e-12);
  EXPECT_NEAR(quad.time(), 5, 1e-9);
}

TEST(Quadrotor, SettlesWhereASteadyPushMeetsTheSpring) {
  const Vehicle v = five_inch();
  Quadrotor quad(v, kStart);
  const Vec3 push(0.5, -0.3, 0.4);
  fly(quad, 10, push);
  const Vec3 e = quad.state().p_W - kStart.p_W;  // k_p e = w
  EXPECT_NEAR(e.x(), push.x() / v.controller.kp.horizontal, 1e-6);
  EXPECT_NEAR(e.y(), push.y() / v.controller.kp.horizontal, 1e-6);
  EXPECT_NEAR(e.z(), push.z() / v.controller.kp.vertical, 1e-6);
  EXPECT_LT(quad.acceleration().norm(), 1e-6);
}

TEST(Quadrotor, WithAnIntegratorItRestsOnItsSetPointAfterThePushHasMovedIt) {
  Vehicle v = five_inch();
  v.controller.velocity_integrator = {2, 2};
  Quadrotor quad(v, kStart);
  const Vec3 push(0.5, -0.3, 0.4);
  fly(quad, 1, push);
  EXPECT_GT((quad.state().p_W - kStart.p_W).x(), 0.5 * push.x() / v.controller.kp.horizontal);
  fly(quad, 60, push);
  EXPECT_LT((quad.state().p_W - kStart.p_W).norm(), 1e-6);
  EXPECT_LT(quad.acceleration().norm(), 1e-6);
}

/// Independent solution of lag·ȧ = u − a, u = −kp (p − r)(t − delay) − kd v(t − delay), r stepping at `latency`:
/// Runge-Kutta with a tenth of the simulator's step; returns p at every ms.
std::vector<double> step_response(double kp, double kd, double lag, double latency, double delay, double r) {
  const double h = 1e-4;
  const auto delay_steps = static_cast<std::size_t>(std::lround(delay / h));
  std::vector<Vec3> x{Vec3::Zero()};  // p, v, a
  std::vector<double> p;
  for (std::size_t i = 0; i < 30000; ++i) {
    if (i % 10 == 0) p.push_back(x[i].x());
    // State `shift` steps after i − delay, on a straight line between stored ones.
    const auto f = [&](const Vec3& y, double shift) {
      Vec3 past = y;
      if (delay_steps > 0) {
        past = Vec3::Zero();
        if (i >= delay_steps) past = x[i - delay_steps] + shift * (x[i - delay_steps + 1] - x[i - delay_steps]);
      }
      const double goal = (static_cast<double>(i) + shift) * h >= latency - 1e-9 ? r : 0;
      const double u = kp * (goal - past.x()) - kd * past.y();
      return Vec3(y.y(), y.z(), (u - y.z()) / lag);
    };
    const Vec3 k1 = f(x[i], 0), k2 = f(x[i] + h / 2 * k1, 0.5), k3 = f(x[i] + h / 2 * k2, 0.5),
               k4 = f(x[i] + h * k3, 1);
    x.push_back(x[i] + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4));
  }
  return p;
}

TEST(Quadrotor, StepResponseSolvesTheLoopsEquation) {
  for (const double delay : {0.0, 0.03})
    for (const int axis : {0, 1, 2}) {
      Vehicle v = five_inch();
      v.controller.feedback_delay = delay;
      Quadrotor quad(v, kStart);
      Setpoint goal{.p_W = kStart.p_W};
      goal.p_W[axis] += 0.2;
      quad.command(goal);
      const double kp = axis == 2 ? v.controller.kp.vertical : v.controller.kp.horizontal;
      const double kd = axis == 2 ? v.controller.kd.vertical : v.controller.kd.horizontal;
      const auto p = step_response(kp, kd, v.controller.attitude_lag, v.controller.latency, delay, 0.2);
      for (const double expected : p) {
        // The controller runs every ms: half a step of delay at up to 0.4 m/s is 0.2 mm.
        ASSERT_NEAR(quad.state().p_W[axis] - kStart.p_W[axis], expected, 4e-4) << quad.time();
        quad.step(Vec3::Zero(), quad.state());
      }
      EXPECT_NEAR(p.back(), 0.2, 1e-3);
    }
}

TEST(Quadrotor, ASetPointActsAfterTheLatencyAndNotBefore) {
  Quadrotor quad(five_inch(), kStart);
  fly(quad, 0.1);
  quad.command({.p_W = kStart.p_W + Vec3(0.1, 0, 0)});
  fly(quad, 0.02);
  EXPECT_EQ(quad.acceleration().norm(), 0);
  fly(quad, 0.001);
  EXPECT_GT(quad.acceleration().x(), 0);
}

TEST(Quadrotor, AnEstimateActsAfterTheFeedbackDelayAndNotBefore) {
  Vehicle v = five_inch();
  v.controller.feedback_delay = 0.05;
  Quadrotor quad(v, kStart);
  const State believed{.p_W = kStart.p_W - Vec3(0.1, 0, 0), .v_W = Vec3::Zero()};
  for (int i = 0; i < 50; ++i) quad.step(Vec3::Zero(), believed);
  EXPECT_EQ(quad.acceleration().norm(), 0);
  quad.step(Vec3::Zero(), believed);
  EXPECT_GT(quad.acceleration().x(), 0);
}

TEST(Quadrotor, FollowsAccelerationAndVelocityCommands) {
  Vehicle v = five_inch();
  v.controller.attitude_lag = v.controller.latency = 0;
  Quadrotor quad(v, kStart);
  // p = ½ a t² with all three commanded every ms: no error builds up.
  const Vec3 a(0.8, -0.5, 0.6);
  for (int i = 0; i < 1000; ++i) {
    const double t = i * Quadrotor::kStep;
    quad.command({.p_W = kStart.p_W + 0.5 * t * t * a, .v_W = t * a, .a_W = a});
    quad.step(Vec3::Zero(), quad.state());
  }
  EXPECT_LT((quad.state().p_W - kStart.p_W - 0.5 * a).norm(), 1e-6);
  EXPECT_LT((quad.state().v_W - a).norm(), 1e-6);
}

TEST(Quadrotor, FliesTheCentreThatReachPredicts) {
  // Two implementations of docs/model.md section 4: a matrix exponential per period there, integration at 1 kHz here.
  for (const char* name : {"builtin:quad-5in", "builtin:quad-7in"}) {
    const Vehicle v = config::load_vehicle(name).value();
    Quadrotor quad(v, kStart);
    reach::CentrePredictor centre(v, reach::Loop::vehicle, kStart, Vec3::Zero(), {.p_W = kStart.p_W});
    for (int i = 0; i < 300; ++i) {
      const double t = 0.02 * i;
      Setpoint s{.p_W = kStart.p_W + Vec3(std::sin(t), 1 - std::cos(t), 0.3 * std::sin(2 * t))};
      s.v_W = Vec3(std::cos(t), std::sin(t), 0.6 * std::cos(2 * t));
      s.a_W = Vec3(-std::sin(t), std::cos(t), -1.2 * std::sin(2 * t));
      quad.command(s);
      fly(quad, 0.02);
      ASSERT_LT((centre.step(s).p_W - quad.state().p_W).norm(), 1e-3) << t;
    }
  }
}

TEST(Quadrotor, ThrustAndTiltSaturate) {
  const Vehicle v = five_inch();
  const double max = v.propulsion.max_thrust / v.body.mass;
  struct Case {
    Vec3 goal;
    double force, tilt;
  };
  for (const Case& c : {Case{{0, 0, 100}, max, 0}, Case{{0, 0, -100}, 0.05 * max, 0},
                        Case{{100, 0, 0}, kGravity * std::sqrt(2), Quadrotor::kMaxTilt},
                        Case{{-70, 70, -100}, 0.05 * max * std::sqrt(2), Quadrotor::kMaxTilt}}) {
    Quadrotor quad(v, kStart);
    quad.command({.p_W = kStart.p_W + c.goal});
    fly(quad, 0.3);  // six lags, speed still far from ending the saturation
    const Vec3 f = quad.acceleration() + Vec3(0, 0, kGravity);
    EXPECT_NEAR(f.norm(), c.force, 0.05) << c.goal.transpose();
    EXPECT_NEAR(std::acos(f.z() / f.norm()), c.tilt, 0.02) << c.goal.transpose();
    EXPECT_NEAR(specific_force(v, quad.thrust()), f.norm(), 0.02);
  }
}

TEST(Quadrotor, AttitudeAndThrustExplainTheAcceleration) {
  const Vehicle v = five_inch();
  Quadrotor quad(v, kStart);
  const Vec3 w(0.3, -0.2, 0.1);
  for (int i = 0; i < 200; ++i) {
    const double t = 0.02 * i;
    quad.command({.p_W = kStart.p_W + Vec3(std::sin(t), std::cos(1.3 * t) - 1, 0.3 * std::sin(2 * t)), .yaw = 0.4 * t});
    fly(quad, 0.02, w);
    const Vec3 a = quad.attitude() * Vec3::UnitZ() * specific_force(v, quad.thrust()) - Vec3(0, 0, kGravity) + w;
    EXPECT_LT((a - quad.acceleration()).norm(), 0.02);
    const Vec3 x = quad.attitude() * Vec3::UnitX();
    // The set-point of latency ago is the one before this one; the yaw follows it at once.
    EXPECT_NEAR(std::atan2(x.y(), x.x()), std::max(0.4 * (t - 0.02), 0.0), 1e-9);
  }
}

TEST(Quadrotor, TurnsTheShortWayNoFasterThanItsYawRate) {
  Quadrotor quad(five_inch(), kStart);
  quad.command({.p_W = kStart.p_W, .yaw = 3.0});
  fly(quad, 1.02);
  EXPECT_NEAR(quad.attitude().angularDistance(Eigen::Quaterniond::Identity()), 1.0, 0.01);
  fly(quad, 3);
  quad.command({.p_W = kStart.p_W, .yaw = -3.0});
  fly(quad, 0.4);  // 0.283 rad away through π
  const Vec3 x = quad.attitude() * Vec3::UnitX();
  EXPECT_NEAR(std::atan2(x.y(), x.x()), -3.0, 1e-6);
}

TEST(Quadrotor, StandsOnTheGroundUntilThrustLiftsIt) {
  const State ground{.p_W = Vec3(0, 0, 0.1), .v_W = Vec3::Zero()};
  Quadrotor quad(five_inch(), ground, 0.1);
  quad.set_motors(false);
  fly(quad, 2, Vec3(0.5, 0.5, -0.2));
  EXPECT_EQ(quad.state().p_W, ground.p_W);
  EXPECT_EQ(quad.acceleration().norm(), 0);
  EXPECT_TRUE(quad.on_ground());
  EXPECT_NEAR(quad.thrust(), 0, 1e-9);

  quad.set_motors(true);
  quad.command({.p_W = Vec3(0, 0, 0.9)});
  fly(quad, 6);
  EXPECT_FALSE(quad.on_ground());
  EXPECT_NEAR(quad.state().p_W.z(), 0.9, 1e-3);

  quad.command({.p_W = Vec3(0, 0, -0.5)});
  fly(quad, 6);
  EXPECT_TRUE(quad.on_ground());
  EXPECT_EQ(quad.state().p_W.z(), 0.1);
  EXPECT_EQ(quad.state().v_W.norm(), 0);
}

TEST(Quadrotor, FallsFreelyWithMotorsOff) {
  Vehicle v = five_inch();
  v.controller.attitude_lag = 0;
  Quadrotor quad(v, kStart);
  quad.set_motors(false);
  fly(quad, 0.4);
  EXPECT_NEAR(quad.state().p_W.z(), kStart.p_W.z() - 0.5 * kGravity * 0.4 * 0.4, 1e-9);
}

/// Without gains of its own: what is commanded is the acceleration alone.
Quadrotor open_loop(const State& start) {
  Vehicle v = config::load_vehicle("builtin:quad-5in").value();
  v.controller.kp = v.controller.kd = {0, 0};
  v.controller.latency = 0;
  return Quadrotor(v, start, 0.0);
}
void step(Quadrotor& q, double a, int steps) {
  for (int n = 0; n < steps; ++n) {
    q.command({Vec3::Zero(), Vec3::Zero(), Vec3(0, 0, a)});
    q.step(Vec3::Zero(), q.state());
  }
}

TEST(QuadrotorFloor, StopsWhatComesDownWhileItBrakes) {
  Quadrotor q = open_loop({Vec3(0, 0, 0.2), Vec3(0, 0, -0.5)});
  double lowest = 1;
  for (int n = 0; n < 1000; ++n) {
    step(q, 0.05, 1);
    lowest = std::min(lowest, q.state().p_W.z());
  }
  EXPECT_EQ(lowest, 0.0);
}

TEST(QuadrotorFloor, LetsGoWhatAcceleratesUpwards) {
  Quadrotor q = open_loop({Vec3(0, 0, 0.0), Vec3::Zero()});
  step(q, -9.0, 500);
  EXPECT_TRUE(q.on_ground());
  step(q, 1.0, 1000);
  EXPECT_FALSE(q.on_ground());
  EXPECT_GT(q.state().p_W.z(), 0.2);
}

}  // namespace
}  // namespace backwash::sim
