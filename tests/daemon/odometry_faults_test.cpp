// SPDX-License-Identifier: BSD-3-Clause
// Rows 1 to 8, 16 and 30 of faults.md in lockstep: what the VIO and the frames can do wrong. Named after their rows.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/config/config.hpp"
#include "firmware_bridge/mavlink/frames.hpp"
#include "tests/daemon/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

using track::Mode;
using track::Reason;

/// From the middle of a route at 1 m/s: HOLD within 100 ms of the last good sample (frozen: one position, no velocity),
/// LAND within 400 ms, then QUIET and not a byte more.
void expect_hold_land_quiet(Lockstep& rig, std::int64_t last_good_ns) {
  const auto since = [&] { return static_cast<double>(rig.now_ns() - last_good_ns) * 1e-6; };
  Setpoint last = rig.in_map(rig.wire().setpoints.at(0));
  while (rig.mode() == Mode::tracking) {
    last = rig.in_map(rig.wire().setpoints.at(0));
    rig.tick();
    ASSERT_LE(since(), 100) << "still tracking";
  }
  ASSERT_EQ(rig.mode(), Mode::hold) << to_string(rig.reason());
  while (rig.mode() == Mode::hold) {
    ASSERT_EQ(rig.wire().setpoints.size(), 1u);
    const Setpoint s = rig.in_map(rig.wire().setpoints[0]);
    EXPECT_LT((s.p_W - last.p_W).norm(), 1e-3);
    EXPECT_EQ(s.v_W, Vec3::Zero());
    EXPECT_EQ(s.a_W, Vec3::Zero());
    rig.tick();
    ASSERT_LE(since(), 400) << "still holding";
  }
  ASSERT_EQ(rig.mode(), Mode::land) << to_string(rig.reason());
  EXPECT_TRUE(rig.wire().commanded(kCommandLand));
  while (rig.mode() == Mode::land) {
    EXPECT_TRUE(rig.wire().setpoints.empty());
    rig.tick();
    ASSERT_LE(since(), 700) << "not quiet";
  }
  ASSERT_EQ(rig.mode(), Mode::quiet);
  for (int n = 0; n < 100; ++n) EXPECT_EQ(rig.tick().bytes, 0u);
}

TEST(Row1, VioStops) {
  // The last sample comes just before a tick, and just after one.
  for (const int age : {0, 19}) {
    Lockstep rig;
    rig.vio_age_steps = age;
    rig.take_off();
    rig.start_route(2);
    rig.vio_on = false;
    const std::int64_t last = rig.now_ns() - age * 1'000'000;
    rig.tick();
    expect_hold_land_quiet(rig, last);
  }
}

TEST(Row2, VioSaysWhatIsNoNumberOrNoRotation) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const std::function<void(OdometrySample&)> spoils[] = {
      [=](auto& s) { s.state.p_W.y() = nan; }, [=](auto& s) { s.state.v_W.x() = inf; }, [=](auto& s) { s.q[3] = nan; },
      [=](auto& s) { s.q = {0, 0, 0, 0}; },    [=](auto& s) { s.q = {2, 0, 0, 0}; },
  };
  for (const auto& spoil : spoils) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(2);
    const std::int64_t last = rig.now_ns();
    rig.spoil = spoil;
    rig.tick();
    expect_hold_land_quiet(rig, last);  // the rig itself refuses a set-point that is not finite
  }
}

TEST(Row3, VioJumpsAndIsHeldInTheSameTick) {
  for (const double jump : {0.2, -3.0}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(2);
    const std::int64_t last = rig.now_ns();
    rig.spoil = [=](auto& s) { s.state.p_W.y() += jump; };
    const Setpoint before = rig.in_map(rig.wire().setpoints.at(0));
    rig.tick();
    EXPECT_EQ(rig.mode(), Mode::hold);
    EXPECT_EQ(rig.reason(), Reason::odometry_jump);
    EXPECT_LT((rig.in_map(rig.wire().setpoints.at(0)).p_W - before.p_W).norm(), 1e-3);
    expect_hold_land_quiet(rig, last);
  }
}

TEST(Row5, DuplicatesAndStampsThatGoBackAreDroppedAndMoreThanThreeInARowHold) {
  for (const std::int64_t back_ns : {0, 100'000'000}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(2);
    const std::uint64_t rejected = rig.view().odometry_rejected;
    std::int64_t stamp = rig.now_ns() - back_ns;
    const auto spoil = [&](OdometrySample& s) { s.stamp_ns = stamp; };
    rig.spoil = spoil;
    rig.ticks(3);
    EXPECT_EQ(rig.view().odometry_rejected - rejected, 3u);
    EXPECT_EQ(rig.mode(), Mode::tracking);
    rig.spoil = nullptr;
    rig.ticks(10);
    EXPECT_EQ(rig.view().odometry_rejected - rejected, 3u);
    EXPECT_EQ(rig.mode(), Mode::tracking);
    const std::int64_t last = rig.now_ns();
    stamp = last - back_ns;
    rig.spoil = spoil;
    rig.ticks(3);
    EXPECT_EQ(rig.mode(), Mode::tracking);
    rig.tick();
    EXPECT_EQ(rig.mode(), Mode::hold);
    EXPECT_EQ(rig.reason(), Reason::odometry_disorder);
    expect_hold_land_quiet(rig, last);
  }
}

