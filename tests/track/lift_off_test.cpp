// SPDX-License-Identifier: BSD-3-Clause
// The lift-off: what it sends, when it is over, and that whatever ends it lands.
#include "tests/track/flown/flown.hpp"

namespace backwash::track::test {
namespace {

/// A take-off of 0.6 m that was accepted and armed, from where the vehicle stands.
struct Lifting : Flown {
  Lifting() : Flown(on_the_ground()) {
    EXPECT_TRUE(offer(up).arm);
    EXPECT_EQ(out.supervisor.mode, Mode::lifting);
    in.autopilot.armed = true;
  }
  /// The vehicle is `height` above where it stood, whatever was commanded, and the autopilot says that it is in the
  /// air, or not, or nothing; on its way there it says that it takes off.
  const TickOutput& at(double height, std::optional<bool> in_air) { return at(Vec3(0, 0, height), in_air); }
  const TickOutput& at(const Vec3& above_W, std::optional<bool> in_air) {
    constexpr double kMost = 0.008;  // m a tick
    const Vec3 above = RigidShift{kYaw, Vec3::Zero()}.point(above_W);
    for (Vec3 way = above - off_L;; way = above - off_L) {
      const Vec3 step_L = way * std::min(1.0, kMost / std::max(1e-9, way.norm()));
      const bool arrives = way.norm() <= kMost;
      off_L += step_L;
      in.autopilot.landed = off_L.z() < 0.01;
      in.autopilot.in_air = arrives ? in_air : in_air ? std::optional(false) : std::nullopt;
      off_L.x() += in.now_ns / 20'000'000 % 2 ? 1e-9 : -1e-9;  // no two samples of a flight are alike to the last bit
      out.command_local.p_W = ground_L + off_L;
      out.command_local.v_W = step_L / kControlPeriod;
      step();
      if (arrives || out.supervisor.mode != Mode::lifting) return out;
    }
  }
  void settle(double height, std::optional<bool> in_air) {
    for (int n = 0; n < 51; ++n) at(height, in_air);
  }
  AcceptedSegment up = take_off();
  Vec3 ground_L = truth_L.p_W, off_L = Vec3::Zero();
};

// Issue: PX4 says IN_AIR 1.15 s before it leaves the ground; ArduPilot says it when the whole height is reached.
TEST(LiftOff, IsOverInTheAirAtItsHeightAndNotBeforeBothAreSo) {
  Lifting f;
  for (int n = 0; n < 100; ++n) EXPECT_EQ(f.at(0, true).supervisor.mode, Mode::lifting) << "on the ground";
  for (int n = 0; n < 60; ++n) ASSERT_EQ(f.at(0.39, true).supervisor.mode, Mode::lifting) << "too low";
  for (int n = 0; n < 60; ++n) ASSERT_EQ(f.at(0.55, false).supervisor.mode, Mode::lifting) << "not by its own words";
  for (int n = 0; n < 50; ++n) ASSERT_EQ(f.at(0.55, true).supervisor.mode, Mode::lifting) << "not settled";
  EXPECT_EQ(f.at(0.55, true).supervisor.mode, Mode::tracking);
  EXPECT_EQ(f.out.supervisor.reason, Reason::lifted_off);
  EXPECT_EQ(f.out.command.p_W, f.up.commands.back().p_W) << "held where the take-off ends";
  EXPECT_EQ(f.out.released[0], &f.up) << "what comes next is a flight of its own, from the state in the air";
  Lifting silent;
  silent.settle(0.55, std::nullopt);
  EXPECT_EQ(silent.out.supervisor.mode, Mode::lifting) << "nothing is done that is not said";
}

TEST(LiftOff, IsOverAfterOneSecondThereWithoutABreakAndWithItsMotorsOn) {
  Lifting f;
  for (int n = 0; n < 30; ++n) f.at(0.55, true);
  EXPECT_EQ(f.at(0.55, false).supervisor.mode, Mode::lifting);
  for (int n = 0; n < 50; ++n) ASSERT_EQ(f.at(0.55, true).supervisor.mode, Mode::lifting) << n;
  EXPECT_EQ(f.at(0.55, true).supervisor.mode, Mode::tracking);
  Lifting carried;  // before its motors start
  carried.in.autopilot.armed = false;
  carried.at(0.55, true);
  for (int n = 0; n < 60; ++n) ASSERT_EQ(carried.at(0.55, true).supervisor.mode, Mode::lifting) << n;
}

// It may hang below on its way for as long as the autopilot takes.
TEST(LiftOff, HasItsWholeColumnAheadUntilItIsOver) {
  Lifting f;
  const std::size_t whole = f.up.tube.size();
  EXPECT_EQ(f.tick.tracker().ahead()[0].size(), whole);
  for (int n = 0; n < 300; ++n) f.at(0.1, true);
  EXPECT_EQ(f.tick.tracker().ahead()[0].size(), whole);
  EXPECT_FALSE(f.tick.tracker().finished()) << "or the age of the map would not count";
}

TEST(LiftOff, AsksToArmInTheTickThatAcceptsItAndForNoSegmentThatIsRefused) {
  Flown f = on_the_ground();
  AcceptedSegment up = take_off(), another = take_off();
  ASSERT_TRUE(f.offer(up).arm);
  another.id = up.id + 1;
  another.epoch.lapse = up.epoch.lapse + 1;  // of no plan of now
  f.in.segment = &another;
  EXPECT_TRUE(f.step().refused);
  EXPECT_FALSE(f.out.arm);
}

TEST(LiftOff, RaisesTheSetpointOfAnAutopilotThatFollowsItOnTheGround) {
  Lifting f;
  double z = f.out.command.p_W.z();
  for (int n = 0; n < 80; ++n) {
    EXPECT_TRUE(f.at(0, false).supervisor.send_setpoint);
    EXPECT_FALSE(f.out.takeoff);
    EXPECT_GE(f.out.command.p_W.z(), z);
    z = f.out.command.p_W.z();
  }
  EXPECT_EQ(z, f.up.commands.back().p_W.z());
}

TEST(LiftOff, AsksAnAutopilotThatLiftsItselfOnceItIsArmedAndSendsItNoSetpointUntilItIsInTheAir) {
  Lifting f;
  f.in.autopilot.lifts_itself = true;
  f.in.autopilot.armed = false;
  for (int n = 0; n < 20; ++n) EXPECT_FALSE(f.at(0, false).takeoff) << "not armed yet";
  f.in.autopilot.armed = true;
  int asked = 0;
  for (int n = 0; n < 60; ++n) {
    asked += f.at(0, false).takeoff.has_value();
    EXPECT_FALSE(f.out.supervisor.send_setpoint);
    EXPECT_NEAR(f.out.takeoff.value_or(0.6), 0.6, 1e-9) << "m above where it stands";
  }
  EXPECT_GE(asked, 2) << "one command may be lost";
  EXPECT_LE(asked, 3);
  f.in.autopilot.takeoff_taken = true;
  for (int n = 0; n < 60; ++n) EXPECT_FALSE(f.at(0.3, false).takeoff) << "it has acknowledged it";
  f.settle(0.6, true);
  EXPECT_TRUE(f.out.supervisor.send_setpoint);
}

TEST(LiftOff, LandsWhateverEndsItBecauseNoHoldIsVerifiedSoLow) {
  const std::vector<std::function<void(Lifting&)>> ends{
      [](Lifting& f) { f.in.request = Request::stop; },
      [](Lifting& f) { f.in.request = Request::disable; },
      [](Lifting& f) { f.in.request = Request::land; },
      [](Lifting& f) { f.in.surroundings.tube_blocked = true; },
      [](Lifting& f) { f.in.surroundings.outside = true; },
      [](Lifting& f) { f.in.autopilot.battery = 0.01; },
      [](Lifting& f) { f.vio_on = false; },
      [](Lifting& f) { f.attitude_on = false; },
      [](Lifting& f) { f.spoil = [](OdometrySample& s) { s.state.p_W.x() += 3; }; },
  };
  for (std::size_t n = 0; n < ends.size(); ++n) {
    Lifting f;
    f.at(0.2, true);
    ends[n](f);
    int ticks = 0, asked = 0;
    for (; ticks < 30 && f.out.supervisor.mode == Mode::lifting; ++ticks) f.at(0.2, true);
    EXPECT_EQ(f.out.supervisor.mode, Mode::land) << n << ": " << to_string(f.out.supervisor.reason);
    EXPECT_LE(ticks, n < 7 && n != 6 ? 1 : 16) << n;
    for (int k = 0; k < 12; ++k) {
      asked += f.out.supervisor.request_land;
      f.at(0.2, true);
      EXPECT_FALSE(f.out.supervisor.send_setpoint);
      EXPECT_FALSE(f.out.disarm) << "in the air";
    }
    EXPECT_GE(asked, 1) << n;
  }
}

// Row 6: fresh stamps, the pose of the ground to the last bit. An autopilot whose height follows the VIO climbs until
// somebody ends it: it believes that it has not left the ground.
TEST(LiftOff, OnAPoseThatFrozeOnTheGroundLandsOnceTheVehicleMustHaveLeftIt) {
  Lifting f;
  std::optional<OdometrySample> frozen;
  f.spoil = [&](OdometrySample& s) {
    if (!frozen) frozen = s;
    s.state = {frozen->state.p_W, Vec3::Zero()};
    s.q = frozen->q;
  };
  const auto in_the_air = [&f](int ticks) {
    for (int n = 0; n < ticks && f.out.supervisor.mode == Mode::lifting; ++n) {
      f.out.command_local.p_W = f.ground_L + f.off_L;
      f.out.command_local.v_W = Vec3::Zero();  // as it believes
      f.in.autopilot.landed = false;
      f.in.autopilot.in_air = true;
      f.step();
    }
  };
  f.at(0, true);
  in_the_air(60);
  EXPECT_EQ(f.out.supervisor.mode, Mode::lifting) << "PX4 calls itself in the air before it leaves the ground";
  in_the_air(10);
  EXPECT_EQ(f.out.supervisor.mode, Mode::land);
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_frozen);
  EXPECT_TRUE(f.out.supervisor.request_land);
  EXPECT_FALSE(f.out.forward_odometry) << "it would go on climbing to where it is told that it is not";
}

TEST(LiftOff, ThatStraysFromItsColumnLandsAfterThreeTicks) {
  Lifting f;
  f.at(0.3, true);
  EXPECT_EQ(f.at({0, 0.19, 0.3}, true).supervisor.mode, Mode::lifting) << "within its sets";
  for (int n = 0; n < 20; ++n) EXPECT_EQ(f.at({0, 0.19, 0.3}, true).supervisor.mode, Mode::lifting);
  int outside = 0;
  for (double y = 0.197; f.out.supervisor.mode == Mode::lifting && outside < 4; y += 0.007) {
    f.at({0, y, 0.3}, true);
    outside += y > 0.2;
  }
  EXPECT_EQ(f.out.supervisor.reason, Reason::outside_column);
  EXPECT_EQ(outside, 3);
}

// The map moves by more than the column is wide, and up; physically nothing has moved.
TEST(LiftOff, StaysInItsColumnAcrossALoopClosureAndIsOverAtItsHeight) {
  Lifting f;
  f.at(0.3, true);
  f.closures = 1;  // the first one of all leaves the map where it is
  f.at(0.3, true);
  f.closures = 2;
  f.frame_W = {0.1, {0.5, -0.3, 0.4}};
  for (int n = 0; n < 60; ++n) ASSERT_EQ(f.at(0.3, true).supervisor.mode, Mode::lifting) << n;
  EXPECT_EQ(f.tick.tracker().closures(), 2u);
  f.settle(0.55, true);
  EXPECT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
}

TEST(LiftOff, ThatIsNotInTheAirAfterTwelveSecondsLandsAndIsDisarmedOnTheGround) {
  Lifting f;
  int ticks = 0, disarmed = 0;
  for (; f.out.supervisor.mode == Mode::lifting && ticks < 700; ++ticks) f.at(0, false);
  EXPECT_EQ(f.out.supervisor.reason, Reason::lift_timeout);
  EXPECT_NEAR(ticks, 600, 2);
  for (int n = 0; n < 100; ++n) disarmed += f.at(0, false).disarm;
  EXPECT_GE(disarmed, 2);
}

TEST(LiftOff, OfAVehicleThatDoesNotArmEndsAfterThreeSeconds) {
  Lifting f;
  f.in.autopilot.armed = false;
  int ticks = 0;
  for (; f.out.supervisor.mode == Mode::lifting && ticks < 700; ++ticks) f.at(0, false);
  EXPECT_EQ(f.out.supervisor.mode, Mode::passive);
  EXPECT_EQ(f.out.supervisor.reason, Reason::not_armed);
  EXPECT_NEAR(ticks, 150, 2);
}

TEST(LiftOff, IsNoLapseOfItsPlannerAndWhatEndsItIs) {
  Flown before = on_the_ground();
  Lifting f;
  EXPECT_EQ(f.tick.epoch(), before.tick.epoch());
  f.settle(0.6, true);
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking);
  EXPECT_EQ(f.tick.epoch(), before.tick.epoch());
  Lifting g;
  g.in.surroundings.tube_blocked = true;
  g.step();
  EXPECT_EQ(g.tick.epoch().lapse, before.tick.epoch().lapse + 1);
}

}  // namespace
}  // namespace backwash::track::test
