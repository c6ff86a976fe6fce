// SPDX-License-Identifier: BSD-3-Clause
// Events that fall together: an order in the tick of a fault, a switch pressed where the vehicle already holds, poses
// that are told again, a pilot who takes over before we have, loop closures in a row.
#include "tests/track/flown.hpp"
#include "tests/track/straight_flight.hpp"

namespace backwash::track::test {
namespace {

// Rows 3 and 39: a sample that jumps is forgotten while nothing is commanded, and with it the place to hold.
TEST(Enabling, IsRefusedInTheTickInWhichThePoseIsForgotten) {
  const std::function<void(OdometrySample&)> jumps[] = {[](OdometrySample& s) {
                                                          s.state.v_W = {2, 0, 0};
                                                        },
                                                        [](OdometrySample& s) { s.state.p_W.x() += 0.12; },
                                                        [](OdometrySample& s) { s.q = Flown::quaternion(0.2); }};
  for (const auto& jump : jumps) {
    Flown f(Flown::Until::aligned);
    f.spoil = jump;
    f.in.request = Request::enable;
    f.step();
    f.spoil = {};
    EXPECT_EQ(f.out.supervisor.mode, Mode::passive);
    EXPECT_EQ(f.out.supervisor.reason, Reason::odometry_lost);
    f.step();
    f.in.request = Request::enable;
    f.step();
    EXPECT_EQ(f.out.supervisor.mode, Mode::enabling) << to_string(f.out.supervisor.reason);
    EXPECT_LT((f.out.command.p_W - Vec3(0, 0, 1)).norm(), 0.15) << "set-points of the present place";
  }
}

// Row 37: it is one more operator, whose STOP has no number.
TEST(StopOfTheSwitch, EndsAPlanUnderWayAlsoWhereTheVehicleHoldsForAStopAlready) {
  Flown f;
  f.in.request = Request::stop;
  f.in.order = 5;
  f.step();
  f.in.order = 0;
  for (int n = 0; n < 200; ++n) f.step();
  ASSERT_EQ(f.out.supervisor.reason, Reason::stop_requested);
  ASSERT_TRUE(f.tick.tracker().finished());
  AcceptedSegment planned = segment_of(std::vector<Setpoint>(100, f.out.command));
  planned.id = 77;
  planned.epoch = f.tick.epoch();
  f.in.request = Request::stop;  // pressed and released while it is planned
  f.step();
  f.in.segment = &planned;
  f.step();
  EXPECT_TRUE(f.out.refused);
  EXPECT_EQ(f.out.supervisor.mode, Mode::hold);
  f.offer(planned);
  EXPECT_TRUE(f.out.accepted) << "what is planned later flies";
}

}  // namespace
}  // namespace backwash::track::test