TEST(Row6, FiveIdenticalPosesUnderCommandedMotionHold) {
  Lockstep rig;
  rig.take_off();
  rig.start_route(2);
  std::optional<OdometrySample> frozen;
  rig.spoil = [&](OdometrySample& s) {
    if (!frozen) frozen = s;
    s.state = frozen->state, s.q = frozen->q;
  };
  // The first one, then three that repeat it: still tracking.
  rig.ticks(4);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  rig.tick();
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(rig.reason(), Reason::odometry_frozen);
}

TEST(Row6, IdenticalPosesAtRestAreNoFault) {
  Lockstep rig;
  rig.take_off();
  rig.ticks(50);
  std::optional<OdometrySample> frozen;
  rig.spoil = [&](OdometrySample& s) {
    if (!frozen) frozen = s;
    s.state = frozen->state, s.q = frozen->q;
  };
  rig.ticks(25);
  EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
}

/// A vehicle that is carried about before it is enabled. The VIO sees the truth changed by `wrong`.
Reason reason_after_carrying(const std::function<void(State&, Eigen::Quaterniond&)>& wrong, bool& commanded) {
  Lockstep rig;
  rig.autopilot->mute = true;
  // Room for wherever the carried vehicle is seen: outside its map it would be refused for that.
  map::OccupancyGrid room({-20, -20, -10}, 1.0, {40, 40, 20}, map::Cell::free);
  rig.channels->worlds.offer(
      plan::build_world(std::move(room), Model{}, config::load_vehicle("builtin:quad-5in").value()));
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
    if (n == 280) rig.channels->requests.push(track::Request::enable);
    const Wire& wire = rig.tick();
    commanded = commanded || !wire.setpoints.empty() || wire.commanded(kCommandMode);
    if (n == 280) return rig.reason();
  }
  return Reason::started;
}

TEST(Row7, AFrameOrYawThatDoesNotMatchIsRefusedBeforeEnablingNamingTheAxis) {
  const auto mirrored = [](int axis) {
    return [axis](State& s, Eigen::Quaterniond&) { s.p_W[axis] *= -1, s.v_W[axis] *= -1; };
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
TEST(Row8, WhenTheControllersEstimatorResetsTheVehicleHoldsInTheNewFrameWithinTwoTicks) {
  for (const double fly : {2.0, 6.5}) {
    for (const double moved : {2.0, 0.2}) {
      Lockstep rig;
      rig.take_off();
      rig.start_route(fly);
      const Setpoint before = rig.in_map(rig.wire().setpoints.at(0));
      rig.local_frame = {1.1, Vec3(5 - moved, -3, 0.2 + moved / 10)};
      rig.autopilot->reset_estimator(rig.local_frame);
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

TEST(Row8, TheControllersOwnResetCounterIsEnough) {
  Lockstep rig;
  rig.take_off();
  rig.say(mavlink::Odometry{.q = {1, 0, 0, 0}, .reset_counter = 7});
  rig.ticks(10);
  EXPECT_EQ(rig.mode(), Mode::tracking);
  rig.say(mavlink::Odometry{.q = {1, 0, 0, 0}, .reset_counter = 8});
  const int ticks = rig.ticks_until(Mode::hold, 5);
  EXPECT_GT(ticks, 0);
  EXPECT_LE(ticks, 2);
  EXPECT_EQ(rig.reason(), Reason::autopilot_reset);
}

// The measured position drifts out of the tube by 2 cm a tick: too slow for the gate.
TEST(Row16, AnErrorOutsideItsSetIsAnEventAtOnceAndHoldsAfterThreeTicks) {
  Lockstep rig;
  rig.take_off();
  rig.start_route(2);
  double drift = 0;
  rig.spoil = [&](OdometrySample& s) { s.state.p_W.y() += drift += 0.02; };
  int outside = 0;
  for (int n = 0; n < 60 && rig.mode() == Mode::tracking; ++n) {
    rig.tick();
    outside = rig.view().outside > 0 ? outside + 1 : 0;
  }
  EXPECT_EQ(rig.view().outside, 3u);
  EXPECT_EQ(outside, 3);
  EXPECT_EQ(rig.mode(), Mode::hold);
  EXPECT_EQ(rig.reason(), Reason::outside_set);
}

TEST(Row30, TheWallClockOfTheVioStepsByAnHourAndNothingHappens) {
  for (const std::int64_t hours : {1, -1}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(1);
    const std::uint64_t rejected = rig.view().odometry_rejected, missed = rig.view().missed;
    rig.spoil = [=](OdometrySample& s) { s.stamp_ns += hours * 3600 * 1'000'000'000; };
    for (int n = 0; n < 150; ++n) {
      // What is forwarded is in the clock of our answers to TIMESYNC all the same.
      ASSERT_EQ(rig.tick().odometry, 1);
      EXPECT_LE(std::abs(static_cast<double>(rig.wire().odometry_us) - static_cast<double>(rig.now_ns()) * 1e-3), 1000);
    }
    EXPECT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
    EXPECT_EQ(rig.view().odometry_rejected, rejected);
    EXPECT_EQ(rig.view().missed, missed);
    EXPECT_EQ(rig.view().outside, 0u);
  }
}

}  // namespace
}  // namespace backwash::daemon::test
