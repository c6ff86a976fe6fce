// SPDX-License-Identifier: BSD-3-Clause
// Of which samples a flight learns of its air.
#include <gtest/gtest.h>

#include "core/log/raw/air_log.hpp"
#include "tests/daemon/lockstep/air_rig.hpp"

namespace backwash::daemon::test {
namespace {

// A closure turns and moves state and set-point, and no air: what it did between two samples is no gust.
TEST(LearnsOfSamples, FromASampleThatALoopClosureMovedItBeginsAnew) {
  LearningRig rig(1);
  track::RigidShift D;
  std::uint32_t closures = 1;  // the identity
  rig.reader = [&](const OdometrySample& in) {
    OdometrySample s = track::moved(D, in);
    s.closures = closures;
    s.map_from_odom = D;
    return std::optional(s);
  };
  rig.take_off();
  rig.start_route(2);
  const auto seconds = [&rig] {
    double all = 0;
    for (const double of_class : rig.view().air->seconds) all += of_class;
    return all;
  };
  const double before = seconds();
  rig.ticks(200);
  EXPECT_GT(seconds(), before) << "it goes on";
  const Vec3 here = rig.view().state.p_W;
  const track::RigidShift turn{5 * kDegree, Vec3::Zero()};
  D = {turn.yaw, here - turn.rotate(here)};
  ++closures;
  rig.tick();
  const double then = seconds();
  rig.ticks(60);
  ASSERT_EQ(rig.mode(), Mode::tracking) << to_string(rig.reason());
  EXPECT_EQ(seconds(), then);
  rig.ticks(300);
  EXPECT_GT(seconds(), then);
}

// Neither is it of the air what motors do on the ground, nor what nobody says where it was.
TEST(LearnsOfSamples, NothingOfAVehicleThatIsNotKnownToFly) {
  track::TickInput in;
  track::TickOutput out;
  in.autopilot.armed = out.supervisor.send_setpoint = true;
  out.supervisor.mode = Mode::tracking;
  EXPECT_FALSE(log::flown(in, out));
  out.landed = true;
  EXPECT_FALSE(log::flown(in, out));
  out.landed = false;
  EXPECT_TRUE(log::flown(in, out));
  out.supervisor.send_setpoint = false;
  EXPECT_FALSE(log::flown(in, out)) << "nothing is flown";
}

}  // namespace
}  // namespace backwash::daemon::test
