// SPDX-License-Identifier: BSD-3-Clause
// When the tick accepts a segment, and when motors start or stop for it.
#include "tests/track/flown/flown.hpp"

namespace backwash::track::test {
namespace {

TEST(TickReactions, NothingIsAcceptedWhileNobodyFollows) {
  Flown f(Flown::Until::aligned);
  AcceptedSegment s = take_off();
  EXPECT_TRUE(f.offer(s).refused);
  EXPECT_FALSE(f.out.arm);
}

TEST(TickReactions, ArmsForAnAcceptedTakeoffThatGoesOnAndForNothingElse) {
  AcceptedSegment good = take_off(), elsewhere = take_off();
  for (auto& t : elsewhere.tube) t.center.p_W.y() += 3;
  {
    Flown f = on_the_ground();
    EXPECT_TRUE(f.offer(good).arm);
  }
  {
    Flown f = on_the_ground();
    EXPECT_TRUE(f.offer(elsewhere).refused);
    EXPECT_FALSE(f.out.arm);
  }
  {
    Flown f = on_the_ground();
    f.in.surroundings.outside = true;  // a hold in the same tick
    EXPECT_TRUE(f.offer(good).accepted);
    ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
    EXPECT_FALSE(f.out.arm);
  }
  {
    Flown f = on_the_ground();
    f.in.autopilot.armed = true;
    EXPECT_TRUE(f.offer(good).accepted);
    EXPECT_FALSE(f.out.arm) << "it is armed already";
  }
}

TEST(TickReactions, AVehicleThatWasAskedToArmCountsAsArmed) {
  Flown f = on_the_ground();
  AcceptedSegment s = take_off();
  ASSERT_TRUE(f.offer(s).arm);
  f.in.request = Request::disable;
  EXPECT_EQ(f.step().supervisor.mode, Mode::land) << "it may be in the air before it says so";
  for (int n = 0; n < 100; ++n) EXPECT_EQ(f.step().supervisor.mode, Mode::land) << "the autopilot may yet arm";
}

/// Orders to disarm in the three seconds after the tick of the STOP, of a vehicle that was armed for a take-off and
/// stopped on the ground.
int disarms(Flown& f, const std::function<void()>& then) {
  AcceptedSegment s = take_off();
  EXPECT_TRUE(f.offer(s).arm);
  f.in.autopilot.armed = true;
  f.step();
  f.in.request = Request::stop;
  f.step();
  then();
  int asked = 0;
  for (int n = 0; n < 160; ++n) asked += f.step().disarm;
  return asked;
}

TEST(TickReactions, AStopOnTheGroundStopsTheMotorsThereAndOnlyUntilTheNextTakeoff) {
  Flown f = on_the_ground();
  EXPECT_GE(disarms(f, [] {}), 2);
  Flown g = on_the_ground();
  EXPECT_EQ(disarms(g, [&] { g.in.autopilot.landed = false; }), 0) << "it is in the air";
  Flown h = on_the_ground();
  AcceptedSegment again = take_off();
  again.id = 2;
  for (auto& command : again.commands) {
    command = again.commands[0];
    command.v_W.setZero();
  }  // as high as before
  h.in.autopilot.landed = true;
  EXPECT_EQ(disarms(h,
                    [&] {
                      h.in.autopilot.armed = false;
                      EXPECT_EQ(h.step().supervisor.mode, Mode::passive);
                      h.in.request = Request::enable;
                      h.step();
                      EXPECT_EQ(h.step().supervisor.mode, Mode::tracking);
                      const Vec3 moved = Flown::map_of(h.truth_L).p_W - again.tube.front().center.p_W;
                      for (auto& set : again.tube) set.center.p_W += moved;
                      for (auto& command : again.commands) command.p_W += moved;
                      EXPECT_TRUE(h.offer(again).arm);
                      h.in.autopilot.armed = true;
                    }),
            0);
}

// docs/faults.md row 56: by its word of now alone, and only where the vehicle is known to stand as it stood disarmed.
TEST(TickReactions, MotorsAreStoppedWhereWordAndHeightOfNowAgreeThatItStands) {
  const auto stopped_at = [](double height, const std::function<void(Flown&)>& then) {
    Flown f = on_the_ground();
    AcceptedSegment up = take_off();
    const Vec3 ground_L = f.truth_L.p_W;
    double z = 0;
    const auto step = [&] {
      const double by = std::clamp(height - z, -0.008, 0.008);
      z += by;
      f.out.command_local.p_W = ground_L + Vec3(0, 0, z);
      f.out.command_local.v_W = Vec3(0, 0, by / kControlPeriod);
      return f.step().disarm;
    };
    EXPECT_TRUE(f.offer(up).arm);
    f.in.autopilot.armed = true;
    for (int n = 0; n < 40; ++n) step();
    EXPECT_EQ(f.out.supervisor.mode, Mode::lifting) << to_string(f.out.supervisor.reason);
    then(f);
    for (int n = 0; n < 10; ++n) step();
    f.in.request = Request::stop;
    int asked = 0;
    for (int n = 0; n < 160; ++n) asked += step();
    return asked;
  };
  const auto nothing = [](Flown&) {};
  EXPECT_GE(stopped_at(0, nothing), 2);
  EXPECT_EQ(stopped_at(0, [](Flown& f) { f.in.autopilot.landed.reset(); }), 0) << "its word is old";
  EXPECT_EQ(stopped_at(0, [](Flown& f) { f.vio_on = false; }), 0) << "nobody knows how high it is";
  EXPECT_GE(stopped_at(0.1, nothing), 2) << "as far as the two estimates may differ";
  EXPECT_EQ(stopped_at(0.16, nothing), 0);
  EXPECT_EQ(stopped_at(-0.16, nothing), 0) << "it fell from where it stood";
}

// The take-off is over by the STOP, the word of the ground comes later than motors are waited for.
TEST(TickReactions, MotorsOfAnAbandonedTakeoffAreStoppedOnceItIsKnownAgainToStand) {
  for (const std::optional<bool> meanwhile : {std::optional<bool>(), std::optional(false)}) {
    Flown f = on_the_ground();
    AcceptedSegment up = take_off();
    ASSERT_TRUE(f.offer(up).arm);
    f.in.autopilot.armed = true;
    f.step();
    f.in.autopilot.landed = meanwhile;
    f.in.request = Request::stop;
    EXPECT_EQ(f.disarms(500), 0);
    ASSERT_EQ(f.out.supervisor.mode, Mode::land);
    f.in.autopilot.landed = true;
    EXPECT_GE(f.disarms(100), 2);
    f.in.autopilot.armed = false;
    f.in.autopilot.landed.reset();
    f.disarms(200);
    f.in.autopilot.armed = f.in.autopilot.landed.emplace(true);  // somebody else's
    EXPECT_EQ(f.disarms(200), 0);
    f.in.request = Request::stop;
    EXPECT_EQ(f.disarms(200), 0);
  }
}

TEST(TickReactions, MotorsOfAnAbandonedTakeoffThatAPilotTookOverAreHis) {
  Flown f = on_the_ground();
  f.in.autopilot.armed = true;
  f.step();
  f.in.autopilot.landed.reset();
  f.in.request = Request::stop;
  f.disarms(10);
  ASSERT_EQ(f.out.supervisor.mode, Mode::hold);
  f.in.autopilot.offboard = false;
  f.step();
  f.in.autopilot.landed = true;
  f.in.request = Request::enable;
  f.step();
  f.in.autopilot.offboard = true;
  EXPECT_EQ(f.disarms(200), 0);
  EXPECT_EQ(f.out.supervisor.mode, Mode::tracking) << to_string(f.out.supervisor.reason);
}

// Row 40: stopped before it armed, and its motors start when the lift-off is over already.
TEST(TickReactions, MotorsThatStartAfterAnEndedTakeoffCountsAsLandedAreStopped) {
  Flown f = on_the_ground();
  AcceptedSegment up = take_off();
  ASSERT_TRUE(f.offer(up).arm);
  for (int n = 0; n < 100; ++n) f.step();
  f.in.request = Request::stop;
  EXPECT_EQ(f.step().supervisor.mode, Mode::land);
  for (int n = 0; n < 60 && f.out.supervisor.mode == Mode::land; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.mode, Mode::passive);
  ASSERT_EQ(f.out.supervisor.reason, Reason::landed);
  f.in.autopilot.armed = true;
  int disarmed = 0;
  for (int n = 0; n < 30; ++n) disarmed += f.step().disarm;
  EXPECT_GE(disarmed, 1);
}

// What the tick makes of the ground: the autopilot's word of it, and the floor on which the vehicle stood disarmed.

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
