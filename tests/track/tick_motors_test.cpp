// SPDX-License-Identifier: BSD-3-Clause
// When the tick accepts a segment, and when motors start or stop for it.
#include "tests/track/flown.hpp"

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

}  // namespace
}  // namespace backwash::track::test
