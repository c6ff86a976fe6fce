// SPDX-License-Identifier: BSD-3-Clause
// What was flown on until an attack found it (docs/faults.md rows 4 and 6).
#include <gtest/gtest.h>

#include <numbers>

#include "core/track/odometry_gate.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

// Fresh stamps, the same pose to the last bit: the autopilot believes it and drifts, 0.6 m in 5 s and 25 m in a minute.
// Nothing compares identical poses unless a velocity is commanded.
TEST(VioFreezeFault, AVioThatFreezesInAHoverIsHeldBeforeTheVehicleHasDriftedAway) {
  for (const bool follows_yaw : {false, true}) {
    Lockstep rig;
    rig.autopilot->follows_yaw = follows_yaw;
    rig.take_off();
    rig.ticks(100);
    std::optional<OdometrySample> frozen;
    rig.spoil = [&](OdometrySample& s) {
      if (!frozen) {
        frozen = s;
        frozen->state.v_W.setZero();
      }
      s.state = frozen->state;
      s.q = frozen->q;
    };
    EXPECT_GT(rig.ticks_until(Mode::hold, 7), 0) << "flown on a frozen pose";
    EXPECT_GT(rig.ticks_until(Mode::land, 60), 0);
  }
}

// The emulated autopilot's height is the VIO's: it climbed 526 m, and went on climbing after LAND.
TEST(VioFreezeFault, AVioThatFreezesBeforeTheVehicleLeavesTheGroundEndsTheTakeOff) {
  Lockstep rig;
  rig.ticks(60);
  EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
  ASSERT_GT(rig.ticks_until(Mode::tracking, 250), 0) << to_string(rig.reason());
  std::optional<OdometrySample> frozen;
  rig.spoil = [&](OdometrySample& s) {
    if (!frozen) {
      frozen = s;
      frozen->state.v_W.setZero();
    }
    s.state = frozen->state;
    s.q = frozen->q;
  };
  rig.tick();
  rig.offer(rig.rise(), true, true);
  ASSERT_GT(rig.ticks_until(Mode::lifting, 3), 0) << to_string(rig.reason());
  ASSERT_GT(rig.ticks_until(Mode::land, 200), 0) << to_string(rig.reason()) << ", " << rig.autopilot->truth().p_W.z();
  EXPECT_EQ(rig.reason(), Reason::odometry_frozen);
  EXPECT_EQ(rig.tick().odometry, 0) << "nor is the autopilot told any more that it has not left the ground";
}

// What one closure of 90° or 10 m may not do, ten of 9° and twelve of 0.9 m do within a quarter of a second.
TEST(AbsurdClosureFault, AnAbsurdLoopClosureInPiecesIsHeldToo) {
  for (const bool turns : {false, true}) {
    Lockstep rig;
    rig.take_off();
    rig.start_route(1);
    track::RigidShift D;
    std::uint32_t closures = 0;
    rig.reader = [&](const OdometrySample& in) {
      OdometrySample s = track::moved(D, in);
      s.closures = closures;
      s.map_from_odom = D;
      return std::optional(s);
    };
    closures = 1;  // the identity
    rig.tick();
    for (int n = 0; n < 12 && rig.mode() == Mode::tracking; ++n) {
      const Vec3 here = rig.view().state.p_W;
      const track::RigidShift turn{9 * kDegree, Vec3::Zero()};
      D = (turns ? track::RigidShift{turn.yaw, here - turn.rotate(here)} : track::RigidShift{0, {0, 0.9, 0}}) * D;
      ++closures;
      rig.tick();
    }
    EXPECT_EQ(rig.mode(), Mode::hold) << (turns ? "turned by 108° in the map" : "moved by 10.8 m in the map");
    EXPECT_EQ(rig.reason(), Reason::closure_refused);
  }
}

}  // namespace
}  // namespace backwash::daemon::test
