// SPDX-License-Identifier: BSD-3-Clause
// Whole flights in lockstep: what the tick must never do, and the rows of docs/faults.md that a good flight shows.
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/mman.h>

#include <cstdlib>
#include <memory>
#include <mutex>

#include "tests/daemon/lockstep/lockstep.hpp"
#include "tests/daemon/lockstep/traps.hpp"

namespace backwash::daemon::test {
namespace {

TEST(Traps, CountWhatTheyAreMeantToCount) {
  if (!backwash::test::traps_work()) GTEST_SKIP() << "sanitizer: it owns these functions";
  const auto before = backwash::test::trapped();
  static std::mutex mutex;
  {
    const backwash::test::Watched watched;
    void* volatile block = std::malloc(8);
    std::free(block);
    auto* volatile one = new int(1);
    delete one;
    const std::lock_guard lock(mutex);
    timespec t{};
    clock_gettime(CLOCK_REALTIME, &t);
    clock_gettime(CLOCK_MONOTONIC, &t);
  }
  const auto after = backwash::test::trapped();
  EXPECT_EQ(after.allocations - before.allocations, 4);
  EXPECT_EQ(after.locks - before.locks, 1);
  EXPECT_EQ(after.wall_clock - before.wall_clock, 1);
}

// Enabling, take-off, route, stop, landing: the rig checks each tick.
TEST(Tick, NeitherAllocatesNorLocksNorReadsTheWallClockNorFaultsAPageInAWholeFlight) {
  const bool locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  Lockstep rig;
  rig.take_off();
  rig.start_route(7);
  EXPECT_TRUE(rig.channels->orders.push({track::Request::land}));
  ASSERT_GT(rig.ticks_until(Mode::passive, 600), 0);
  EXPECT_EQ(rig.reason(), Reason::landed);
  EXPECT_GT(rig.view().shown.samples_inside, 340u);  // the lift-off is not judged
  EXPECT_EQ(rig.view().shown.samples_outside, 0u);
  EXPECT_EQ(rig.channels->control_log.lost(), 0u);
  if (locked && backwash::test::traps_work()) {  // a sanitizer's own bookkeeping touches new pages
    EXPECT_EQ(rig.page_faults_in_flight, 0);
  }
  ::munlockall();
}

TEST(Tick, SendsOneFullSetpointEachTickWhileItCommandsAndAHeartbeatASecond) {
  Lockstep rig;
  rig.take_off();
  rig.start_route(0.1);
  int heartbeats = 0;
  for (int n = 0; n < 200; ++n) {
    const Wire& wire = rig.tick();
    ASSERT_EQ(wire.setpoints.size(), 1u);
    EXPECT_EQ(wire.setpoints[0].type_mask, 2048);  // all but the yaw rate
    EXPECT_EQ(wire.setpoints[0].coordinate_frame, 1);
    EXPECT_EQ(wire.odometry, 1);
    heartbeats += wire.heartbeats;
    // In the controller's true frame it is the planned command: what the daemon found out of the frame is right.
    const auto& planned = rig.route()[rig.view().index - 1];
    EXPECT_LT((rig.in_map(wire.setpoints[0]).p_W - planned.p_W).norm(), 0.03);
    EXPECT_LT((rig.in_map(wire.setpoints[0]).v_W - planned.v_W).norm(), 0.03);
  }
  EXPECT_EQ(heartbeats, 4);
}

// Row 15, the planner is late: nothing new comes, the verified tail is finished and held.
// The control thread frees nothing: what it has finished with has to come back to the planner.
TEST(Tick, GivesEverySegmentBackToBeFreed) {
  if (!backwash::test::traps_work()) GTEST_SKIP() << "sanitizer: it counts the memory";
  Lockstep rig;
  rig.take_off();
  const auto offers = [&](int count) {
    for (int n = 0; n < count; ++n) {
      rig.offer(rig.rise());
      rig.tick();
      rig.log.clear();
    }
    return ::mallinfo2().uordblks;
  };
  const std::size_t early = offers(20), late = offers(40);
  const std::size_t segment = rig.rise().size() * (sizeof(Setpoint) + sizeof(reach::TubeStep));
  EXPECT_LT(late, early + 5 * segment) << segment << " bytes a segment";
}

TEST(LatePlanFault, WithoutANewTrajectoryTheVerifiedTailIsFlownAndItsEndIsHeld) {
  Lockstep rig;
  rig.take_off();
  rig.start_route(1);
  const auto end = rig.route().back().p_W;
  while (!rig.view().finished) rig.tick();
  for (int n = 0; n < 250; ++n) {
    const Wire& wire = rig.tick();
    ASSERT_EQ(wire.setpoints.size(), 1u);
    const Setpoint s = rig.in_map(wire.setpoints[0]);
    EXPECT_LT((s.p_W - end).norm(), 0.03);
    EXPECT_EQ(s.v_W, Vec3::Zero());
    EXPECT_EQ(s.a_W, Vec3::Zero());
  }
  EXPECT_LT((rig.autopilot->truth().p_W - end).norm(), 0.15);
  EXPECT_EQ(rig.view().shown.samples_outside, 0u);
}

}  // namespace
}  // namespace backwash::daemon::test
