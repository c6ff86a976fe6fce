// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "core/config/config.hpp"
#include "core/sim/vehicle/quadrotor.hpp"

namespace backwash::sim {
namespace {

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
