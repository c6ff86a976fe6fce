// SPDX-License-Identifier: BSD-3-Clause
// Obstacles in the sets ahead: the tick brakes, freezes, or goes on around them.
#include "tests/track/flown/straight_flight.hpp"

namespace backwash::track::test {
namespace {

// Row 14: at command 101 the next stop leaves at 110.
TEST(FlightTick, AnObstacleInTheSetsAheadStopsTheVehicleOnTheNextVerifiedStopFromTheSameTick) {
  Flight flight;
  ASSERT_EQ(flight.tracker().index(), 101u);
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
  EXPECT_EQ(flight.out.supervisor.reason, Reason::obstacle_ahead);
  flight.in.surroundings.tube_blocked = false;  // what is ahead now is the stop, and it is clear
  const auto& stop = flight.segment.stops[11];
  ASSERT_EQ(stop.branch, 110u);
  for (std::size_t k = 102; k < 110; ++k) EXPECT_EQ(flight.step().command.p_W, flight.segment.commands[k].p_W) << k;
  for (const Setpoint& c : stop.commands) EXPECT_EQ(flight.step().command.p_W, c.p_W);
  for (int n = 0; n < 50; ++n) {
    EXPECT_EQ(flight.step().command.p_W, stop.commands.back().p_W);
    EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
  }
}

TEST(FlightTick, WhatIsAheadWhileItBrakesIsTheStop) {
  Flight flight;
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  const auto ahead = flight.tracker().ahead();
  EXPECT_EQ(ahead[0].size(), 8u);  // entries 102 to 109 of the segment
  EXPECT_EQ(ahead[1].size(), flight.segment.stops[11].tube.size());
  EXPECT_EQ(flight.tracker().next_stop(), nullptr);
}

TEST(FlightTick, IfTheStopIsBlockedTooTheSetpointIsFrozenAtOnce) {
  Flight flight;
  const Vec3 last = flight.out.command.p_W;
  flight.in.surroundings.tube_blocked = flight.in.surroundings.stop_blocked = true;
  for (int n = 0; n < 50; ++n) {
    flight.step();
    EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
    EXPECT_EQ(flight.out.command.p_W, last);
    EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
  }
}

TEST(FlightTick, AnObstacleInTheStopItBrakesOnFreezesTheSetpoint) {
  Flight flight;
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  flight.in.surroundings.tube_blocked = false;
  for (int n = 0; n < 15; ++n) flight.step();
  const Vec3 last = flight.out.command.p_W;
  flight.in.surroundings.tube_blocked = true;
  EXPECT_EQ(flight.step().command.p_W, last);
  EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
}

/// Leaves the stop that the flight brakes on, at command 120, with the commands flown until then.
AcceptedSegment around(const Flight& flight) {
  const auto& stop = flight.segment.stops[11];
  AcceptedSegment on = flight.segment;
  on.id = 99;
  on.continues = flight.segment.id;
  on.branch = 120;
  on.stops.clear();
  for (std::size_t k = stop.branch; k < on.commands.size(); ++k) {
    on.commands[k] = k < on.branch ? stop.commands[k - stop.branch] : on.commands[on.branch - 1];
    if (k < on.branch) continue;
    on.commands[k].p_W.y() += 0.001 * static_cast<double>(k - on.branch);
    on.commands[k].v_W = {0, 0.05, 0};
  }
  on.tube = tube_of(on.commands);
  return on;
}

// Row 14: it need not come to rest first.
TEST(FlightTick, AFlightThatBrakesForAnObstacleGoesOnAroundItAlongItsStop) {
  Flight flight;
  const auto on = around(flight);
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  flight.in.surroundings.tube_blocked = false;
  for (int n = 0; n < 12; ++n) flight.step();
  ASSERT_EQ(flight.tracker().index(), 114u);
  flight.in.segment = &on;
  flight.step();
  EXPECT_TRUE(flight.out.accepted);
  EXPECT_EQ(flight.out.supervisor.mode, Mode::tracking);
  EXPECT_EQ(flight.out.command.p_W, flight.segment.stops[11].commands[4].p_W);
  for (std::size_t k = 115; k < 140; ++k) EXPECT_EQ(flight.step().command.p_W, on.commands[k].p_W) << k;
}

TEST(FlightTick, WhileItBrakesASegmentThatDoesNotKnowOfTheStopIsRefused) {
  for (const std::size_t branch : {std::size_t{105}, std::size_t{111}, std::size_t{120}}) {
    Flight flight;
    AcceptedSegment unaware = flight.segment;  // its commands go on at full speed
    unaware.id = 99;
    unaware.continues = flight.segment.id;
    unaware.branch = branch;
    flight.in.surroundings.tube_blocked = true;
    flight.step();
    flight.in.surroundings.tube_blocked = false;
    flight.in.segment = &unaware;
    flight.step();
    EXPECT_TRUE(flight.out.refused) << branch;
    EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
    EXPECT_TRUE(flight.tracker().braking());
  }
}

TEST(FlightTick, AnOperatorsStopWinsOverAFlightThatWouldGoOn) {
  for (const int late : {0, 1, 3}) {  // ticks from the stop to the segment
    Flight flight;
    const auto on = around(flight);
    flight.in.surroundings.tube_blocked = true;
    flight.step();
    flight.in.surroundings.tube_blocked = false;
    for (int n = 0; n < 3; ++n) flight.step();
    flight.in.request = Request::stop;
    if (late == 0) flight.in.segment = &on;
    flight.step();
    for (int n = 1; n <= late; ++n) {
      if (n == late) flight.in.segment = &on;
      flight.step();
      EXPECT_EQ(flight.out.refused, n == late);
    }
    for (int n = 0; n < 300; ++n) flight.step();
    EXPECT_EQ(flight.out.supervisor.mode, Mode::hold) << late;
    EXPECT_EQ(flight.out.supervisor.reason, Reason::stop_requested);
    EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
  }
}

}  // namespace
}  // namespace backwash::track::test
