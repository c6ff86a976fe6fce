// SPDX-License-Identifier: BSD-3-Clause
// Rows 7 and 8 of docs/faults.md in lockstep: what the frames of VIO and controller can do wrong.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/config/config.hpp"
#include "firmware_bridge/mavlink/frames.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

/// A vehicle that is carried about before it is enabled. The VIO sees the truth changed by `wrong`.
Reason reason_after_carrying(const std::function<void(State&, Eigen::Quaterniond&)>& wrong, bool& commanded) {
  Lockstep rig;
  rig.autopilot->mute = true;
  // Room for wherever the carried vehicle is seen: outside its map it would be refused for that.
  map::OccupancyGrid room({-20, -20, -10}, 1.0, {40, 40, 20}, map::Cell::free);
  rig.channels->worlds.offer(
      {plan::build_world(std::move(room), Model{}, config::load_vehicle("builtin:quad-5in").value())});
  const double yaw = 0.4;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(yaw, Vec3::UnitZ()));
  commanded = false;
  for (int n = 0; n < 300; ++n) {
    const double t = 0.02 * n;
    // About a place that the two frames name differently.
    const State truth{{std::sin(t), 0.7 * std::cos(1.3 * t), 0.5 * std::sin(0.9 * t)},
                      {std::cos(t), -0.91 * std::sin(1.3 * t), 0.45 * std::cos(0.9 * t)}};
    if (n % 50 == 0)
      rig.say(mavlink::Heartbeat{.custom_mode = 1u << 16,
                                 .type = 2,
                                 .autopilot = 12,
                                 .base_mode = 1,
                                 .system_status = 3,
                                 .mavlink_version = 3});
    const auto boot = static_cast<std::uint32_t>(20 * n);
    const auto attitude = mavlink::swap_ned_frd(q).cast<float>();
    rig.say(mavlink::AttitudeQuaternion{
        .time_boot_ms = boot, .q1 = attitude.w(), .q2 = attitude.x(), .q3 = attitude.y(), .q4 = attitude.z()});
    const Eigen::Vector3f p = mavlink::swap_ned(truth.p_W).cast<float>(),
                          v = mavlink::swap_ned(truth.v_W).cast<float>();
    rig.say(mavlink::LocalPositionNed{boot, p.x(), p.y(), p.z(), v.x(), v.y(), v.z()});
    rig.spoil = [&](OdometrySample& s) {
      State seen = truth;
      Eigen::Quaterniond attitude_seen = q;
      wrong(seen, attitude_seen);
      s.state = {seen.p_W + Vec3(-1, 0, 1.2), seen.v_W};  // within the map, however it is mirrored
      s.q = {attitude_seen.w(), attitude_seen.x(), attitude_seen.y(), attitude_seen.z()};
    };
    if (n == 280) {
      EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
    }
    const Wire& wire = rig.tick();
    commanded = commanded || !wire.setpoints.empty() || wire.commanded(kCommandMode);
    if (n == 280) return rig.reason();
  }
  return Reason::started;
}

TEST(FrameMismatchFault, AFrameOrYawThatDoesNotMatchIsRefusedBeforeEnablingNamingTheAxis) {
  const auto mirrored = [](int axis) {
    return [axis](State& s, Eigen::Quaterniond&) {
      s.p_W[axis] *= -1;
      s.v_W[axis] *= -1;
    };
  };
  const auto turned = [](double angle) {
    return [angle](State& s, Eigen::Quaterniond&) {
      const Eigen::AngleAxisd R(angle, Vec3::UnitZ());
      s = {R * s.p_W, R * s.v_W};  // the attitude is right, the positions are in another frame
    };
  };
  const auto tilted = [](const Vec3& axis, double angle) {
    return [=](State&, Eigen::Quaterniond& q) { q = q * Eigen::AngleAxisd(angle, axis); };
  };
  bool commanded = false;
  EXPECT_EQ(reason_after_carrying([](auto&, auto&) {}, commanded), Reason::enabled);
  EXPECT_EQ(reason_after_carrying(mirrored(0), commanded), Reason::frame_mismatch_x);
  EXPECT_FALSE(commanded);
  EXPECT_EQ(reason_after_carrying(mirrored(1), commanded), Reason::frame_mismatch_y);
  EXPECT_FALSE(commanded);
  EXPECT_EQ(reason_after_carrying(mirrored(2), commanded), Reason::frame_mismatch_z);
  EXPECT_FALSE(commanded);
  EXPECT_EQ(reason_after_carrying(turned(0.5), commanded), Reason::frame_mismatch_yaw);
  EXPECT_EQ(reason_after_carrying(turned(-1.5708), commanded), Reason::frame_mismatch_yaw);
  EXPECT_FALSE(commanded);
  EXPECT_EQ(reason_after_carrying(tilted(Vec3::UnitX(), 3.1416), commanded), Reason::frame_mismatch_roll);
  EXPECT_EQ(reason_after_carrying(tilted(Vec3::UnitY(), 0.2), commanded), Reason::frame_mismatch_pitch);
  EXPECT_FALSE(commanded);
}

// The controller's frame moves by 2 m and 23°, as its estimator's reset does, in flight and at rest.
TEST(EstimatorResetFault, WhenTheControllersEstimatorResetsTheVehicleHoldsInTheNewFrameWithinTwoTicks) {
  for (const double fly : {2.0, 6.5}) {
    for (const double moved : {2.0, 0.2}) {
      Lockstep rig;
      rig.take_off();
      rig.start_route(fly);
      const Setpoint before = rig.in_map(rig.wire().setpoints.at(0));
      rig.local_frame = {1.1, Vec3(5 - moved, -3, 0.2 + moved / 10)};
      rig.in_hand().reset_estimator(rig.local_frame);
      const int ticks = rig.ticks_until(Mode::hold, 10);
      ASSERT_GT(ticks, 0);
      EXPECT_LE(ticks, 2);
      EXPECT_EQ(rig.reason(), Reason::autopilot_reset);
      // From this tick on the set-points mean the old places, in the new frame.
      Setpoint last = before;
      for (int n = 0; n < 150; ++n) {
        const Setpoint now = rig.in_map(rig.wire().setpoints.at(0));
        EXPECT_LT((now.p_W - last.p_W).norm(), n == 0 ? 0.08 : 0.04) << n;
        last = now;
        rig.tick();
      }
      EXPECT_EQ(rig.mode(), Mode::hold);
      EXPECT_EQ(last.v_W, Vec3::Zero());
      EXPECT_LT((rig.autopilot->truth().p_W - last.p_W).norm(), 0.15);
    }
  }
}

}  // namespace
}  // namespace backwash::daemon::test
