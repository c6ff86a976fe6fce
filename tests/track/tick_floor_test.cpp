// SPDX-License-Identifier: BSD-3-Clause
// What the tick makes of the ground: the autopilot's word of it, and the floor on which the vehicle stood disarmed.
#include "tests/track/flown/flown.hpp"

namespace backwash::track::test {
namespace {

// Its heartbeat may tell a second late that it armed: until then it rises from a floor that stays where it was.
TEST(TickReactions, TheFloorDoesNotRiseWithAVehicleThatWasAskedToArm) {
  Flown f = on_the_ground();
  AcceptedSegment up = take_off();
  const Vec3 ground_L = f.truth_L.p_W;
  ASSERT_TRUE(f.offer(up).arm);
  for (int n = 0; n < 90; ++n) {
    const double z = 0.008 * std::min(n, 40);
    f.out.command_local = {ground_L + Vec3(0, 0, z), Vec3(0, 0, n < 40 ? 0.4 : 0), Vec3::Zero(), 0};
    f.step();
    if (n == 45) f.in.autopilot.armed = true;
    if (n == 60) f.in.request = Request::stop;
    EXPECT_FALSE(f.out.disarm) << n;
    EXPECT_EQ(f.out.landed, n <= 45) << n;
  }
  EXPECT_EQ(f.out.supervisor.mode, Mode::land) << to_string(f.out.supervisor.reason);
}

// Row 6, at rest: what it says of the ground does not hide that it flies.
TEST(TickReactions, APoseThatFreezesAtRestAfterAFlightIsFoundWhateverIsSaidOfTheGround) {
  Flown f;
  f.in.request = Request::stop;
  for (int n = 0; n < 200; ++n) f.step();
  ASSERT_TRUE(f.tick.tracker().finished());
  f.in.autopilot.landed = true;
  for (int n = 0; n < 10; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.reason, Reason::stop_requested);
  f.shakes = false;
  for (int n = 0; n < 10; ++n) f.step();
  EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_frozen);
}

// A pilot brought it back: it may take off again, but its height is no witness of where it stands any more.
TEST(TickReactions, AVehicleThatStandsArmedAfterAFlightIsLandedByItsWordAndNotDisarmed) {
  Flown f = on_the_ground();
  AcceptedSegment there = segment_of(std::vector<Setpoint>(50, {{0, 0, 1}, Vec3::Zero(), Vec3::Zero(), 0}));
  f.in.autopilot.armed = true;
  ASSERT_TRUE(f.offer(there).accepted);
  for (int n = 0; n < 60; ++n) f.step();
  ASSERT_EQ(f.out.landed, false) << "it has flown a segment";
  f.in.autopilot.offboard = false;
  f.in.autopilot.landed = false;
  for (int n = 0; n < 60; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::passive);
  EXPECT_EQ(f.out.landed, false);
  f.in.autopilot.landed = true;
  f.step();
  EXPECT_EQ(f.step().landed, true);
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = true;
  f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
  EXPECT_EQ(f.out.landed, true);
  f.in.request = Request::stop;
  EXPECT_EQ(f.disarms(200), 0);
}

TEST(TickReactions, AVehicleThatIsHighAboveItsFloorHasNotLandedWhateverItSaysInOtherHands) {
  Flown f = on_the_ground();
  f.in.autopilot.offboard = false;
  f.in.autopilot.armed = true;
  f.step();
  const Vec3 ground_L = f.truth_L.p_W;
  for (int n = 0; n < 200; ++n) {
    const double z = 0.005 * std::min(n, 60);
    f.truth_L = {ground_L + Vec3(0, 0, z), Vec3(0, 0, n < 60 ? 0.25 : 0)};
    f.step();
  }
  EXPECT_EQ(f.out.landed, false);
}

TEST(TickReactions, AVehicleThatWasNeverSeenToStandDisarmedIsNotDisarmed) {
  Flown f(Flown::Until::aligned);  // it does not say of the ground what it stands on
  AcceptedSegment up = take_off();
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = f.in.autopilot.armed = f.in.autopilot.landed.emplace(true);
  f.step();
  EXPECT_TRUE(f.offer(up).accepted);
  f.in.request = Request::stop;
  for (int n = 0; n < 160; ++n) EXPECT_FALSE(f.step().disarm) << n;
}

// A pilot flew it meanwhile, and the VIO began anew in the air with the numbers that it had on the ground.
TEST(TickReactions, AVehicleThatWasArmedAndNotSeenHasNoFloor) {
  enum class Vio { seen, gap, jump };
  for (const Vio vio : {Vio::seen, Vio::gap, Vio::jump}) {
    Flown f = on_the_ground();
    f.in.autopilot.offboard = false;
    f.step();
    f.in.autopilot.armed = true;
    f.vio_on = vio != Vio::gap;
    if (vio == Vio::jump) f.spoil = [](OdometrySample& s) { s.state.p_W.x() += 5; };
    for (int n = 0; n < 100; ++n) f.step();
    f.vio_on = true;
    for (int n = 0; n < 300; ++n) f.step();
    f.in.request = Request::enable;
    f.step();
    f.in.autopilot.offboard = true;
    for (int n = 0; n < 60; ++n) f.step();
    ASSERT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
    f.in.request = Request::stop;
    int asked = 0;
    for (int n = 0; n < 160; ++n) asked += f.step().disarm;
    EXPECT_EQ(asked > 0, vio == Vio::seen);
  }
}

TEST(TickReactions, TheFloorMovesWithTheMapAndIsLeftByEveryFlight) {
  Flown f = on_the_ground();
  f.closures = 1;
  f.step();
  f.closures = 2;
  f.frame_W = {0, {0, 0, 0.3}};
  f.step();
  AcceptedSegment up = take_off();
  up.closures = 2;
  for (auto& set : up.tube) set.center.p_W.z() += 0.3;
  for (auto& command : up.commands) command.p_W.z() += 0.3;
  ASSERT_TRUE(f.offer(up).arm);
  f.in.autopilot.armed = true;
  f.step();
  EXPECT_EQ(f.out.landed, true);
  f.in.request = Request::stop;
  int disarmed = f.step().disarm;
  for (int n = 0; n < 160; ++n) disarmed += f.step().disarm;
  EXPECT_GE(disarmed, 2);

  Flown g;  // level, at the height at which it stood
  ASSERT_EQ(g.out.supervisor.mode, Mode::tracking);
  g.in.autopilot.landed = true;
  EXPECT_EQ(g.step().landed, false);
  g.in.request = Request::stop;
  for (int n = 0; n < 160; ++n) EXPECT_FALSE(g.step().disarm) << n;
  g.in.autopilot.armed = false;
  EXPECT_EQ(g.step().landed, true) << "nothing flies without motors";
}

}  // namespace
}  // namespace backwash::track::test
