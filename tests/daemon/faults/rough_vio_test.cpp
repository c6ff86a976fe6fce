// SPDX-License-Identifier: BSD-3-Clause
// Flights on the worst odometry that the vehicle file allows: none is held (docs/faults.md rows 3, 7, 41).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

#include "tests/daemon/lockstep/eights.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

/// A VIO as bad as the vehicle file allows (estimation.position, and its velocity by σ / 0.5 s), delivered with up to
/// 19 ms of delay and now and then not at all.
class RoughVio {
 public:
  RoughVio(Lockstep& rig, std::uint64_t seed) : rig_(rig), rng_(seed) {}
  void before_tick() {
    rig_.vio_age_steps = std::uniform_int_distribution(0, 19)(rng_);
    rig_.vio_on = std::uniform_real_distribution(0., 1.)(rng_) > 0.02;
  }
  void operator()(OdometrySample& s) {
    // The rig's own drift is 0.75 σ; this noise fills the rest at three standard deviations.
    const double sigma = vehicle_5in().estimation.position;
    for (int axis = 0; axis < 3; ++axis) {
      s.state.p_W[axis] += 0.25 / 3 / std::sqrt(3.) * sigma * normal_(rng_);
      s.state.v_W[axis] += sigma / 0.5 / 3 * normal_(rng_);
    }
    const Vec3 turn(normal_(rng_), normal_(rng_), normal_(rng_));
    const Eigen::Quaterniond noise(Eigen::AngleAxisd(0.3 * kDegree * turn.norm(), turn.normalized()));
    const Eigen::Quaterniond q = noise * Eigen::Quaterniond(s.q[0], s.q[1], s.q[2], s.q[3]);
    s.q = {q.w(), q.x(), q.y(), q.z()};
    // Taken up to its age before it is received.
    s.received_ns += std::uniform_int_distribution(0, rig_.vio_age_steps)(rng_) * 1'000'000;
  }

 private:
  Lockstep& rig_;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
};

// More than 20 minutes: eleven flights, each with five stops out of full motion, which tilt the vehicle at up to 13
// rad/s.
TEST(PoseFaults, RoughFlightsOnANoisyVioAreNeverHeld) {
  long ticks = 0, holds = 0;
  double worst_drift = 0;
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    Lockstep rig;
    rig.recorded = false;
    rig.autopilot->follows_yaw = seed % 2 == 0;
    rig.take_off();
    const Vec3 home = rig.view().command.p_W;
    RoughVio vio(rig, seed);
    for (int leg = 0; leg < 5; ++leg) {
      rig.spoil = nullptr;
      rig.vio_on = true;
      rig.vio_age_steps = 0;
      rig.ticks(100);
      rig.offer(eights(rig.view().command, home, 18), false);
      rig.tick();
      ASSERT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
      rig.spoil = std::ref(vio);
      for (int n = 0; n < 1050; ++n, ++ticks) {
        vio.before_tick();
        rig.tick();
        if (rig.mode() != Mode::tracking) ++holds;
        ASSERT_EQ(rig.mode(), Mode::tracking)
            << to_string(rig.reason()) << ", seed " << seed << ", leg " << leg << ", tick " << n;
        worst_drift = std::max(worst_drift, rig.view().shown.frame_residual_rad);
      }
      EXPECT_TRUE(rig.channels->orders.push({track::Request::stop}));
      for (int n = 0; n < 100; ++n, ++ticks) {
        vio.before_tick();
        rig.tick();
        ASSERT_EQ(rig.mode(), Mode::hold);
        ASSERT_EQ(rig.reason(), Reason::stop_requested) << to_string(rig.reason()) << ", seed " << seed;
      }
    }
  }
  std::printf("%ld ticks (%.1f min), %ld false holds, largest yaw residual %.2f°\n", ticks,
              static_cast<double>(ticks) / 3000, holds, worst_drift / kDegree);
  EXPECT_GE(ticks, 20 * 60 * 50);
}

}  // namespace
}  // namespace backwash::daemon::test
